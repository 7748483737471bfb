/* unseen: pixels that no eye sees through the lens are black. */
#ifndef FV_PASS_UNSEEN_H
#define FV_PASS_UNSEEN_H

#include "rt/fovea/lens.h"

#include <stdint.h>

#define FV_UNSEEN 0xff000000u /* 8-bit r, g, b, unused; as a word */

/* Of `count` pixels of row y, from x0 on. */
static inline void fv_darken_unseen(const struct fv_bend *bend, int x0, int y, int count, uint32_t *rgbx)
{
    int from, to;
    fv_bend_row(bend, y, x0 + count, &from, &to);
    for (int x = x0; x < x0 + count; x++)
        if (x < from || x >= to) rgbx[x - x0] = FV_UNSEEN;
}

#endif
