/* fake_drm: a made-up card behind struct fv_kms_io, on a made-up clock: two connectors and two CRTCs, of which the
 * first shows the console; what it offers and does wrong is set by the test. For tests only. */
#ifndef FV_TESTS_FAKE_DRM_H
#define FV_TESTS_FAKE_DRM_H

#include "display/kms.h"
#include "tests/support/program.h"

#include <drm_fourcc.h>
#include <errno.h>

enum {
    FAKE_CONNECTOR = 11, /* 11: HDMI-A-1, 12: DP-1 */
    FAKE_ENCODER = 21,
    FAKE_CRTC = 31,
    FAKE_PLANE = 41, /* primary ones of each CRTC; then an overlay */
    FAKE_PROPERTY = 100,
    FAKE_CONSOLE = 199, /* frame buffer that is shown before us */
    FAKE_FB = 200,
    FAKE_BUFFERS = 8,
    FAKE_BYTES = 1 << 17,
    FAKE_EVENTS = 8,
    FAKE_MODES = 5
};

static const char *const fake_properties[] = {"DPMS",    "CRTC_ID", "ACTIVE", "MODE_ID", "type",   "FB_ID",  "SRC_X", "SRC_Y",
                                              "SRC_W",   "SRC_H",   "CRTC_X", "CRTC_Y",  "CRTC_W", "CRTC_H", "rotation"};
enum { FAKE_PROPERTIES = sizeof fake_properties / sizeof fake_properties[0] };

static struct fake_drm {
    /* What it is. */
    bool card, connected[2], atomic, vblank, dumb, wallclock, no_crtc_ids, one_crtc, any_plane;
    int master;                    /* errno of another program's holding it; 0: none does */
    int open_fails, mode_fails, atomic_fails, flip_fails, read_fails; /* errno; 0: works */
    int busy;                      /* so many flips are refused yet */
    bool silent;                   /* flips never end */
    int64_t t_ns, period_ns, begun_ns;
    uint32_t number;               /* of the vertical blank at begun_ns */
    struct drm_mode_modeinfo mode[FAKE_MODES];
    int modes;
    /* What it was asked for. */
    int opened, mapped, blobs, waits, probes, commits, set_crtcs, flips;
    bool ours, console, atomic_asked;
    struct {
        bool used, fb;
        uint32_t width, height, pitch;
        uint8_t memory[FAKE_BYTES];
    } buffer[FAKE_BUFFERS];
    struct {
        uint32_t fb, next_fb; /* shown; flipped to */
        bool pending;
        struct drm_mode_modeinfo mode;
        bool on;
        uint32_t connector;
    } crtc[2];
    struct fake_event {
        int64_t due_ns;
        struct drm_event_vblank e;
    } event[FAKE_EVENTS];
    int events;
} fake;

static inline struct drm_mode_modeinfo fake_mode(int width, int height, int hz, uint32_t type)
{
    struct drm_mode_modeinfo m = {.hdisplay = (uint16_t)width, .vdisplay = (uint16_t)height, .type = type};
    m.htotal = (uint16_t)(width + 36);
    m.vtotal = (uint16_t)(height + height / 8);
    m.vrefresh = (uint32_t)hz;
    m.clock = (uint32_t)(m.htotal * m.vtotal * hz / 1000);
    return m;
}

/* A sound card: two displays of 64 x 32 at 90, 60 and 75 Hz, among other modes; the first shows the console. */
static inline void fake_plug(void)
{
    memset(&fake, 0, sizeof fake);
    fake.card = fake.connected[0] = fake.connected[1] = fake.atomic = fake.vblank = fake.dumb = true;
    fake.t_ns = fake.begun_ns = 5000000000;
    fake.number = 1000;
    fake.mode[0] = fake_mode(164, 48, 1000, 0);
    fake.mode[1] = fake_mode(264, 80, 500, DRM_MODE_TYPE_PREFERRED);
    fake.mode[2] = fake_mode(64, 32, 1000, 0);
    fake.mode[3] = fake_mode(64, 32, 500, 0);
    fake.mode[4] = fake_mode(32, 32, 500, 0);
    fake.modes = FAKE_MODES;
    fake.period_ns = 2000000;
    fake.crtc[0].fb = FAKE_CONSOLE;
    fake.crtc[0].mode = fake.mode[0];
    fake.crtc[0].on = true;
    fake.crtc[0].connector = FAKE_CONNECTOR;
}

