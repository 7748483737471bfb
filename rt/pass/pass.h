/* pass: the unit of work of a frame: a function over tiles, and what it reads and writes.
 *
 * A frame's picture is cut into tiles of 32 x 32 pixels, all eyes' tiles numbered through; a tile
 * into 8 x 8 blocks of 4 x 4 pixels, bit 8 * row + column of a 64-bit mask. Passes run one after
 * another, each over all tiles on all workers; a tile of a pass writes only its own pixels (or
 * support nodes), so the order of tiles changes nothing.
 *
 * Far from the gaze tiles are coarse: kept at half the density, as 16 x 16 pixels twice as large, in 4 x 4
 * blocks, in a raster of their own; and farther out at a quarter of it, as 8 x 8 pixels four times as large. Each
 * raster also holds the denser ones' tiles, halved, so that the coarsest always is the whole picture; a denser one
 * holds its tiles and the colours next to them, and no history (FV_CACHE_NONE) elsewhere. */
#ifndef FV_PASS_PASS_H
#define FV_PASS_PASS_H

#include "rt/fovea/acuity.h"
#include "rt/fovea/foveal.h"
#include "rt/pass/kernels.h"
#include "rt/trace/rays.h"
#include "platform/threads.h"

enum { FV_TILE = 32, FV_BLOCK = 4, FV_BLOCKS = FV_TILE / FV_BLOCK };

/* What buffers of colours hold, image behind image: pixels; and where sampled light is kept apart, the pixels'
 * albedo and light (trace/pixel.h). The two bits above these are a number c of 0 to 15, light's the upper ones
 * and albedo's the lower: the light is worth c + 1 samples. */
enum fv_plane { FV_PLANE_BASE, FV_PLANE_ALBEDO, FV_PLANE_LIGHT, FV_PLANES };

enum fv_buffer {
    FV_COLOUR, /* this frame's pixels (trace/pixel.h), stride x rows */
    FV_CACHE,  /* their depths and what is known of their history (pass/cache.h) */
    FV_COARSE_COLOUR, /* both of the coarse raster, and of the coarsest */
    FV_COARSE_CACHE,
    FV_COARSEST_COLOUR,
    FV_COARSEST_CACHE,
    FV_HISTORY_COLOUR, /* the frame before: swapped with the six above after each frame */
    FV_HISTORY_CACHE,
    FV_COARSE_HISTORY_COLOUR,
    FV_COARSE_HISTORY_CACHE,
    FV_COARSEST_HISTORY_COLOUR,
    FV_COARSEST_HISTORY_CACHE,
    FV_SUPPORT_COLOUR, /* support image: one node in every cell of `spacing` pixels, at `node` of the cell */
    FV_SUPPORT_DEPTH,  /* support G-buffer */
    FV_SUPPORT_SURFACE, /* of the nodes, enum fv_surface, a byte each */
    FV_SUPPORT_HISTORY_DEPTH, /* the frame before's: swapped with the two above */
    FV_SUPPORT_HISTORY_SURFACE,
    FV_SELECTED,       /* mask of traced blocks, 64 bits a tile */
    FV_RESAMPLED,      /* of these, those that history was not good enough for */
    FV_MASKED,         /* mask of blocks that are traced at the pyramid's highest level, 64 bits a tile */
    FV_STARTS,         /* of each 4 x 4 pixels, where rays through fields begin (pass/pyramid.h), float */
    FV_COARSE_SEEN,    /* of the coarse raster's pixels, which checks of fields they show, and where (pass/pyramid.h) */
    FV_COARSEST_SEEN,  /* of the coarsest's */
    FV_TRIANGLE,       /* of the central region, which triangles pixels show, lit by which lights (struct fv_samples) */
    FV_LIT,
    FV_BASE,           /* of the central region, what its pixels' own samples show (pass/selective.h): FV_COLOUR of then */
    FV_IDENTITY,       /* and their attributes, as struct fv_samples has them; 0: not known */
    FV_FACING,
    FV_SECOND_IDENTITY,
    FV_SECOND_FACING,
    FV_CHAIN,          /* of how many frames in a row pixels' colours are (pass/reuse.h), a byte each */
    FV_HISTORY_BASE,   /* the frame before's: swapped with the six above after each frame */
    FV_HISTORY_IDENTITY,
    FV_HISTORY_FACING,
    FV_HISTORY_SECOND_IDENTITY,
    FV_HISTORY_SECOND_FACING,
    FV_HISTORY_CHAIN,
    FV_REUSED,         /* pixels that took the last frame's colour: a bit each, 32 rows of 32 a tile; of all eyes */
    FV_EARLIER_COLOUR, /* colours and caches of frames before the last, one image after another (struct fv_past) */
    FV_EARLIER_CACHE,
    FV_SMOOTHED,       /* FV_COLOUR smoothed over frames: shown of tiles that say so (struct fv_tile_state) */
    FV_HISTORY_STARTS, /* the frame before's: swapped with it, where levels are carried over */
    FV_LAYER,          /* of each pixel, its layer (pass/denoise.h), a byte each */
    FV_TILE_LAYERS,    /* of each tile of all eyes, which layers it has, a byte each */
    FV_ALBEDO,         /* of what pixels show, as trace/pixel.h has it; and its inverse depth, float */
    FV_DEPTH,
    FV_LIGHT,          /* that falls on it (pass/atrous.h); and that again, half way through an iteration of the filter */
    FV_FILTERED,
    FV_MEAN,           /* light before the filter, accumulated over frames (pass/accumulate.h); what it is of */
    FV_TRACK,
    FV_HISTORY_MEAN,   /* the frame before's: swapped with the two above and FV_FACING after each frame */
    FV_HISTORY_TRACK,
    FV_VARIANCE,       /* of the brightness of FV_LIGHT, times the exposure squared, float; the same of FV_FILTERED */
    FV_FILTERED_VARIANCE,
    FV_PICTURE,        /* 8-bit picture for the display */
    FV_GREEN,          /* the same before red and blue come from beside (pass/fringe.h) */
    FV_TURNED,         /* a late FV_PICTURE turned to the newest head (pass/turn.h): they change places to be shown */
    FV_BUFFERS
};

