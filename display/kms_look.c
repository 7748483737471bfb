/* kms_look: which card, connectors and modes there are, and how often the display refreshes now. See kms.h. */
#include "display/kms.h"

#include <stdio.h>

static const int64_t look_ns = 300000000;

/* The newest vertical blank of the first screen: its number and time; false where the driver has none. */
static bool newest_blank(struct fv_kms *k, uint32_t *number, double *t_s)
{
    unsigned crtc = (unsigned)k->screen[0].crtc_index << _DRM_VBLANK_HIGH_CRTC_SHIFT & _DRM_VBLANK_HIGH_CRTC_MASK;
    union drm_wait_vblank wait = {.request = {.type = (enum drm_vblank_seq_type)(_DRM_VBLANK_RELATIVE | crtc)}};
    if (k->io->control(k->io->context, k->fd, DRM_IOCTL_WAIT_VBLANK, &wait) < 0) return false;
    *number = wait.reply.sequence;
    *t_s = (double)wait.reply.tval_sec + 1e-6 * (double)wait.reply.tval_usec;
    return true;
}

/* By the kernel's numbers; 0: it cannot be told. */
static double measure_hz(struct fv_kms *k)
{
    uint32_t first, last;
    double from_s, to_s;
    if (!newest_blank(k, &first, &from_s)) return 0;
    k->io->wait(k->io->context, k->fd, look_ns);
    if (!newest_blank(k, &last, &to_s) || !(to_s > from_s)) return 0;
    uint32_t blanks = last - first;
    return blanks > 0 && blanks < 1u << 16 ? blanks / (to_s - from_s) : 0;
}

int fv_kms_look(struct fv_kms *k, const struct fv_kms_settings *settings, const struct fv_kms_io *io,
                struct fv_kms_looked *looked, struct fv_error *error)
{
    struct fv_error held;
    *looked = (struct fv_kms_looked){.held = false};
    if (fv_kms_take(k, settings, io, false, error)) {
        if (fv_kms_take(k, settings, io, true, &held)) return -1;
        looked->held = true;
    }
    fv_kms_remember(k);
    const struct fv_kms_before *now = &k->screen[0].before;
    looked->shows = now->known && now->connector && now->crtc.mode_valid;
    if (looked->shows) {
        looked->mode_hz = fv_kms_mode_hz(&now->crtc.mode);
        snprintf(looked->mode, sizeof looked->mode, "%dx%d, %.2f Hz", now->crtc.mode.hdisplay, now->crtc.mode.vdisplay,
                 looked->mode_hz);
        looked->measured_hz = measure_hz(k);
    }
    fv_kms_close(k);
    return 0;
}
