/* calibrate: parts of the verb: pictures of the targets, and what is told of a calibration. */
#ifndef FV_CLI_CALIBRATE_H
#define FV_CLI_CALIBRATE_H

#include "cli/cli.h"
#include "sensors/eye/calibrated.h"

/* Both eyes' pictures of a target on a dark ground. */
struct fv_target_picture {
    struct fv_loop loop; /* of its camera alone */
    struct fv_config *config;
    struct fv_picture picture;
    uint8_t *pixels[2];
    int drawn[2][4]; /* what the last target covers: left, top, right, bottom */
};

/* How far targets go: parts of the display that both eyes see, and no further than eyes turn with ease. */
struct fv_target_reach fv_target_reach(const struct fv_config *config);

/* Takes memory from the arena ("display"). */
void fv_target_picture_open(struct fv_target_picture *picture, struct fv_config *config);

/* Draws a target in this direction in place of the last; at part 0 of its time its ring is widest, from 1 on
 * it stays small. */
void fv_target_picture_draw(struct fv_target_picture *picture, const double at_deg[2], double part);

/* What came of it, on standard error: a line an eye, and a table of the targets. */
void fv_calibrated_tell(const struct fv_calibrated *calibrated);

/* The same as a page. */
int fv_calibrated_page(const struct fv_calibrated *calibrated, const char *about, const char *path,
                       struct fv_error *error);

#endif
