/* tape: parsing and writing; see tape.h. Looking up is in tape_at.c.
 *
 * Besides our own, two formats of others are read, recognised by their column names:
 *
 * Varjo. The CSV that the Unity script of the project VarjoGazeDetector logs, one row a gaze sample.
 * raw_timestamp is in ns. Unity's axes are x right, y up, z forward, left-handed, so z changes sign,
 * and so do x and y of a rotation. HMD_rotation_x, _y, _z are not angles: the script logs three
 * components of transform.localRotation, a unit quaternion whose w is left out. A recording bears that
 * out: with the eyes resting on something they turn against the head by 1.3 to 1.9 times the change in
 * these numbers (regression one way and the other, correlation 0.9), which half angles explain and
 * whole ones, at most 1, do not; +y goes with eyes turning left and
 * +x with eyes turning up, so that they are turns to the right and down. w is found up to its sign,
 * which continuity gives. The poses are some 0.15 s newer than the gaze of the same row, since
 * rows are written later than they are captured; this is left as it is. Gaze is used when status is 2
 * (valid); an eye that is not seen itself (its status below 2) takes the combined gaze.
 *
 * Head text. "timestamp viewpoint w x y z" of the MMSys 2018 multi-viewpoint dataset (Corbillon et
 * al.), seconds and a quaternion that takes the device's axes to the world's. The tracker program of
 * the authors' 2017 dataset, whose convention it keeps, has z up, y right, x backward. In a recording
 * the device's y axis stays level (standard deviation 5 degrees: roll is small) while the x axis
 * tilts by 12.6, more often so that one looks down than up.
 *
 * Their poses are made relative to the first one's position and heading, and time to the first row. */
#include "sensors/tape.h"

#include "platform/arena.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS_MAX = 64, VALUES_MAX = 32 };

static const int64_t longest_ns = 1000000000000000; /* 11 days: a later row is a broken clock */
static const int64_t latest_start_ns = 60000000000; /* session time starts near 0 */
static const double unit_tolerance = 1e-3, farthest_m = 1e4;

/* A tape being read. */
struct reading {
    struct fv_tape *tape;
    const struct format *format;
    const char *name;
    struct fv_error *error;
    int line, column[VALUES_MAX]; /* where each wanted column stands in a row */
    int64_t origin_ns;            /* subtracted from every time */
    bool based;                   /* a first pose is there: base holds its position and heading */
    struct fv_pose base;
    double previous[4]; /* rotation of the row before, as read */
    int first_bad_line;
    const char *first_bad;
    struct fv_head_sample *head; /* NULL: only count */
    struct fv_gaze_sample *gaze;
};

/* What the values of one row say. */
struct row {
    bool has_head, has_gaze;
    struct fv_pose head;
    struct fv_gaze_sample gaze;
};

/* Turns values, in the order of the format's columns behind the time, into a row; NULL, or what is
 * wrong with it. */
typedef const char *row_function(struct reading *r, const double *value, struct row *row);
static row_function own_head_row, own_gaze_row, varjo_row, text_row;

static const struct format {
    const char *first_line; /* "" where the column names come first */
    const char *columns;    /* names wanted, the time first */
    const char *optional;   /* one more, whose value is 0 where it is not there; NULL: none */
    char separator;
    bool seconds; /* time in s, not in integer ns */
    row_function *row;
} formats[] = {
    {"# foveola head 1",
     "t_ns,position_x_m,position_y_m,position_z_m,rotation_w,rotation_x,rotation_y,rotation_z", NULL, ',',
     false, own_head_row},
    {"# foveola gaze 1", "t_ns,left_x,left_y,left_z,right_x,right_y,right_z,valid", "uncertainty_deg", ',',
     false, own_gaze_row},
    {"",
     "raw_timestamp,HMD_position_x,HMD_position_y,HMD_position_z,HMD_rotation_x,HMD_rotation_y,HMD_rotation_"
     "z,"
     "gaze_forward_x,gaze_forward_y,gaze_forward_z,left_forward_x,left_forward_y,left_forward_z,"
     "right_forward_x,right_forward_y,right_forward_z,status,left_status,right_status",
     NULL, ',', false, varjo_row},
    {"", "timestamp w x y z", NULL, ' ', true, text_row},
};
enum { FORMATS = sizeof formats / sizeof formats[0] };

bool fv_gaze_direction_good(const double d[3])
{
    double length2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    return fabs(length2 - 1) <= 2 * unit_tolerance && d[2] < 0;
}

bool fv_head_pose_good(const struct fv_pose *pose)
{
    for (int i = 0; i < 3; i++)
        if (!(fabs(pose->position_m[i]) <= farthest_m)) return false;
    return fv_pose_sound(pose);
}

