/* kms: buffers, pictures and events, and what becomes of a display's faults. See the header.
 *
 * Every way in which a display can fail ends in lose(): all is closed, and opened anew after a pause that grows from
 * 0.25 to 1 s until its mode is set again. */
#include "display/kms.h"

#include <drm_fourcc.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const int64_t pause_least_ns = 250000000, pause_most_ns = 1000000000, look_ns = 250000000;
static const int64_t flip_most_ns = 500000000; /* a flip that takes longer is lost */
static const int64_t margin_ns = 300000;       /* between a picture handed over and the blank it is meant for */
static const int64_t ahead_ns = 50000000, old_ns = 1000000000; /* time stamps may be so far off our clock */
enum { TRIES = 4, EVENTS = 1024, READS = 16 };

/* How far opening a card came: the message of the one that came farthest is told. */
enum { REACHED_NOTHING, REACHED_FILE, REACHED_CARD, REACHED_DISPLAY, REACHED_MASTER, REACHED_ALL };

static int control(const struct fv_kms *k, unsigned long request, void *argument)
{
    return k->io->control(k->io->context, k->fd, request, argument);
}

static int64_t now(const struct fv_kms *k)
{
    return k->io->now_ns(k->io->context);
}

static void release_buffers(struct fv_kms *k)
{
    for (int s = 0; s < FV_KMS_SCREENS; s++)
        for (int i = 0; i < FV_KMS_BUFFERS_MAX; i++) {
            struct fv_kms_buffer *b = &k->screen[s].buffer[i];
            struct drm_mode_destroy_dumb dumb = {b->handle};
            if (b->at) k->io->unmap(k->io->context, b->at, b->bytes);
            if (b->id) control(k, DRM_IOCTL_MODE_RMFB, &b->id);
            if (b->handle) control(k, DRM_IOCTL_MODE_DESTROY_DUMB, &dumb);
            *b = (struct fv_kms_buffer){0};
        }
}

/* Closes the card, its screens as they are. */
static void leave(struct fv_kms *k)
{
    if (k->fd < 0) return;
    release_buffers(k);
    if (k->master) control(k, DRM_IOCTL_DROP_MASTER, NULL);
    k->io->close(k->io->context, k->fd);
    k->master = k->set = false;
    k->fd = k->front = k->queued = -1;
    for (int s = 0; s < FV_KMS_SCREENS; s++) k->screen[s].pending = k->screen[s].numbered = false;
}

static int make_buffer(struct fv_kms *k, const struct fv_kms_screen *screen, struct fv_kms_buffer *b)
{
    struct drm_mode_create_dumb dumb = {.width = screen->mode.hdisplay, .height = screen->mode.vdisplay, .bpp = 32};
    int failed = control(k, DRM_IOCTL_MODE_CREATE_DUMB, &dumb);
    if (failed < 0) return failed;
    *b = (struct fv_kms_buffer){.handle = dumb.handle, .pitch = dumb.pitch, .bytes = dumb.size};
    if (dumb.pitch < 4 * dumb.width || dumb.size < (uint64_t)dumb.pitch * dumb.height) return -EIO;
    struct drm_mode_fb_cmd2 fb = {.width = dumb.width,
                                  .height = dumb.height,
                                  .pixel_format = DRM_FORMAT_XRGB8888,
                                  .handles = {dumb.handle},
                                  .pitches = {dumb.pitch}};
    if ((failed = control(k, DRM_IOCTL_MODE_ADDFB2, &fb)) < 0) return failed;
    b->id = fb.fb_id;
    struct drm_mode_map_dumb map = {.handle = dumb.handle};
    if ((failed = control(k, DRM_IOCTL_MODE_MAP_DUMB, &map)) < 0) return failed;
    b->at = k->io->map(k->io->context, k->fd, b->bytes, map.offset);
    if (!b->at) return -ENOMEM;
    memset(b->at, 0, b->bytes);
    return 0;
}