static inline int fake_open(void *context, const char *path)
{
    (void)context;
    if (strcmp(path, "/dev/dri/card0") != 0 || !fake.card) return -ENOENT;
    if (fake.open_fails) return -fake.open_fails;
    assert_int_equal(fake.opened, 0);
    fake.opened++;
    return 7;
}

static inline void fake_close(void *context, int fd)
{
    (void)context;
    assert_int_equal(fd, 7);
    assert_false(fake.card && (fake.ours || fake.blobs)); /* given back before */
    for (int i = 0; i < FAKE_BUFFERS && fake.card; i++) assert_false(fake.buffer[i].used || fake.buffer[i].fb);
    fake.opened--;
    fake.events = fake.blobs = 0;
    for (int i = 0; i < FAKE_BUFFERS; i++) fake.buffer[i].used = fake.buffer[i].fb = false;
    fake.ours = fake.atomic_asked = false;
    fake.crtc[0].pending = fake.crtc[1].pending = false;
}

/* Copies a list as the kernel does: all of it where there is room, and its length in any case. */
static inline void fake_list(uint64_t to, uint32_t *count, const void *list, uint32_t length, size_t each)
{
    if (to && *count >= length) memcpy((void *)(uintptr_t)to, list, length * each);
    *count = length;
}

static inline int fake_connector(struct drm_mode_get_connector *c)
{
    unsigned i = c->connector_id - FAKE_CONNECTOR;
    uint32_t encoder = FAKE_ENCODER + i;
    if (i > 1) return -ENOENT;
    if (c->count_modes == 0) fake.probes++;
    c->connection = fake.connected[i] ? 1 : 2;
    c->connector_type = i ? DRM_MODE_CONNECTOR_DisplayPort : DRM_MODE_CONNECTOR_HDMIA;
    c->connector_type_id = 1;
    c->encoder_id = fake.crtc[i].connector == c->connector_id ? encoder : 0;
    fake_list(c->modes_ptr, &c->count_modes, fake.mode, fake.connected[i] ? (uint32_t)fake.modes : 0, sizeof fake.mode[0]);
    fake_list(c->encoders_ptr, &c->count_encoders, &encoder, 1, sizeof encoder);
    c->count_props = 0;
    return 0;
}

static inline int fake_resources(struct drm_mode_card_res *r)
{
    static const uint32_t connectors[] = {FAKE_CONNECTOR, FAKE_CONNECTOR + 1}, crtcs[] = {FAKE_CRTC, FAKE_CRTC + 1};
    fake_list(r->connector_id_ptr, &r->count_connectors, connectors, 2, sizeof connectors[0]);
    fake_list(r->crtc_id_ptr, &r->count_crtcs, crtcs, fake.one_crtc ? 1 : 2, sizeof crtcs[0]);
    return 0;
}

static inline int fake_object_properties(struct drm_mode_obj_get_properties *p)
{
    uint32_t ids[FAKE_PROPERTIES], count = 0;
    uint64_t values[FAKE_PROPERTIES] = {0};
    int first = 0, last = 1; /* of a connector */
    if (p->obj_type == DRM_MODE_OBJECT_CRTC) first = 2, last = 3;
    if (p->obj_type == DRM_MODE_OBJECT_PLANE) first = 4, last = FAKE_PROPERTIES - 1;
    for (int i = first; i <= last; i++) {
        values[count] = i == 4 ? (p->obj_id < FAKE_PLANE + 2) : 0;
        ids[count++] = (uint32_t)(FAKE_PROPERTY + i);
    }
    if (p->obj_type == DRM_MODE_OBJECT_PLANE) ids[count++] = FAKE_PROPERTY + 1; /* CRTC_ID, too */
    uint32_t room = p->count_props;
    fake_list(p->props_ptr, &p->count_props, ids, count, sizeof ids[0]);
    fake_list(p->prop_values_ptr, &room, values, count, sizeof values[0]);
    return 0;
}