/* Unit length to rounding stays as it is, bit for bit. */
static void tidy_unit(double *v, int n)
{
    double length2 = 0;
    for (int i = 0; i < n; i++) length2 += v[i] * v[i];
    if (fabs(length2 - 1) < 1e-12) return;
    for (int i = 0; i < n; i++) v[i] /= sqrt(length2);
}

static void tidy_gaze(struct fv_gaze_sample *gaze)
{
    for (int eye = 0; eye < 2; eye++) {
        gaze->valid = gaze->valid && fv_gaze_direction_good(gaze->direction[eye]);
        if (gaze->valid) tidy_unit(gaze->direction[eye], 3);
    }
    if (!gaze->valid) memset(gaze->direction, 0, sizeof gaze->direction);
}

static const char *own_head_row(struct reading *r, const double *value, struct row *row)
{
    (void)r;
    row->has_head = true;
    memcpy(row->head.position_m, value, sizeof row->head.position_m);
    memcpy(row->head.rotation, value + 3, sizeof row->head.rotation);
    if (!fv_head_pose_good(&row->head)) return "not a finite position and unit quaternion";
    tidy_unit(row->head.rotation, 4);
    return NULL;
}

static const char *own_gaze_row(struct reading *r, const double *value, struct row *row)
{
    (void)r;
    if (value[6] != 0 && value[6] != 1) return "valid must be 0 or 1";
    if (!(value[7] >= 0 && value[7] <= 180)) return "uncertainty_deg must be 0 to 180";
    row->has_gaze = true;
    row->gaze.valid = value[6] == 1;
    row->gaze.uncertainty_deg = value[7];
    memcpy(row->gaze.direction, value, sizeof row->gaze.direction);
    tidy_gaze(&row->gaze);
    return NULL;
}

/* The turn about the vertical that a pose looks along; by its right side when it looks straight up
 * or down. */
static double heading(const double rotation[4])
{
    double ahead[3] = {0, 0, -1}, right[3] = {1, 0, 0};
    fv_quat_rotate(rotation, ahead, ahead);
    fv_quat_rotate(rotation, right, right);
    return hypot(ahead[0], ahead[2]) > 1e-3 ? atan2(-ahead[0], -ahead[2]) : atan2(-right[2], right[0]);
}

/* Makes a pose of another's tape relative to the first one's stand and heading, and its quaternion
 * continuous. */
static const char *rebase(struct reading *r, struct row *row)
{
    row->has_head = true;
    if (!fv_head_pose_good(&row->head)) return "not a finite position and unit quaternion";
    fv_quat_normalise(row->head.rotation);
    if (!r->based) {
        r->based = true;
        r->base = row->head;
        fv_quat_from_yaw_pitch_roll(-heading(row->head.rotation), 0, 0, r->base.rotation);
        memcpy(r->previous, row->head.rotation, sizeof r->previous);
    }
    double *q = row->head.rotation, *p = row->head.position_m;
    double along =
        q[0] * r->previous[0] + q[1] * r->previous[1] + q[2] * r->previous[2] + q[3] * r->previous[3];
    for (int i = 0; along < 0 && i < 4; i++) q[i] = -q[i];
    memcpy(r->previous, q, sizeof r->previous);
    for (int i = 0; i < 3; i++) p[i] -= r->base.position_m[i];
    fv_quat_rotate(r->base.rotation, p, p);
    fv_quat_multiply(r->base.rotation, q, q);
    fv_quat_normalise(q);
    return NULL;
}

static const char *varjo_row(struct reading *r, const double *value, struct row *row)
{
    const double *v = value + 3, *combined = value + 6, *status = value + 15;
    row->has_gaze = true;
    row->gaze.valid = status[0] == 2;
    for (int eye = 0; eye < 2; eye++) {
        const double *d = status[1 + eye] >= 2 ? value + 9 + 3 * eye : combined;
        for (int i = 0; i < 3; i++) row->gaze.direction[eye][i] = i == 2 ? -d[i] : d[i];
    }
    tidy_gaze(&row->gaze);
    double w2 = 1 - v[0] * v[0] - v[1] * v[1] - v[2] * v[2];
    row->has_head = true;
    if (!(w2 >= -2 * unit_tolerance)) return "HMD_rotation is no part of a unit quaternion";
    row->head = (struct fv_pose){{value[0], value[1], -value[2]}, {sqrt(fmax(w2, 0)), -v[0], -v[1], v[2]}};
    double *q = row->head.rotation, *before = r->previous;
    double vectors = q[1] * before[1] + q[2] * before[2] + q[3] * before[3];
    if (r->based && fabs(vectors - q[0] * before[0]) > fabs(vectors + q[0] * before[0])) q[0] = -q[0];
    return rebase(r, row);
}

