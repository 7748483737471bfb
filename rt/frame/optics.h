/* optics: each eye's lens by the settings of the display: a pinhole's picture, or rays through a radial lens
 * (fovea/lens.h). */
#ifndef FV_FRAME_OPTICS_H
#define FV_FRAME_OPTICS_H

#include "config/config.h"
#include "rt/fovea/view.h"

/* Eye 0 is the left one; the right one's lens is its mirror image. */
void fv_optics_lens(const struct fv_config *config, int eye, struct fv_lens *lens, struct fv_bend *bend);

/* Pixels of one eye's picture that show nothing through it. */
int64_t fv_optics_unseen(const struct fv_lens *lens, const struct fv_bend *bend);

#endif
