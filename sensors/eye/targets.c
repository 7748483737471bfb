/* targets: see the header. */
#include "sensors/eye/targets.h"

#include "platform/lines.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FILE_MAX_BYTES = 1 << 20 };
static const char head[] = "# foveola targets 1", columns[] = "t_ns,from_ns,until_ns,right_deg,up_deg";
static const double most_deg = 80, one_deg = 0.5;
/* Some centuries either way are no times. */
static const int64_t far_ns = INT64_MAX / 4;

bool fv_targets_place(int points, const struct fv_target_reach *reach, double place_deg[FV_TARGETS_MAX][2])
{
    static const double part[FV_TARGETS_MAX][2] = {
        {0, 0}, {-1, 1}, {1, -1},    {-1, -1},     {1, 1},      {-1, 0},    {1, 0},
        {0, 1}, {0, -1}, {0.5, 0.5}, {-0.5, -0.5}, {-0.5, 0.5}, {0.5, -0.5}};
    if (points != 5 && points != 9 && points != 13) return false;
    for (int i = 0; i < points; i++) {
        place_deg[i][0] = part[i][0] * reach->side;
        place_deg[i][1] = part[i][1] * (part[i][1] > 0 ? reach->up : reach->down);
    }
    return true;
}

bool fv_targets_same(const double a[2], const double b[2])
{
    return hypot(a[0] - b[0], a[1] - b[1]) < one_deg;
}

/* A row, which begins when the one before (NULL: none) is over. */
static int read_row(const struct fv_lines *r, const struct fv_target_shown *before, struct fv_target_shown *s,
                    struct fv_error *error)
{
    int64_t *const time[3] = {&s->t_ns, &s->from_ns, &s->until_ns};
    int end = 0;
    /* Digits in bounds: more than an int64_t holds would be undefined. */
    if (sscanf(r->text, "%18" SCNd64 ",%18" SCNd64 ",%18" SCNd64 ",%lf,%lf%n", &s->t_ns, &s->from_ns,
               &s->until_ns, &s->at_deg[0], &s->at_deg[1], &end) != 5 ||
        r->text[end])
        return fv_error_set(error, "%s:%d: must be %s", r->name, r->line, columns);
    if (!(hypot(s->at_deg[0], s->at_deg[1]) <= most_deg))
        return fv_error_set(error, "%s:%d: must be a target at most %g degrees off straight ahead", r->name,
                            r->line, most_deg);
    for (int i = 0; i < 3; i++)
        if (*time[i] > far_ns || *time[i] < -far_ns)
            return fv_error_set(error, "%s:%d: a time that cannot be", r->name, r->line);
    if (s->from_ns < s->t_ns || s->until_ns <= s->from_ns || (before && s->t_ns < before->until_ns))
        return fv_error_set(error,
                            "%s:%d: must appear when the target before is over, then be looked at from "
                            "from_ns until until_ns",
                            r->name, r->line);
    return 0;
}

int fv_targets_parse(struct fv_target_shown *shown, const char *name, const char *text, size_t size,
                     struct fv_error *error)
{
    struct fv_lines r = {.name = name, .at = text, .end = text + size};
    int rows = 0;
    if (!fv_lines_next(&r) || strcmp(r.text, head) != 0)
        return fv_error_set(error, "%s:1: no targets; must begin with '%s'", name, head);
    if (!fv_lines_next(&r) || strcmp(r.text, columns) != 0)
        return fv_error_set(error, "%s:2: must be '%s'", name, columns);
    while (fv_lines_next(&r)) {
        if (!r.text[0] || r.text[0] == '#') continue;
        if (rows == FV_SHOWN_MAX)
            return fv_error_set(error, "%s:%d: more than %d rows", name, r.line, FV_SHOWN_MAX);
        if (read_row(&r, rows > 0 ? &shown[rows - 1] : NULL, &shown[rows], error)) return -1;
        rows++;
    }
    return rows > 0 ? rows : fv_error_set(error, "%s: holds no row", name);
}

int fv_targets_read(struct fv_target_shown *shown, const char *path, struct fv_error *error)
{
    char *text;
    size_t size;
    if (fv_file_read(path, FILE_MAX_BYTES, &text, &size, error)) return -1;
    int rows = fv_targets_parse(shown, path, text, size, error);
    free(text);
    return rows;
}

void fv_targets_begin(struct fv_writer *writer)
{
    fv_writer_print(writer, "%s\n%s\n", head, columns);
}

void fv_targets_row(struct fv_writer *writer, const struct fv_target_shown *s)
{
    fv_writer_print(writer, "%" PRId64 ",%" PRId64 ",%" PRId64 ",%.17g,%.17g\n", s->t_ns, s->from_ns,
                    s->until_ns, s->at_deg[0], s->at_deg[1]);
}
