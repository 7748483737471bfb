/* imu_tape: see imu_tape.h. */
#include "sensors/imu/imu_tape.h"

#include "platform/arena.h"
#include "sensors/tape.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

static const char first_line[] = "# foveola imu 1";
static const char columns[] = "arrival_ns,reading,counter,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s,acc_x_m_s2,acc_y_m_s2,"
                              "acc_z_m_s2";
static const char session_line[] = "# session 0 = ", stream_line[] = "# stream ";
static const int64_t span_max_ns = 1000000000000000; /* 11 days: a later row is a broken clock */
static const double integer_max = 1e6;

/* What a stream line holds, in its order. */
struct said {
    double tick_ns, counter_bits, hz, acc_full, rate_full, axes[3];
    struct fv_imu_calibration calibration;
};
static const struct {
    const char *name;
    size_t offset;
    int count;
} words[] = {{"tick_ns=", offsetof(struct said, tick_ns), 1},
             {"counter_bits=", offsetof(struct said, counter_bits), 1},
             {"hz=", offsetof(struct said, hz), 1},
             {"acc_full=", offsetof(struct said, acc_full), 1},
             {"rate_full=", offsetof(struct said, rate_full), 1},
             {"axes=", offsetof(struct said, axes), 3},
             {"acc_scale=", offsetof(struct said, calibration.acc_scale), 3},
             {"acc_bias_m_s2=", offsetof(struct said, calibration.acc_bias), 3},
             {"rate_scale=", offsetof(struct said, calibration.rate_scale), 3},
             {"rate_bias_rad_s=", offsetof(struct said, calibration.rate_bias), 3}};
enum { WORDS = sizeof words / sizeof words[0] };

int fv_imu_decode_taped(const struct fv_imu_layout *layout, const uint8_t *report, size_t bytes,
                        struct fv_imu_reading readings[FV_IMU_READINGS])
{
    (void)layout;
    if (bytes % sizeof readings[0] != 0 || bytes > FV_IMU_READINGS * sizeof readings[0]) return -1;
    memcpy(readings, report, bytes);
    return (int)(bytes / sizeof readings[0]);
}

bool fv_imu_tape_is(const char *text, size_t size)
{
    size_t length = sizeof first_line - 1;
    return size > length && memcmp(text, first_line, length) == 0 && (text[length] == '\n' || text[length] == '\r');
}

/* A tape being read. */
struct reading {
    struct fv_imu_tape *tape;
    const char *name;
    struct fv_error *error;
    int line, first_bad_line;
    const char *first_bad;
    bool begins, session;
    int stream; /* -1: none yet */
    struct fv_imu_tape_row last;
    struct fv_imu_tape_row *row; /* NULL: only count */
};

/* A line, without its end; ends with a byte that is no part of a number. */
struct line {
    const char *at, *end;
};

static bool take(struct line *l, const char *text)
{
    size_t length = strlen(text);
    if ((size_t)(l->end - l->at) < length || memcmp(l->at, text, length) != 0) return false;
    l->at += length;
    return true;
}

/* strtod and its kin skip blanks, over the line's end too. */
static bool at_number(const struct line *l)
{
    return l->at < l->end && (unsigned char)*l->at > ' ';
}

static bool take_real(struct line *l, double *out)
{
    char *end;
    if (!at_number(l)) return false;
    *out = strtod(l->at, &end);
    bool good = end > l->at && end <= l->end;
    l->at = end;
    return good;
}

static bool take_integer(struct line *l, int64_t *out)
{
    char *end;
    if (!at_number(l)) return false;
    errno = 0;
    *out = strtoll(l->at, &end, 10);
    bool good = end > l->at && end <= l->end && errno == 0;
    l->at = end;
    return good;
}

static bool take_counter(struct line *l, uint64_t *out)
{
    char *end;
    if (l->at == l->end || *l->at < '0' || *l->at > '9') return false;
    errno = 0;
    *out = strtoull(l->at, &end, 10);
    bool good = end <= l->end && errno == 0;
    l->at = end;
    return good;
}

/* The number of this device in the list; -1: the list is full. */
static int find_device(struct fv_imu_tape *t, const struct fv_imu_device *d)
{
    for (int i = 0; i < t->devices; i++) {
        const struct fv_imu_device *o = &t->device[i];
        if (o->tick_ns == d->tick_ns && o->counter_bits == d->counter_bits && o->hz == d->hz &&
            o->acc_full == d->acc_full && o->rate_full == d->rate_full && memcmp(o->axes, d->axes, sizeof d->axes) == 0)
            return i;
    }
    if (t->devices == FV_IMU_TAPE_DEVICES) return -1;
    t->device[t->devices] = *d;
    return t->devices++;
}