/* The newest vertical blank; false where the driver has none. */
static bool ask_vblank(struct fv_kms *k)
{
    unsigned crtc = (unsigned)k->screen[0].crtc_index << _DRM_VBLANK_HIGH_CRTC_SHIFT & _DRM_VBLANK_HIGH_CRTC_MASK;
    union drm_wait_vblank wait = {.request = {.type = (enum drm_vblank_seq_type)(_DRM_VBLANK_RELATIVE | crtc)}};
    if (control(k, DRM_IOCTL_WAIT_VBLANK, &wait) < 0) return false;
    int64_t t_ns = (int64_t)wait.reply.tval_sec * 1000000000 + (int64_t)wait.reply.tval_usec * 1000, now_ns = now(k);
    if (k->monotonic && t_ns > now_ns - old_ns && t_ns <= now_ns + ahead_ns &&
        (!k->vsync.known || t_ns > k->vsync.t_ns)) {
        fv_vsync_saw(&k->vsync, t_ns, 0);
        k->asked = true;
    }
    return true;
}

static bool able(struct fv_kms *k, uint64_t capability)
{
    struct drm_get_cap cap = {.capability = capability};
    return control(k, DRM_IOCTL_GET_CAP, &cap) >= 0 && cap.value;
}

static bool enable(struct fv_kms *k, uint64_t capability)
{
    struct drm_set_client_cap cap = {capability, 1};
    return control(k, DRM_IOCTL_SET_CLIENT_CAP, &cap) >= 0;
}

static void say(struct fv_kms *k)
{
    char driver[24] = "", screens[128] = "";
    struct drm_version version = {.name = driver, .name_len = sizeof driver - 1};
    if (control(k, DRM_IOCTL_VERSION, &version) < 0 || !driver[0]) snprintf(driver, sizeof driver, "unknown driver");
    for (int s = 0; s < k->screens; s++) {
        const struct fv_kms_screen *screen = &k->screen[s];
        size_t used = strlen(screens);
        snprintf(screens + used, sizeof screens - used, "%s%s %dx%d, %.2f Hz", s ? "; " : "", screen->name,
                 screen->mode.hdisplay, screen->mode.vdisplay, fv_kms_mode_hz(&screen->mode));
    }
    snprintf(k->text, sizeof k->text, "%.200s (%s): %s; %s, %d buffers%s", k->path, driver, screens,
             k->atomic ? "atomic" : "legacy", k->settings.buffers,
             k->vblank ? "" : ", no vertical blank: paced by the clock");
}

/* With the card open and ours: buffers and mode. */
static int show(struct fv_kms *k, struct fv_error *error)
{
    fv_kms_remember(k);
    fv_kms_find_properties(k);
    int failed = 0;
    for (int s = 0; s < k->screens; s++)
        for (int i = 0; i < k->settings.buffers && failed >= 0; i++)
            failed = make_buffer(k, &k->screen[s], &k->screen[s].buffer[i]);
    if (failed < 0)
        return fv_error_set(error, "%s: gives no buffers for %s: %s", k->path, k->screen[0].name, strerror(-failed));
    failed = fv_kms_set_mode(k, 0);
    if (failed < 0)
        return fv_error_set(error, "%s: %s: the mode %dx%d cannot be set: %s", k->path, k->screen[0].name,
                            k->screen[0].mode.hdisplay, k->screen[0].mode.vdisplay, strerror(-failed));
    k->set = true;
    k->front = 0;
    k->queued = -1;
    fv_vsync_begin(&k->vsync, k->nominal_ns);
    k->vblank = ask_vblank(k);
    k->looked_ns = now(k);
    say(k);
    return 0;
}

