/* pupil: from an infrared frame of an eye to its pupil: an ellipse with sub-pixel outline and a confidence.
 *
 * How (each step in a file of its own; order of reading):
 *   pupil.c          sizes, scratch memory, search in the whole frame or around the last pupil
 *   pupil_edges.c    the frame boxed down to a working size; its gradients; edges one pixel thin
 *   pupil_spots.c    lamps' reflections taken out of the working size before that
 *   pupil_arcs.c     edges linked with the dark on their right; arcs that turn around it; circles from arcs
 *   pupil_outline.c  circles grown into ellipses along the outline, judged; the best refined at full size
 *   pupil_ellipse.c  least-squares ellipses
 *
 * The class of method is that of PuRe (Santini, Fuhl and Kasneci 2018: edge segments selected by curvature,
 * ellipses ranked by outline contrast and angular spread) and of Pupil Labs' 2D detector (Kassner, Patera
 * and Bulling 2014: the pupil is the dark region). Other than there, edges keep which side is dark, so that
 * outlines of glints and lashes part from the pupil's wherever they turn the other way.
 *
 * Nothing is allocated, every list and loop is bounded: the time has an upper limit for each frame size. */
#ifndef FV_SENSORS_PUPIL_H
#define FV_SENSORS_PUPIL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Eight bits of grey, rows of `stride` >= width bytes, the top one first. */
struct fv_eye_frame {
    const uint8_t *pixels;
    int width, height;
    ptrdiff_t stride;
};

/* Pixels of the frame; the middle of its first pixel is 0, 0; y down. */
struct fv_pupil {
    bool found;          /* a pupil is seen: confidence >= FV_PUPIL_CONFIDENT */
    double x, y;         /* centre */
    double major, minor; /* whole axes, major >= minor */
    double angle;        /* of the major axis, from x towards y, radians in (-pi/2, pi/2] */
    double confidence; /* [0, 1]; of the best ellipse there is, found or not; 0: there is none, all else 0 */
};

/* From here on an ellipse is called a pupil; how confidence is made up: pupil_outline.c. */
#define FV_PUPIL_CONFIDENT 0.5

/* What widths (whole major axes, pixels) are looked for. fv_pupil_limits: what a head-mounted camera sees,
 * the longer side / 32 (but 8) to half of the shorter one: 20 to 200 px of 640x400. */
struct fv_pupil_limits {
    double least, most;
};
struct fv_pupil_limits fv_pupil_limits(int width, int height);

/* What is known from frames before; all 0 at the start. While the last pupil was found, the next is first
 * looked for around it, at the best working size for it; where it is not, in the whole frame. */
struct fv_pupil_track {
    struct fv_pupil last;
    int64_t frames, followed, found; /* seen so far; of these, by the region alone; with a pupil */
};

/* Frames up to this size are searched; larger ones hold no pupil. */
#define FV_PUPIL_SIDE_MAX 16384

/* Bytes of scratch memory for frames of this size; 0 where it is not between 1 and FV_PUPIL_SIDE_MAX. */
size_t fv_pupil_scratch_bytes(int width, int height);

/* Finds the pupil. limits: NULL for fv_pupil_limits; track: NULL for a search in the whole frame. scratch: at
 * least fv_pupil_scratch_bytes, 64-byte aligned; need not be cleared, holds nothing between calls.
 * The answer depends on frame, limits and track alone; never NaN. */
void fv_pupil_find(const struct fv_eye_frame *frame, const struct fv_pupil_limits *limits,
                   struct fv_pupil_track *track, void *scratch, struct fv_pupil *pupil);

#endif
