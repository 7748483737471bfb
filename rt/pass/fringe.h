/* fringe: chromatic aberration, by shifted lookups: the picture is traced for green, whose rays go straight through the
 * lens; red and blue are taken from where the lens shows their light, a little farther in or out (fovea/lens.h). */
#ifndef FV_PASS_FRINGE_H
#define FV_PASS_FRINGE_H

#include "rt/fovea/lens.h"

#include <stdint.h>

/* What fv_bend_fringe gives for red and blue, at r^2 from 0 to most^2 in FV_LENS_STEPS steps; and once more the last. */
struct fv_fringe {
    float per_square; /* steps of 1 r^2 */
    float ratio[2][FV_LENS_STEPS + 2];
};

void fv_fringe_set(struct fv_fringe *fringe, const struct fv_bend *bend);

/* `count` pixels of row y from x on, 8-bit r, g, b, unused; a multiple of 16, padded in `to`. */
struct fv_fringe_row {
    const struct fv_bend *bend;
    const struct fv_fringe *table;
    const uint32_t *green; /* the whole picture; bilinear, at its border the pixels there */
    uint32_t *to;          /* the row's, from x on */
    int stride, width, height;
    int x, y, count;
};

#endif
