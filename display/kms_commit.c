/* kms_commit: modes and flips, by the atomic interface or the legacy one; see kms.h. Both screens go in one commit, so
 * that both eyes change together; the legacy interface takes them one after the other. */
#include "display/kms.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

enum { OBJECTS = 3 * FV_KMS_SCREENS, ENTRIES = FV_KMS_PROPERTIES * FV_KMS_SCREENS, PLANE_PRIMARY = 1 };

/* By enum fv_kms_property. */
static const struct {
    uint32_t of; /* DRM_MODE_OBJECT_* */
    const char *name;
} properties[FV_KMS_PROPERTIES] = {
    {DRM_MODE_OBJECT_CONNECTOR, "CRTC_ID"}, {DRM_MODE_OBJECT_CRTC, "MODE_ID"}, {DRM_MODE_OBJECT_CRTC, "ACTIVE"},
    {DRM_MODE_OBJECT_PLANE, "FB_ID"},       {DRM_MODE_OBJECT_PLANE, "CRTC_ID"}, {DRM_MODE_OBJECT_PLANE, "SRC_X"},
    {DRM_MODE_OBJECT_PLANE, "SRC_Y"},       {DRM_MODE_OBJECT_PLANE, "SRC_W"},  {DRM_MODE_OBJECT_PLANE, "SRC_H"},
    {DRM_MODE_OBJECT_PLANE, "CRTC_X"},      {DRM_MODE_OBJECT_PLANE, "CRTC_Y"}, {DRM_MODE_OBJECT_PLANE, "CRTC_W"},
    {DRM_MODE_OBJECT_PLANE, "CRTC_H"},
};

/* An atomic commit under way: values by object. */
struct request {
    int objects, entries;
    uint32_t object[OBJECTS], count[OBJECTS], property[ENTRIES];
    uint64_t value[ENTRIES];
};

static int control(const struct fv_kms *k, unsigned long request, void *argument)
{
    return k->io->control(k->io->context, k->fd, request, argument);
}

/* The id of a property of an object by its name, and its value; 0: it has none. */
static uint32_t property_of(struct fv_kms *k, uint32_t object, uint32_t type, const char *name, uint64_t *value)
{
    uint64_t values[FV_KMS_OBJECTS];
    struct drm_mode_obj_get_properties all = {.props_ptr = (uintptr_t)k->ids,
                                              .prop_values_ptr = (uintptr_t)values,
                                              .count_props = FV_KMS_OBJECTS,
                                              .obj_id = object,
                                              .obj_type = type};
    if (control(k, DRM_IOCTL_MODE_OBJ_GETPROPERTIES, &all) < 0 || all.count_props > FV_KMS_OBJECTS) return 0;
    for (uint32_t i = 0; i < all.count_props; i++) {
        struct drm_mode_get_property p = {.prop_id = k->ids[i]};
        if (control(k, DRM_IOCTL_MODE_GETPROPERTY, &p) < 0 || strncmp(p.name, name, sizeof p.name) != 0) continue;
        *value = values[i];
        return k->ids[i];
    }
    return 0;
}

static bool is_taken(const struct fv_kms *k, int s, uint32_t plane)
{
    for (int i = 0; i < s; i++)
        if (k->screen[i].plane == plane) return true;
    return false;
}

/* A primary plane for the CRTC of screen s: the one that it shows, where several may be, else one that is idle, else any
 * that no other screen has; 0: none can be found. */
static uint32_t plane_of(struct fv_kms *k, int s)
{
    const struct fv_kms_screen *screen = &k->screen[s];
    uint32_t planes[FV_KMS_OBJECTS], idle = 0, any = 0;
    struct drm_mode_get_plane_res all = {.plane_id_ptr = (uintptr_t)planes, .count_planes = FV_KMS_OBJECTS};
    if (control(k, DRM_IOCTL_MODE_GETPLANERESOURCES, &all) < 0 || all.count_planes > FV_KMS_OBJECTS) return 0;
    for (uint32_t i = 0; i < all.count_planes; i++) {
        struct drm_mode_get_plane plane = {.plane_id = planes[i]};
        uint64_t type = 0;
        if (control(k, DRM_IOCTL_MODE_GETPLANE, &plane) < 0 || !(plane.possible_crtcs >> screen->crtc_index & 1) ||
            is_taken(k, s, planes[i]))
            continue;
        if (!property_of(k, planes[i], DRM_MODE_OBJECT_PLANE, "type", &type) || type != PLANE_PRIMARY) continue;
        if (plane.crtc_id == screen->crtc) return planes[i];
        if (!plane.crtc_id && !idle) idle = planes[i];
        if (!any) any = planes[i];
    }
    return idle ? idle : any;
}

