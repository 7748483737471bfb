/* kms: a made-up card behind struct fv_kms_io: what is picked and refused, pictures pixel by pixel, flips and their
 * times, by the atomic interface and the legacy one. What fails later: kms_faults.c. */
#define _GNU_SOURCE
#include "display/kms.h"

#include "tests/support/fake_screen.h"
#include "tests/support/random.h"

#include <math.h>

#define COUNT(table) (sizeof table / sizeof table[0])

static void names(void **state)
{
    (void)state;
    char name[FV_KMS_NAME];
    static const struct {
        const char *text;
        int width, height;
        double hz;
    } modes[] = {{"1920x1080", 1920, 1080, 0}, {"2160x1200@90", 2160, 1200, 90}, {"2x3@59.94", 2, 3, 59.94}};
    static const char *const none[] = {"",     "1920",   "1920x", "0x5",    "5x-1", "5x5@",   "5x5@0",
                                       "5x5@-3", "5x5@9e9", "5x5@60Hz", "5x5p", "5x5@nan", "999999x2"};
    int width, height;
    double hz;
    for (unsigned i = 0; i < COUNT(modes); i++)
        assert_true(fv_kms_mode_read(modes[i].text, &width, &height, &hz) && width == modes[i].width &&
                    height == modes[i].height && hz == modes[i].hz);
    for (unsigned i = 0; i < COUNT(none); i++)
        if (fv_kms_mode_read(none[i], &width, &height, &hz)) fail_msg("'%s'", none[i]);
    fv_kms_connector_name(DRM_MODE_CONNECTOR_eDP, 1, name);
    assert_string_equal(name, "eDP-1");
    fv_kms_connector_name(DRM_MODE_CONNECTOR_VIRTUAL, 2, name);
    assert_string_equal(name, "Virtual-2");
    fv_kms_connector_name(4000, 3, name);
    assert_string_equal(name, "Unknown-3");
    /* CEA mode 16: 1080p60; a mode that says nothing of itself. */
    struct drm_mode_modeinfo hd = {.clock = 148500, .htotal = 2200, .vtotal = 1125}, unsaid = {.vrefresh = 50};
    assert_float_equal(fv_kms_mode_hz(&hd), 60, 1e-9);
    /* CEA mode 5: 1080i60, of 60 fields; 320x240 of a VGA, each line twice. */
    struct drm_mode_modeinfo fields = {.clock = 74250, .htotal = 2200, .vtotal = 1125, .flags = DRM_MODE_FLAG_INTERLACE};
    struct drm_mode_modeinfo twice = {.clock = 12588, .htotal = 400, .vtotal = 262, .flags = DRM_MODE_FLAG_DBLSCAN};
    assert_float_equal(fv_kms_mode_hz(&fields), 60, 1e-9);
    assert_float_equal(fv_kms_mode_hz(&twice), 60, 0.1);
    assert_float_equal(fv_kms_mode_hz(&unsaid), 50, 0);
}

static void copies(void **state)
{
    (void)state;
    uint64_t seed = 5;
    for (int width = 1; width < 70; width++) {
        enum { ROWS = 3, APART = 300, FROM = 304 }; /* rows begin at any multiple of 4 */
        uint8_t *from = malloc(ROWS * FROM), *to = malloc(ROWS * APART);
        for (int i = 0; i < ROWS * FROM; i++) from[i] = (uint8_t)random_bits(&seed);
        memset(to, 0xee, ROWS * APART);
        fv_kms_copy(to, APART, from, FROM, width, ROWS);
        for (int i = 0; i < ROWS * APART; i++) {
            const uint8_t *p = from + i / APART * FROM + (i % APART & ~3);
            uint8_t wanted[] = {p[2], p[1], p[0], 0};
            if (to[i] != (i % APART < 4 * width ? wanted[i % 4] : 0xee)) fail_msg("width %d, byte %d", width, i);
        }
        free(from), free(to);
    }
}

