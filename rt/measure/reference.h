/* reference: what a sweep's pictures are judged by: the left eye's picture of the last frame of each segment
 * at many samples a pixel, and each pixel's zone of eccentricity; of some segments, for flicker, also the
 * picture of the frame before, and exact depth.
 *
 * Rendered once, with FV_REFERENCE_SPP_MIN samples, doubled until half of them agree with all to
 * FV_REFERENCE_DB (so that all of them are some 6 dB better), but with no more than FV_REFERENCE_RAYS (half
 * the least samples, if need be): not by the clock, so that machines that share a sweep judge alike. Kept as
 * PNG in a folder with a file that says of what they are. */
#ifndef FV_MEASURE_REFERENCE_H
#define FV_MEASURE_REFERENCE_H

#include "rt/frame/loop.h"
#include "rt/measure/metrics.h"

enum { FV_SWEEP_SEGMENTS = 5, FV_REFERENCE_SPP_MIN = 64, FV_REFERENCE_SPP_MAX = 256, FV_REFERENCE_DB = 45 };
#define FV_REFERENCE_RAYS 3e9 /* of the whole reference: one minute to three on two cores */

/* What a frame is latched from. */
struct fv_sweep_frame {
    int64_t t_ns;
    struct fv_pose head;
    double gaze[2][3], uncertainty_deg;
};

/* The last frame of a segment and the one before. */
enum { FV_REFERENCE_BEFORE, FV_REFERENCE_LAST, FV_REFERENCE_PICTURES };
struct fv_reference_segment {
    struct fv_metrics_picture picture[FV_REFERENCE_PICTURES];
    uint8_t *zone; /* of the last frame's pixels (metrics.h) */
    /* Where flicker is judged, as the picture before: */
    float *inverse_depth[FV_REFERENCE_PICTURES]; /* at pixel centres, stride of the frame's buffers */
    struct fv_map map;                           /* from the last frame's pixels to those before */
    double flicker;                              /* of the reference itself */
};

/* True for the segments at which flicker is judged: two of them. */
static inline bool fv_reference_flickers(int segment)
{
    return segment % 2 == 1;
}

struct fv_reference {
    struct fv_config config; /* the sweep's, one eye */
    struct fv_plan plan;
    struct fv_session session;
    struct fv_loop loop;
    struct fv_workers *workers;
    int spp;
    double agreement_db; /* PSNR of half the samples against all of them */
    struct fv_reference_segment segment[FV_SWEEP_SEGMENTS];
};

/* Settings of denoise as its pictures are judged by: so many paths a pixel as they come, each frame alone; no filter, nothing left
 * out, nothing taken down. */
void fv_reference_paths(struct fv_config *config, int spp);

/* Takes the memory. `by_paths`: by paths of the method denoise, without its filter, instead of `full`. */
void fv_reference_open(struct fv_reference *reference, const struct fv_config *config, bool by_paths,
                       const struct fv_tracer *tracer, struct fv_workers *workers);

/* -1 with the error set where the folder (which need not be there) holds references of another `key`. */
int fv_reference_check(const char *folder, const char *key, struct fv_error *error);

/* Renders or loads all segments: frames[segment][FV_REFERENCE_PICTURES]. `stopped` and `progress` as in
 * struct fv_sweep_io. Returns 0; 1: stopped; -1 with the error set. */
int fv_reference_make(struct fv_reference *reference, const char *folder, const char *key,
                      const struct fv_sweep_frame (*frames)[FV_REFERENCE_PICTURES],
                      struct fv_metrics *metrics, bool (*stopped)(void *context),
                      void (*progress)(void *context, const char *what, double done), void *context,
                      struct fv_error *error);

#endif
