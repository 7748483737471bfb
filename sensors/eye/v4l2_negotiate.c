/* v4l2_negotiate: what the camera is asked for. Every format that it offers and we read is tried (TRY_FMT)
 * with the size that is wished for; the one whose size and rate come nearest is set, the cheaper one of
 * equals. What the driver then says it has set counts, whatever was asked. */
#include "sensors/eye/v4l2.h"

#include <errno.h>
#include <linux/videodev2.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { OFFERS_MAX = 64, INTERVALS_MAX = 256 };

struct offer {
    const struct fv_camera_format *format;
    struct v4l2_fract interval; /* 0/0: the driver lists none */
    double hz, cost;
    bool refused;
};

static int control(const struct fv_camera *c, unsigned long request, void *argument)
{
    return c->io->control(c->io->context, c->fd, request, argument);
}

static double hz_of(struct v4l2_fract interval)
{
    return interval.numerator > 0 && interval.denominator > 0
               ? (double)interval.denominator / interval.numerator
               : 0;
}

/* How far a rate is from that wished for, in octaves; one that is not known may be right. */
static double hz_cost(double hz, double wished)
{
    return hz > 0 && wished > 0 ? fabs(log2(hz / wished)) : 0.5;
}

/* The interval nearest to the one wished for, at this size. */
static void best_interval(const struct fv_camera *c, int width, int height, struct offer *offer)
{
    double wished = c->settings.hz;
    for (uint32_t i = 0; i < INTERVALS_MAX; i++) {
        struct v4l2_frmivalenum e = {.index = i,
                                     .pixel_format = offer->format->fourcc,
                                     .width = (uint32_t)width,
                                     .height = (uint32_t)height};
        if (control(c, VIDIOC_ENUM_FRAMEINTERVALS, &e) < 0) return;
        if (e.type != V4L2_FRMIVAL_TYPE_DISCRETE) {
            /* The shortest interval is the highest rate. */
            double most = hz_of(e.stepwise.min), least = hz_of(e.stepwise.max);
            offer->interval = (struct v4l2_fract){1000, (uint32_t)fmin(fmax(wished * 1000, 1), 4e9)};
            if (most > 0 && wished > most) offer->interval = e.stepwise.min;
            if (least > 0 && wished < least) offer->interval = e.stepwise.max;
            offer->hz = hz_of(offer->interval);
            return;
        }
        double hz = hz_of(e.discrete);
        if (hz > 0 && (offer->hz == 0 || hz_cost(hz, wished) < hz_cost(offer->hz, wished))) {
            offer->interval = e.discrete;
            offer->hz = hz;
        }
    }
}

static struct v4l2_format format_of(const struct fv_camera *c, const struct fv_camera_format *format)
{
    struct v4l2_format f = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    f.fmt.pix.width = (uint32_t)c->settings.width;
    f.fmt.pix.height = (uint32_t)c->settings.height;
    f.fmt.pix.pixelformat = format->fourcc;
    f.fmt.pix.field = V4L2_FIELD_NONE;
    return f;
}

/* All formats that both sides know, each with what it would cost; `all` tells what the camera offers at all.
 */
