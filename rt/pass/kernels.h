/* kernels: the table of functions that are compiled once for each instruction set. A pass asks
 * fv_kernels_for(isa, variant) once and calls through it. */
#ifndef FV_PASS_KERNELS_H
#define FV_PASS_KERNELS_H

#include "rt/trace/tracer.h"
#include "rt/trace/variant.h"

/* How dense a tile's pixels are (pass.h): they are 1 << density of the picture's a side. */
enum fv_density { FV_FINE, FV_COARSE, FV_COARSEST, FV_DENSITIES };

struct fv_reproject_tile; /* rt/pass/reproject.h */
struct fv_merge;          /* rt/pass/merge.h */
struct fv_support_packet; /* rt/pass/support.h */
struct fv_carry;          /* rt/pass/pyramid.h */
struct fv_corners;        /* rt/pass/selective.h */
struct fv_resolve;
struct fv_contrast;       /* rt/pass/pyramid.h */
struct fv_repaint;        /* rt/pass/pyramid.h */
struct fv_smooth;         /* rt/pass/smooth.h */
struct fv_reuse;          /* rt/pass/reuse.h */
struct fv_atrous;         /* rt/pass/atrous.h */
struct fv_variances;      /* rt/pass/denoise.h */
struct fv_accumulate;     /* rt/pass/accumulate.h */
struct fv_fringe_row;     /* rt/pass/fringe.h */
struct fv_turn_square;    /* rt/pass/turn.h */

struct fv_kernels {
    /* Traces and shades samples [0, count); seed: changes the random numbers of sampled light.
     * Adds to rays[FV_RAY_*]. */
    void (*trace)(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                  uint32_t seed, int64_t *rays);

    /* The same, but what primary rays hit is lit by paths: see trace/path.h and `paths` of struct fv_samples. */
    void (*paths)(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                  uint32_t seed, int64_t *rays);

    /* Cones through the scene's fields: afterwards samples->start holds, for each sample, a ray parameter before
     * which no ray of the view whose place lies within `radius_px` pixels (each way across the picture, as the crow
     * flies) of the sample's meets anything in the fields, nor comes near enough to count as a hit; infinite where
     * none does at all. From samples->start where `started`, which is then set: as a coarser level left it, each
     * taken from the sample whose circle holds this one's. Adds to rays[FV_RAY_MARCH_*]. Meshes are not looked at:
     * `trace` finds them wherever a ray starts in fields. */
    void (*starts)(const struct fv_tracer *tracer, const struct fv_view *view, struct fv_samples *samples,
                   float radius_px, int64_t *rays);

    /* A row of a light's map; see trace/visibility.h. */
    fv_map_row *map_row;

    /* Tone-maps and encodes n linear radiances to pixels (pixel.h); n and the arrays padded to the width. */
    void (*encode)(const float *red, const float *green, const float *blue, float exposure, uint32_t *pixel, int n);

    /* The same of light and albedo that are kept apart (pixel.h). */
    void (*encode_light)(const float *red, const float *green, const float *blue, float exposure, uint32_t *pixel,
                         int n);
    void (*encode_albedo)(const float *red, const float *green, const float *blue, uint32_t *pixel, int n);

    /* Variances of a tile; see denoise.h. */
    void (*even_out)(struct fv_variances *variances);

    /* Pixels of base + albedo * light; with base's flags. `pixel` may be one of the others. */
    void (*compose)(const uint32_t *base, const uint32_t *albedo, const uint32_t *light, uint32_t *pixel, int n);

    /* One tile of history into the new view, by its density; see reproject.h. */
    void (*reproject[FV_DENSITIES])(struct fv_reproject_tile *tile);

    /* The last frame's levels of the pyramid into the new view, by the tile's density; see pyramid.h. */
    void (*carry[FV_DENSITIES])(struct fv_carry *carry);

    /* A row of corners of the central region, and a row of its pixels; see selective.h. */
    void (*test_corners)(struct fv_corners *corners);
    void (*resolve)(const struct fv_resolve *row);

    /* A row of pixels over those of the frames before; see smooth.h. */
    void (*smooth)(const struct fv_smooth *row);

    /* A row of pixels of the central region; see reuse.h. */
    void (*reuse)(struct fv_reuse *row);

    /* Light filtered over its neighbours: a rectangle of a picture, one iteration; and n linear colours times `scale` to
     * light in 32 bits, and back; n and the arrays padded to the width. See atrous.h. */
    void (*atrous)(const struct fv_atrous *rectangle);
    void (*pack_light)(const float *red, const float *green, const float *blue, float scale, uint32_t *light, int n);
    void (*unpack_light)(const uint32_t *light, float *red, float *green, float *blue, int n);

    /* A tile's light mixed with the last frame's; see accumulate.h. */
    void (*accumulate)(struct fv_accumulate *tile);

    /* Pixels of base + albedo * light; `pixel` may be one of the others; n and the arrays padded to the width. */
    void (*light_up)(const uint32_t *base, const uint32_t *albedo, const float *red, const float *green, const float *blue,
                     uint32_t *pixel, int n);

    /* n pixels to the linear colours, times the exposure, that they stand for; n and the arrays padded to the width. */
    void (*decode)(const uint32_t *pixel, float *red, float *green, float *blue, int n);
    /* Where neighbouring pixels of a lower level differ; see pyramid.h. */
    void (*contrast)(struct fv_contrast *contrast);

    /* What lies between pixels of a lower level that differ by checks only; see pyramid.h. */
    void (*repaint)(const struct fv_repaint *repaint);

    /* What history tells of a packet of support nodes; see support.h. */
    void (*answer)(struct fv_support_packet *packet);

    /* New samples over what was reprojected; see merge.h. */
    void (*merge)(const struct fv_merge *merge);

    /* The greatest and the least inverse depth at and around each pixel of a tile, by its density, within it; rows of `cache`
     * are `stride` apart, those of the results FV_TILE. `rows`: a bit for each row that is wanted. */
    void (*bounds[FV_DENSITIES])(const uint32_t *cache, int64_t stride, int side, uint32_t rows, float *nearest, float *farthest);

    /* Two rows of 2n pixels to one of n, their means. */
    void (*halve)(const uint32_t *upper, const uint32_t *lower, uint32_t *out, int n);

    /* Bilinear, a row of n pixels to one of 2n, a quarter of a pixel from the row `near` towards `far`; both
     * begin one pixel before the first and end one behind the last. */
    void (*double_row)(const uint32_t *near, const uint32_t *far, uint32_t *out, int n);

    /* n pixels to 8-bit r, g, b, 255; n padded to the width. */
    void (*present)(const uint32_t *pixel, uint8_t *rgbx, int n);

    /* Red and blue from where the lens shows them; see fringe.h. */
    void (*fringe)(const struct fv_fringe_row *row);

    /* A late picture's pixels by the newest head; see turn.h. */
    void (*turn)(const struct fv_turn_square *square);
};

/* Those that can show every scene. */
const struct fv_kernels *fv_kernels(enum fv_isa isa);

/* Those whose `trace` is the variant's. */
const struct fv_kernels *fv_kernels_for(enum fv_isa isa, enum fv_variant variant);

#endif