/* Bit of a buffer in a pass's reads and writes. */
#define FV_BIT(buffer) (1ull << (buffer))

/* Bits of the colours and caches of all rasters, from the first of them. */
#define FV_RASTERS ((1ull << 2 * FV_DENSITIES) - 1)

/* Of the pyramid, where the scene has checks. */
#define FV_SEEN (FV_BIT(FV_COARSE_SEEN) | FV_BIT(FV_COARSEST_SEEN))

/* What levels of the pyramid are carried over from: the highest where it is refined. */
#define FV_CARRIED (FV_BIT(FV_HISTORY_COLOUR) | FV_BIT(FV_COARSE_HISTORY_COLOUR) | \
                    FV_BIT(FV_COARSEST_HISTORY_COLOUR) | FV_BIT(FV_HISTORY_STARTS))

/* A pixel's colour, and flags above it (trace/pixel.h). */
#define FV_PIXEL_COLOUR (FV_PIXEL_SAMPLED - 1)
#define FV_PIXEL_SAMPLED (1u << 30) /* traced in this frame; in the pyramid's lower levels, where nothing is carried over, when they were last */
#define FV_PIXEL_FILLED (1u << 31)  /* no history arrived: taken from the support image */

/* Settings of the method pyramid (pass/pyramid.h). */
struct fv_pyramid {
    bool foveated;    /* else every pixel is traced, from its start */
    bool minimum;     /* starts are the least of 3 x 3 distances, not those of cones */
    bool blur;        /* across the mask's edge */
    bool cut;         /* frames may be: tiles that were left out are shown at lower levels */
    bool carry;       /* what is not traced comes from where the last frame showed it; else it stays as it stands */
    bool has_last;    /* the last frame's lower levels and starts are there */
    int spp_passed;   /* samples of lower levels' pixels in which something lies that their ray passed by */
    float ssaa_contrast; /* of a pixel's first samples, up to which they agree; 0: all are taken */
    float edge;       /* relative step of distance that is an edge */
    float lowest_deg; /* eccentricity beyond which colour comes from the lowest level */
};