/* The pictures' size and the nearest rate; the CRTC that shows the console; what is said. */
static void picks(void **state)
{
    (void)state;
    static const struct {
        int width, mode_width, mode_height;
        double hz, mode_hz;
        const char *connector, *text;
    } table[] = {
        {32, 0, 0, 500, 0, "", "/dev/dri/card0 (made up): HDMI-A-1 64x32, 500.00 Hz; atomic, 3 buffers"},
        {32, 0, 0, 900, 0, "HDMI-A-1", "HDMI-A-1 64x32, 1000."},
        {40, 0, 0, 500, 0, "DP-1", "DP-1 264x80, 500."},   /* none of that size: its own */
        {32, 164, 48, 500, 0, "", "HDMI-A-1 164x48, 1000."}, /* the only one of its size */
        {32, 64, 32, 500, 1000, "", "64x32, 1000."},
    };
    for (unsigned i = 0; i < COUNT(table); i++) {
        fake_plug();
        struct fv_kms_settings w = wishes();
        w.width = table[i].width, w.hz = table[i].hz, w.mode_width = table[i].mode_width;
        w.mode_height = table[i].mode_height, w.mode_hz = table[i].mode_hz;
        strcpy(w.connector[0], table[i].connector);
        opened(&w);
        if (!strstr(kms.text, table[i].text)) fail_msg("%d: %s", i, kms.text);
        assert_int_equal(kms.screen[0].crtc, FAKE_CRTC + (kms.screen[0].connector != FAKE_CONNECTOR));
        closed();
    }
    fake_plug(); /* the first connector has nothing plugged in: the second, on a CRTC that is idle */
    fake.connected[0] = false;
    struct fv_kms_settings w = wishes();
    opened(&w);
    assert_true(kms.screen[0].connector == FAKE_CONNECTOR + 1 && kms.screen[0].crtc == FAKE_CRTC + 1);
    assert_int_equal(fake.crtc[0].fb, FAKE_CONSOLE);
    closed();
}

static void refusals(void **state)
{
    (void)state;
    static const char *const expected[] = {
        "there is no display card",  "be root or in the group",  "no dumb buffers",          "another program holds",
        "no display is plugged in; connectors are: HDMI-A-1 (nothing plugged in) DP-1", "no connector DP-7; there are: HDMI-A-1 (connected) DP-1",
        "DP-1: no display is plugged in", "no such mode as display.mode says; it has: 164x48@1e+03 264x80@500", "no such mode",
        "No CRTC", "cannot be set: No space left", "/dev/dri/card5: No such file"};
    for (unsigned i = 0; i < COUNT(expected); i++) {
        struct fv_kms_settings w = wishes();
        fake_plug();
        if (i == 0) fake.card = false;
        if (i == 1) fake.open_fails = EACCES;
        if (i == 2) fake.dumb = false;
        if (i == 3) fake.master = EBUSY;
        if (i == 4) fake.connected[0] = fake.connected[1] = false;
        if (i == 5) strcpy(w.connector[0], "DP-7");
        if (i == 6) strcpy(w.connector[0], "DP-1"), fake.connected[1] = false;
        if (i == 7) w.mode_width = 65, w.mode_height = 32;
        if (i == 8) w.mode_width = 64, w.mode_height = 32, w.mode_hz = 700;
        if (i == 9) strcpy(w.connector[1], "DP-1"), fake.one_crtc = true;
        if (i == 10) fake.mode_fails = ENOSPC;
        if (i == 11) strcpy(w.device, "/dev/dri/card5");
        assert_int_equal(fv_kms_open(&kms, &w, &fake_io, &error), -1);
        if (!strcasestr(error.text, expected[i]) || strchr(error.text, '\n')) fail_msg("%s: %s", expected[i], error.text);
        fake.card = true;
        fake_left();
        assert_int_equal(fake.crtc[0].fb, FAKE_CONSOLE);
    }
}

