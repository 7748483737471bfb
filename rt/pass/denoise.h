/* denoise: path tracing whose samples and filter follow where the eye looks, after Peres et al. 2023, "Non-homogeneous denoising
 * for virtual reality in real-time path tracing rendering". What its passes share:
 *
 *   distribute  three layers around the gaze, of each pixel its number and whether it is sampled: kept until the gaze or the
 *               radii change (section 3.2)
 *   paths       of every pixel what its ray meets (depth, normal, albedo, emission), of sampled ones light by paths, so many as
 *               the layer takes (sections 3.1 and 3.3): one packet does both, so that surfaces are looked up once;
 *               and how much these vary, which guides the filter (after SVGF, Schied et al. 2017)
 *   accumulate  their light mixed with the last frame's, where that showed the same place (accumulate.h)
 *   fill, settle  where pixels are left out, their light from those around, before the filter
 *   across, down  one iteration of the filter (atrous.h), steps 16, 8, 4, 2, 1; a layer takes the last so many of them, and
 *               tiles that have no pixel of such a layer cost nothing (section 3.4)
 *   compose     emission + albedo x light */
#ifndef FV_PASS_DENOISE_H
#define FV_PASS_DENOISE_H

#include "rt/pass/atrous.h"
#include "rt/pass/pass.h"

enum { FV_PATHS_MAX = 1024 }; /* a pixel, as in denoise.spp */

/* Of a pixel (FV_LAYER, a byte each): its layer, and whether it is sampled. Of a tile (FV_TILE_LAYERS, a byte each, of all eyes):
 * which layers it has, a bit each, FV_LAYER_HOLES where some pixel is not sampled, and FV_LAYER_EMPTY where in this frame some
 * surface has neither light nor history, where light is accumulated. Pixels beyond the picture are none. */
enum { FV_LAYER_NUMBER = 3, FV_LAYER_SAMPLED = 4, FV_LAYER_HOLES = 8, FV_LAYER_EMPTY = 16 };

/* Once a frame, its views and parameters being set: what layers are to be, and whether those that stand are. */
void fv_layers_begin(struct fv_frame *frame);

/* Squared distance from `centre` within which lie as many pixel centres as pi r^2 says, rounded, where the whole circle lies in
 * the picture, else r^2. The centre must be such that no two pixels are equally far off. So areas are those of Peres et al.'s
 * Table 1. */
double fv_layer_square(const double centre[2], double radius_px, int width, int height);

/* Of a tile that begins at `from`, how many of its columns or rows lie in a picture of `all`. */
static inline int fv_tile_rest(int all, int from)
{
    return all - from < FV_TILE ? all - from : FV_TILE;
}

/* Whether pixels of this layer take the iteration of step 1 << k. */
static inline bool fv_layer_takes(const struct fv_parameters *p, int layer, int k)
{
    return k < p->iterations[layer];
}

/* Variances of a tile's pixels, by rows, within FV_VARIANCE_EDGE zeros; `counts`: 1 where there is one, else 0. Evened out, each is the
 * mean of those that there are up to FV_VARIANCE_REACH pixels around it in the tile, 0 where there is none: two to four paths tell
 * little of how much they vary. */
enum { FV_VARIANCE_REACH = 2, FV_VARIANCE_EDGE = 16 };
struct fv_variances {
    _Alignas(64) float variance[FV_TILE][FV_TILE + 2 * FV_VARIANCE_EDGE], counts[FV_TILE][FV_TILE + 2 * FV_VARIANCE_EDGE];
};

#endif
