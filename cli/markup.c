/* markup: escaping for HTML, and numbers for people. */
#include "cli/markup.h"

#include "platform/json.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void fv_html_text(struct fv_writer *out, const char *text)
{
    for (const char *at = text ? text : ""; *at;) {
        int n = fv_utf8_length(at);
        unsigned char c = (unsigned char)*at;
        bool none = n == 0 || (c < 0x20 && c != '\t' && c != '\n') || c == 0x7F;
        if (none) fv_writer_print(out, FV_UTF8_REPLACEMENT);
        else if (strchr("&<>\"'", c)) fv_writer_print(out, "&#%d;", c);
        else fv_writer_bytes(out, at, (size_t)n);
        at += n ? n : 1;
    }
}

struct fv_shown fv_shown_fixed(double value, int decimals)
{
    struct fv_shown out = {"\xE2\x80\x93"};
    if (isfinite(value))
        snprintf(out.text, sizeof out.text, fabs(value) < 1e9 ? "%.*f" : "%.*e", decimals, value);
    return out;
}

/* Three significant digits and a unit out of a list, each `step` times the one before. */
static struct fv_shown scaled(double value, double step, const char *const *units, int count)
{
    struct fv_shown out = {"\xE2\x80\x93"};
    if (!isfinite(value)) return out;
    int unit = 0;
    for (; unit + 1 < count && fabs(value) >= step * 0.9995; unit++) value /= step;
    int decimals = fabs(value) >= 99.95 || (unit == 0 && value == floor(value)) ? 0
                   : fabs(value) >= 9.995                                       ? 1
                                                                                : 2;
    snprintf(out.text, sizeof out.text, "%.*f%s", decimals, fmin(fmax(value, -1e12), 1e12), units[unit]);
    return out;
}

struct fv_shown fv_shown_count(double value)
{
    static const char *const units[] = {"", " k", " M", " G", " T"};
    return scaled(value, 1000, units, 5);
}

struct fv_shown fv_shown_bytes(double bytes)
{
    static const char *const units[] = {" B", " KB", " MB", " GB", " TB"};
    return scaled(bytes, 1024, units, 5);
}

struct fv_shown fv_shown_percent(double fraction)
{
    static const char *const units[] = {" %"};
    return scaled(fraction * 100, 1000, units, 1);
}