/* Thresholds of the method selective, by attribute; of the second hits those of FV_TAU_OBJECT to FV_TAU_TEXTURED again. */
enum fv_tau { FV_TAU_OBJECT, FV_TAU_FACING, FV_TAU_SHADOWS, FV_TAU_TEXTURED, FV_TAU_SECOND, FV_TAU_COLOUR = 8, FV_TAUS };

/* Settings of the method selective (pass/selective.h). */
struct fv_selective {
    float threshold[FV_TAUS];
    float facing_limit;        /* sum of the squared distances between each two of four unit normals above which they disagree */
    int spread;                /* regions, from the fovea on, where corners next to one that fails do so, too */
    struct fv_regions regions;
    struct fv_tolerance tolerance;
    bool every;                /* peripheral pixels are sampled as well, each in every frame */
    float reuse;               /* factor on thresholds below which colours are reused (pass/reuse.h) */
    int reuse_max;             /* frames in a row */
    double alpha[FV_REGIONS + 1];
};

/* Settings of the method denoise (pass/denoise.h). */
struct fv_denoise {
    int bounces;
    bool apart;                                      /* light that chance has no part in is not filtered */
    int history;                                     /* frames that light is accumulated over (pass/accumulate.h); 0: none */
    int rate;                                        /* frames in which the outer layer's pixels take paths once */
    bool despeckle;                                  /* lone bright pixels are taken down before the filter */
    float sigma_light, sigma_normal, sigma_position; /* pass/atrous.h */
    float deviations;                                /* instead of sigma_light where variances are known */
};

/* An eye's layers: what they were made for; whether that has changed since; and by pixels, squared radii about a centre. */
enum { FV_LAYERS = 3 };
struct fv_layers {
    struct fv_layers_of {
        float gaze_px[2], gaze[3], corner[3], radius_deg[2], radius_px[2], left_out;
    } of;
    bool made, fresh;
    double centre[2], square[2];
};

/* A frame before this one, as far as it is kept: [0] is the last one, whose images are FV_HISTORY_COLOUR and
 * FV_HISTORY_CACHE. They change places with this frame's, so that nothing is copied. */
enum { FV_PAST_MAX = 4 };
struct fv_past {
    struct fv_view view[2];
    struct fv_pose object[FV_MOVING_MAX];
    uint32_t *colour[2], *cache[2];
    struct fv_map map[2][FV_MOVING_MAX + 1]; /* of this frame's pixels to its: of what is fixed to each object; [0]: to none */
};

/* What a method's quality level sets. */
struct fv_parameters {
    struct fv_foveal foveal;
    int spp;
    int spacing; /* pixels between support nodes: 4, 8 or 16, not fewer than method.support */
    /* Of the method pyramid (pass/pyramid.h): */
    float p_scale;      /* factor on the probability of edges */
    float contrast;     /* of colours, between pixels of lower levels, beyond which is refined; 1: nowhere */
    int refresh, spp_middle;
    /* Of the method selective (pass/selective.h): */
    float tolerance;    /* factor on tau_fov; and whether that is 1 instead, wherever the eye looks: */
    bool even;
    int extra[FV_REGIONS]; /* samples of a quarter of a pixel that fails, by region; FV_REGION_FAR as before it */
    float near_deg;     /* radius of the central region */
    /* Of the method denoise (pass/denoise.h): */
    int layer_spp[3], iterations[3]; /* of each layer, from the inner one on */
    float left_out;     /* share of the outer layer's pixels that are not sampled */
    float radius_px[2]; /* radii of the inner and the middle one; the latter 0: those of `foveal`, in degrees */
};

