/* frame_tape: recorded camera frames of one eye, as they came from the camera.
 *
 *   # foveola frames 1, 640x400, GREY
 *
 * is the first line: version, size, and the format by its name (v4l2_format.h), rows without padding. Then
 * records: t_ns, the middle of the exposure (8 bytes), the frame's number of bytes (4), both the low byte
 * first, and the bytes. */
#ifndef FV_SENSORS_FRAME_TAPE_H
#define FV_SENSORS_FRAME_TAPE_H

#include "platform/error.h"
#include "platform/files.h"
#include "sensors/eye/v4l2_format.h"

/* Of a file; of its first line; of a record before its bytes. */
enum { FV_FRAME_TAPE_BYTES_MAX = 1 << 30, FV_FRAME_TAPE_LINE_MAX = 64, FV_FRAME_TAPE_HEAD_BYTES = 12 };

/* The files' names in a recording's folder: the left eye's, or the only one; the right one's. */
extern const char *const fv_frame_tape_name[2];

struct fv_frame_tape {
    struct fv_camera_layout layout;
    int64_t frames, rejected; /* with another number of bytes, not later than the one before, or cut off */
    int64_t first_ns, last_ns;
    const uint8_t *bytes; /* the file, kept */
    size_t begin, size;   /* of the first record; of the file */
};

/* Looks through the bytes of a file, which must stay. 0, or -1 with "name: ...": no such file, or no good
 * frame. */
int fv_frame_tape_parse(struct fv_frame_tape *tape, const char *name, const uint8_t *bytes, size_t size,
                        struct fv_error *error);

/* Reads a file of at most FV_FRAME_TAPE_BYTES_MAX whole, for good. Before the seal only. */
int fv_frame_tape_read(struct fv_frame_tape *tape, const char *path, struct fv_error *error);

/* The next good frame: `at` is where to look, tape->begin at the start, and is moved on; after_ns: the time
 * of the one before (INT64_MIN: none). NULL: there is none. */
const uint8_t *fv_frame_tape_next(const struct fv_frame_tape *tape, size_t *at, int64_t after_ns,
                                  int64_t *t_ns);

/* Recording. */
void fv_frame_tape_begin(struct fv_writer *writer, const struct fv_camera_layout *layout);
void fv_frame_tape_write(struct fv_writer *writer, int64_t t_ns, const uint8_t *bytes, size_t size);

#endif
