/* pass: from tile numbers to tiles, and the tracing of a tile's blocks that passes share. */
#include "rt/pass/pass.h"

#include <string.h>

struct run {
    const struct fv_pass *pass;
    struct fv_frame *frame;
};

void fv_frame_lay(struct fv_frame *f)
{
    for (int e = 0; e < f->eyes; e++)
        for (int d = 0; d < FV_DENSITIES; d++) {
            int colour = FV_COLOUR + 2 * d;
            f->raster[d][e] = (struct fv_raster){
                .width = (f->width + (1 << d) - 1) >> d,
                .height = (f->height + (1 << d) - 1) >> d,
                .stride = f->stride >> d,
                .scale = (float)(1 << d),
                .colour = f->buffer[colour][e],
                .cache = f->buffer[colour + 1][e],
                .history_colour = f->buffer[colour + FV_HISTORY_COLOUR][e],
                .history_cache = f->buffer[colour + 1 + FV_HISTORY_COLOUR][e],
                .plane = (f->stride >> d) * (f->rows >> d) + 16, /* and what is loaded behind the last */
            };
        }
}

void fv_raster_row(const struct fv_raster *r, int plane, int x0, int y, int n, uint32_t *row)
{
    const uint32_t *from = r->colour + plane * r->plane + fv_clamp(y, r->height) * r->stride;
    if (x0 >= 0 && x0 + n <= r->width) memcpy(row, from + x0, (size_t)n * sizeof *row);
    else
        for (int x = 0; x < n; x++) row[x] = from[fv_clamp(x0 + x, r->width)];
}

struct fv_tile fv_tile_at(const struct fv_frame *f, int index, int worker)
{
    int per_eye = f->tiles_x * f->tiles_y, in_eye = index % per_eye;
    struct fv_tile tile = {.index = index, .eye = index / per_eye, .worker = worker,
                           .x0 = in_eye % f->tiles_x * FV_TILE, .y0 = in_eye / f->tiles_x * FV_TILE};
    tile.density = f->state ? f->state[index].density : FV_FINE;
    return tile;
}

float fv_tile_reach_deg(const struct fv_view *view)
{
    return fv_radius_deg(view, FV_TILE) + fv_radius_deg(view, 2 * FV_BLOCK);
}

enum fv_density fv_ring_density(const struct fv_frame *f, const struct fv_parameters *p, float e)
{
    float outer = p->foveal.r1_deg > p->foveal.r0_deg ? p->foveal.r1_deg : p->foveal.r0_deg;
    if (!f->state) return FV_FINE;
    for (int d = FV_DENSITIES - 1; d > FV_FINE; d--) {
        float from_deg = outer > f->density_deg[d] ? outer : f->density_deg[d];
        if ((float)fv_density_pixels(d) * p->foveal.p_min <= 1 && e - fv_tile_reach_deg(&f->view[0]) > from_deg)
            return (enum fv_density)d;
    }
    return FV_FINE;
}

float fv_block_probability(const struct fv_frame *f, float p, int density, int spacing)
{
    float pixels = (float)fv_density_pixels(density), share = pixels * p;
    float support = f->support_counts ? pixels / (float)(spacing * spacing * f->support_refresh) : 0;
    if (share >= 1) return 1;
    return share > support ? (share - support) / (1 - support) : 0;
}

static void run_tile(void *context, int index, int worker)
{
    const struct run *run = context;
    struct fv_tile tile = fv_tile_at(run->frame, index, worker);
    run->pass->run(run->frame, &tile);
}

void fv_pass_run(const struct fv_pass *pass, struct fv_frame *frame, struct fv_workers *workers)
{
    struct run run = {pass, frame};
    fv_workers_run(workers, frame->tiles, run_tile, &run);
}

/* Of these blocks, those that show something through the lens or stand next to a pixel that does. */
static uint64_t seen_of(const struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    const struct fv_bend *b = &f->view[tile->eye].bend;
    float size = (float)(FV_BLOCK << tile->density), margin = (float)(1 << tile->density);
    uint64_t seen = 0;
    for (; blocks; blocks &= blocks - 1) {
        int block = __builtin_ctzll(blocks);
        float x = (float)tile->x0 + (float)(block % FV_BLOCKS) * size, y = (float)tile->y0 + (float)(block / FV_BLOCKS) * size;
        if (!fv_bend_beyond(b, x, y, x + size, y + size, margin)) seen |= 1ull << block;
    }
    return seen;
}