struct fv_worker_scratch {
    struct fv_samples samples;
    _Alignas(64) uint32_t pixel[FV_PLANES][FV_SAMPLES_MAX]; /* the samples', by enum fv_plane */
    _Alignas(64) uint32_t merged_colour[FV_PLANES][FV_SAMPLES_MAX], merged_cache[FV_SAMPLES_MAX]; /* to merge into */
    _Alignas(64) int32_t replaced[FV_SAMPLES_MAX];
    _Alignas(64) float nearest[FV_SAMPLES_MAX], farthest[FV_SAMPLES_MAX];
    _Alignas(64) float tile_nearest[FV_TILE * FV_TILE], tile_farthest[FV_TILE * FV_TILE];
    /* This frame's: */
    _Alignas(64) int64_t rays[FV_RAY_KINDS];
    int64_t reprojected, marked, failed; /* blocks: of reprojected tiles; of these marked, failed (pass/reproject.h) */
    int64_t corners, failed_corners;     /* that were tested (pass/selective.h); of these failed */
    int64_t central, reused;             /* pixels that might be reused (pass/reuse.h); of these were */
    int64_t doubtful, spared;            /* subpixels at corners that failed; of these in pixels that were reused */
    _Alignas(64) float extra[3][FV_SAMPLES_MAX]; /* of a tile's pixels: sums of extra samples */
    struct fv_map bent[FV_PAST_MAX][FV_MOVING_MAX + 1]; /* of a tile's pixels, through the lens (pass/bent.h) */
    struct fv_view near;                 /* likewise */
    int64_t asked, unanswered;           /* support nodes that history was asked for; of these that it did not know */
};

/* How far from the gaze the picture lies: its pixels and its tiles (by their centres) in rings of one degree. */
enum { FV_DEGREES = 181 };
struct fv_rings {
    float pixels[FV_DEGREES], tiles[FV_DEGREES];
};

/* The pixels of one density of an eye. */
struct fv_raster {
    int width, height; /* what of it lies in the picture at least in part */
    int64_t stride;
    float scale;       /* picture pixels a pixel: 1, 2 or 4 */
    uint32_t *colour, *cache;
    const uint32_t *history_colour, *history_cache;
    int64_t plane;     /* elements from one of a colour's images to the next */
};

/* Of struct fv_tile_state's holds: in every raster. */
enum { FV_HELD_ALL = (1 << FV_DENSITIES) - 1 };

/* What a tile was in a frame. */
struct fv_tile_state {
    uint8_t density;     /* enum fv_density, by select or mask */
    uint8_t reprojected; /* what stands in its pixels before they are sampled came from history */
    uint8_t waits;       /* pyramid: its lower levels were not traced in this frame */
    uint8_t smoothed;    /* FV_SMOOTHED is what is shown of it */
    uint8_t holds[2];    /* bit d: the raster of density d may hold history here, of this frame and the last */
    uint8_t held;        /* bit i: of the finest, of the i-th frame before the last (struct fv_past) */
};

