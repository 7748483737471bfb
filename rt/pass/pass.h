/* pass: the unit of work of a frame: a function over tiles, and what it reads and writes.
 *
 * A frame's picture is cut into tiles of 32 x 32 pixels, all eyes' tiles numbered through; a tile
 * into 8 x 8 blocks of 4 x 4 pixels, bit 8 * row + column of a 64-bit mask. Passes run one after
 * another, each over all tiles on all workers; a tile of a pass writes only its own pixels (or
 * support nodes), so the order of tiles changes nothing. */
#ifndef FV_PASS_PASS_H
#define FV_PASS_PASS_H

#include "rt/fovea/foveal.h"
#include "rt/pass/kernels.h"
#include "rt/trace/rays.h"
#include "platform/threads.h"

enum { FV_TILE = 32, FV_BLOCK = 4, FV_BLOCKS = FV_TILE / FV_BLOCK };

enum fv_buffer {
    FV_COLOUR,         /* this frame's pixels (trace/pixel.h), stride x rows */
    FV_DEPTH,          /* their inverse depths, float, 1/m, or FV_DEPTH_UNKNOWN */
    FV_HISTORY_COLOUR, /* the frame before: swapped with the two above after each frame */
    FV_HISTORY_DEPTH,
    FV_SUPPORT_COLOUR, /* support image: one node every `spacing` pixels, at its cell's centre */
    FV_SUPPORT_DEPTH,  /* support G-buffer */
    FV_SUPPORT_SURFACE, /* of the nodes, enum fv_surface, a byte each */
    FV_SELECTED,       /* mask of traced blocks, 64 bits a tile */
    FV_PICTURE,        /* 8-bit picture for the display */
    FV_BUFFERS
};

/* Bit of a buffer in a pass's reads and writes. */
#define FV_BIT(buffer) (1u << (buffer))

/* A pixel's colour, and flags above it (trace/pixel.h). */
#define FV_PIXEL_COLOUR (FV_PIXEL_SAMPLED - 1)
#define FV_PIXEL_SAMPLED (1u << 30) /* traced in this frame */
#define FV_PIXEL_FILLED (1u << 31)  /* no history arrived: taken from the support image */

/* What a method's quality level sets. */
struct fv_parameters {
    struct fv_foveal foveal;
    int spp;
    int spacing; /* pixels between support nodes: 4, 8 or 16, not fewer than method.support */
};

struct fv_worker_scratch {
    struct fv_samples samples;
    uint32_t pixel[FV_SAMPLES_MAX];
    /* This frame's: */
    _Alignas(64) int64_t rays[FV_RAY_KINDS];
    int64_t reprojected, edges, failed; /* blocks: of reprojected tiles; of these at depth edges, without history */
};

/* How far from the gaze the picture lies: its pixels and its tiles (by their centres) in rings of one degree. */
enum { FV_DEGREES = 181 };
struct fv_rings {
    float pixels[FV_DEGREES], tiles[FV_DEGREES];
};

struct fv_frame {
    int64_t number;
    int eyes, width, height;
    int tiles_x, tiles_y, tiles; /* tiles: of all eyes */
    int64_t stride, rows;        /* of the pixel buffers: whole tiles */
    int spacing;                 /* the parameters'; stride / spacing nodes a row */
    bool has_history, overlay;
    float alpha, epsilon_depth;
    struct fv_parameters parameters;
    struct fv_view view[2], before[2];
    struct fv_map map[2];
    /* Where the moving objects are, and were a frame before: [0] is object 1 (struct fv_object). */
    struct fv_pose object[FV_MOVING_MAX], object_before[FV_MOVING_MAX];
    struct fv_map object_map[2][FV_MOVING_MAX + 1]; /* of what is fixed to each object; [0]: as map */
    const struct fv_tracer *tracer;
    const struct fv_kernels *kernels;
    const float *noise;          /* fv_noise(), NULL where no pass needs it */
    void *buffer[FV_BUFFERS][2]; /* of each eye, NULL where the plan left it out */
    uint8_t *failed_blocks;      /* of each tile: blocks in which no history arrived; NULL: nobody asks */
    float edge_share, failed_share; /* of the frame before's reprojected blocks */
    struct fv_worker_scratch *scratch;
};

struct fv_tile {
    int index, eye, worker;
    int x0, y0; /* first pixel */
};

/* What a pass needs besides buffers. */
enum fv_needs {
    FV_NEEDS_GAZE = 1, /* where the eye looks */
    FV_NEEDS_NOISE = 2, /* the blue-noise mask */
    FV_NEEDS_HISTORY = 4 /* its stand-in does: where there is none, nothing is left out */
};

/* Which tiles come first. */
enum fv_order {
    FV_ORDER_GAZE, /* those nearest to it */
    FV_ORDER_NEED  /* the fovea's, then those whose absence costs most */
};

struct fv_pass {
    const char *name;
    uint32_t reads, writes; /* bits of fv_buffer */
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
    fv_pass_sample, fv_pass_present;

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

/* First element of tile's row y (0..31) in a buffer of 32-bit pixels. */
static inline int64_t fv_tile_row(const struct fv_frame *frame, const struct fv_tile *tile, int y)
{
    return (int64_t)(tile->y0 + y) * frame->stride + tile->x0;
}

/* Blocks of the tile that lie in the picture at least in part. */
uint64_t fv_tile_inside(const struct fv_frame *frame, const struct fv_tile *tile);

/* This frame's blue-noise threshold of a block, in [0, 1). The eyes look up different parts of the mask,
 * so that the two fill each other in. */
float fv_tile_threshold(const struct fv_frame *frame, const struct fv_tile *tile, int block);

/* Eccentricity of a block's centre, degrees. */
float fv_tile_eccentricity_deg(const struct fv_frame *frame, const struct fv_tile *tile, int block);

/* Puts the centres of all pixels of the masked blocks, block by block, into the worker's samples. */
void fv_tile_place(struct fv_frame *frame, const struct fv_tile *tile, uint64_t blocks);

/* Places, traces and encodes them, into scratch->samples and scratch->pixel. */
void fv_tile_trace(struct fv_frame *frame, const struct fv_tile *tile, uint64_t blocks);

#endif