static int take_card(struct fv_kms *k, struct fv_error *error)
{
    k->fd = k->io->open(k->io->context, k->path);
    k->reached = k->fd == -ENOENT ? REACHED_NOTHING : REACHED_FILE;
    if (k->fd < 0)
        return fv_error_set(error, "%s: %s%s", k->path, strerror(-k->fd),
                            k->fd == -EACCES ? "; be root or in the group that owns it (video)" : "");
    k->reached = REACHED_CARD;
    if (!able(k, DRM_CAP_DUMB_BUFFER)) return fv_error_set(error, "%s: gives no dumb buffers", k->path);
    k->monotonic = able(k, DRM_CAP_TIMESTAMP_MONOTONIC);
    k->atomic = enable(k, DRM_CLIENT_CAP_UNIVERSAL_PLANES) && enable(k, DRM_CLIENT_CAP_ATOMIC);
    int failed = control(k, DRM_IOCTL_SET_MASTER, NULL);
    k->master = failed >= 0;
    if (!k->master && !k->shares) {
        k->reached = REACHED_MASTER;
        return fv_error_set(error,
                            "%s: another program holds the display (%s): end it, a display server most likely "
                            "(systemctl stop display-manager), or name another card by display.device",
                            k->path, strerror(-failed));
    }
    k->reached = REACHED_DISPLAY;
    if (fv_kms_pick(k, error)) return -1;
    k->reached = REACHED_ALL;
    return k->looks ? 0 : show(k, error);
}

static int start(struct fv_kms *k, struct fv_error *error)
{
    bool named = k->settings.device[0];
    int farthest = -1;
    for (int card = 0; card < (named ? 1 : FV_KMS_CARDS); card++) {
        struct fv_error why;
        if (named) memcpy(k->path, k->settings.device, sizeof k->path);
        else snprintf(k->path, sizeof k->path, "/dev/dri/card%d", card);
        if (take_card(k, &why) == 0) return 0;
        leave(k);
        k->fd = -1;
        for (int s = 0; s < FV_KMS_SCREENS && !k->missing; s++) k->screen[s].before.known = false; /* of another card */
        if (k->reached > farthest) *error = why;
        if (k->reached > farthest) farthest = k->reached;
    }
    if (farthest == REACHED_NOTHING && !named)
        fv_error_set(error, "there is no display card (/dev/dri/card0 to card%d)", FV_KMS_CARDS - 1);
    return -1;
}

int fv_kms_open(struct fv_kms *k, const struct fv_kms_settings *settings, const struct fv_kms_io *io,
                struct fv_error *error)
{
    *k = (struct fv_kms){.settings = *settings, .io = io, .fd = -1, .front = -1, .queued = -1, .pause_ns = pause_least_ns};
    if (start(k, error)) return -1;
    io->console(io->context, true);
    k->graphics = true;
    return 0;
}

int fv_kms_take(struct fv_kms *k, const struct fv_kms_settings *settings, const struct fv_kms_io *io, bool shares,
                struct fv_error *error)
{
    *k = (struct fv_kms){.settings = *settings, .io = io, .fd = -1, .front = -1, .queued = -1, .looks = true, .shares = shares};
    return start(k, error);
}

static enum fv_kms_event lose(struct fv_kms *k, const char *format, ...) __attribute__((format(printf, 2, 3)));
static enum fv_kms_event lose(struct fv_kms *k, const char *format, ...)
{
    bool first = !k->missing;
    leave(k);
    k->retry_ns = now(k) + k->pause_ns;
    k->pause_ns = k->pause_ns < pause_most_ns / 2 ? 2 * k->pause_ns : pause_most_ns;
    k->missing = true;
    k->vsync.known = false;
    if (!first) return FV_KMS_NOTHING;
    k->counts.lost++;
    char why[160];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, sizeof why, format, arguments);
    va_end(arguments);
    snprintf(k->text, sizeof k->text, "%.200s: display lost (%s); looked for again until it is back", k->path, why);
    return FV_KMS_LOST;
}

/* All screens show what was queued. */
static void shown(struct fv_kms *k)
{
    k->front = k->queued;
    k->queued = -1;
    k->counts.flips++;
}

static bool pending(const struct fv_kms *k)
{
    bool any = false;
    for (int s = 0; s < k->screens; s++) any |= k->screen[s].pending;
    return any;
}

/* The time and number of a refresh, of the first screen. */
static void count_refresh(struct fv_kms *k, const struct drm_event_vblank *e)
{
    struct fv_kms_screen *screen = &k->screen[0];
    uint32_t steps = e->sequence - screen->sequence;
    bool follows = screen->numbered && steps > 0 && steps < 1u << 16;
    int64_t t_ns = (int64_t)e->tv_sec * 1000000000 + (int64_t)e->tv_usec * 1000, now_ns = now(k);
    bool sane = k->monotonic && t_ns <= now_ns + ahead_ns && t_ns >= now_ns - old_ns;
    if (follows) k->counts.skipped += steps - 1;
    fv_vsync_saw(&k->vsync, sane ? t_ns : now_ns, follows && !k->asked ? steps : 0);
    k->asked = false;
    screen->sequence = e->sequence;
    screen->numbered = true;
}