struct fv_frame {
    int64_t number;
    int eyes, width, height;
    int tiles_x, tiles_y, tiles; /* tiles: of all eyes */
    int64_t stride, rows;        /* of the pixel buffers: whole tiles */
    int spacing;                 /* the parameters'; stride / spacing nodes a row */
    bool keeps_history, has_history, overlay;
    bool has_mean;               /* the last frame's accumulated light is there */
    bool light_apart;            /* in this frame, what points and suns send is part of FV_COLOUR, not of FV_LIGHT */
    bool refined;                /* pixels of the central region are put together by refine */
    bool keep;                   /* history is kept in the fovea and in resampled blocks too */
    bool support_counts;         /* support nodes are among the samples that the foveal function asks for */
    int support_refresh;         /* frames in which each support node is traced once; 1: always */
    float epsilon_depth, epsilon_luminance;
    float resample;              /* how many times as often marked blocks are sampled */
    float density_deg[FV_DENSITIES]; /* eccentricities beyond which tiles may be as coarse */
    int cluster_shift;           /* coarse tiles: 1 << this blocks a side are sampled in the same frames; in the
                                  * coarsest half as many */
    bool sharp;                  /* history is interpolated by cubics, not linearly */
    bool still;                  /* nothing moves: history is carried without loss, and all samples count alike */
    float k[2][128];             /* least weight of a new sample, by age (pass/cache.h); [1]: where still */
    int light_divisor;           /* samples of sparse tiles take this part of the settings' rays of sampled light */
    int planes;                  /* images of a buffer of colours: FV_PLANES where sampled light is kept apart */
    int64_t support_plane;       /* elements between those of the support image */
    float light_k[2][128];       /* as k, of light that is kept apart */
    int post_filter;             /* candidates of the post filter (merge.h) */
    float jitter[2];             /* this frame's, of samples from the centre of their pixel, in pixels */
    float node[2];               /* this frame's places of support nodes in their cells, [0, 1) */
    struct fv_parameters parameters;
    struct fv_view view[2], before[2];
    struct fv_map map[2];
    /* Where the moving objects are, and were a frame before: [0] is object 1 (struct fv_object). */
    struct fv_pose object[FV_MOVING_MAX], object_before[FV_MOVING_MAX];
    struct fv_map object_map[2][FV_MOVING_MAX + 1]; /* of what is fixed to each object; [0]: as map */
    struct fv_pyramid pyramid;
    struct fv_selective selective;
    struct fv_denoise denoise;
    struct fv_layers layers[2];
    int pasts_kept, pasts;       /* frames before this one: that are kept, at most FV_PAST_MAX; of these there already */
    struct fv_past past[FV_PAST_MAX];
    const struct fv_tracer *tracer;
    const struct fv_kernels *kernels;
    const float *noise;          /* fv_noise(), NULL where no pass needs it */
    void *buffer[FV_BUFFERS][2]; /* of each eye, NULL where the plan left it out */
    struct fv_raster raster[FV_DENSITIES][2];
    struct fv_tile_state *state; /* of each tile; NULL: all are fine and nothing is reprojected */
    uint8_t *failed_blocks;      /* of each tile: how many failed (pass/reproject.h); NULL: nobody asks */
    float marked_share, failed_share; /* of the frame before's reprojected blocks */
    float failed_corners_share;       /* of the corners tested in the newest frame that tested some */
    float reused_share;               /* of the pixels that might be (pass/reuse.h), in this frame */
    float spared_share;               /* of the subpixels at corners that failed, in the newest frame in which some did */
    float unanswered_share;           /* of support nodes that history was asked for in the newest frame that asked */
    int spacing_before;               /* the frame before's */
    struct fv_worker_scratch *scratch;
    struct fv_fringe *fringe;         /* of the lenses; NULL: their colours do not part */
    struct fv_turn *turn;             /* of late pictures; NULL: they stay as they are */
};

/* Rasters of the buffers, after these have changed places. */
void fv_frame_lay(struct fv_frame *frame);

struct fv_tile {
    int index, eye, worker;
    int x0, y0;    /* first pixel */
    int density;   /* enum fv_density: coordinates in its raster are those of the picture shifted right by it */
};

/* What a pass needs besides buffers. */
enum fv_needs {
    FV_NEEDS_GAZE = 1, /* where the eye looks */
    FV_NEEDS_NOISE = 2, /* the blue-noise mask */
    FV_NEEDS_HISTORY = 4, /* its stand-in does: where there is none, nothing is left out */
    FV_NEEDS_DENSITIES = 8, /* it chooses tiles' densities (struct fv_tile_state) */
    FV_NEEDS_MAPS = 16 /* lights' maps, where samples are `mapped` (trace/visibility.h) */
};

/* Which tiles come first. */
enum fv_order {
    FV_ORDER_GAZE, /* those nearest to it */
    FV_ORDER_NEED  /* the fovea's, then those whose absence costs most */
};

