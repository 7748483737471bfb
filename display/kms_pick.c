/* kms_pick: which connector, CRTC and mode; see kms.h. Every list that the kernel gives has a fixed place. */
#include "display/kms.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { CONNECTED = 1, DISCONNECTED = 2 }; /* as the kernel numbers them */

/* By DRM_MODE_CONNECTOR_*; the names are those of the kernel's /sys/class/drm and of display servers. */
static const char *const types[] = {"Unknown",   "VGA",  "DVI-I", "DVI-D",  "DVI-A", "Composite", "SVIDEO",
                                    "LVDS",      "Component", "DIN", "DP",  "HDMI-A", "HDMI-B", "TV",
                                    "eDP",       "Virtual", "DSI", "DPI",   "Writeback", "SPI", "USB"};
enum { TYPES = sizeof types / sizeof types[0] };

void fv_kms_connector_name(uint32_t type, uint32_t number, char name[FV_KMS_NAME])
{
    snprintf(name, FV_KMS_NAME, "%s-%u", types[type < TYPES ? type : 0], number);
}

bool fv_kms_mode_read(const char *text, int *width, int *height, double *hz)
{
    int used = 0, more = 0;
    *hz = 0;
    if (sscanf(text, "%5dx%5d%n", width, height, &used) != 2 || *width < 1 || *height < 1) return false;
    if (!text[used]) return true;
    if (sscanf(text + used, "@%lf%n", hz, &more) != 1 || text[used + more]) return false;
    return *hz > 0 && *hz <= 1000;
}

/* Vertical blanks a second, as the kernel counts them: two fields a frame where a mode is interlaced. */
double fv_kms_mode_hz(const struct drm_mode_modeinfo *m)
{
    double lines = (double)m->htotal * m->vtotal * (m->vscan > 1 ? m->vscan : 1);
    if (!m->clock || lines <= 0) return m->vrefresh;
    double hz = 1e3 * m->clock / lines;
    if (m->flags & DRM_MODE_FLAG_INTERLACE) hz *= 2;
    if (m->flags & DRM_MODE_FLAG_DBLSCAN) hz /= 2;
    return hz;
}

static int control(const struct fv_kms *k, unsigned long request, void *argument)
{
    return k->io->control(k->io->context, k->fd, request, argument);
}

/* What the kernel knows of a connector; `probe`: asks the display itself, which may take a tenth of a second. */
static int look_at(struct fv_kms *k, uint32_t connector, bool probe)
{
    struct drm_mode_get_connector *c = &k->found;
    *c = (struct drm_mode_get_connector){.connector_id = connector};
    int failed = probe ? control(k, DRM_IOCTL_MODE_GETCONNECTOR, c) : 0;
    if (failed < 0) return failed;
    *c = (struct drm_mode_get_connector){.connector_id = connector,
                                         .encoders_ptr = (uintptr_t)k->encoders,
                                         .count_encoders = FV_KMS_OBJECTS,
                                         .modes_ptr = (uintptr_t)k->modes,
                                         .count_modes = FV_KMS_MODES};
    failed = control(k, DRM_IOCTL_MODE_GETCONNECTOR, c);
    if (c->count_modes > FV_KMS_MODES) c->count_modes = 0; /* none was written */
    if (c->count_encoders > FV_KMS_OBJECTS) c->count_encoders = 0;
    return failed;
}

bool fv_kms_connected(struct fv_kms *k)
{
    for (int s = 0; s < k->screens; s++)
        if (look_at(k, k->screen[s].connector, false) < 0 || k->found.connection == DISCONNECTED) return false;
    return true;
}

