/* kms_faults: each way in which a display on a made-up card fails, by the atomic interface and the legacy one, and the
 * way back; events that cannot be. */
#define _GNU_SOURCE
#include "display/kms.h"

#include "tests/support/fake_screen.h"
#include "tests/support/random.h"

#define COUNT(table) (sizeof table / sizeof table[0])

static void busy(void **state)
{
    (void)state;
    for (int legacy = 0; legacy < 2; legacy++) {
        struct fv_kms_settings w = wishes();
        fake_plug();
        fake.atomic = !legacy;
        opened(&w);
        assert_int_equal(present(1), FV_KMS_NOTHING);
        fake.busy = 2;
        assert_int_equal(present(2), FV_KMS_NOTHING);
        settle();
        assert_true(kms.counts.busy == 2 && kms.counts.flips == 2 && kms.counts.dropped == 0);
        fake.busy = 1000; /* for good: the picture is dropped, the loop goes on */
        int64_t begun_ns = fake.t_ns;
        assert_int_equal(present(3), FV_KMS_NOTHING);
        assert_true(fake.t_ns - begun_ns < 3 * fake.period_ns && kms.counts.dropped == 1 && kms.counts.lost == 0);
        assert_int_equal(shown(0, 0, 0), expected(0, 0, 0, 2));
        fake.busy = 0;
        assert_int_equal(present(4), FV_KMS_NOTHING);
        settle();
        assert_int_equal(shown(0, 0, 0), expected(0, 0, 0, 4));
        closed();
    }
}

/* The atomic interface is offered, but sets no mode: the legacy one does. */
static void atomic_refused(void **state)
{
    (void)state;
    struct fv_kms_settings w = wishes();
    fake_plug();
    fake.atomic_fails = EINVAL;
    opened(&w);
    assert_true(!kms.atomic && strstr(kms.text, "legacy"));
    assert_int_equal(present(1), FV_KMS_NOTHING);
    settle();
    assert_true(shown(0, 0, 0) == expected(0, 0, 0, 1) && fake.commits == 0);
    closed();
}

/* Drivers without vertical blank: nothing is waited for, whether they say that they flipped or not. */
static void no_blank(void **state)
{
    (void)state;
    for (int silent = 0; silent < 2; silent++) {
        struct fv_kms_settings w = wishes();
        struct fv_beat beat;
        fake_plug();
        fake.vblank = false;
        opened(&w);
        assert_non_null(strstr(kms.text, "no vertical blank: paced by the clock"));
        fake.silent = silent;
        int64_t begun_ns = fake.t_ns;
        for (int frame = 0; frame < 50; frame++) {
            assert_int_equal(present(frame), FV_KMS_NOTHING);
            if (silent) fake.crtc[0].pending = false, fake.crtc[0].fb = fake.crtc[0].next_fb;
        }
        assert_true(kms.counts.flips >= 49 && kms.counts.skipped == 0 && kms.counts.lost == 0);
        assert_true(fake.t_ns - begun_ns <= (silent ? 50 : 0) * fake.period_ns);
        assert_false(fv_kms_beat(&kms, &beat));
        closed();
    }
}

/* Presents for a while, a frame each 4 ms; returns how often something was said. */
static int presented(int64_t for_ns, enum fv_kms_event event)
{
    int said = 0;
    for (int64_t until_ns = fake.t_ns + for_ns; fake.t_ns < until_ns; fake.t_ns += 4 * ms) {
        enum fv_kms_event now = present(1);
        if (now != FV_KMS_NOTHING && now != event) fail_msg("%s", kms.text);
        said += now != FV_KMS_NOTHING;
    }
    return said;
}