void fv_kms_find_properties(struct fv_kms *k)
{
    for (int s = 0; s < k->screens && k->atomic; s++) {
        struct fv_kms_screen *screen = &k->screen[s];
        screen->plane = plane_of(k, s);
        if (!screen->plane) k->atomic = false;
        for (int p = 0; p < FV_KMS_PROPERTIES && k->atomic; p++) {
            uint32_t of = properties[p].of;
            uint32_t object = of == DRM_MODE_OBJECT_CONNECTOR ? screen->connector
                              : of == DRM_MODE_OBJECT_CRTC    ? screen->crtc
                                                              : screen->plane;
            uint64_t value;
            screen->property[p] = property_of(k, object, of, properties[p].name, &value);
            if (!screen->property[p]) k->atomic = false;
        }
    }
}

static void begin(struct request *r, uint32_t object)
{
    r->object[r->objects] = object;
    r->count[r->objects++] = 0;
}

static void add(struct request *r, const struct fv_kms_screen *screen, enum fv_kms_property property, uint64_t value)
{
    r->property[r->entries] = screen->property[property];
    r->value[r->entries++] = value;
    r->count[r->objects - 1]++;
}

static int commit(struct fv_kms *k, const struct request *r, uint32_t flags)
{
    struct drm_mode_atomic a = {.flags = flags,
                                .count_objs = (uint32_t)r->objects,
                                .objs_ptr = (uintptr_t)r->object,
                                .count_props_ptr = (uintptr_t)r->count,
                                .props_ptr = (uintptr_t)r->property,
                                .prop_values_ptr = (uintptr_t)r->value};
    return control(k, DRM_IOCTL_MODE_ATOMIC, &a);
}

static void destroy_blobs(struct fv_kms *k)
{
    for (int s = 0; s < k->screens; s++) {
        struct drm_mode_destroy_blob blob = {k->screen[s].mode_blob};
        if (blob.blob_id) control(k, DRM_IOCTL_MODE_DESTROYPROPBLOB, &blob);
        k->screen[s].mode_blob = 0;
    }
}

static int set_atomic(struct fv_kms *k, int buffer)
{
    struct request r = {0};
    for (int s = 0; s < k->screens; s++) {
        struct fv_kms_screen *screen = &k->screen[s];
        struct drm_mode_create_blob blob = {.data = (uintptr_t)&screen->mode, .length = sizeof screen->mode};
        int failed = control(k, DRM_IOCTL_MODE_CREATEPROPBLOB, &blob);
        if (failed < 0) return failed;
        screen->mode_blob = blob.blob_id;
        uint64_t width = screen->mode.hdisplay, height = screen->mode.vdisplay;
        begin(&r, screen->connector);
        add(&r, screen, FV_KMS_CONNECTOR_CRTC, screen->crtc);
        begin(&r, screen->crtc);
        add(&r, screen, FV_KMS_CRTC_MODE, blob.blob_id);
        add(&r, screen, FV_KMS_CRTC_ACTIVE, 1);
        begin(&r, screen->plane);
        const uint64_t value[] = {screen->buffer[buffer].id, screen->crtc, 0, 0, width << 16, height << 16, 0, 0, width, height};
        for (int p = FV_KMS_PLANE_FB; p < FV_KMS_PROPERTIES; p++)
            add(&r, screen, (enum fv_kms_property)p, value[p - FV_KMS_PLANE_FB]);
    }
    return commit(k, &r, DRM_MODE_ATOMIC_ALLOW_MODESET);
}

static int set_legacy(struct fv_kms *k, int buffer)
{
    for (int s = 0; s < k->screens; s++) {
        struct fv_kms_screen *screen = &k->screen[s];
        struct drm_mode_crtc crtc = {.set_connectors_ptr = (uintptr_t)&screen->connector,
                                     .count_connectors = 1,
                                     .crtc_id = screen->crtc,
                                     .fb_id = screen->buffer[buffer].id,
                                     .mode_valid = 1,
                                     .mode = screen->mode};
        int failed = control(k, DRM_IOCTL_MODE_SETCRTC, &crtc);
        if (failed < 0 && s > 0) fv_kms_restore(k); /* that of the first is set by now */
        if (failed < 0) return failed;
    }
    return 0;
}

