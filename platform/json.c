/* json: escaping and shortest decimals; see json.h. */
#include "platform/json.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

int fv_utf8_length(const char *text)
{
    static const struct {
        unsigned char lead_low, lead_high, second_low, second_high, length;
    } rows[] = {
        {0x00, 0x7F, 0x00, 0xFF, 1}, {0xC2, 0xDF, 0x80, 0xBF, 2}, {0xE0, 0xE0, 0xA0, 0xBF, 3},
        {0xE1, 0xEC, 0x80, 0xBF, 3}, {0xED, 0xED, 0x80, 0x9F, 3}, {0xEE, 0xEF, 0x80, 0xBF, 3},
        {0xF0, 0xF0, 0x90, 0xBF, 4}, {0xF1, 0xF3, 0x80, 0xBF, 4}, {0xF4, 0xF4, 0x80, 0x8F, 4},
    };
    const unsigned char *s = (const unsigned char *)text;
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
        int n = fv_utf8_length(at);
        unsigned char c = (unsigned char)*at;
        if (n == 0) fv_writer_print(out, FV_UTF8_REPLACEMENT);
        else if (c < 0x20) fv_writer_print(out, "\\u%04x", c);
        else if (c == '"' || c == '\\') fv_writer_print(out, "\\%c", c);
        else fv_writer_bytes(out, at, (size_t)n);
        at += n ? n : 1;
    }
    fv_writer_bytes(out, "\"", 1);
}

/* The common case, much faster than trying lengths: a float of usual size with at most nine digits behind the
 * point. Returns the length, 0 where it is none. */
static int float_text(char text[32], double value)
{
    double size = fabs(value), scale = 1;
    if (!(size == 0 || (size >= 1e-4 && size < 1e6)) || (double)(float)value != value) return 0;
    int decimals = 0;
    long long digits = llround(size);
    while ((float)((double)digits / scale) != (float)size) {
        if (decimals++ == 9) return 0;
        scale *= 10;
        digits = llround(size * scale);
    }
    char *at = text + 32, *end = at;
    for (int k = 0; k <= decimals || digits > 0; k++) {
        if (k == decimals && decimals > 0) *--at = '.';
        *--at = (char)('0' + digits % 10);
        digits /= 10;
    }
    if (signbit(value)) *--at = '-';
    int length = (int)(end - at);
    for (int i = 0; i < length; i++) text[i] = at[i];
    return length;
}

void fv_json_number(struct fv_writer *out, double value)
{
    char text[32];
    if (!isfinite(value)) {
        fv_writer_print(out, "null");
        return;
    }
    int length = float_text(text, value);
    bool is_float = (double)(float)value == value;
    for (int digits = 6; digits <= 17 && length == 0; digits++) {
        int n = snprintf(text, sizeof text, "%.*g", digits, value);
        double read = strtod(text, NULL);
        if (read == value || (is_float && (float)read == (float)value)) length = n;
    }
    fv_writer_bytes(out, text, (size_t)length);
}