/* Each way to lose a display: said once, looked for, and back with its mode set and the same way out. */
static void lost_and_back(void **state)
{
    (void)state;
    static const char *const why[] = {"unplugged", "No such device", "Permission denied", "a flip was never over",
                                      "Input/output error", "Invalid argument"};
    for (unsigned i = 0; i < COUNT(why) * 2; i++) {
        struct fv_kms_settings w = wishes();
        unsigned way = i / 2;
        fake_plug();
        fake.atomic = i % 2;
        opened(&w);
        assert_int_equal(presented(100 * ms, FV_KMS_NOTHING), 0);
        int64_t flips = kms.counts.flips;
        if (way == 0) fake.connected[0] = fake.connected[1] = false;
        if (way == 1) fake.card = false, fake.flip_fails = ENODEV, fake.read_fails = ENODEV;
        if (way == 2) fake.flip_fails = EACCES, fake.master = EBUSY;
        if (way == 3) fake.silent = true, fake.connected[0] = fake.connected[1] = false;
        if (way == 4) fake.read_fails = EIO, fake.open_fails = EIO;
        if (way == 5) fake.flip_fails = EINVAL, fake.mode_fails = EIO;
        assert_int_equal(presented(3000 * ms, FV_KMS_LOST), 1);
        if (!strstr(kms.text, why[way]) || !strstr(kms.text, "/dev/dri/card0: display lost")) fail_msg("%s", kms.text);
        assert_true(kms.counts.lost == 1 && kms.fd < 0 && fake.opened == 0 && fake.mapped == 0 && fake.console);
        struct fv_beat beat;
        assert_false(fv_kms_beat(&kms, &beat));
        fake.card = fake.connected[0] = fake.connected[1] = true;
        fake.flip_fails = fake.read_fails = fake.open_fails = fake.mode_fails = fake.master = 0;
        fake.silent = false;
        assert_int_equal(presented(1500 * ms, FV_KMS_BACK), 1);
        assert_true(kms.counts.back == 1 && kms.counts.lost == 1 && kms.counts.flips > flips + 50);
        assert_non_null(strstr(kms.text, "64x32"));
        assert_true(fv_kms_beat(&kms, &beat) && beat.flip_ns <= fake.t_ns);
        settle();
        assert_int_equal(shown(0, 3, 2), expected(0, 3, 2, 1));
        closed();
    }
}

/* While it is gone nothing is waited for, and it is looked for ever less often: once a second at last. */
static void gone(void **state)
{
    (void)state;
    struct fv_kms_settings w = wishes();
    fake_plug();
    opened(&w);
    fake.connected[0] = fake.connected[1] = false;
    presented(1000 * ms, FV_KMS_LOST);
    int probes = fake.probes, waits = fake.waits;
    assert_int_equal(presented(20000 * ms, FV_KMS_NOTHING), 0);
    assert_in_range(fake.probes - probes, 2 * 18, 2 * 22);
    assert_int_equal(fake.waits, waits);
    assert_true(kms.counts.dropped >= 5000);
    fv_kms_close(&kms);
    assert_true(fake.opened == 0 && !fake.console);
    fv_kms_close(&kms); /* once more: nothing */
}

/* Closed with a flip under way: it is waited for, not longer than a display takes. */
static void closed_in_flight(void **state)
{
    (void)state;
    struct fv_kms_settings w = wishes();
    fake_plug();
    opened(&w);
    assert_int_equal(present(1), FV_KMS_NOTHING);
    closed();
    assert_int_equal(kms.counts.flips, 1);
    fake_plug();
    opened(&w);
    fake.silent = true;
    assert_int_equal(present(1), FV_KMS_NOTHING);
    int64_t begun_ns = fake.t_ns;
    closed();
    assert_true(fake.t_ns - begun_ns <= 600 * ms);
}

/* A loop that stands still for seconds: the time that is asked for then and the number of the next flip do not meet. */
static void stood_still(void **state)
{
    (void)state;
    struct fv_kms_settings w = wishes();
    struct fv_beat beat;
    fake_plug();
    opened(&w);
    assert_int_equal(presented(100 * ms, FV_KMS_NOTHING), 0);
    settle();
    int64_t skipped = kms.counts.skipped;
    fake.t_ns += 2500 * ms;
    assert_true(fv_kms_beat(&kms, &beat) && beat.flip_ns > fake.t_ns - 2 * fake.period_ns);
    assert_int_equal(presented(100 * ms, FV_KMS_NOTHING), 0);
    assert_true(kms.vsync.odd == 0 && kms.vsync.count > 40 && kms.counts.skipped > skipped + 1000);
    closed();
}

/* Modes by the legacy interface, of which the second is refused; and a first card whose modes are refused, and whose
 * screens show something else. */