static int read_resources(struct fv_kms *k, struct fv_error *error)
{
    struct drm_mode_card_res *r = &k->resources;
    *r = (struct drm_mode_card_res){.crtc_id_ptr = (uintptr_t)k->crtcs,
                                    .count_crtcs = FV_KMS_OBJECTS,
                                    .connector_id_ptr = (uintptr_t)k->connectors,
                                    .count_connectors = FV_KMS_OBJECTS};
    int failed = control(k, DRM_IOCTL_MODE_GETRESOURCES, r);
    if (failed < 0 || r->count_connectors == 0 || r->count_crtcs == 0)
        return fv_error_set(error, "%s: drives no displays; display.device must name a card that does", k->path);
    if (r->count_connectors > FV_KMS_OBJECTS) r->count_connectors = FV_KMS_OBJECTS;
    if (r->count_crtcs > FV_KMS_OBJECTS) r->count_crtcs = FV_KMS_OBJECTS;
    return 0;
}

/* The connector of a screen: the one that is named, else the first that a display is plugged into. Leaves what is
 * known of it in k->found. */
static int find_connector(struct fv_kms *k, int s, struct fv_error *error)
{
    const char *wanted = k->settings.connector[s];
    char all[160] = "", name[FV_KMS_NAME];
    for (uint32_t i = 0; i < k->resources.count_connectors; i++) {
        if (look_at(k, k->connectors[i], true) < 0) continue;
        fv_kms_connector_name(k->found.connector_type, k->found.connector_type_id, name);
        bool plugged = wanted[0] ? k->found.connection != DISCONNECTED : k->found.connection == CONNECTED;
        bool right = !wanted[0] || strcmp(wanted, name) == 0;
        size_t used = strlen(all);
        snprintf(all + used, sizeof all - used, " %s (%s)", name, plugged ? "connected" : "nothing plugged in");
        if (!right) continue;
        if (plugged && k->found.count_modes > 0) {
            struct fv_kms_screen *screen = &k->screen[s];
            memcpy(screen->name, name, sizeof name);
            screen->connector = k->connectors[i];
            return 0;
        }
        if (wanted[0])
            return fv_error_set(error, "%s: %s: no display is plugged in%s", k->path, name, plugged ? " that says its modes" : "");
    }
    if (wanted[0]) return fv_error_set(error, "%s: has no connector %s; there are:%s", k->path, wanted, all);
    return fv_error_set(error, "%s: no display is plugged in; connectors are:%s", k->path, all);
}

static bool sized(const struct drm_mode_modeinfo *m, int width, int height)
{
    return m->hdisplay == width && m->vdisplay == height && !(m->flags & DRM_MODE_FLAG_INTERLACE);
}

/* The mode of a size whose rate is nearest, the first of equals; NULL: there is none. */
static const struct drm_mode_modeinfo *nearest(const struct fv_kms *k, int width, int height, double hz)
{
    const struct drm_mode_modeinfo *best = NULL;
    for (uint32_t i = 0; i < k->found.count_modes; i++) {
        const struct drm_mode_modeinfo *m = &k->modes[i];
        if (!sized(m, width, height)) continue;
        if (!best || fabs(fv_kms_mode_hz(m) - hz) < fabs(fv_kms_mode_hz(best) - hz) - 1e-3) best = m;
    }
    return best;
}

/* The display's own size, at the rate of the frames where it has it. */
static const struct drm_mode_modeinfo *preferred(const struct fv_kms *k)
{
    const struct drm_mode_modeinfo *own = &k->modes[0];
    for (uint32_t i = k->found.count_modes; i-- > 0;)
        if (k->modes[i].type & DRM_MODE_TYPE_PREFERRED) own = &k->modes[i];
    const struct drm_mode_modeinfo *m = nearest(k, own->hdisplay, own->vdisplay, k->settings.hz);
    return m && fabs(fv_kms_mode_hz(m) - k->settings.hz) < 0.01 * k->settings.hz ? m : own;
}

static int no_such_mode(const struct fv_kms *k, const struct fv_kms_screen *screen, struct fv_error *error)
{
    char all[256] = "";
    for (uint32_t i = 0; i < k->found.count_modes; i++) {
        size_t used = strlen(all);
        if (used > sizeof all - 24) break;
        snprintf(all + used, sizeof all - used, " %dx%d@%.3g", k->modes[i].hdisplay, k->modes[i].vdisplay,
                 fv_kms_mode_hz(&k->modes[i]));
    }
    return fv_error_set(error, "%s: %s has no such mode as display.mode says; it has:%s", k->path, screen->name, all);
}