int fv_kms_set_mode(struct fv_kms *k, int buffer)
{
    int failed = k->atomic ? set_atomic(k, buffer) : -EINVAL;
    destroy_blobs(k); /* the mode that was set keeps what it needs */
    if (failed >= 0) return 0;
    /* A driver may offer the atomic interface and then refuse what the legacy one does; a display that is gone, or
     * another's, is so for both. */
    if (k->atomic && failed != -EINVAL && failed != -EOPNOTSUPP && failed != -ERANGE) return failed;
    k->atomic = false;
    failed = set_legacy(k, buffer);
    return failed < 0 ? failed : 0;
}

static int flip_legacy(struct fv_kms *k, int buffer)
{
    int done = 0;
    for (int s = 0; s < k->screens; s++) {
        struct fv_kms_screen *screen = &k->screen[s];
        if (screen->pending) continue; /* went through before the other was refused */
        struct drm_mode_crtc_page_flip flip = {.crtc_id = screen->crtc,
                                               .fb_id = screen->buffer[buffer].id,
                                               .flags = DRM_MODE_PAGE_FLIP_EVENT,
                                               .user_data = (uint64_t)s};
        int failed = control(k, DRM_IOCTL_MODE_PAGE_FLIP, &flip);
        if (failed < 0) done = failed;
        else screen->pending = true;
    }
    return done;
}

int fv_kms_flip(struct fv_kms *k, int buffer)
{
    if (!k->atomic) return flip_legacy(k, buffer);
    struct request r = {0};
    for (int s = 0; s < k->screens; s++) {
        begin(&r, k->screen[s].plane);
        add(&r, &k->screen[s], FV_KMS_PLANE_FB, k->screen[s].buffer[buffer].id);
    }
    int failed = commit(k, &r, DRM_MODE_ATOMIC_NONBLOCK | DRM_MODE_PAGE_FLIP_EVENT);
    for (int s = 0; s < k->screens && failed >= 0; s++) k->screen[s].pending = true;
    return failed < 0 ? failed : 0;
}

void fv_kms_remember(struct fv_kms *k)
{
    for (int s = 0; s < k->screens; s++) {
        struct fv_kms_screen *screen = &k->screen[s];
        struct fv_kms_before *b = &screen->before;
        struct drm_mode_get_connector connector = {.connector_id = screen->connector, .count_modes = 1,
                                                   .modes_ptr = (uintptr_t)k->modes};
        if (b->known) continue; /* lost since, and back: the first look counts */
        *b = (struct fv_kms_before){.crtc = {.crtc_id = screen->crtc}};
        b->known = control(k, DRM_IOCTL_MODE_GETCRTC, &b->crtc) >= 0;
        if (control(k, DRM_IOCTL_MODE_GETCONNECTOR, &connector) < 0) continue;
        struct drm_mode_get_encoder encoder = {.encoder_id = connector.encoder_id};
        if (encoder.encoder_id && control(k, DRM_IOCTL_MODE_GETENCODER, &encoder) >= 0 && encoder.crtc_id == screen->crtc)
            b->connector = screen->connector;
    }
}

/* The legacy interface sets a mode of any driver in one call; what cannot be had back is turned off, and the kernel
 * puts its console there once the card is closed. */
void fv_kms_restore(struct fv_kms *k)
{
    for (int s = 0; s < k->screens; s++) {
        const struct fv_kms_before *b = &k->screen[s].before;
        struct drm_mode_crtc crtc = b->crtc, off = {.crtc_id = k->screen[s].crtc};
        crtc.set_connectors_ptr = (uintptr_t)&b->connector;
        crtc.count_connectors = 1;
        bool showed = b->known && b->connector && b->crtc.mode_valid && b->crtc.fb_id && b->crtc.crtc_id == off.crtc_id;
        if (!showed || control(k, DRM_IOCTL_MODE_SETCRTC, &crtc) < 0) control(k, DRM_IOCTL_MODE_SETCRTC, &off);
    }
}