static inline int fake_buffer_of(uint32_t fb)
{
    assert_true(fb >= FAKE_FB && fb < FAKE_FB + FAKE_BUFFERS && fake.buffer[fb - FAKE_FB].fb);
    return (int)(fb - FAKE_FB);
}

static inline int64_t fake_next_blank(void)
{
    return fake.t_ns + fake.period_ns - (fake.t_ns - fake.begun_ns) % fake.period_ns;
}

static inline void fake_event(int64_t due_ns, uint32_t crtc, uint64_t user)
{
    struct fake_event *e = &fake.event[fake.events++];
    assert_true(fake.events <= FAKE_EVENTS);
    int64_t t_ns = due_ns + (fake.wallclock ? 1700000000000000000 : 0);
    *e = (struct fake_event){.due_ns = due_ns};
    e->e.base = (struct drm_event){DRM_EVENT_FLIP_COMPLETE, sizeof e->e};
    e->e.user_data = user;
    e->e.tv_sec = (uint32_t)(t_ns / 1000000000);
    e->e.tv_usec = (uint32_t)(t_ns % 1000000000 / 1000);
    e->e.sequence = fake.vblank ? fake.number + (uint32_t)((due_ns - fake.begun_ns) / fake.period_ns) : 0;
    e->e.crtc_id = fake.no_crtc_ids ? 0 : crtc;
}

static inline int fake_flip(uint32_t crtc, uint32_t fb, uint64_t user)
{
    unsigned i = crtc - FAKE_CRTC;
    assert_true(i < 2);
    int buffer = fake_buffer_of(fb);
    if (!fake.crtc[i].on) return -EINVAL;
    assert_true(fake.buffer[buffer].width == fake.crtc[i].mode.hdisplay);
    assert_true(fb != fake.crtc[i].fb); /* never what is shown */
    if (fake.crtc[i].pending) return -EBUSY;
    fake.crtc[i].pending = true;
    fake.crtc[i].next_fb = fb;
    fake.flips++;
    if (!fake.silent) fake_event(fake.vblank ? fake_next_blank() : fake.t_ns, crtc, user);
    return 0;
}

static inline int fake_refusal(void)
{
    if (fake.flip_fails) return fake.flip_fails;
    return fake.busy > 0 ? (fake.busy--, EBUSY) : 0;
}

static inline int fake_set(uint32_t crtc, uint32_t connector, uint32_t fb, const struct drm_mode_modeinfo *mode)
{
    unsigned i = crtc - FAKE_CRTC;
    assert_true(i < 2);
    if (connector && !fake.connected[connector - FAKE_CONNECTOR]) return -EINVAL;
    if (fb && fb != FAKE_CONSOLE) fake_buffer_of(fb);
    fake.crtc[i].fb = fb;
    fake.crtc[i].on = mode != NULL;
    fake.crtc[i].connector = connector;
    if (mode) fake.crtc[i].mode = *mode;
    return 0;
}