static int find_stream(struct fv_imu_tape *t, int device, const struct fv_imu_calibration *calibration)
{
    for (int i = 0; i < t->streams; i++)
        if (t->stream[i].device == device && memcmp(&t->stream[i].calibration, calibration, sizeof *calibration) == 0)
            return i;
    if (t->streams == FV_IMU_TAPE_STREAMS) return -1;
    t->stream[t->streams].device = device;
    t->stream[t->streams].calibration = *calibration;
    return t->streams++;
}

static int bad_stream(const struct reading *r, const char *what)
{
    return fv_error_set(r->error, "%s:%d: stream: %s", r->name, r->line, what);
}

/* Without it the rows behind it mean nothing: it must be right. */
static int take_stream(struct reading *r, struct line l)
{
    static struct fv_imu_stream tried;
    struct said said;
    struct fv_error why;
    for (int i = 0; i < WORDS; i++) {
        double *value = (double *)((char *)&said + words[i].offset);
        bool good = (i == 0 || take(&l, " ")) && take(&l, words[i].name);
        for (int k = 0; k < words[i].count && good; k++) good = (k == 0 || take(&l, ",")) && take_real(&l, &value[k]);
        if (!good) return bad_stream(r, words[i].name);
    }
    struct fv_imu_device device = {.name = "tape", .decode = fv_imu_decode_taped, .tick_ns = said.tick_ns, .hz = said.hz,
                                   .acc_full = said.acc_full, .rate_full = said.rate_full,
                                   .command = {.every_s = INFINITY}};
    if (!(fabs(said.counter_bits) <= integer_max)) return bad_stream(r, "counter_bits is no such number");
    if (!(said.acc_full > 0 && said.rate_full > 0)) return bad_stream(r, "a full scale is not above 0");
    device.counter_bits = (int)said.counter_bits;
    for (int i = 0; i < 3; i++) {
        if (!(fabs(said.axes[i]) <= 3)) return bad_stream(r, "an axis is none of 1, 2 and 3");
        device.axes[i] = (int8_t)said.axes[i];
    }
    if (fv_imu_stream_begin(&tried, &device, &said.calibration, &why)) return bad_stream(r, why.text);
    int number = find_device(r->tape, &device);
    r->stream = number < 0 ? -1 : find_stream(r->tape, number, &said.calibration);
    if (r->stream < 0) return bad_stream(r, "more kinds of them than can be told apart");
    r->begins = true;
    return 0;
}

/* NULL, or what is wrong with the row. */
static const char *take_row(struct reading *r, struct line l)
{
    struct fv_imu_tape *t = r->tape;
    struct fv_imu_tape_row row = {.stream = (uint8_t)r->stream, .begins = r->begins};
    int64_t number;
    double *value[] = {row.reading.rate, row.reading.acc};
    if (l.end - l.at > FV_TAPE_LINE_MAX) return "the line is too long";
    if (!take_integer(&l, &row.arrival_ns) || !take(&l, ",") || !take_integer(&l, &number) || !take(&l, ",") ||
        !take_counter(&l, &row.reading.counter))
        return "not a time, a number and a counter";
    for (int i = 0; i < 6; i++)
        if (!take(&l, ",") || !take_real(&l, &value[i / 3][i % 3])) return "not a number in every column";
    if (l.at != l.end) return "the row is long";
    if (row.arrival_ns > INT64_MAX / 4 || row.arrival_ns < -INT64_MAX / 4) return "the time is out of range";
    if (t->rows > 0 && row.arrival_ns < t->last_ns) return "the time falls";
    if (t->rows > 0 && row.arrival_ns - t->first_ns > span_max_ns) return "the time is out of range";
    bool next = number > 0 && t->rows > 0 && !r->begins && number == r->last.number + 1 &&
                number < FV_IMU_READINGS && row.arrival_ns == t->last_ns;
    if (number != 0 && !next) return "not the next reading of its report";
    row.number = (uint8_t)number;
    if (t->rows == 0) t->first_ns = row.arrival_ns;
    t->last_ns = row.arrival_ns;
    if (r->row) r->row[t->rows] = row;
    t->rows++;
    r->last = row;
    r->begins = false;
    return NULL;
}

