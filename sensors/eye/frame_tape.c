/* frame_tape: see the header. */
#include "sensors/eye/frame_tape.h"

#include <stdio.h>
#include <string.h>

enum { HEAD_MAX = FV_FRAME_TAPE_LINE_MAX, RECORD_HEAD = FV_FRAME_TAPE_HEAD_BYTES };

const char *const fv_frame_tape_name[2] = {"left.frames", "right.frames"};

static uint64_t number(const uint8_t *bytes, int count)
{
    uint64_t value = 0;
    for (int i = count; i-- > 0;) value = value << 8 | bytes[i];
    return value;
}

static int read_head(struct fv_frame_tape *t, const char *name, struct fv_error *error)
{
    char line[HEAD_MAX] = "", format[8];
    int version = 0, end = 0;
    const uint8_t *stop = memchr(t->bytes, '\n', t->size < HEAD_MAX ? t->size : HEAD_MAX - 1);
    if (stop) memcpy(line, t->bytes, (size_t)(stop - t->bytes));
    if (!stop ||
        sscanf(line, "# foveola frames %9d, %5dx%5d, %7[A-Z0-9]%n", &version, &t->layout.width,
               &t->layout.height, format, &end) != 4 ||
        line[end] || version != 1)
        return fv_error_set(error, "%s: no frames; must begin with '# foveola frames 1, 640x400, GREY'",
                            name);
    t->layout.format = fv_camera_format_named(format);
    if (!t->layout.format)
        return fv_error_set(error, "%s: frames of %s; must be GREY, NV12, YUYV, Y10, Y12 or Y16", name,
                            format);
    t->layout.stride = fv_camera_row_bytes(t->layout.format, t->layout.width);
    if (fv_camera_frame_bytes(&t->layout) == 0)
        return fv_error_set(error, "%s: %s frames of %dx%d cannot be", name, format, t->layout.width,
                            t->layout.height);
    t->begin = (size_t)(stop - t->bytes) + 1;
    return 0;
}

/* The record at `at`, which is moved behind it; false: the file ends within it. */
static bool record(const struct fv_frame_tape *t, size_t *at, int64_t *t_ns, size_t *size)
{
    if (t->size - *at < RECORD_HEAD) return false;
    *t_ns = (int64_t)number(t->bytes + *at, 8);
    *size = (size_t)number(t->bytes + *at + 8, 4);
    if (t->size - *at - RECORD_HEAD < *size) return false;
    *at += RECORD_HEAD + *size;
    return true;
}

/* Session times: some centuries either way are no times. */
static bool is_good(int64_t t_ns, int64_t after_ns, size_t size, size_t whole)
{
    return size == whole && t_ns > INT64_MIN / 4 && t_ns < INT64_MAX / 4 && t_ns > after_ns;
}

const uint8_t *fv_frame_tape_next(const struct fv_frame_tape *t, size_t *at, int64_t after_ns, int64_t *t_ns)
{
    size_t size, whole = fv_camera_frame_bytes(&t->layout);
    while (record(t, at, t_ns, &size))
        if (is_good(*t_ns, after_ns, size, whole)) return t->bytes + *at - size;
    return NULL;
}

int fv_frame_tape_parse(struct fv_frame_tape *t, const char *name, const uint8_t *bytes, size_t size,
                        struct fv_error *error)
{
    *t = (struct fv_frame_tape){.bytes = bytes, .size = size};
    if (read_head(t, name, error)) return -1;
    size_t at = t->begin, of_record, whole = fv_camera_frame_bytes(&t->layout);
    int64_t t_ns;
    while (record(t, &at, &t_ns, &of_record)) {
        if (!is_good(t_ns, t->frames ? t->last_ns : INT64_MIN, of_record, whole)) {
            t->rejected++;
            continue;
        }
        if (t->frames++ == 0) t->first_ns = t_ns;
        t->last_ns = t_ns;
    }
    t->rejected += at < size;
    if (t->frames == 0 || t->rejected > t->frames)
        return fv_error_set(error, "%s: %lld frames are good and %lld are not", name, (long long)t->frames,
                            (long long)t->rejected);
    return 0;
}

int fv_frame_tape_read(struct fv_frame_tape *t, const char *path, struct fv_error *error)
{
    char *bytes;
    size_t size;
    if (fv_file_read(path, FV_FRAME_TAPE_BYTES_MAX, &bytes, &size, error)) return -1;
    return fv_frame_tape_parse(t, path, (const uint8_t *)bytes, size, error);
}

void fv_frame_tape_begin(struct fv_writer *writer, const struct fv_camera_layout *l)
{
    fv_writer_print(writer, "# foveola frames 1, %dx%d, %s\n", l->width, l->height, l->format->name);
}

void fv_frame_tape_write(struct fv_writer *writer, int64_t t_ns, const uint8_t *bytes, size_t size)
{
    uint8_t head[RECORD_HEAD];
    for (int i = 0; i < 8; i++) head[i] = (uint8_t)((uint64_t)t_ns >> 8 * i);
    for (int i = 0; i < 4; i++) head[8 + i] = (uint8_t)(size >> 8 * i);
    fv_writer_bytes(writer, head, sizeof head);
    fv_writer_bytes(writer, bytes, size);
}
