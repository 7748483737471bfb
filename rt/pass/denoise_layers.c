/* denoise_layers: the pass distribute: three layers around the gaze; see denoise.h. */
#include "rt/pass/denoise.h"

#include <math.h>
#include <string.h>

/* Centres of pixels of a row that lie within `half` of x, each way, in the picture. */
static int64_t count_row(double x, double half, int width)
{
    double first = fmax(ceil(x - half - 0.5), 0), last = fmin(floor(x + half - 0.5), width - 1);
    return last >= first ? (int64_t)(last - first) + 1 : 0;
}

static int64_t count_within(const double centre[2], double square, int width, int height)
{
    double radius = sqrt(square);
    int64_t count = 0;
    int first = (int)fmax(floor(centre[1] - radius) - 1, 0), last = (int)fmin(ceil(centre[1] + radius) + 1, height);
    for (int y = first; y < last; y++) {
        double dy = y + 0.5 - centre[1];
        if (dy * dy <= square) count += count_row(centre[0], sqrt(square - dy * dy), width);
    }
    return count;
}

double fv_layer_square(const double centre[2], double r, int width, int height)
{
    bool inside = centre[0] >= r + 1 && centre[1] >= r + 1 && centre[0] <= width - r - 1 && centre[1] <= height - r - 1;
    double low = fmax(r - 1, 0) * fmax(r - 1, 0), high = (r + 1) * (r + 1);
    int64_t wanted = llround(M_PI * r * r);
    if (!inside || !(r > 0)) return r > 0 ? r * r : -1;
    for (int i = 0; i < 60; i++) {
        double middle = 0.5 * (low + high);
        int64_t count = count_within(centre, middle, width, height);
        if (count == wanted) return middle;
        *(count < wanted ? &low : &high) = middle;
    }
    return r * r;
}

/* Steady light is kept apart where it is of all layers: pixels of the others would get it by the filter. Light of a frame where it
 * was otherwise is no history. */
static void set_apart(struct fv_frame *f)
{
    int least = FV_PATHS_MAX;
    for (int n = 0; n < FV_LAYERS; n++) {
        int spp = f->parameters.layer_spp[n];
        if (spp > 0 && spp < least) least = spp;
    }
    bool apart = f->denoise.apart && f->tracer->data->lights <= least;
    if (apart != f->light_apart) f->has_mean = false;
    f->light_apart = apart;
}

void fv_layers_begin(struct fv_frame *f)
{
    const struct fv_parameters *p = &f->parameters;
    if (!f->buffer[FV_LAYER][0]) return;
    set_apart(f);
    for (int e = 0; e < f->eyes; e++) {
        struct fv_layers *l = &f->layers[e];
        struct fv_layers_of of;
        memset(&of, 0, sizeof of);
        memcpy(of.gaze_px, f->view[e].gaze_px, sizeof of.gaze_px);
        memcpy(of.gaze, f->view[e].gaze, sizeof of.gaze);
        memcpy(of.corner, f->view[e].corner, sizeof of.corner);
        memcpy(of.radius_px, p->radius_px, sizeof of.radius_px);
        of.radius_deg[0] = p->foveal.r0_deg;
        of.radius_deg[1] = p->foveal.r1_deg;
        of.left_out = p->left_out;
        l->fresh = !l->made || memcmp(&of, &l->of, sizeof of) != 0;
        if (!l->fresh) continue;
        l->of = of;
        l->made = true;
        /* Off the pixels' lattice, so that no two are equally far. */
        l->centre[0] = (double)of.gaze_px[0] + 0.013717;
        l->centre[1] = (double)of.gaze_px[1] + 0.007193;
        for (int i = 0; i < 2; i++) l->square[i] = fv_layer_square(l->centre, (double)of.radius_px[i], f->width, f->height);
    }
}

/* How far out a pixel lies: its layer, and from 0 to 1 where in the middle one. */
static int place_by_pixels(const struct fv_layers *l, int x, int y, float *way)
{
    double dx = x + 0.5 - l->centre[0], dy = y + 0.5 - l->centre[1], square = dx * dx + dy * dy;
    float r0 = l->of.radius_px[0], r1 = l->of.radius_px[1];
    if (square <= l->square[0]) return 0;
    if (square > l->square[1]) return 2;
    *way = r1 > r0 ? ((float)sqrt(square) - r0) / (r1 - r0) : 1;
    return 1;
}