static int pick_mode(struct fv_kms *k, struct fv_kms_screen *screen, struct fv_error *error)
{
    const struct fv_kms_settings *w = &k->settings;
    const struct drm_mode_modeinfo *m;
    if (w->mode_width > 0) {
        m = nearest(k, w->mode_width, w->mode_height, w->mode_hz > 0 ? w->mode_hz : w->hz);
        if (!m || (w->mode_hz > 0 && fabs(fv_kms_mode_hz(m) - w->mode_hz) > 1)) return no_such_mode(k, screen, error);
    } else {
        m = nearest(k, k->screens > 1 ? w->width : w->eyes * w->width, w->height, w->hz);
        if (!m) m = preferred(k);
    }
    screen->mode = *m;
    return 0;
}

static bool taken(const struct fv_kms *k, int s, uint32_t crtc)
{
    for (int i = 0; i < s; i++)
        if (k->screen[i].crtc == crtc) return true;
    return false;
}

static int index_of(const struct fv_kms *k, uint32_t crtc)
{
    for (uint32_t i = 0; i < k->resources.count_crtcs; i++)
        if (k->crtcs[i] == crtc) return (int)i;
    return -1;
}

/* One of the possible CRTCs that shows nothing, else any that is not taken; -1: there is none. */
static int other_crtc(const struct fv_kms *k, int s, uint32_t possible)
{
    int best = -1;
    for (int i = 0; i < (int)k->resources.count_crtcs && i < 32; i++) {
        struct drm_mode_crtc crtc = {.crtc_id = k->crtcs[i]};
        if (!(possible >> i & 1) || taken(k, s, crtc.crtc_id)) continue;
        if (control(k, DRM_IOCTL_MODE_GETCRTC, &crtc) >= 0 && !crtc.mode_valid) return i;
        if (best < 0) best = i;
    }
    return best;
}

/* The CRTC that feeds the connector already, where there is one. */
static int pick_crtc(struct fv_kms *k, int s, struct fv_error *error)
{
    struct fv_kms_screen *screen = &k->screen[s];
    struct drm_mode_get_encoder encoder = {.encoder_id = k->found.encoder_id};
    uint32_t possible = 0;
    int best = -1;
    if (encoder.encoder_id && control(k, DRM_IOCTL_MODE_GETENCODER, &encoder) >= 0 && encoder.crtc_id &&
        !taken(k, s, encoder.crtc_id))
        best = index_of(k, encoder.crtc_id);
    for (uint32_t i = 0; i < k->found.count_encoders; i++) {
        encoder = (struct drm_mode_get_encoder){.encoder_id = k->encoders[i]};
        if (control(k, DRM_IOCTL_MODE_GETENCODER, &encoder) >= 0) possible |= encoder.possible_crtcs;
    }
    if (best < 0) best = other_crtc(k, s, possible);
    if (best < 0)
        return fv_error_set(error, "%s: no CRTC is left for %s: other displays of this card use all", k->path,
                            screen->name);
    screen->crtc = k->crtcs[best];
    screen->crtc_index = best;
    return 0;
}

int fv_kms_pick(struct fv_kms *k, struct fv_error *error)
{
    if (read_resources(k, error)) return -1;
    k->screens = k->settings.connector[1][0] && k->settings.eyes > 1 ? 2 : 1;
    for (int s = 0; s < k->screens; s++)
        if (find_connector(k, s, error) || pick_mode(k, &k->screen[s], error) || pick_crtc(k, s, error)) return -1;
    const struct drm_mode_modeinfo *m = &k->screen[0].mode;
    k->nominal_ns = llround(1e9 / fmax(fv_kms_mode_hz(m), 1));
    double blank = m->vtotal > m->vdisplay ? 1 - (double)m->vdisplay / m->vtotal : 0;
    k->blank_ns = llround(blank * (double)k->nominal_ns);
    return 0;
}
