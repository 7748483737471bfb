/* pupil_work: what the steps of the pupil search hand to each other. Internal to sensors/eye/pupil*.c. */
#ifndef FV_SENSORS_PUPIL_WORK_H
#define FV_SENSORS_PUPIL_WORK_H

#include "sensors/eye/pupil.h"
#include "sensors/eye/pupil_ellipse.h"

/* The working size: the frame boxed down by a whole number so that its longer side is at most this many
 * pixels. 640 px become 320: the narrowest pupils there, 20 px, keep 10, on whose outline some 30 edges
 * lie, and the widest ones' edges are still thin after smoothing. */
enum { FV_PUPIL_SIDE = 320 };

/* Values of the working image: 16 for each level of grey. Gradients, over two pixels: 32 for a level a pixel.
 */
enum { FV_GREY = 16, FV_SLOPE = 32 };

/* Bounds of the lists. Frames of noise alone would have more edges: then the strongest are kept. */
enum { FV_EDGES_MAX = 10000, FV_ARCS_MAX = 1024, FV_SEEDS_MAX = 16 };

/* Pixels at the border in which no gradients are. */
enum { FV_PUPIL_BORDER = 3 };

/* How far reflections reach from their middle at most, working pixels: 1/80 of the side, as in glint.c. */
enum { FV_SPOT = 4 };

struct fv_edge {
    float x, y;          /* to a fraction of a pixel along the gradient */
    float nx, ny;        /* unit gradient: towards the bright side */
    int16_t column, row; /* the pixel */
    uint16_t next;       /* the edge ahead, dark on the right; FV_NO_EDGE: none */
    uint16_t before;
    float link; /* how well `before` fits, while they are linked */
};
#define FV_NO_EDGE UINT16_MAX

/* A stretch of `order` that turns around its dark side. */
struct fv_arc {
    int first, count;
    float turn; /* radians, >= 0 */
};

/* A circle that an arc lies on. */
struct fv_seed {
    float x, y, radius, worth;
    int arc;
};

struct fv_pupil_work {
    int width, height, scale; /* working pixels; frame pixels in each, a side */
    int row;                  /* pixels from one working row to the next, a multiple of 16 */
    int least, most;          /* radii looked for, working pixels */
    uint16_t *grey;           /* planes of row * height */
    uint16_t *smooth;         /* also: the horizontal pass's rows */
    uint16_t *across;
    int16_t *gx, *gy, *slope; /* gradient and its length (to 7 %) */
    uint8_t *thin;            /* not 0: an edge */
    uint8_t *hidden;          /* not 0: behind a reflection */
    uint16_t *at;             /* index of the edge there; FV_NO_EDGE */
    uint32_t *column;         /* sums of a row's columns, as wide as the frame */
    int threshold;            /* slopes from here on are edges */
    struct fv_edge *edge;
    uint16_t *order; /* edges of chains, one after the other */
    struct fv_arc *arc;
    struct fv_seed seed[FV_SEEDS_MAX];
    int edges, arcs, seeds;
};

/* pupil_edges.c: from the frame to `edge`. */
void fv_pupil_edges(const struct fv_eye_frame *frame, struct fv_pupil_work *work);
/* pupil_spots.c: `grey` without reflections; `hidden`. */
void fv_pupil_spots(struct fv_pupil_work *work);
/* pupil_arcs.c: from `edge` to `seed`, the worthiest first. */
void fv_pupil_arcs(struct fv_pupil_work *work);
/* pupil_outline.c: from `seed` to the best ellipse, in frame pixels. */
void fv_pupil_outline(const struct fv_eye_frame *frame, struct fv_pupil_work *work, struct fv_pupil *pupil);

#endif