/* A commit as the driver would check it: all that a mode needs, or one plane's buffer. */
static inline int fake_atomic(const struct drm_mode_atomic *a)
{
    const uint32_t *object = (const uint32_t *)(uintptr_t)a->objs_ptr, *count = (const uint32_t *)(uintptr_t)a->count_props_ptr,
                   *property = (const uint32_t *)(uintptr_t)a->props_ptr;
    const uint64_t *value = (const uint64_t *)(uintptr_t)a->prop_values_ptr;
    uint32_t fb[2] = {0}, connector[2] = {0}, blob[2] = {0};
    if (!fake.atomic_asked) return -EINVAL;
    bool mode = a->flags & DRM_MODE_ATOMIC_ALLOW_MODESET;
    int refused = mode ? (fake.atomic_fails ? fake.atomic_fails : fake.mode_fails) : fake_refusal();
    if (refused) return -refused;
    for (uint32_t o = 0, at = 0; o < a->count_objs; at += count[o++])
        for (uint32_t p = at; p < at + count[o]; p++) {
            const char *name = fake_properties[property[p] - FAKE_PROPERTY];
            unsigned plane = object[o] - FAKE_PLANE;
            if (strcmp(name, "FB_ID") == 0 && plane < 2) fb[plane] = (uint32_t)value[p];
            if (strcmp(name, "CRTC_ID") == 0 && object[o] < FAKE_CONNECTOR + 2) connector[value[p] - FAKE_CRTC] = object[o];
            if (strcmp(name, "MODE_ID") == 0) blob[object[o] - FAKE_CRTC] = (uint32_t)value[p];
            if (strcmp(name, "SRC_W") == 0) assert_int_equal(value[p] >> 16, fake.buffer[fake_buffer_of(fb[plane])].width);
        }
    if (!mode && !(a->flags & DRM_MODE_PAGE_FLIP_EVENT && a->flags & DRM_MODE_ATOMIC_NONBLOCK)) return -EINVAL;
    for (int i = 0; i < 2; i++) {
        assert_true(!mode || (!fb[i] == !connector[i] && !fb[i] == !blob[i]));
        int failed = !fb[i] ? 0
                     : mode ? fake_set((uint32_t)(FAKE_CRTC + i), connector[i], fb[i], &fake.mode[blob[i] - 1])
                            : fake_flip((uint32_t)(FAKE_CRTC + i), fb[i], a->user_data);
        if (failed) return failed;
    }
    fake.commits++;
    return 0;
}

static inline int fake_blob(struct drm_mode_create_blob *b)
{
    assert_int_equal(b->length, sizeof(struct drm_mode_modeinfo));
    for (int i = 0; i < fake.modes; i++)
        if (memcmp((const void *)(uintptr_t)b->data, &fake.mode[i], b->length) == 0) b->blob_id = (uint32_t)i + 1;
    assert_true(b->blob_id > 0);
    fake.blobs++;
    return 0;
}

static inline int fake_create(struct drm_mode_create_dumb *d)
{
    for (uint32_t i = 0; i < FAKE_BUFFERS; i++) {
        if (fake.buffer[i].used) continue;
        d->handle = i + 1;
        d->pitch = 4 * d->width + 64; /* rows apart */
        d->size = (uint64_t)d->pitch * d->height;
        assert_true(d->size <= FAKE_BYTES && d->bpp == 32);
        fake.buffer[i].used = true;
        fake.buffer[i].width = d->width, fake.buffer[i].height = d->height, fake.buffer[i].pitch = d->pitch;
        memset(fake.buffer[i].memory, 0xee, FAKE_BYTES);
        return 0;
    }
    return -ENOMEM;
}

static inline int fake_add(struct drm_mode_fb_cmd2 *f)
{
    unsigned i = f->handles[0] - 1;
    if (f->pixel_format != DRM_FORMAT_XRGB8888 || f->pitches[0] != fake.buffer[i].pitch) return -EINVAL;
    fake.buffer[i].fb = true;
    f->fb_id = FAKE_FB + i;
    return 0;
}

/* What shows a buffer that is taken away is turned off. */
static inline int fake_remove(uint32_t fb)
{
    fake.buffer[fake_buffer_of(fb)].fb = false;
    for (int i = 0; i < 2; i++)
        if (fake.crtc[i].fb == fb) fake_set((uint32_t)(FAKE_CRTC + i), 0, 0, NULL);
    return 0;
}

static inline int fake_vblank(union drm_wait_vblank *v)
{
    if (!fake.vblank) return -EOPNOTSUPP;
    int64_t t_ns = fake_next_blank() - fake.period_ns;
    v->reply.sequence = fake.number + (uint32_t)((t_ns - fake.begun_ns) / fake.period_ns);
    v->reply.tval_sec = t_ns / 1000000000;
    v->reply.tval_usec = t_ns % 1000000000 / 1000;
    return 0;
}

static inline int fake_capability(struct drm_get_cap *c)
{
    c->value = c->capability == DRM_CAP_DUMB_BUFFER ? fake.dumb : !fake.wallclock;
    return 0;
}