/* Side by side, by pixels; the fourth byte of a picture shows nowhere. */
static void side_by_side(void **state)
{
    for (int legacy = 0; legacy < 2; legacy++) {
        (void)state;
        fake_plug();
        fake.atomic = !legacy;
        struct fv_kms_settings w = wishes();
        opened(&w);
        assert_int_equal(kms.atomic, !legacy);
        assert_true(shown(0, 0, 0) == 0 && shown(0, 63, 31) == 0);
        for (int frame = 1; frame < 8; frame++) {
            assert_int_equal(present(frame), FV_KMS_NOTHING);
            settle();
            for (int y = 0; y < SIDE; y++)
                for (int x = 0; x < 2 * SIDE; x++)
                    if (shown(0, x, y) != expected(x / SIDE, x % SIDE, y, frame)) fail_msg("frame %d, %d %d", frame, x, y);
        }
        assert_true(kms.counts.flips == 7 && kms.counts.dropped == 0 && kms.counts.busy == 0 && kms.counts.odd == 0);
        assert_int_equal(kms.counts.bytes, 7 * 4 * 2 * SIDE * SIDE);
        assert_int_equal(legacy ? fake.set_crtcs : fake.commits, legacy ? 1 : 8);
        closed();
    }
}

/* Larger than the display, and smaller: the middle, in the middle of each half. */
static void sizes(void **state)
{
    (void)state;
    struct fv_kms_settings w = wishes();
    fake_plug();
    w.width = 40, w.height = 36, w.mode_width = 64, w.mode_height = 32;
    opened(&w);
    struct fv_picture p = picture(2, 40, 36, 9);
    assert_int_equal(fv_kms_present(&kms, &p), FV_KMS_NOTHING);
    settle();
    assert_int_equal(shown(0, 0, 0), expected(0, 4, 2, 9));
    assert_int_equal(shown(0, 63, 31), expected(1, 35, 33, 9));
    closed();
    fake_plug();
    w.width = 20, w.height = 30, w.mode_width = 164, w.mode_height = 48;
    opened(&w);
    p = picture(2, 20, 30, 9);
    assert_int_equal(fv_kms_present(&kms, &p), FV_KMS_NOTHING);
    settle();
    assert_true(shown(0, 30, 20) == 0 && shown(0, 31, 8) == 0 && shown(0, 51, 20) == 0 && shown(0, 31, 39) == 0);
    assert_int_equal(shown(0, 31, 9), expected(0, 0, 0, 9));
    assert_int_equal(shown(0, 50, 38), expected(0, 19, 29, 9));
    assert_int_equal(shown(0, 82 + 31, 9), expected(1, 0, 0, 9));
    closed();
    fake_plug(); /* one eye has all of it */
    w = wishes();
    w.eyes = 1, w.mode_width = 64, w.mode_height = 32;
    opened(&w);
    p = picture(1, SIDE, SIDE, 3);
    assert_int_equal(fv_kms_present(&kms, &p), FV_KMS_NOTHING);
    settle();
    assert_int_equal(shown(0, 16, 0), expected(0, 0, 0, 3));
    assert_true(shown(0, 15, 0) == 0 && shown(0, 48, 0) == 0);
    closed();
}

/* Planes that any CRTC may have: that of the console's CRTC is left to it, and none is taken twice. */
static void shared_planes(void **state)
{
    (void)state;
    for (int two = 0; two < 2; two++) {
        struct fv_kms_settings w = wishes();
        fake_plug();
        fake.any_plane = true;
        strcpy(w.connector[0], "DP-1");
        if (two) strcpy(w.connector[1], "HDMI-A-1");
        opened(&w);
        assert_true(kms.atomic && kms.screen[0].crtc == FAKE_CRTC + 1 && kms.screen[0].plane == FAKE_PLANE + 1);
        if (two) assert_int_equal(kms.screen[1].plane, FAKE_PLANE);
        assert_int_equal(present(1), FV_KMS_NOTHING);
        settle();
        assert_int_equal(shown(1, 0, 0), expected(0, 0, 0, 1));
        if (two) assert_int_equal(shown(0, 0, 0), expected(1, 0, 0, 1));
        else assert_int_equal(fake.crtc[0].fb, FAKE_CONSOLE);
        closed();
    }
}