struct fv_pass {
    const char *name;
    uint64_t reads, writes; /* bits of fv_buffer */
    uint64_t offers;        /* of those that it writes where another pass reads them */
    /* Why these settings leave it out; NULL where they do not, and where there is no such function. */
    const char *(*idle)(const struct fv_config *config);
    uint32_t needs;         /* enum fv_needs */
    enum fv_order order;
    int whole;              /* units of a tile that is worked at whole; 0: a unit costs the same in all tiles */
    /* Works at a tile. Returns units of work, which its cost grows with: rays, nodes, pixels or tiles. */
    int (*run)(struct fv_frame *frame, const struct fv_tile *tile);
    /* Instead, where time has run out: far cheaper, and good enough for a frame. NULL: every tile must be
     * worked at. */
    void (*stand_in)(struct fv_frame *frame, const struct fv_tile *tile);
    /* Units that the whole pass is expected to be with these parameters: those of sparse tiles, and those of
     * tiles that are worked at whole. */
    void (*expect)(const struct fv_frame *frame, const struct fv_parameters *parameters,
                   const struct fv_rings *rings, double units[2]);
};

extern const struct fv_pass fv_pass_sample_all, fv_pass_support, fv_pass_select, fv_pass_reproject,
    fv_pass_sample, fv_pass_march, fv_pass_mask, fv_pass_trace, fv_pass_compose, fv_pass_sharpen, fv_pass_gather,
    fv_pass_reuse, fv_pass_refine, fv_pass_smooth, fv_pass_distribute, fv_pass_paths, fv_pass_accumulate, fv_pass_fill, fv_pass_settle,
    fv_pass_across_16, fv_pass_down_16, fv_pass_across_8, fv_pass_down_8, fv_pass_across_4, fv_pass_down_4,
    fv_pass_across_2, fv_pass_down_2, fv_pass_across_1, fv_pass_down_1, fv_pass_light_up, fv_pass_present, fv_pass_fringe, fv_pass_turn;

/* Blocks along so many pixels, the last one perhaps beyond them. */
static inline int fv_blocks_along(int pixels)
{
    return (pixels + FV_BLOCK - 1) / FV_BLOCK;
}

/* The nearest of 0 to count - 1. */
static inline int fv_clamp(int64_t i, int count)
{
    return i < 0 ? 0 : i >= count ? count - 1 : (int)i;
}

/* Brings what will be written on its way, a cache line of 64 bytes at a time. */
static inline void fv_fetch(const void *from, int bytes)
{
    for (int at = 0; at < bytes; at += 64) __builtin_prefetch((const char *)from + at, 1, 2);
}

/* n pixels of a raster's row y from x0 on, of one image of its colours; beyond the raster, the pixels at its border. */
void fv_raster_row(const struct fv_raster *raster, int plane, int x0, int y, int n, uint32_t *row);

/* The tile of that number. */
struct fv_tile fv_tile_at(const struct fv_frame *frame, int index, int worker);

/* Half the diagonal of `size` pixels as an angle, from above: a pixel never spans more than its angle at the
 * centre of the picture, nor than its longer side. */
static inline float fv_radius_deg(const struct fv_view *view, float size)
{
    return 0.7072f * size * view->pixel_deg;
}

/* Runs one pass over all tiles, in any order and whole. */
void fv_pass_run(const struct fv_pass *pass, struct fv_frame *frame, struct fv_workers *workers);

/* Pixels along a tile's side, in its raster. */
static inline int fv_tile_side(const struct fv_tile *tile)
{
    return FV_TILE >> tile->density;
}

static inline const struct fv_raster *fv_tile_raster(const struct fv_frame *frame, const struct fv_tile *tile)
{
    return &frame->raster[tile->density][tile->eye];
}

/* First element of the tile's row y in its raster. */
static inline int64_t fv_tile_row(const struct fv_frame *frame, const struct fv_tile *tile, int y)
{
    return (int64_t)((tile->y0 >> tile->density) + y) * fv_tile_raster(frame, tile)->stride +
           (tile->x0 >> tile->density);
}

/* First element of a block's row y (0..3). */
static inline int64_t fv_block_row(const struct fv_frame *frame, const struct fv_tile *tile, int block, int y)
{
    return fv_tile_row(frame, tile, block / FV_BLOCKS * FV_BLOCK + y) + block % FV_BLOCKS * FV_BLOCK;
}

/* The tile's rows of pixels that the blocks lie in, a bit each. */
static inline uint32_t fv_block_rows(uint64_t blocks)
{
    uint32_t rows = 0;
    for (int y = 0; y < FV_BLOCKS; y++)
        if (blocks >> (FV_BLOCKS * y) & 255) rows |= 15u << (FV_BLOCK * y);
    return rows;
}

