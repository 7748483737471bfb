/* pupil_spots: reflections of lamps taken out of the working image, before its edges are looked for. A glint
 * on the outline or beside it breaks the edge there; a ring of them leaves arcs too short to tell a circle
 * from.
 *
 * How: a grey opening (of the squares of n x n pixels that a pixel lies in, each square's darkest pixel, the
 * brightest of these) takes away whatever is bright and narrower than the square, and leaves edges between
 * wider parts where they are: what a spot hides takes the grey of that side of the outline on which it lies.
 * It replaces the image in and around spots, nowhere else. */
#include "sensors/eye/pupil_work.h"

#include <string.h>

/* A spot's pixel is at least so bright and so much brighter, in levels of grey, than each of eight places at
 * a reach around it, as in glint.c: gaps between lashes and lids are as bright, but along them on. */
enum { BRIGHT = 96, CONTRAST = 32, AROUND = 8 };
/* How far beyond such pixels a spot's skirts reach. */
enum { SKIRT = 2 };

/* The part of the image that is opened for one spot: what is filled in, and squares' widths around it. */
enum { BLOCK = 6 * FV_SPOT + 2 * SKIRT + 1 };
struct block {
    int16_t a[BLOCK * BLOCK], b[BLOCK * BLOCK];
};

static void least(int16_t *restrict out, const int16_t *restrict in, int ahead, int n)
{
    for (int i = 0; i < n; i++) out[i] = in[i] < in[i + ahead] ? in[i] : in[i + ahead];
}

static void most(int16_t *restrict out, const int16_t *restrict in, int ahead, int n)
{
    for (int i = 0; i < n; i++) out[i] = in[i] > in[i + ahead] ? in[i] : in[i + ahead];
}

/* From `from` to the least, or most, of each value and the side - 1 ahead of it, `apart` from each other, by
 * doubled lengths; n becomes less by those that reach over the end. Returns where they are: *from or *to. */
static int16_t *of_side(void (*pick)(int16_t *, const int16_t *, int, int), int16_t *from, int16_t *to,
                        int *n, int apart, int side)
{
    for (int reach = 1, step; reach < side; reach += step) {
        step = reach < side - reach ? reach : side - reach;
        *n -= step * apart;
        pick(to, from, step * apart, *n);
        int16_t *swap = from;
        from = to;
        to = swap;
    }
    return from;
}

/* Opens the block of size x size in a; the answer for column i, row j, both at least side - 1, stands side -
 * 1 columns and rows before that. */
static const int16_t *opened(struct block *block, int size, int side)
{
    int16_t *at = block->a;
    int n = size * size;
    for (int i = 0; i < 4; i++)
        at = of_side(i < 2 ? least : most, at, at == block->a ? block->b : block->a, &n, i % 2 ? size : 1,
                     side);
    return at;
}

static int within(int at, int size)
{
    return at < 0 ? 0 : at < size ? at : size - 1;
}

/* Fills in the spot whose first pixel, by rows, is x, y: all its pixels as far as a spot reaches. */
static void fill(struct fv_pupil_work *work, int x, int y)
{
    struct block block;
    enum { reach = FV_SPOT, margin = 2 * reach, size = BLOCK };
    int row = work->row;
    int left = x - reach - SKIRT - margin, top = y - SKIRT - margin;
    for (int j = 0; j < size; j++)
        for (int i = 0; i < size; i++)
            block.a[j * size + i] =
                (int16_t)work->grey[within(top + j, work->height) * row + within(left + i, work->width)];
    const int16_t *grey = opened(&block, size, margin + 1);
    for (int v = y; v <= y + 2 * reach && v < work->height; v++)
        for (int u = within(x - reach, work->width); u <= x + reach && u < work->width; u++) {
            if (!work->thin[v * row + u]) continue;
            work->thin[v * row + u] = 0;
            for (int j = v - SKIRT; j <= v + SKIRT; j++)
                for (int i = u - SKIRT; i <= u + SKIRT; i++) {
                    int16_t without = grey[(j - top - margin) * size + i - left - margin];
                    work->grey[j * row + i] = (uint16_t)without;
                    work->hidden[j * row + i] = 1;
                }
        }
}

/* Bright, and brighter than what is `reach` to both sides. */
static void brighter(const int16_t *restrict grey, int reach, uint8_t *restrict spot, int width)
{
    for (int x = reach; x < width - reach; x++) {
        int16_t here = (int16_t)(grey[x] - CONTRAST * FV_GREY), left = grey[x - reach],
                right = grey[x + reach];
        spot[x] = (uint8_t)((grey[x] >= BRIGHT * FV_GREY) & (here >= left) & (here >= right));
    }
}

/* Marks the pixels of spots in `thin`. */
static bool mark(struct fv_pupil_work *work)
{
    int reach = FV_SPOT, row = work->row, aside = (int)(0.7071 * reach + 0.5);
    const int around[AROUND - 2] = {reach * row,        -reach * row,      aside * (row + 1),
                                    -aside * (row + 1), aside * (row - 1), -aside * (row - 1)};
    bool any = false;
    memset(work->thin, 0, (size_t)row * (size_t)work->height);
    for (int y = reach; y < work->height - reach; y++) {
        const int16_t *grey = (const int16_t *)work->grey + y * row;
        uint8_t *spot = work->thin + y * row;
        brighter(grey, reach, spot, work->width);
        for (int x = 0; x < row; x += 8) {
            uint64_t eight;
            memcpy(&eight, spot + x, 8);
            for (int i = x; eight && i < x + 8; i++) {
                for (int k = 0; k < AROUND - 2 && spot[i]; k++)
                    spot[i] = grey[i] - grey[i + around[k]] >= CONTRAST * FV_GREY;
                any |= spot[i];
            }
        }
    }
    return any;
}

void fv_pupil_spots(struct fv_pupil_work *work)
{
    memset(work->hidden, 0, (size_t)work->row * (size_t)work->height);
    if (!mark(work)) return;
    for (int y = 0; y < work->height; y++) {
        const uint8_t *spot = work->thin + y * work->row;
        for (int x = 0; x < work->row; x += 8) {
            uint64_t eight;
            memcpy(&eight, spot + x, 8);
            for (int i = x; eight && i < x + 8; i++)
                if (spot[i]) fill(work, i, y);
        }
    }
}