static int refused_modes, first_card;
static int refusing(void *context, int fd, unsigned long request, void *at)
{
    struct drm_mode_crtc *crtc = at;
    if (first_card && request == DRM_IOCTL_MODE_GETCRTC) {
        int failed = fake_control(context, fd, request, at);
        crtc->fb_id = 777;
        return failed;
    }
    bool mode = request == DRM_IOCTL_MODE_SETCRTC && crtc->mode_valid && crtc->fb_id != FAKE_CONSOLE && crtc->fb_id != 777;
    if (mode && (first_card || ++refused_modes == 2)) return -ENOSPC;
    if (crtc && request == DRM_IOCTL_MODE_SETCRTC && crtc->fb_id == 777 && first_card) return 0;
    return fake_control(context, fd, request, at);
}

static int open_either(void *context, const char *path)
{
    first_card = strcmp(path, "/dev/dri/card0") == 0;
    return first_card || strcmp(path, "/dev/dri/card1") == 0 ? fake_open(context, "/dev/dri/card0") : -ENOENT;
}

static void refused_in_part(void **state)
{
    (void)state;
    struct fv_kms_settings w = wishes();
    struct fv_kms_io io = fake_io;
    io.control = refusing;
    refused_modes = first_card = 0;
    fake_plug();
    fake.atomic = false;
    strcpy(w.connector[1], "DP-1");
    assert_int_equal(fv_kms_open(&kms, &w, &io, &error), -1);
    fake_left();
    assert_true(fake.crtc[0].on && fake.crtc[0].fb == FAKE_CONSOLE && fake.crtc[0].mode.hdisplay == 164 && !fake.crtc[1].on);
    fake_plug();
    fake.atomic = false;
    io.open = open_either;
    w = wishes();
    refused_modes = 2;
    assert_int_equal(fv_kms_open(&kms, &w, &io, &error), 0);
    assert_string_equal(kms.path, "/dev/dri/card1");
    closed();
}

/* Events that nobody waits for, of no CRTC of ours, or cut off. */
static uint8_t bytes[256];
static int bytes_wait;
static int read_bytes(void *context, int fd, void *to, size_t size)
{
    (void)context, (void)fd, (void)size;
    int n = bytes_wait;
    memcpy(to, bytes, (size_t)n);
    bytes_wait = 0;
    return n ? n : -EAGAIN;
}

static void odd_events(void **state)
{
    (void)state;
    struct fv_kms_settings w = wishes();
    struct fv_kms_io io = fake_io;
    fake_plug();
    io.read = read_bytes;
    assert_int_equal(fv_kms_open(&kms, &w, &io, &error), 0);
    struct drm_event_vblank e = {{DRM_EVENT_FLIP_COMPLETE, sizeof e}, UINT64_MAX, 0, 0, 3, 99};
    struct fv_beat beat;
    for (int i = 0; i < 6; i++) {
        int64_t before = kms.counts.odd;
        e.base.type = i == 5 ? 0x70000000 : DRM_EVENT_FLIP_COMPLETE;
        e.base.length = i == 1 ? 0 : i == 2 ? 7 : i == 3 ? 4000 : i == 4 ? 12 : sizeof e;
        memcpy(bytes, &e, sizeof e);
        bytes_wait = sizeof e;
        fv_kms_beat(&kms, &beat);
        if (kms.counts.odd - before != (i < 5)) fail_msg("%d: %lld", i, (long long)(kms.counts.odd - before));
    }
    uint64_t seed = 11;
    for (int i = 0; i < 20000; i++) { /* anything */
        for (int b = 0; b < (int)sizeof bytes; b++) bytes[b] = (uint8_t)random_bits(&seed);
        memset(bytes + 5, 0, 3);
        bytes_wait = 1 + (int)(random_bits(&seed) >> 56) % 255;
        fv_kms_beat(&kms, &beat);
    }
    assert_true(kms.counts.flips == 0 && kms.fd == 7);
    fv_kms_close(&kms);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(busy),
                                       cmocka_unit_test(atomic_refused),
                                       cmocka_unit_test(no_blank),
                                       cmocka_unit_test(lost_and_back),
                                       cmocka_unit_test(gone),
                                       cmocka_unit_test(closed_in_flight),
                                       cmocka_unit_test(stood_still),
                                       cmocka_unit_test(refused_in_part),
                                       cmocka_unit_test(odd_events)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