static inline int fake_get_crtc(struct drm_mode_crtc *c)
{
    unsigned i = c->crtc_id - FAKE_CRTC;
    if (i > 1) return -ENOENT;
    c->fb_id = fake.crtc[i].fb;
    c->mode_valid = fake.crtc[i].on;
    c->mode = fake.crtc[i].mode;
    return 0;
}

static inline int fake_set_crtc(const struct drm_mode_crtc *c)
{
    fake.set_crtcs++;
    if (fake.mode_fails && c->mode_valid) return -fake.mode_fails;
    uint32_t connector = c->count_connectors ? *(const uint32_t *)(uintptr_t)c->set_connectors_ptr : 0;
    assert_int_equal(c->mode_valid, c->count_connectors);
    return fake_set(c->crtc_id, connector, c->fb_id, c->mode_valid ? &c->mode : NULL);
}

static inline int fake_property(struct drm_mode_get_property *p)
{
    if (p->prop_id < FAKE_PROPERTY || p->prop_id >= FAKE_PROPERTY + FAKE_PROPERTIES) return -ENOENT;
    snprintf(p->name, sizeof p->name, "%s", fake_properties[p->prop_id - FAKE_PROPERTY]);
    return 0;
}

static inline int fake_plane(struct drm_mode_get_plane *p)
{
    unsigned i = p->plane_id - FAKE_PLANE;
    p->possible_crtcs = i > 1 || fake.any_plane ? 3 : 1u << i;
    p->crtc_id = i < 2 && fake.crtc[i].on ? FAKE_CRTC + i : 0;
    return 0;
}

static inline int fake_planes(struct drm_mode_get_plane_res *r)
{
    static const uint32_t planes[] = {FAKE_PLANE + 2, FAKE_PLANE, FAKE_PLANE + 1};
    fake_list(r->plane_id_ptr, &r->count_planes, planes, 3, sizeof planes[0]);
    return 0;
}

static inline int fake_control(void *context, int fd, unsigned long request, void *at)
{
    (void)context;
    assert_int_equal(fd, 7);
    assert_int_equal(fake.opened, 1);
    if (!fake.card) return -ENODEV;
    switch (request) {
    case DRM_IOCTL_GET_CAP: return fake_capability(at);
    case DRM_IOCTL_SET_CLIENT_CAP:
        if (((struct drm_set_client_cap *)at)->capability == DRM_CLIENT_CAP_ATOMIC && !fake.atomic) return -EOPNOTSUPP;
        if (((struct drm_set_client_cap *)at)->capability == DRM_CLIENT_CAP_ATOMIC) fake.atomic_asked = true;
        return 0;
    case DRM_IOCTL_SET_MASTER: fake.ours = !fake.master; return -fake.master;
    case DRM_IOCTL_DROP_MASTER: fake.ours = false; return 0;
    case DRM_IOCTL_VERSION: {
        struct drm_version *v = at;
        memcpy(v->name, "made up", v->name_len < 7 ? v->name_len : 7);
        return 0;
    }
    case DRM_IOCTL_WAIT_VBLANK: return fake_vblank(at);
    case DRM_IOCTL_MODE_GETRESOURCES: return fake_resources(at);
    case DRM_IOCTL_MODE_GETCONNECTOR: return fake_connector(at);
    case DRM_IOCTL_MODE_GETENCODER: {
        struct drm_mode_get_encoder *e = at;
        e->possible_crtcs = 3;
        e->crtc_id = 0;
        for (unsigned i = 0; i < 2; i++)
            if (fake.crtc[i].connector == e->encoder_id - FAKE_ENCODER + FAKE_CONNECTOR) e->crtc_id = FAKE_CRTC + i;
        return 0;
    }
    case DRM_IOCTL_MODE_GETCRTC: return fake_get_crtc(at);
    case DRM_IOCTL_MODE_SETCRTC: return fake.ours ? fake_set_crtc(at) : -EACCES;
    case DRM_IOCTL_MODE_GETPLANERESOURCES: return fake_planes(at);
    case DRM_IOCTL_MODE_GETPLANE: return fake_plane(at);
    case DRM_IOCTL_MODE_OBJ_GETPROPERTIES: return fake_object_properties(at);
    case DRM_IOCTL_MODE_GETPROPERTY: return fake_property(at);
    case DRM_IOCTL_MODE_CREATEPROPBLOB: return fake_blob(at);
    case DRM_IOCTL_MODE_DESTROYPROPBLOB: fake.blobs--; return 0;
    case DRM_IOCTL_MODE_ATOMIC: return fake.ours ? fake_atomic(at) : -EACCES;
    case DRM_IOCTL_MODE_CREATE_DUMB: return fake_create(at);
    case DRM_IOCTL_MODE_ADDFB2: return fake_add(at);
    case DRM_IOCTL_MODE_MAP_DUMB:
        ((struct drm_mode_map_dumb *)at)->offset = (((struct drm_mode_map_dumb *)at)->handle - 1) * (uint64_t)FAKE_BYTES;
        return 0;
    case DRM_IOCTL_MODE_RMFB: return fake_remove(*(uint32_t *)at);
    case DRM_IOCTL_MODE_DESTROY_DUMB: fake.buffer[((struct drm_mode_destroy_dumb *)at)->handle - 1].used = false; return 0;
    case DRM_IOCTL_MODE_PAGE_FLIP: {
        const struct drm_mode_crtc_page_flip *f = at;
        int refused = fake_refusal();
        return refused ? -refused : fake.ours ? fake_flip(f->crtc_id, f->fb_id, f->user_data) : -EACCES;
    }
    default: return -ENOTTY;
    }
}