/* Of the picture's pixels, how many one stands for. */
static inline int fv_density_pixels(int density)
{
    return 1 << 2 * density;
}

/* Blocks a side, as a power of two, that are sampled in the same frames. */
static inline int fv_cluster_shift(const struct fv_frame *frame, int density)
{
    return density == FV_FINE ? 0 : density == FV_COARSE || !frame->cluster_shift ? frame->cluster_shift
                                                                                  : frame->cluster_shift - 1;
}

/* The share of a raster's blocks to be sampled where p of the picture's pixels are: a coarse pixel stands for
 * several, and the support image's samples, `spacing` pixels apart, count among them. */
float fv_block_probability(const struct fv_frame *frame, float p, int density, int spacing);

/* The density of a tile whose middle lies at this eccentricity: coarse past r1 and method.density_deg as a whole,
 * coarsest past method.quarter_deg, and only where the samples wanted there do not suffice for the picture's own density. */
enum fv_density fv_ring_density(const struct fv_frame *frame, const struct fv_parameters *parameters,
                                float eccentricity_deg);

/* How far from a tile's middle its blocks may reach, degrees, from above. */
float fv_tile_reach_deg(const struct fv_view *view);

/* Blocks of the tile that lie in the picture, and where an eye sees it through the lens, at least in part. */
uint64_t fv_tile_inside(const struct fv_frame *frame, const struct fv_tile *tile);

/* This frame's blue-noise threshold of a block, in [0, 1). The eyes look up different parts of the mask,
 * so that the two fill each other in. Blocks of a cluster have the same: rays of neighbours take less time. */
float fv_tile_threshold(const struct fv_frame *frame, const struct fv_tile *tile, int block);

/* Eccentricity of a block's centre, degrees, and of its nearest point, from below. */
float fv_tile_eccentricity_deg(const struct fv_frame *frame, const struct fv_tile *tile, int block);
float fv_tile_nearest_deg(const struct fv_frame *frame, const struct fv_tile *tile, int block);

/* Whether some of the tile's pixels may lie within so many degrees of the gaze. */
static inline bool fv_tile_within(const struct fv_frame *frame, const struct fv_tile *tile, float deg)
{
    const struct fv_view *view = &frame->view[tile->eye];
    float e = fv_eccentricity_deg(view, (float)(tile->x0 + FV_TILE / 2), (float)(tile->y0 + FV_TILE / 2));
    return e - fv_radius_deg(view, FV_TILE) <= deg;
}

/* Puts one place in each pixel of the masked blocks, block by block, into the worker's samples: its centre,
 * jittered. */
void fv_tile_place(struct fv_frame *frame, const struct fv_tile *tile, uint64_t blocks);

/* True where sampled light is kept apart. */
static inline bool fv_light_apart(const struct fv_frame *frame)
{
    return frame->planes == FV_PLANES;
}

/* Traces the worker's samples, into scratch->samples. `fewer`: as in struct fv_samples. */
void fv_samples_trace(struct fv_frame *frame, const struct fv_tile *tile, int fewer);

/* Encodes what was traced, into scratch->pixel. */
void fv_samples_encode(struct fv_frame *frame, const struct fv_tile *tile);

/* Traces and encodes the mean of spp samples of each pixel that the worker's samples stand in. One goes through the
 * pixel's centre; more are spread over sqrt(spp) x sqrt(spp) strata (spp that is no square: a rank-1 lattice), the
 * same for every pixel. inverse_depth becomes that of each pixel's nearest sample. `agreeing`: pixels of which the first 4
 * of 8 to 64 samples saw one even surface, lit alike (method.ssaa_contrast), by starts of their own, take no more. */
void fv_samples_trace_mean(struct fv_frame *frame, const struct fv_tile *tile, int spp, bool agreeing);

/* Places and traces them. */
void fv_tile_trace(struct fv_frame *frame, const struct fv_tile *tile, uint64_t blocks);

#endif
