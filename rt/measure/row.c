/* row: see row.h. A table of the struct's fields makes the file's writer and reader. */
#include "rt/measure/row.h"

#include "rt/method/method.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char heading[] = "foveola-row 1\n";

enum kind { TEXT, INT, REAL, MEASURED, ZONES };

static const struct field {
    const char *name;
    enum kind kind;
    size_t offset, size; /* size: of a TEXT */
} fields[] = {
#define FIELD(name, kind)                                                                                    \
    {                                                                                                        \
#name, kind, offsetof(struct fv_measure_row, name), sizeof((struct fv_measure_row *)0)->name         \
    }
    FIELD(scene, TEXT),
    FIELD(method, TEXT),
    FIELD(level, INT),
    FIELD(parameters, TEXT),
    FIELD(about, TEXT),
    FIELD(key, TEXT),
    FIELD(frames, INT),
    FIELD(pictures, INT),
    FIELD(frame_ms, MEASURED),
    FIELD(frame_ms_p99, REAL),
    FIELD(full_frame_ms, MEASURED),
    FIELD(speedup, MEASURED),
    FIELD(rays, REAL),
    FIELD(sampled_fraction, REAL),
    FIELD(psnr, ZONES),
    FIELD(rmse, ZONES),
    FIELD(ssim, ZONES),
    FIELD(flip, ZONES),
    FIELD(flicker, MEASURED),
    FIELD(period_ms, REAL),
#undef FIELD
};
enum { FIELDS = sizeof fields / sizeof fields[0] };

static void write_measured(struct fv_writer *out, const char *name, const struct fv_measured *m)
{
    fv_writer_print(out, "%s %.9g %.9g %.9g\n", name, m->value, m->low, m->high);
}

static void write_field(struct fv_writer *out, const struct field *f, const void *at)
{
    switch (f->kind) {
    case TEXT: fv_writer_print(out, "%s %s\n", f->name, (const char *)at); break;
    case INT: fv_writer_print(out, "%s %d\n", f->name, *(const int *)at); break;
    case REAL: fv_writer_print(out, "%s %.9g\n", f->name, *(const double *)at); break;
    case MEASURED: write_measured(out, f->name, at); break;
    case ZONES:
        for (int z = 0; z < FV_ZONES; z++) {
            char name[32];
            snprintf(name, sizeof name, "%s_%s", f->name, fv_zones[z].name);
            write_measured(out, name, (const struct fv_measured *)at + z);
        }
    }
}

int fv_row_write(const struct fv_measure_row *row, const char *path, struct fv_error *error)
{
    static struct fv_writer out;
    if (fv_writer_open(&out, path, error)) return -1;
    fv_writer_print(&out, "%s", heading);
    for (int i = 0; i < FIELDS; i++) write_field(&out, &fields[i], (const char *)row + fields[i].offset);
    return fv_writer_close(&out, error);
}

/* The value of the line "name value", which must be the next one; moves on behind it. NULL where it is not.
 */
static char *take_line(char **at, const char *name)
{
    size_t length = strlen(name);
    char *line = *at, *end = strchr(line, '\n');
    if (!end || strncmp(line, name, length) != 0 || line[length] != ' ') return NULL;
    *end = 0;
    *at = end + 1;
    return line + length + 1;
}

static bool read_measured(char **at, const char *name, struct fv_measured *m)
{
    char *value = take_line(at, name), *end = value;
    if (!value) return false;
    double *part[3] = {&m->value, &m->low, &m->high};
    for (int i = 0; i < 3; i++) {
        value = end;
        *part[i] = strtod(value, &end);
        if (end == value) return false;
    }
    return *end == 0;
}

static bool read_field(char **at, const struct field *f, void *to)
{
    char *value, *end, name[32];
    switch (f->kind) {
    case TEXT:
        value = take_line(at, f->name);
        return value && snprintf(to, f->size, "%s", value) < (int)f->size;
    case INT:
        value = take_line(at, f->name);
        if (value) *(int *)to = (int)strtol(value, &end, 10);
        return value && end > value && !*end;
    case REAL:
        value = take_line(at, f->name);
        if (value) *(double *)to = strtod(value, &end);
        return value && end > value && !*end;
    case MEASURED: return read_measured(at, f->name, to);
    case ZONES:
        for (int z = 0; z < FV_ZONES; z++) {
            snprintf(name, sizeof name, "%s_%s", f->name, fv_zones[z].name);
            if (!read_measured(at, name, (struct fv_measured *)to + z)) return false;
        }
        return true;
    }
    return false;
}