static int list_offers(const struct fv_camera *c, struct offer *offer, char *all, size_t size)
{
    int offers = 0;
    all[0] = 0;
    for (uint32_t i = 0; i < OFFERS_MAX; i++) {
        struct v4l2_fmtdesc d = {.index = i, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
        if (control(c, VIDIOC_ENUM_FMT, &d) < 0) break;
        size_t used = strlen(all);
        if (used + 8 < size)
            snprintf(all + used, size - used, " %c%c%c%c", d.pixelformat & 127, d.pixelformat >> 8 & 127,
                     d.pixelformat >> 16 & 127, d.pixelformat >> 24 & 127);
        const struct fv_camera_format *format = fv_camera_format_of(d.pixelformat);
        if (!format || (c->settings.format && c->settings.format != format)) continue;
        struct v4l2_format f = format_of(c, format);
        int width = c->settings.width, height = c->settings.height;
        offer[offers] = (struct offer){.format = format};
        if (control(c, VIDIOC_TRY_FMT, &f) >= 0 && f.fmt.pix.width > 0 && f.fmt.pix.height > 0) {
            width = (int)fmin(f.fmt.pix.width, 1e6);
            height = (int)fmin(f.fmt.pix.height, 1e6);
        }
        best_interval(c, width, height, &offer[offers]);
        double area = (double)width * height / ((double)c->settings.width * c->settings.height);
        offer[offers].cost = fabs(log2(area)) + hz_cost(offer[offers].hz, c->settings.hz) +
                             1e-3 * (double)(format - fv_camera_formats);
        offers++;
    }
    return offers;
}

/* Takes over what the driver says it has set. */
static int take_format(struct fv_camera *c, const struct v4l2_pix_format *pix, struct fv_error *error)
{
    const struct fv_camera_format *format = fv_camera_format_of(pix->pixelformat);
    if (!format || (c->settings.format && format != c->settings.format))
        return fv_error_set(error, "%s: it set another format than asked (%.4s)", c->settings.path,
                            (const char *)&pix->pixelformat);
    if (pix->width > FV_CAMERA_SIDE_MAX || pix->height > FV_CAMERA_SIDE_MAX)
        return fv_error_set(error, "%s: frames of %ux%u pixels, at most %d a side are read", c->settings.path,
                            pix->width, pix->height, (int)FV_CAMERA_SIDE_MAX);
    c->layout = (struct fv_camera_layout){format, (int)pix->width, (int)pix->height, pix->bytesperline};
    if (c->layout.stride == 0) c->layout.stride = fv_camera_row_bytes(format, c->layout.width);
    size_t bytes = fv_camera_frame_bytes(&c->layout);
    if (bytes == 0 || (pix->sizeimage > 0 && pix->sizeimage < bytes))
        return fv_error_set(error, "%s: frames of %ux%u %s pixels cannot have %u bytes in rows of %u",
                            c->settings.path, pix->width, pix->height, format->name, pix->sizeimage,
                            pix->bytesperline);
    return 0;
}

static int set_format(struct fv_camera *c, const struct offer *offer, struct fv_error *error)
{
    struct v4l2_format f = format_of(c, offer->format);
    int failed = control(c, VIDIOC_S_FMT, &f);
    if (failed == -EBUSY) return fv_error_set(error, "%s: in use by another program", c->settings.path);
    if (failed < 0)
        return fv_error_set(error, "%s: refuses %s: %s", c->settings.path, offer->format->name,
                            strerror(-failed));
    return take_format(c, &f.fmt.pix, error);
}

/* Asks for the rate and keeps what the camera says of it. */
static void set_rate(struct fv_camera *c, const struct offer *offer)
{
    struct v4l2_streamparm p = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    p.parm.capture.timeperframe = offer->interval;
    if (offer->hz == 0)
        p.parm.capture.timeperframe =
            (struct v4l2_fract){1000, (uint32_t)fmin(fmax(c->settings.hz * 1000, 1), 4e9)};
    if (control(c, VIDIOC_S_PARM, &p) < 0) {
        p = (struct v4l2_streamparm){.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
        if (control(c, VIDIOC_G_PARM, &p) < 0) p.parm.capture.timeperframe = (struct v4l2_fract){0, 0};
    }
    c->hz = hz_of(p.parm.capture.timeperframe);
}

static int look_at(struct fv_camera *c, char card[33], struct fv_error *error)
{
    struct v4l2_capability able = {0};
    int failed = control(c, VIDIOC_QUERYCAP, &able);
    if (failed < 0)
        return fv_error_set(error, "%s: no camera (%s); must be a capture device such as /dev/v4l/by-id/...",
                            c->settings.path, strerror(-failed));
    uint32_t can = able.capabilities & V4L2_CAP_DEVICE_CAPS ? able.device_caps : able.capabilities;
    if (!(can & V4L2_CAP_VIDEO_CAPTURE))
        return fv_error_set(error, "%s: %s; must be a device that captures into one plane", c->settings.path,
                            can & V4L2_CAP_VIDEO_CAPTURE_MPLANE ? "captures into several planes"
                                                                : "captures no video");
    if (!(can & V4L2_CAP_STREAMING))
        return fv_error_set(error, "%s: does not stream into shared buffers", c->settings.path);
    snprintf(card, 33, "%.32s", (const char *)able.card);
    return 0;
}

static void say(struct fv_camera *c, const char *card)
{
    char rate[32] = "rate not known";
    if (c->hz > 0) snprintf(rate, sizeof rate, "%.4g Hz", c->hz);
    snprintf(c->text, sizeof c->text, "%.200s (%s): %s %dx%d, %s; asked for %s %dx%d, %.4g Hz",
             c->settings.path, card, c->layout.format->name, c->layout.width, c->layout.height, rate,
             c->settings.format ? c->settings.format->name : "any", c->settings.width, c->settings.height,
             c->settings.hz);
}

int fv_camera_negotiate(struct fv_camera *c, struct fv_error *error)
{
    struct offer offer[OFFERS_MAX];
    char card[33], all[OFFERS_MAX * 5 + 8];
    if (look_at(c, card, error)) return -1;
    int offers = list_offers(c, offer, all, sizeof all);
    if (offers == 0)
        return fv_error_set(error, "%s: gives none of %s, only:%.200s", c->settings.path,
                            c->settings.format ? c->settings.format->name : "GREY NV12 YUYV Y10 Y12 Y16",
                            all[0] ? all : " nothing");
    for (int tries = 0; tries < offers; tries++) {
        struct offer *best = NULL;
        for (int i = 0; i < offers; i++)
            if (!offer[i].refused && (!best || offer[i].cost < best->cost)) best = &offer[i];
        if (set_format(c, best, error) == 0) {
            set_rate(c, best);
            say(c, card);
            return 0;
        }
        best->refused = true;
    }
    return -1;
}
