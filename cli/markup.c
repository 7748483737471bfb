/* markup: escaping and number formats. */
#include "cli/markup.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char replacement[] = "\xEF\xBF\xBD"; /* U+FFFD */

/* Bytes of the UTF-8 sequence at `s`, 0 where there is none (Unicode 15, table 3-7). */
static int sequence_length(const unsigned char *s)
{
    static const struct {
        unsigned char lead_low, lead_high, second_low, second_high, length;
    } rows[] = {
        {0x00, 0x7F, 0x00, 0xFF, 1}, {0xC2, 0xDF, 0x80, 0xBF, 2}, {0xE0, 0xE0, 0xA0, 0xBF, 3},
        {0xE1, 0xEC, 0x80, 0xBF, 3}, {0xED, 0xED, 0x80, 0x9F, 3}, {0xEE, 0xEF, 0x80, 0xBF, 3},
        {0xF0, 0xF0, 0x90, 0xBF, 4}, {0xF1, 0xF3, 0x80, 0xBF, 4}, {0xF4, 0xF4, 0x80, 0x8F, 4},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        if (s[0] < rows[i].lead_low || s[0] > rows[i].lead_high) continue;
        if (rows[i].length == 1) return 1;
        if (s[1] < rows[i].second_low || s[1] > rows[i].second_high) return 0;
        for (int k = 2; k < rows[i].length; k++)
            if (s[k] < 0x80 || s[k] > 0xBF) return 0;
        return rows[i].length;
    }
    return 0;
}

void fv_json_text(struct fv_writer *out, const char *text)
{
    fv_writer_bytes(out, "\"", 1);
    for (const char *at = text ? text : ""; *at;) {
        int n = sequence_length((const unsigned char *)at);
        unsigned char c = (unsigned char)*at;
        if (n == 0) fv_writer_bytes(out, replacement, 3);
        else if (c < 0x20) fv_writer_print(out, "\\u%04x", c);
        else if (c == '"' || c == '\\') fv_writer_print(out, "\\%c", c);
        else fv_writer_bytes(out, at, (size_t)n);
        at += n ? n : 1;
    }
    fv_writer_bytes(out, "\"", 1);
}

void fv_json_number(struct fv_writer *out, double value)
{
    char text[32];
    if (!isfinite(value)) {
        fv_writer_print(out, "null");
        return;
    }
    bool is_float = (double)(float)value == value;
    for (int digits = 6; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        double read = strtod(text, NULL);
        if (read == value || (is_float && (float)read == (float)value)) break;
    }
    fv_writer_print(out, "%s", text);
}

void fv_html_text(struct fv_writer *out, const char *text)
{
    for (const char *at = text ? text : ""; *at;) {
        int n = sequence_length((const unsigned char *)at);
        unsigned char c = (unsigned char)*at;
        if (n == 0 || (c < 0x20 && c != '\t' && c != '\n') || c == 0x7F) fv_writer_bytes(out, replacement, 3);
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