int fv_row_read(struct fv_measure_row *row, const char *path, struct fv_error *error)
{
    char *text, *at;
    size_t size;
    if (fv_file_read(path, 1 << 16, &text, &size, error)) return -1;
    bool good = strncmp(text, heading, sizeof heading - 1) == 0;
    at = text + (good ? sizeof heading - 1 : 0);
    for (int i = 0; good && i < FIELDS; i++)
        good = read_field(&at, &fields[i], (char *)row + fields[i].offset);
    good = good && *at == 0 && row->frames >= 1 && row->level >= 0;
    free(text);
    if (good) return 0;
    return fv_error_set(error, "%s: not a whole row of this version's measure; remove it to measure it again",
                        path);
}

static int place_of(const char *method)
{
    int n = 0;
    while (fv_method_at(n) && strcmp(fv_method_at(n)->name, method) != 0) n++;
    return n;
}

static int compare_rows(const void *a, const void *b)
{
    const struct fv_measure_row *p = a, *q = b;
    int by_scene = strcmp(p->scene, q->scene), by_method = place_of(p->method) - place_of(q->method);
    int by_name = strcmp(p->method, q->method);
    return by_scene ? by_scene : by_method ? by_method : by_name ? by_name : p->level - q->level;
}

void fv_rows_sort(struct fv_measure_row *row, int rows)
{
    qsort(row, (size_t)rows, sizeof *row, compare_rows);
}

bool fv_row_is_pareto(const struct fv_measure_row *row, int rows, int which, enum fv_zone zone)
{
    const struct fv_measure_row *r = &row[which];
    if (isnan(r->psnr[zone].value) || isnan(r->speedup.value)) return false;
    for (int i = 0; i < rows; i++) {
        double faster = row[i].speedup.value - r->speedup.value,
               better = row[i].psnr[zone].value - r->psnr[zone].value;
        if (row[i].psnr[zone].value == r->psnr[zone].value) better = 0; /* both infinite */
        if (strcmp(row[i].scene, r->scene) == 0 && faster >= 0 && better >= 0 && faster + better > 0)
            return false;
    }
    return true;
}

int fv_rows_reach(const struct fv_measure_row *row, int rows, const char *method, enum fv_zone zone,
                  double decibel)
{
    int best = -1;
    for (int i = 0; i < rows; i++) {
        if (strcmp(row[i].method, method) != 0 || !(row[i].psnr[zone].value >= decibel) ||
            isnan(row[i].speedup.value))
            continue;
        if (best < 0 || row[i].speedup.value > row[best].speedup.value) best = i;
    }
    return best;
}

static void write_cell(struct fv_writer *out, double value, char after)
{
    if (isinf(value)) fv_writer_print(out, "inf");
    else if (!isnan(value)) fv_writer_print(out, "%.6g", value);
    fv_writer_bytes(out, &after, 1);
}

int fv_rows_csv(const struct fv_measure_row *row, int rows, const char *path, struct fv_error *error)
{
    static struct fv_writer out;
    if (fv_writer_open(&out, path, error)) return -1;
    fv_writer_print(&out,
                    "scene,method,level,parameters,frame_ms_p50,frame_ms_p99,full_frame_ms_p50,speedup,rays,"
                    "sampled_fraction,psnr_all,psnr_fovea,psnr_para,psnr_peri,psnr_near,psnr_far,rmse,ssim,"
                    "flip,flicker\n");
    for (const struct fv_measure_row *r = row; r < row + rows; r++) {
        fv_writer_print(&out, "%s,%s,%d,%s,", r->scene, r->method, r->level, r->parameters);
        const double cells[] = {r->frame_ms.value,
                                r->frame_ms_p99,
                                r->full_frame_ms.value,
                                r->speedup.value,
                                r->rays,
                                r->sampled_fraction,
                                r->psnr[FV_ZONE_ALL].value,
                                r->psnr[FV_ZONE_FOVEA].value,
                                r->psnr[FV_ZONE_PARA].value,
                                r->psnr[FV_ZONE_PERI].value,
                                r->psnr[FV_ZONE_NEAR].value,
                                r->psnr[FV_ZONE_FAR].value,
                                r->rmse[FV_ZONE_ALL].value,
                                r->ssim[FV_ZONE_ALL].value,
                                r->flip[FV_ZONE_ALL].value,
                                r->flicker.value};
        enum { CELLS = sizeof cells / sizeof cells[0] };
        for (int i = 0; i < CELLS; i++) write_cell(&out, cells[i], i + 1 < CELLS ? ',' : '\n');
    }
    return fv_writer_close(&out, error);
}
