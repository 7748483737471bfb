/* display: where finished frames go. A sink is a row of a const table: {name, open, present,
 * close}. Frames come as 8-bit sRGB-encoded pictures, one an eye.
 *
 * png   FOLDER/left-NNNNN.png and right-NNNNN.png, each under a temporary name until complete
 * y4m   one 4:4:4 stream, the eyes side by side, BT.709 limited range, to a file, FIFO or standard
 *       output. A reader that is slow blocks present: the stream never drops a frame. SIGPIPE is
 *       ignored from open on.
 * kms   a display of the kernel (kms.h): page flips at the vertical blank; needs no pictures kept
 * none  nowhere */
#ifndef FV_DISPLAY_DISPLAY_H
#define FV_DISPLAY_DISPLAY_H

#include "config/config.h"
#include "platform/files.h"
#include "platform/vsync.h"

#include <stdbool.h>
#include <stdint.h>

/* Pixels of one frame: eye e, row y at pixels[e] + y * stride_bytes, 4 bytes a pixel: r, g, b, unused. */
struct fv_picture {
    int eyes, width, height;
    int64_t stride_bytes;
    const uint8_t *pixels[2];
};

struct fv_display; /* opaque, in the arena */

/* Opens the sink that display.sink names. `folder`: where the png sink writes; made by the caller.
 * All memory is taken here: present allocates nothing. */
int fv_display_open(struct fv_display **display, const struct fv_config *config, const char *folder,
                    struct fv_error *error);

/* True when the sink wants the pixels of this frame (the png sink takes every n-th and the last;
 * none takes none): the caller need not convert others. */
bool fv_display_wants(const struct fv_display *display, int64_t frame, bool last);

/* Takes one frame. Returns 0; -1 with the error set when it cannot be stored (disk full, pipe
 * closed): the loop goes on, and the sink takes no more. What was complete before stays. */
int fv_display_present(struct fv_display *display, const struct fv_picture *picture, int64_t frame,
                       struct fv_error *error);

/* Also where a run ends before its first frame: a display is given back as it was. */
int fv_display_close(struct fv_display *display, struct fv_error *error);

/* When a display refreshes, as of now; false: the sink is none, or has no vertical blank, or is lost. */
bool fv_display_beat(struct fv_display *display, struct fv_beat *beat);

/* What a display is and has done so far (kms.h says more). */
struct fv_display_counts {
    char mode[128]; /* "Virtual-1 1024x768, 60.00 Hz"; empty: the sink is no display, and all else is 0 */
    double hz;      /* of its mode */
    bool atomic, vblank;
    int64_t flips, skipped, dropped, busy, odd, lost, back, bytes;
    double copy_ms_mean, copy_ms_most; /* of a picture into the display's memory */
    double measured_hz;                /* 0: not known */
};
struct fv_display_counts fv_display_counts(const struct fv_display *display);

/* png: writes 8-bit RGB pictures of up to `width` x `height` pixels, compressed by zlib at `level`
 * 0 to 9, out of memory taken at fv_png_open. Used by the sink, the report and the tests. */
struct fv_png; /* opaque */
struct fv_png *fv_png_open(int width, int height);

/* Writes one eye as a file. Returns 0, or -1 with the error set: no file is left then. */
int fv_png_write(struct fv_png *png, const char *path, const struct fv_picture *picture, int eye,
                 int level, struct fv_error *error);

/* Writes the same base64-encoded into an open writer, for a data: URI. Returns 0, or -1 with the
 * error set when it could not be encoded; the writer's own failures are reported by its close. */
int fv_png_base64(struct fv_png *png, struct fv_writer *out, const struct fv_picture *picture, int eye,
                  int level, struct fv_error *error);

#endif