uint64_t fv_tile_inside(const struct fv_frame *f, const struct fv_tile *tile)
{
    int size = FV_BLOCK << tile->density, side = fv_tile_side(tile) / FV_BLOCK;
    int columns = (f->width - tile->x0 + size - 1) / size, rows = (f->height - tile->y0 + size - 1) / size;
    uint64_t row = (1u << (columns < side ? columns : side)) - 1, mask = 0;
    for (int y = 0; y < rows && y < side; y++) mask |= row << (8 * y);
    return f->view[tile->eye].bend.masks ? seen_of(f, tile, mask) : mask;
}

float fv_tile_threshold(const struct fv_frame *f, const struct fv_tile *tile, int block)
{
    int size = FV_BLOCK << tile->density;
    int shift = fv_cluster_shift(f, tile->density);
    int x = (tile->x0 / size + block % FV_BLOCKS) >> shift, y = (tile->y0 / size + block / FV_BLOCKS) >> shift;
    return fv_noise_threshold(f->noise, x + 29 * tile->eye, y + 37 * tile->eye, f->number);
}

float fv_tile_eccentricity_deg(const struct fv_frame *f, const struct fv_tile *tile, int block)
{
    int size = FV_BLOCK << tile->density;
    float x = (float)(tile->x0 + block % FV_BLOCKS * size) + 0.5f * (float)size;
    float y = (float)(tile->y0 + block / FV_BLOCKS * size) + 0.5f * (float)size;
    return fv_eccentricity_deg(&f->view[tile->eye], x, y);
}

float fv_tile_nearest_deg(const struct fv_frame *f, const struct fv_tile *tile, int block)
{
    return fv_tile_eccentricity_deg(f, tile, block) -
           fv_radius_deg(&f->view[tile->eye], (float)(FV_BLOCK << tile->density));
}

void fv_tile_place(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    struct fv_samples *samples = &f->scratch[tile->worker].samples;
    int n = 0, step = 1 << tile->density, size = FV_BLOCK * step;
    float first_x = (float)step * (0.5f + f->jitter[0]), first_y = (float)step * (0.5f + f->jitter[1]);
    for (uint64_t left = blocks; left; left &= left - 1) {
        int block = __builtin_ctzll(left);
        float x = (float)(tile->x0 + block % FV_BLOCKS * size) + first_x;
        float y = (float)(tile->y0 + block / FV_BLOCKS * size) + first_y;
        for (int i = 0; i < FV_BLOCK * FV_BLOCK; i++) {
            samples->x[n + i] = x + (float)(i % FV_BLOCK * step);
            samples->y[n + i] = y + (float)(i / FV_BLOCK * step);
        }
        n += FV_BLOCK * FV_BLOCK;
    }
    samples->count = n;
}

/* Nowhere in it more than half of the pixels are to be sampled: most of what is shown is history. */
static bool sparse(const struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_view *view = &f->view[tile->eye];
    if (!f->has_history || f->light_divisor <= 1) return false;
    float e = fv_eccentricity_deg(view, (float)(tile->x0 + FV_TILE / 2), (float)(tile->y0 + FV_TILE / 2));
    return fv_foveal_probability(&f->parameters.foveal, e - fv_tile_reach_deg(view)) <= 0.5f;
}

void fv_samples_trace(struct fv_frame *f, const struct fv_tile *tile, int fewer)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    s->samples.split = fv_light_apart(f);
    s->samples.fewer = fewer;
    f->kernels->trace(f->tracer, &f->view[tile->eye], &s->samples, (uint32_t)f->number, s->rays);
}

void fv_samples_encode(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    struct fv_samples *v = &s->samples;
    const struct fv_kernels *k = f->kernels;
    float exposure = f->tracer->data->exposure;
    k->encode(v->red, v->green, v->blue, exposure, s->pixel[FV_PLANE_BASE], v->count);
    if (!v->split) return;
    k->encode_albedo(v->albedo_red, v->albedo_green, v->albedo_blue, s->pixel[FV_PLANE_ALBEDO], v->count);
    k->encode_light(v->light_red, v->light_green, v->light_blue, exposure, s->pixel[FV_PLANE_LIGHT], v->count);
}

void fv_tile_trace(struct fv_frame *f, const struct fv_tile *tile, uint64_t blocks)
{
    fv_tile_place(f, tile, blocks);
    if (f->scratch[tile->worker].samples.count == 0) return;
    fv_samples_trace(f, tile, sparse(f, tile) ? f->light_divisor : 1);
}