static inline void *fake_map(void *context, int fd, size_t bytes, uint64_t offset)
{
    (void)context, (void)fd;
    assert_true(bytes <= FAKE_BYTES);
    fake.mapped++;
    return fake.buffer[offset / FAKE_BYTES].memory;
}

static inline void fake_unmap(void *context, void *at, size_t bytes)
{
    (void)context, (void)at, (void)bytes;
    fake.mapped--;
}

/* Hands out one event a call, once it is due. */
static inline int fake_read(void *context, int fd, void *bytes, size_t size)
{
    (void)context, (void)fd;
    if (fake.read_fails) return -fake.read_fails;
    if (!fake.card || fake.events == 0 || fake.event[0].due_ns > fake.t_ns) return -EAGAIN;
    struct drm_event_vblank e = fake.event[0].e;
    memmove(fake.event, fake.event + 1, sizeof fake.event[0] * (size_t)--fake.events);
    assert_true(size >= sizeof e);
    for (unsigned i = 0; i < 2; i++) {
        bool this = fake.no_crtc_ids ? e.user_data == i : e.crtc_id == FAKE_CRTC + i;
        if (!this || !fake.crtc[i].pending) continue;
        fake.crtc[i].pending = false;
        fake.crtc[i].fb = fake.crtc[i].next_fb;
    }
    memcpy(bytes, &e, sizeof e);
    return (int)sizeof e;
}

static inline void fake_wait(void *context, int fd, int64_t timeout_ns)
{
    (void)context, (void)fd;
    int64_t until_ns = fake.t_ns + timeout_ns;
    if (fake.events && fake.event[0].due_ns < until_ns) until_ns = fake.event[0].due_ns;
    if (until_ns > fake.t_ns) fake.t_ns = until_ns;
    fake.waits++;
}

static inline void fake_console(void *context, bool graphics)
{
    (void)context;
    assert_true(fake.console != graphics);
    fake.console = graphics;
}

static inline int64_t fake_now(void *context)
{
    (void)context;
    return fake.t_ns;
}

static const struct fv_kms_io fake_io = {fake_open, fake_close, fake_control, fake_map, fake_unmap,
                                         fake_read, fake_wait,  fake_console, fake_now, NULL};

/* All that was asked for was given back. */
static inline void fake_left(void)
{
    assert_true(fake.opened == 0 && fake.mapped == 0 && !fake.ours && !fake.console);
}

#endif
