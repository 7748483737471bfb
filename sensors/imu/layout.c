/* layout: see layout.h. */
#include "sensors/imu/layout.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum kind { WHOLE, REAL, AXES, NUMBER, ORDER };

static const struct field {
    const char *name;
    enum kind kind;
    size_t offset;
    double least, most;
} fields[] = {
    {"interface", WHOLE, offsetof(struct fv_imu_device, interface), 0, 255},
    {"id", WHOLE, offsetof(struct fv_imu_device, layout.id), -1, 255},
    {"bytes", WHOLE, offsetof(struct fv_imu_device, layout.bytes), 1, 1024},
    {"readings", WHOLE, offsetof(struct fv_imu_device, layout.readings), 1, FV_IMU_READINGS},
    {"first", WHOLE, offsetof(struct fv_imu_device, layout.first), 0, 1023},
    {"stride", WHOLE, offsetof(struct fv_imu_device, layout.stride), 0, 1023},
    {"acc", WHOLE, offsetof(struct fv_imu_device, layout.acc), 0, 1023},
    {"rate", WHOLE, offsetof(struct fv_imu_device, layout.rate), 0, 1023},
    {"counter", WHOLE, offsetof(struct fv_imu_device, layout.counter), 0, 1023},
    {"counter_bytes", WHOLE, offsetof(struct fv_imu_device, layout.counter_bytes), 0, 8},
    {"counter_bits", WHOLE, offsetof(struct fv_imu_device, counter_bits), 0, 64},
    {"number", NUMBER, offsetof(struct fv_imu_device, layout.number), 0, 0},
    {"order", ORDER, offsetof(struct fv_imu_device, layout.big_endian), 0, 0},
    {"acc_unit", REAL, offsetof(struct fv_imu_device, layout.acc_unit), 1e-12, 1e6},
    {"rate_unit", REAL, offsetof(struct fv_imu_device, layout.rate_unit), 1e-12, 1e6},
    {"tick_ns", REAL, offsetof(struct fv_imu_device, tick_ns), 1e-3, INFINITY},
    {"hz", REAL, offsetof(struct fv_imu_device, hz), 1, 1e5},
    {"acc_full", REAL, offsetof(struct fv_imu_device, acc_full), 1, INFINITY},
    {"rate_full", REAL, offsetof(struct fv_imu_device, rate_full), 0.1, INFINITY},
    {"axes", AXES, offsetof(struct fv_imu_device, axes), -3, 3},
};
enum { FIELDS = sizeof fields / sizeof fields[0] };

/* A number and no more; NaN is none. */
static int read_number(const char **text, const struct field *f, double *value, struct fv_error *error)
{
    char *end;
    *value = strtod(*text, &end);
    bool fits = end != *text && *value >= f->least && *value <= f->most;
    if (!fits || (f->kind != REAL && *value != floor(*value)))
        return fv_error_set(error, "%s: '%.40s'; must be a %snumber from %g to %g", f->name, *text,
                            f->kind == REAL ? "" : "whole ", f->least, f->most);
    *text = end;
    return 0;
}

/* One of the words; its number goes to *value. */
static int read_word(const char **text, const struct field *f, const char *const words[], int count, int *value,
                     struct fv_error *error)
{
    *text += strspn(*text, " \t");
    size_t length = strcspn(*text, " \t");
    char all[64] = "";
    for (*value = 0; *value < count; ++*value) {
        if (strlen(words[*value]) == length && strncmp(*text, words[*value], length) == 0) {
            *text += length;
            return 0;
        }
        snprintf(all + strlen(all), sizeof all - strlen(all), "%s%s", *value ? ", " : "", words[*value]);
    }
    return fv_error_set(error, "%s: '%.40s'; must be one of %s", f->name, *text, all);
}

static int read_value(const char *text, const struct field *f, struct fv_imu_device *device, struct fv_error *error)
{
    static const char *const numbers[FV_IMU_NUMBERS] = {[FV_IMU_I16] = "i16", [FV_IMU_I32] = "i32", [FV_IMU_F32] = "f32"};
    static const char *const orders[] = {"little", "big"};
    char *at = (char *)device + f->offset;
    double value;
    int word;
    switch (f->kind) {
    case WHOLE:
    case REAL:
        if (read_number(&text, f, &value, error)) return -1;
        if (f->kind == REAL) *(double *)at = value;
        else *(int *)at = (int)value;
        break;
    case AXES:
        for (int i = 0; i < 3; i++) {
            if (read_number(&text, f, &value, error)) return -1;
            device->axes[i] = (int8_t)value;
        }
        break;
    case NUMBER:
        if (read_word(&text, f, numbers, FV_IMU_NUMBERS, &word, error)) return -1;
        device->layout.number = (enum fv_imu_number)word;
        break;
    case ORDER:
        if (read_word(&text, f, orders, 2, &word, error)) return -1;
        device->layout.big_endian = word == 1;
        break;
    }
    if (text[strspn(text, " \t")]) return fv_error_set(error, "%s: '%.40s' is too much", f->name, text);
    return 0;
}

static int read_row(char *row, struct fv_imu_device *device, struct fv_error *error)
{
    row += strspn(row, " \t\r\n");
    size_t length = strcspn(row, " \t");
    char all[256] = "";
    for (int i = 0; i < FIELDS; i++) {
        if (strlen(fields[i].name) == length && strncmp(row, fields[i].name, length) == 0)
            return read_value(row + length, &fields[i], device, error);
        snprintf(all + strlen(all), sizeof all - strlen(all), "%s%s", i ? ", " : "", fields[i].name);
    }
    return fv_error_set(error, "'%.40s' is no field of a layout; there are %s", row, all);
}

int fv_imu_layout_read(const char *text, struct fv_imu_device *device, struct fv_error *error)
{
    static struct fv_imu_stream tried;
    *device = fv_imu_devices[FV_IMU_GENERIC];
    while (*text) {
        char row[128];
        size_t length = strcspn(text, ",");
        if (length >= sizeof row) return fv_error_set(error, "'%.40s...' is too long", text);
        memcpy(row, text, length);
        row[length] = 0;
        if (read_row(row, device, error)) return -1;
        text += length + (text[length] == ',');
    }
    return fv_imu_stream_begin(&tried, device, NULL, error);
}
