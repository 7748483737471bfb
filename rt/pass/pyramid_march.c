/* march: where rays through fields begin, of each 4 x 4 pixels; see pyramid.h. */
#include "rt/pass/pyramid.h"

enum { WIDE = 2 * FV_BLOCK, WIDES = FV_TILE / WIDE, COUNT = FV_BLOCKS * FV_BLOCKS };

/* The middles of side x side squares of `size` pixels. */
static void place(struct fv_samples *s, const struct fv_tile *tile, int side, int size)
{
    s->count = side * side;
    for (int i = 0; i < s->count; i++) {
        s->x[i] = (float)tile->x0 + ((float)(i % side) + 0.5f) * (float)size;
        s->y[i] = (float)tile->y0 + ((float)(i / side) + 0.5f) * (float)size;
    }
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *w = &f->scratch[tile->worker];
    struct fv_samples *s = &w->samples;
    const struct fv_view *view = &f->view[tile->eye];
    float *starts = f->buffer[FV_STARTS][tile->eye], wide[WIDES * WIDES];
    int64_t at = tile->y0 / FV_BLOCK * fv_starts_stride(f) + tile->x0 / FV_BLOCK;
    place(s, tile, WIDES, WIDE);
    s->started = false;
    f->kernels->starts(f->tracer, view, s, fv_reach_px(WIDE), w->rays);
    for (int i = 0; i < WIDES * WIDES; i++) wide[i] = s->start[i];
    place(s, tile, FV_BLOCKS, FV_BLOCK);
    for (int i = 0; i < COUNT; i++) s->start[i] = wide[i / FV_BLOCKS / 2 * WIDES + i % FV_BLOCKS / 2];
    f->kernels->starts(f->tracer, view, s, f->pyramid.minimum ? 0 : fv_reach_px(FV_BLOCK), w->rays);
    for (int i = 0; i < COUNT; i++) starts[at + i / FV_BLOCKS * fv_starts_stride(f) + i % FV_BLOCKS] = s->start[i];
    s->started = false;
    return COUNT + WIDES * WIDES;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings,
                   double units[2])
{
    (void)p, (void)rings;
    units[0] = (double)f->tiles * (COUNT + WIDES * WIDES);
}

const struct fv_pass fv_pass_march = {.name = "march", .writes = FV_BIT(FV_STARTS), .run = run, .expect = expect};