static const char *text_row(struct reading *r, const double *value, struct row *row)
{
    row->head = (struct fv_pose){{0, 0, 0}, {value[0], value[2], value[3], value[1]}};
    return rebase(r, row);
}

/* A field: its first and one past its last byte, without blanks around it. */
struct field {
    const char *start, *end;
};

/* Cuts the next line off [*text, end), without its line end. False at the end. */
static bool next_line(const char **text, const char *end, struct field *line)
{
    if (*text >= end) return false;
    const char *stop = memchr(*text, '\n', (size_t)(end - *text));
    line->start = *text;
    line->end = stop ? stop : end;
    *text = stop ? stop + 1 : end;
    if (line->end > line->start && line->end[-1] == '\r') line->end--;
    return true;
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t';
}

/* Splits a line; returns the number of fields, at most COLUMNS_MAX. */
static int split(struct field line, char separator, struct field *field)
{
    int count = 0;
    for (const char *at = line.start; at <= line.end && count < COLUMNS_MAX; count++) {
        const char *stop = at < line.end ? memchr(at, separator, (size_t)(line.end - at)) : NULL;
        struct field f = {at, stop ? stop : line.end};
        at = f.end + 1;
        while (f.start < f.end && is_blank(*f.start)) f.start++;
        while (f.end > f.start && is_blank(f.end[-1])) f.end--;
        field[count] = f;
    }
    return count;
}

static bool same(struct field f, const char *text, size_t length)
{
    return (size_t)(f.end - f.start) == length && memcmp(f.start, text, length) == 0;
}

static int find_column(const struct field *field, int fields, const char *name, size_t length)
{
    for (int i = 0; i < fields; i++)
        if (same(field[i], name, length)) return i;
    return -1;
}

/* Finds the format's columns by name in the header; false when one is missing that must be there. */
static bool find_columns(const struct format *format, struct field header, int column[VALUES_MAX])
{
    struct field field[COLUMNS_MAX];
    int fields = split(header, format->separator, field), wanted = 0;
    for (const char *name = format->columns; *name; wanted++) {
        size_t length = strcspn(name, format->separator == ' ' ? " " : ",");
        column[wanted] = find_column(field, fields, name, length);
        if (column[wanted] < 0) return false;
        name += length + (name[length] != 0);
    }
    const char *optional = format->optional;
    column[wanted] = optional ? find_column(field, fields, optional, strlen(optional)) : -1;
    column[wanted + 1] = -1; /* the end */
    return true;
}

/* Numbers are followed by a separator, a blank, a line end or the final zero: strtod stops there. */
static bool parse_number(struct field f, double *out)
{
    char *end;
    if (f.start == f.end) return false;
    *out = strtod(f.start, &end);
    return end == f.end && isfinite(*out);
}

static bool parse_time(const struct format *format, struct field f, int64_t *out)
{
    double seconds;
    char *end;
    if (f.start == f.end) return false;
    if (format->seconds) {
        if (!parse_number(f, &seconds) || fabs(seconds) > 4e9) return false;
        *out = llround(seconds * 1e9);
        return true;
    }
    errno = 0;
    long long ns = strtoll(f.start, &end, 10);
    *out = ns;
    return end == f.end && errno == 0 && ns > -INT64_MAX / 2 && ns < INT64_MAX / 2;
}

/* Reads a row and takes what is good of it; NULL, or why something was rejected. */
static const char *take_row(struct reading *r, struct field line)
{
    struct fv_tape *tape = r->tape;
    struct field field[COLUMNS_MAX];
    double value[VALUES_MAX] = {0};
    struct row row = {0};
    int64_t t_ns = 0;
    if (line.end - line.start > FV_TAPE_LINE_MAX) return "the line is too long";
    int fields = split(line, r->format->separator, field);
    for (int i = 0; r->column[i] >= 0; i++) {
        if (r->column[i] >= fields) return "the row is short";
        struct field f = field[r->column[i]];
        if (i == 0 ? !parse_time(r->format, f, &t_ns) : !parse_number(f, &value[i - 1]))
            return i == 0 ? "the time is not a number in range" : "not a finite number in every column";
    }
    if (tape->rows == 0 && !*r->format->first_line) r->origin_ns = t_ns;
    t_ns -= r->origin_ns;
    if (t_ns < 0 || t_ns > longest_ns) return "the time is out of range";
    if (tape->rows > 0 && t_ns <= tape->last_ns) return "the time does not grow";
    if (tape->rows == 0 && t_ns > latest_start_ns) return "session time starts at 0, not above a minute";
    const char *bad = r->format->row(r, value, &row);
    if (!row.has_gaze && bad) return bad;
    if (tape->rows++ == 0) tape->first_ns = t_ns;
    tape->last_ns = t_ns;
    if (row.has_gaze) {
        row.gaze.t_ns = t_ns;
        if (r->gaze) r->gaze[tape->gazes] = row.gaze;
        tape->gazes++;
    }
    if (row.has_head && !bad) {
        if (r->head) r->head[tape->heads] = (struct fv_head_sample){t_ns, row.head};
        tape->heads++;
    }
    return bad;
}