static int place_by_degrees(const struct fv_view *v, const struct fv_layers *l, int x, int y, float *way)
{
    float e = fv_eccentricity_deg(v, (float)x + 0.5f, (float)y + 0.5f), r0 = l->of.radius_deg[0], r1 = l->of.radius_deg[1];
    if (!(e > r0)) return 0;
    if (e > r1) return 2;
    *way = r1 > r0 ? (e - r0) / (r1 - r0) : 1;
    return 1;
}

/* The mask's place of a pixel: from the gaze on, to the left in the right eye, so that both have one distribution. */
static float threshold(const struct fv_frame *f, const struct fv_layers *l, int eye, int x, int y)
{
    int gx = fabsf(l->of.gaze_px[0]) < 1e5f ? (int)floorf(l->of.gaze_px[0]) : 0;
    int gy = fabsf(l->of.gaze_px[1]) < 1e5f ? (int)floorf(l->of.gaze_px[1]) : 0, mask = FV_NOISE_SIZE - 1;
    int u = eye ? gx - 1 - x : x - gx, v = y - gy;
    return f->noise[(v & mask) * FV_NOISE_SIZE + (u & mask)];
}

static int place(const struct fv_frame *f, int eye, int x, int y, float *way)
{
    const struct fv_layers *l = &f->layers[eye];
    *way = 0;
    if (l->of.radius_px[1] > 0) return place_by_pixels(l, x, y, way);
    return place_by_degrees(&f->view[eye], l, x, y, way);
}

/* The layer that all of the tile lies in, -1: perhaps several. */
static int single(const struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_view *v = &f->view[tile->eye];
    const struct fv_layers *l = &f->layers[tile->eye];
    float x = (float)(tile->x0 + FV_TILE / 2), y = (float)(tile->y0 + FV_TILE / 2), from, to, r0, r1;
    if (l->of.radius_px[1] > 0) {
        float d = hypotf(x - l->of.gaze_px[0], y - l->of.gaze_px[1]), reach = 0.72f * FV_TILE + 2;
        from = d - reach, to = d + reach, r0 = l->of.radius_px[0], r1 = l->of.radius_px[1];
    } else {
        float e = fv_eccentricity_deg(v, x, y), reach = fv_radius_deg(v, FV_TILE) + 0.01f;
        from = e - reach, to = e + reach, r0 = l->of.radius_deg[0], r1 = l->of.radius_deg[1];
    }
    return to <= r0 ? 0 : from > r1 ? 2 : from > r0 && to <= r1 ? 1 : -1;
}

static int run(struct fv_frame *f, const struct fv_tile *tile)
{
    const struct fv_layers *l = &f->layers[tile->eye];
    uint8_t *layer = f->buffer[FV_LAYER][tile->eye], *of_tile = (uint8_t *)f->buffer[FV_TILE_LAYERS][0] + tile->index;
    if (!l->fresh) return 0;
    int whole = l->of.left_out > 0 ? -1 : single(f, tile), columns = f->width - tile->x0, rows = f->height - tile->y0;
    float way;
    *of_tile = 0;
    for (int y = tile->y0; y < tile->y0 + (rows < FV_TILE ? rows : FV_TILE); y++)
        for (int x = tile->x0; x < tile->x0 + (columns < FV_TILE ? columns : FV_TILE); x++) {
            int n = whole >= 0 ? whole : place(f, tile->eye, x, y, &way);
            float share = n == 0 || whole >= 0 ? 1 : n == 1 ? 1 - way * l->of.left_out : 1 - l->of.left_out;
            bool sampled = share >= 1 || threshold(f, l, tile->eye, x, y) < share;
            layer[y * f->stride + x] = (uint8_t)(n | (sampled ? FV_LAYER_SAMPLED : 0));
            *of_tile |= (uint8_t)(1 << n | (sampled ? 0 : FV_LAYER_HOLES));
        }
    return 1;
}

static void expect(const struct fv_frame *f, const struct fv_parameters *p, const struct fv_rings *rings, double units[2])
{
    (void)p;
    (void)rings;
    units[0] = (double)f->tiles;
}

const struct fv_pass fv_pass_distribute = {.name = "distribute",
                                           .writes = FV_BIT(FV_LAYER) | FV_BIT(FV_TILE_LAYERS),
                                           .needs = FV_NEEDS_GAZE | FV_NEEDS_NOISE,
                                           .run = run,
                                           .expect = expect};