static void take_event(struct fv_kms *k, const struct drm_event_vblank *e)
{
    int s = e->user_data < (uint64_t)k->screens ? (int)e->user_data : 0;
    for (int i = 0; i < k->screens; i++)
        if (e->crtc_id && k->screen[i].crtc == e->crtc_id) s = i;
    if (!k->screen[s].pending) {
        k->counts.odd++;
        return;
    }
    k->screen[s].pending = false;
    if (s == 0 && k->vblank) count_refresh(k, e);
    if (!pending(k) && k->queued >= 0) shown(k);
}

/* Takes all events that wait; 0, or -errno where none can be read any more. */
static int drain(struct fv_kms *k)
{
    _Alignas(8) char bytes[EVENTS];
    for (int reads = 0; reads < READS; reads++) {
        int n = k->io->read(k->io->context, k->fd, bytes, sizeof bytes), at = 0;
        if (n < 0) return n == -EAGAIN ? 0 : n;
        if (n == 0) return 0;
        while (n - at >= (int)sizeof(struct drm_event)) {
            struct drm_event head;
            struct drm_event_vblank e;
            memcpy(&head, bytes + at, sizeof head);
            bool whole = head.length >= sizeof head && head.length <= (uint32_t)(n - at);
            if (!whole || (head.type == DRM_EVENT_FLIP_COMPLETE && head.length < sizeof e)) {
                k->counts.odd++;
                break;
            }
            if (head.type == DRM_EVENT_FLIP_COMPLETE) {
                memcpy(&e, bytes + at, sizeof e);
                take_event(k, &e);
            }
            at += (int)head.length;
        }
    }
    return 0;
}

/* Until the flip that is under way is over; 0, or -errno: it never will be. */
static int wait_flip(struct fv_kms *k, int64_t most_ns)
{
    int64_t begun_ns = now(k), left_ns;
    int failed = drain(k);
    while (failed >= 0 && pending(k)) {
        left_ns = most_ns - (now(k) - begun_ns);
        if (left_ns <= 0) break;
        k->io->wait(k->io->context, k->fd, left_ns);
        failed = drain(k);
    }
    if (failed < 0) return failed;
    if (!pending(k)) return 0;
    if (k->vblank) return -ETIMEDOUT;
    /* Shown at once, if not said. */
    for (int s = 0; s < k->screens; s++) k->screen[s].pending = false;
    if (k->queued >= 0) shown(k);
    return 0;
}

static int64_t flip_limit_ns(const struct fv_kms *k)
{
    return k->vblank ? flip_most_ns : k->nominal_ns;
}

static void copy_picture(struct fv_kms *k, int buffer, const struct fv_picture *picture)
{
    int64_t begun_ns = now(k);
    for (int eye = 0; eye < picture->eyes; eye++) {
        bool shared = k->screens == 1 && picture->eyes > 1;
        const struct fv_kms_screen *screen = &k->screen[shared ? 0 : eye];
        const struct fv_kms_buffer *b = &screen->buffer[buffer];
        int room = shared ? screen->mode.hdisplay / 2 : screen->mode.hdisplay, high = screen->mode.vdisplay;
        int width = picture->width < room ? picture->width : room;
        int height = picture->height < high ? picture->height : high;
        size_t stride = (size_t)picture->stride_bytes;
        const uint8_t *from = picture->pixels[eye] + (size_t)((picture->height - height) / 2) * stride +
                              4 * (size_t)((picture->width - width) / 2);
        int left = (shared ? eye * room : 0) + (room - width) / 2;
        fv_kms_copy(b->at + (size_t)((high - height) / 2) * b->pitch + 4 * (size_t)left, b->pitch, from, stride, width,
                    height);
        k->counts.bytes += 4 * (int64_t)width * height;
    }
    int64_t took_ns = now(k) - begun_ns;
    k->counts.copies++;
    k->counts.copy_ns += took_ns;
    if (took_ns > k->counts.copy_most_ns) k->counts.copy_most_ns = took_ns;
    k->copy_held_ns -= k->copy_held_ns / 128;
    if (took_ns > k->copy_held_ns) k->copy_held_ns = took_ns;
}