/* A display for each eye: both change in one commit; without the events' CRTCs, legacy ones are told by their number. */
static void two_connectors(void **state)
{
    (void)state;
    for (int legacy = 0; legacy < 2; legacy++) {
        fake_plug();
        fake.atomic = !legacy;
        fake.no_crtc_ids = legacy;
        struct fv_kms_settings w = wishes();
        strcpy(w.connector[0], "DP-1"), strcpy(w.connector[1], "HDMI-A-1");
        opened(&w);
        int left = (int)(kms.screen[0].crtc - FAKE_CRTC);
        assert_true(left == 1 && kms.screen[0].mode.hdisplay == SIDE);
        for (int frame = 0; frame < 9; frame++) {
            assert_int_equal(present(frame), FV_KMS_NOTHING);
            settle();
            assert_int_equal(shown(left, 5, 6), expected(0, 5, 6, frame));
            assert_int_equal(shown(!left, 31, 31), expected(1, 31, 31, frame));
        }
        assert_true(kms.counts.flips == 9 && kms.counts.odd == 0 && fake.flips == 18);
        assert_int_equal(fake.commits, legacy ? 0 : 10);
        closed();
    }
}

/* A loop that draws as fast as it can is held to the refresh: 600 frames, none skipped, none dropped. The numbers wrap
 * meanwhile. */
static void paced_by_flips(void **state)
{
    (void)state;
    for (int variant = 0; variant < 4; variant++) {
        fake_plug();
        fake.atomic = variant & 1;
        fake.number = UINT32_MAX - 100;
        struct fv_kms_settings w = wishes();
        w.buffers = 2 + variant / 2;
        opened(&w);
        int64_t begun_ns = fake.t_ns;
        for (int frame = 0; frame < 600; frame++) {
            fake.t_ns += 300000;
            assert_int_equal(present(frame), FV_KMS_NOTHING);
        }
        settle();
        assert_true(kms.counts.flips == 600 && kms.counts.skipped == 0 && kms.counts.dropped == 0 && kms.counts.busy == 0);
        assert_true(llabs(fake.t_ns - begun_ns - 602 * fake.period_ns) <= 2 * fake.period_ns);
        struct fv_beat beat = {0};
        assert_true(fv_kms_beat(&kms, &beat));
        assert_true(llabs(beat.period_ns - fake.period_ns) < 100);
        assert_int_equal((beat.flip_ns - fake.begun_ns) % fake.period_ns, 0);
        assert_true(beat.flip_ns <= fake.t_ns && beat.lead_ns > kms.blank_ns && beat.lead_ns < beat.period_ns);
        closed();
    }
}

/* Refreshes that nothing new was there for, by number; the beat is known before the first flip, and after a rest. */
static void skipped(void **state)
{
    (void)state;
    struct fv_beat beat;
    struct fv_kms_settings w = wishes();
    fake_plug();
    opened(&w);
    fake.t_ns += 700000;
    assert_true(fv_kms_beat(&kms, &beat) && beat.flip_ns == fake.begun_ns && beat.period_ns == kms.nominal_ns);
    for (int frame = 0; frame < 10; frame++) {
        assert_int_equal(present(frame), FV_KMS_NOTHING);
        fake.t_ns += 3 * fake.period_ns;
    }
    assert_int_equal(kms.counts.skipped, 8 * 2);
    fake.t_ns += 5000 * ms + 700000;
    assert_true(fv_kms_beat(&kms, &beat));
    assert_true(fake.t_ns - beat.flip_ns < fake.period_ns && (beat.flip_ns - fake.begun_ns) % fake.period_ns == 0);
    closed();
    fake_plug(); /* stamps of another clock: the time of arrival */
    fake.wallclock = true;
    opened(&w);
    for (int frame = 0; frame < 40; frame++) assert_int_equal(present(frame), FV_KMS_NOTHING);
    assert_true(fv_kms_beat(&kms, &beat) && llabs(beat.period_ns - fake.period_ns) < 1000 && beat.flip_ns <= fake.t_ns);
    closed();
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(names),
                                       cmocka_unit_test(copies),
                                       cmocka_unit_test(picks),
                                       cmocka_unit_test(refusals),
                                       cmocka_unit_test(side_by_side),
                                       cmocka_unit_test(sizes),
                                       cmocka_unit_test(shared_planes),
                                       cmocka_unit_test(two_connectors),
                                       cmocka_unit_test(paced_by_flips),
                                       cmocka_unit_test(skipped)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