/* Finds out the format from the first line, or the first two, which are cut off the text. */
static int recognise(struct reading *r, const char **text, const char *end)
{
    struct field first, header;
    if (end - *text >= 3 && memcmp(*text, "\xef\xbb\xbf", 3) == 0) *text += 3;
    if (!next_line(text, end, &first)) return fv_error_set(r->error, "%s:1: the tape is empty", r->name);
    r->line = 1;
    for (int i = 0; i < FORMATS; i++) {
        const struct format *f = &formats[i];
        header = first;
        if (*f->first_line) {
            if (!same(first, f->first_line, strlen(f->first_line))) continue;
            r->line = 2;
            if (!next_line(text, end, &header)) header.start = header.end = end;
        }
        r->format = f;
        if (find_columns(f, header, r->column)) return 0;
        if (*f->first_line)
            return fv_error_set(r->error, "%s:2: column names are missing; must be %s", r->name, f->columns);
    }
    if (first.end - first.start >= 9 && memcmp(first.start, "# foveola", 9) == 0)
        return fv_error_set(r->error, "%s:1: not a version that is known; must be '%s' or '%s'", r->name,
                            formats[0].first_line, formats[1].first_line);
    return fv_error_set(
        r->error,
        "%s:1: not a tape; must begin with '%s', '%s', the column names of a Varjo gaze log, or "
        "'timestamp viewpoint w x y z'",
        r->name, formats[0].first_line, formats[1].first_line);
}

int fv_tape_parse(struct fv_tape *tape, const char *name, const char *text, size_t size,
                  struct fv_head_sample *head, struct fv_gaze_sample *gaze, struct fv_error *error)
{
    struct reading r = {.tape = tape, .name = name, .error = error, .head = head, .gaze = gaze};
    const char *end = text + size;
    struct field line;
    *tape = (struct fv_tape){.head = head, .gaze = gaze};
    if (recognise(&r, &text, end)) return -1;
    while (next_line(&text, end, &line)) {
        r.line++;
        if (line.start == line.end) continue;
        const char *bad = take_row(&r, line);
        if (!bad) continue;
        tape->rejected++;
        if (!r.first_bad) r.first_bad = bad, r.first_bad_line = r.line;
    }
    if (tape->rows == 0 && !r.first_bad) return fv_error_set(error, "%s:%d: no rows follow", name, r.line);
    if (tape->rows == 0 || tape->rejected > tape->rows)
        return fv_error_set(error, "%s:%d: %s; %lld rows are bad, %lld good", name, r.first_bad_line,
                            r.first_bad, (long long)tape->rejected, (long long)tape->rows);
    return 0;
}

int fv_tape_read(struct fv_tape *tape, const char *path, struct fv_error *error)
{
    char *text;
    size_t size;
    if (fv_file_read(path, FV_TAPE_BYTES_MAX, &text, &size, error)) return -1;
    int result = fv_tape_parse(tape, path, text, size, NULL, NULL, error);
    if (result == 0) {
        struct fv_head_sample *head =
            fv_arena_take(fv_arena(), "sensors", (size_t)tape->heads * sizeof *head, 64);
        struct fv_gaze_sample *gaze =
            fv_arena_take(fv_arena(), "sensors", (size_t)tape->gazes * sizeof *gaze, 64);
        result = fv_tape_parse(tape, path, text, size, head, gaze, error);
    }
    free(text);
    return result;
}

void fv_tape_begin_head(struct fv_writer *writer)
{
    fv_writer_print(writer, "%s\n%s\n", formats[0].first_line, formats[0].columns);
}

void fv_tape_begin_gaze(struct fv_writer *writer)
{
    fv_writer_print(writer, "%s\n%s,%s\n", formats[1].first_line, formats[1].columns, formats[1].optional);
}

void fv_tape_write_head(struct fv_writer *writer, const struct fv_head_sample *sample)
{
    const double *p = sample->pose.position_m, *q = sample->pose.rotation;
    fv_writer_print(writer, "%lld,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", (long long)sample->t_ns, p[0],
                    p[1], p[2], q[0], q[1], q[2], q[3]);
}

void fv_tape_write_gaze(struct fv_writer *writer, const struct fv_gaze_sample *sample)
{
    const double *l = sample->direction[0], *r = sample->direction[1];
    fv_writer_print(writer, "%lld,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%d,%.17g\n", (long long)sample->t_ns,
                    l[0], l[1], l[2], r[0], r[1], r[2], sample->valid, sample->uncertainty_deg);
}