static int take_line(struct reading *r, struct line l)
{
    const char *bad = NULL;
    if (take(&l, stream_line)) return take_stream(r, l);
    if (take(&l, session_line)) {
        int64_t at_ns;
        if (take_integer(&l, &at_ns) && at_ns < INT64_MAX / 4 && at_ns > -INT64_MAX / 4)
            r->tape->session_ns = at_ns, r->session = true;
        else bad = "no time of the session";
    } else if (*l.at == '#') return 0;
    else if (r->stream < 0) return bad_stream(r, "none is told before the first row");
    else bad = take_row(r, l);
    if (!bad) return 0;
    r->tape->rejected++;
    if (!r->first_bad) r->first_bad = bad, r->first_bad_line = r->line;
    return 0;
}

int fv_imu_tape_parse(struct fv_imu_tape *tape, const char *name, const char *text, size_t size,
                      struct fv_imu_tape_row *row, struct fv_error *error)
{
    struct reading r = {.tape = tape, .name = name, .error = error, .stream = -1, .row = row};
    const char *end = text + size, *stop;
    bool named = false;
    memset(tape, 0, sizeof *tape);
    tape->row = row;
    if (!fv_imu_tape_is(text, size)) return fv_error_set(error, "%s:1: must begin with '%s'", name, first_line);
    /* A last line that is cut off might be another number than it was. */
    for (; (stop = memchr(text, '\n', (size_t)(end - text))) != NULL; text = stop + 1) {
        struct line l = {text, stop > text && stop[-1] == '\r' ? stop - 1 : stop};
        r.line++;
        if (l.at == l.end) continue;
        struct line rest = l;
        if (!named && *l.at != '#') {
            if (!take(&rest, columns) || rest.at != rest.end)
                return fv_error_set(error, "%s:%d: column names are missing; must be %s", name, r.line, columns);
            named = true;
        } else if (take_line(&r, l)) return -1;
    }
    if (tape->rows == 0 && !r.first_bad) return fv_error_set(error, "%s:%d: no rows follow", name, r.line);
    if (tape->rows == 0 || tape->rejected > tape->rows)
        return fv_error_set(error, "%s:%d: %s; %lld rows are bad, %lld good", name, r.first_bad_line, r.first_bad,
                            (long long)tape->rejected, (long long)tape->rows);
    if (!r.session || tape->session_ns > tape->last_ns || tape->session_ns < tape->first_ns - span_max_ns)
        tape->session_ns = tape->first_ns;
    return 0;
}

int fv_imu_tape_read(struct fv_imu_tape *tape, const char *path, struct fv_error *error)
{
    char *text;
    size_t size;
    if (fv_file_read(path, FV_TAPE_BYTES_MAX, &text, &size, error)) return -1;
    int result = fv_imu_tape_is(text, size) ? fv_imu_tape_parse(tape, path, text, size, NULL, error) : 1;
    if (result == 0) {
        struct fv_imu_tape_row *row = fv_arena_take(fv_arena(), "sensors", (size_t)tape->rows * sizeof *row, 64);
        result = fv_imu_tape_parse(tape, path, text, size, row, error);
    }
    free(text);
    return result;
}

void fv_imu_tape_begin(struct fv_writer *writer)
{
    fv_writer_print(writer, "%s\n%s\n", first_line, columns);
}

void fv_imu_tape_write_stream(struct fv_writer *writer, const struct fv_imu_device *device,
                              const struct fv_imu_calibration *calibration)
{
    struct said said = {device->tick_ns, device->counter_bits, device->hz, device->acc_full, device->rate_full,
                        {device->axes[0], device->axes[1], device->axes[2]}, *calibration};
    fv_writer_print(writer, "# stream");
    for (int i = 0; i < WORDS; i++) {
        const double *value = (const double *)((const char *)&said + words[i].offset);
        fv_writer_print(writer, " %s", words[i].name);
        for (int k = 0; k < words[i].count; k++) fv_writer_print(writer, k ? ",%.17g" : "%.17g", value[k]);
    }
    fv_writer_print(writer, " device=%s\n", device->name);
}

void fv_imu_tape_write_reading(struct fv_writer *writer, int64_t arrival_ns, int number,
                               const struct fv_imu_reading *reading)
{
    const double *r = reading->rate, *a = reading->acc;
    fv_writer_print(writer, "%lld,%d,%llu,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", (long long)arrival_ns, number,
                    (unsigned long long)reading->counter, r[0], r[1], r[2], a[0], a[1], a[2]);
}

void fv_imu_tape_write_session(struct fv_writer *writer, int64_t session_ns)
{
    fv_writer_print(writer, "%s%lld ns\n", session_line, (long long)session_ns);
}
