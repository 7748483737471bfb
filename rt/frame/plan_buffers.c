/* plan_buffers: see plan_buffers.h. */
#include "rt/frame/plan_buffers.h"

static const char *const buffer_names[FV_BUFFERS] = {
    [FV_COLOUR] = "colour",
    [FV_CACHE] = "cache",
    [FV_COARSE_COLOUR] = "coarse colour",
    [FV_COARSE_CACHE] = "coarse cache",
    [FV_COARSEST_COLOUR] = "coarsest colour",
    [FV_COARSEST_CACHE] = "coarsest cache",
    [FV_HISTORY_COLOUR] = "history colour",
    [FV_HISTORY_CACHE] = "history cache",
    [FV_COARSE_HISTORY_COLOUR] = "coarse history colour",
    [FV_COARSE_HISTORY_CACHE] = "coarse history cache",
    [FV_COARSEST_HISTORY_COLOUR] = "coarsest history colour",
    [FV_COARSEST_HISTORY_CACHE] = "coarsest history cache",
    [FV_SUPPORT_COLOUR] = "support colour",
    [FV_SUPPORT_DEPTH] = "support depth",
    [FV_SUPPORT_SURFACE] = "support surface",
    [FV_SUPPORT_HISTORY_DEPTH] = "support history depth",
    [FV_SUPPORT_HISTORY_SURFACE] = "support history surface",
    [FV_SELECTED] = "selected blocks",
    [FV_RESAMPLED] = "resampled blocks",
    [FV_MASKED] = "masked blocks",
    [FV_STARTS] = "starts",
    [FV_BASE] = "base colour",
    [FV_IDENTITY] = "identity",
    [FV_FACING] = "facing",
    [FV_SECOND_IDENTITY] = "second identity",
    [FV_SECOND_FACING] = "second facing",
    [FV_TRIANGLE] = "triangle",
    [FV_LIT] = "lit",
    [FV_COARSE_SEEN] = "coarse seen checks",
    [FV_COARSEST_SEEN] = "coarsest seen checks",
    [FV_CHAIN] = "chain",
    [FV_HISTORY_BASE] = "history base colour",
    [FV_HISTORY_IDENTITY] = "history identity",
    [FV_HISTORY_FACING] = "history facing",
    [FV_HISTORY_SECOND_IDENTITY] = "history second identity",
    [FV_HISTORY_SECOND_FACING] = "history second facing",
    [FV_HISTORY_CHAIN] = "history chain",
    [FV_REUSED] = "reused pixels",
    [FV_EARLIER_COLOUR] = "earlier colour",
    [FV_EARLIER_CACHE] = "earlier cache",
    [FV_SMOOTHED] = "smoothed colour",
    [FV_HISTORY_STARTS] = "history starts",
    [FV_LAYER] = "layer",
    [FV_TILE_LAYERS] = "layers of tiles",
    [FV_ALBEDO] = "albedo",
    [FV_DEPTH] = "depth",
    [FV_LIGHT] = "light",
    [FV_FILTERED] = "filtered light",
    [FV_VARIANCE] = "variance",
    [FV_FILTERED_VARIANCE] = "filtered variance",
    [FV_MEAN] = "accumulated light",
    [FV_TRACK] = "track",
    [FV_HISTORY_MEAN] = "history accumulated light",
    [FV_HISTORY_TRACK] = "history track",
    [FV_PICTURE] = "picture",
    [FV_GREEN] = "green's picture",
    [FV_TURNED] = "turned picture",
};

const char *fv_plan_buffer_name(enum fv_buffer buffer)
{
    return buffer_names[buffer];
}

int64_t fv_plan_buffer_bytes(const struct fv_frame *f, enum fv_buffer buffer)
{
    int64_t pixels = f->stride * f->rows;
    switch (buffer) {
    case FV_SUPPORT_COLOUR:
    case FV_SUPPORT_DEPTH:
    case FV_SUPPORT_HISTORY_DEPTH: return 4 * pixels / (f->spacing * f->spacing);
    case FV_SUPPORT_SURFACE:
    case FV_SUPPORT_HISTORY_SURFACE: return pixels / (f->spacing * f->spacing);
    case FV_STARTS:
    case FV_HISTORY_STARTS: return 4 * pixels / (FV_BLOCK * FV_BLOCK);
    case FV_SELECTED:
    case FV_MASKED:
    case FV_RESAMPLED: return 8 * (int64_t)f->tiles_x * f->tiles_y;
    case FV_TILE_LAYERS: return (int64_t)f->tiles_x * f->tiles_y;
    case FV_LAYER:
    case FV_COARSE_SEEN:
    case FV_CHAIN:
    case FV_HISTORY_CHAIN: return pixels + 64;
    case FV_REUSED: return 4 * pixels / FV_TILE;
    case FV_COARSE_COLOUR:
    case FV_COARSE_CACHE:
    case FV_COARSE_HISTORY_COLOUR:
    case FV_COARSE_HISTORY_CACHE: return pixels + 64;
    case FV_COARSEST_SEEN:
    case FV_COARSEST_COLOUR:
    case FV_COARSEST_CACHE:
    case FV_COARSEST_HISTORY_COLOUR:
    case FV_COARSEST_HISTORY_CACHE: return pixels / 4 + 64;
    default: return 4 * pixels + 64; /* pixels are loaded in pairs: one behind the last */
    }
}
