/* turn: a finished picture that is shown later than it was rendered for, turned to where the head is by then: by
 * rotation alone, which moves a picture most and needs no depths (van Waveren, The asynchronous time warp for virtual
 * reality on consumer hardware, VRST 2016).
 *
 * A pixel of the turned picture shows what lies in its direction, seen from the newest head; the picture that was
 * rendered shows that direction somewhere else. From one to the other:
 *
 *   display's pixel -> straight (fovea/lens.h) -> a homography, the turn between two pinholes (fv_map_set) -> bent
 *
 * and there it is looked up, bilinear. Where red and blue part from green (pass/fringe.h), each channel goes its own
 * way from the pixel where the lens shows it, through green's picture, so that nothing is looked up twice. Directions
 * that the rendered picture does not show take what stands at its edge, or at the edge of what an eye sees of it:
 * black borders that come and go would be seen more than that. */
#ifndef FV_PASS_TURN_H
#define FV_PASS_TURN_H

#include "rt/fovea/view.h"
#include "rt/pass/fringe.h"

/* Farther, and the picture stays as it is: hardly anything of it would still be in view. */
#define FV_TURN_MOST_DEG 60.0

/* `bent` as a table: r / t over 1 - cos of the angle from the axis, in which it is smooth from the axis to 90 degrees;
 * less so next to where a lens all but stops growing, whose last pixels may be a tenth of one off. */
enum { FV_UNBEND_STEPS = 1024 };
struct fv_unbend {
    float per_unit; /* steps of a whole 1 - cos */
    float edge;     /* r: no lookups beyond; 1e6: nothing is unseen */
    float ratio[FV_UNBEND_STEPS + 2];
};

struct fv_turn {
    float m[2][3][3]; /* of each eye: the turned picture's straight coordinates to the rendered one's (struct fv_map) */
    struct fv_unbend unbend; /* the lenses mirror each other: of both */
};

/* `bend` on. */
void fv_unbend_set(struct fv_unbend *unbend, const struct fv_bend *bend);

struct fv_frame;

/* From the frame's views to the newest head. False: the picture is to stay as it is, as the head has turned by nothing
 * that shows (fv_map_still), by more than FV_TURN_MOST_DEG, or is none. */
bool fv_turn_set(struct fv_frame *frame, const struct fv_pose *head);

/* The square of FV_TURN_SIDE pixels a side at (x, y), 8-bit r, g, b, 255. What its pixels look up is interpolated by
 * squares of x and y between 3 x 3 of them that go all the way above, where that is to a 64th of a pixel at four more;
 * else each goes all the way. Colours are within one code of 255 of what squares of the codes make, and stay as they are
 * where the picture is even. Squares are best taken from left to right: each fetches what the next one wants. */
enum { FV_TURN_SIDE = 32 };
struct fv_turn_square {
    const struct fv_bend *bend;
    const struct fv_unbend *unbend;
    const struct fv_fringe *fringe; /* NULL: the channels stay together */
    const float (*m)[3];
    const uint32_t *from;           /* the whole picture */
    uint32_t *to;                   /* likewise */
    int stride, width, height;      /* of both; at least 2 x 2 */
    int x, y;
};

#endif