/* A buffer that is neither shown nor queued; -1: there is none. */
static int free_buffer(const struct fv_kms *k)
{
    for (int i = 0; i < k->settings.buffers; i++)
        if (i != k->front && i != k->queued) return i;
    return -1;
}

static enum fv_kms_event flip(struct fv_kms *k, int buffer)
{
    int failed = -EBUSY;
    for (int tries = 0; tries < TRIES && failed == -EBUSY; tries++) {
        failed = fv_kms_flip(k, buffer);
        if (failed != -EBUSY) break;
        k->counts.busy++;
        k->io->wait(k->io->context, k->fd, k->nominal_ns / 2);
        int broken = drain(k);
        if (broken < 0) failed = broken;
    }
    if (failed == 0 || pending(k)) k->queued = buffer; /* of one screen of two, too */
    if (failed == 0) return FV_KMS_NOTHING;
    k->counts.dropped++;
    return failed == -EBUSY ? FV_KMS_NOTHING : lose(k, "%s", strerror(-failed));
}

/* The mode set again once the display is back. */
static enum fv_kms_event look_again(struct fv_kms *k)
{
    struct fv_error error;
    if (now(k) < k->retry_ns) return FV_KMS_NOTHING;
    if (start(k, &error)) return lose(k, "%s", error.text);
    k->missing = false;
    k->pause_ns = pause_least_ns;
    k->counts.back++;
    return FV_KMS_BACK;
}

static enum fv_kms_event drop(struct fv_kms *k, int failed)
{
    k->counts.dropped++;
    return lose(k, "%s", failed == -ETIMEDOUT ? "a flip was never over" : strerror(-failed));
}

enum fv_kms_event fv_kms_present(struct fv_kms *k, const struct fv_picture *picture)
{
    enum fv_kms_event event = FV_KMS_NOTHING;
    int failed = k->fd >= 0 ? drain(k) : 0;
    if (failed < 0) return drop(k, failed);
    if (k->fd >= 0 && now(k) - k->looked_ns >= look_ns) {
        k->looked_ns = now(k);
        if (!fv_kms_connected(k)) event = lose(k, "unplugged");
    }
    if (k->fd < 0 && event == FV_KMS_NOTHING) event = look_again(k);
    if (k->fd < 0) {
        k->counts.dropped++;
        return event;
    }
    int buffer = free_buffer(k);
    if (buffer < 0 && (failed = wait_flip(k, flip_limit_ns(k))) < 0) return drop(k, failed);
    if (buffer < 0) buffer = free_buffer(k);
    if (buffer < 0) return drop(k, -EIO);
    copy_picture(k, buffer, picture);
    if ((failed = wait_flip(k, flip_limit_ns(k))) < 0) return drop(k, failed);
    enum fv_kms_event flipped = flip(k, buffer);
    return flipped != FV_KMS_NOTHING ? flipped : event;
}

bool fv_kms_beat(struct fv_kms *k, struct fv_beat *beat)
{
    if (k->fd < 0 || !k->vblank) return false;
    drain(k);
    if (now(k) - k->vsync.t_ns > old_ns || !k->vsync.known) ask_vblank(k);
    int64_t lead_ns = k->blank_ns + k->copy_held_ns + margin_ns, most_ns = k->nominal_ns * 9 / 10;
    beat->lead_ns = lead_ns < most_ns ? lead_ns : most_ns;
    return fv_vsync_beat(&k->vsync, now(k), beat);
}

void fv_kms_close(struct fv_kms *k)
{
    if (k->fd >= 0) {
        wait_flip(k, flip_limit_ns(k));
        if (k->set) fv_kms_restore(k);
        leave(k);
    }
    if (k->graphics) k->io->console(k->io->context, false);
    k->graphics = false;
}
