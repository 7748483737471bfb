/* eye_frames: frames of the simulated eyes recorded, read again, and played as a source of gaze: near the
 * true gaze, at their own times, starting again at the end; files that are none, cut off, or hold bad frames
 * between good ones. */
#include "sensors/eye/frame_player.h"
#include "sensors/eye/frame_recorder.h"
#include "sensors/eye/image_sim.h"
#include "tests/support/opened_sensors.h"

#include <math.h>
#include <signal.h>
#include <sys/resource.h>

enum { WIDTH = 320, HEIGHT = 240, FRAMES = 60 };
static const int64_t ms = 1000000, period_ns = 8333333, begin_ns = 7000000000;
static uint8_t pixels[WIDTH * HEIGHT];
static struct fv_writer out;
static struct fv_error error;
static char text[1 << 17];

static struct fv_camera_layout grey(int width, int height)
{
    return (struct fv_camera_layout){fv_camera_format_named("GREY"), width, height, (size_t)width};
}

/* Records an eye; the right one's frames come 1 ms later, and every tenth is lost. */
static void record(int eye)
{
    struct fv_camera_layout layout = grey(WIDTH, HEIGHT);
    struct fv_eye_camera camera = fv_eye_camera_usual(WIDTH, HEIGHT, 2 + (uint64_t)eye);
    char path[256];
    snprintf(path, sizeof path, "%s/%s.frames", program_folder(), eye ? "right" : "left");
    assert_int_equal(fv_writer_open(&out, path, &error), 0);
    fv_frame_tape_begin(&out, &layout);
    for (int i = 0; i < FRAMES; i++) {
        struct fv_eye_state state;
        int64_t t_ns = i * period_ns + eye * ms;
        if (eye == 1 && i % 10 == 9) continue;
        fv_eye_state_at(5, eye, 300 * ms + t_ns, &state);
        fv_eye_image(&camera, &state, pixels, WIDTH, NULL);
        fv_frame_tape_write(&out, begin_ns + t_ns, pixels, sizeof pixels);
    }
    assert_int_equal(fv_writer_close(&out, &error), 0);
}

static double angle_deg(const double a[3], const double b[3])
{
    return acos(fmin(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], 1)) * 180 / M_PI;
}

static struct fv_config *playing(const char *folder)
{
    struct fv_config *config = sensor_settings("tape", "none", 1, 1);
    config->eye_tape[0] = 0;
    strcpy(config->eye_device, folder);
    config->eye_confidence = 0.5, config->eye_settle_ms = 30;
    config->eye_model.count = 3;
    config->eye_model.value[0] = 0.5, config->eye_model.value[1] = 0.55, config->eye_model.value[2] = 0.245;
    return config;
}

static void recorded_frames_are_a_source(void **state)
{
    (void)state;
    static struct fv_gaze first[FRAMES * 2];
    record(0);
    record(1);
    for (int round = 0; round < 2; round++) {
        struct fv_sensors *sensors = opened(playing(program_folder()));
        struct fv_pose head;
        int near = 0;
        for (int i = 0; i < FRAMES * 2; i++) { /* the tapes twice */
            struct fv_gaze_sample truth;
            int64_t now_ns = i * period_ns + 3 * ms;
            fv_sensors_latch(sensors, now_ns, now_ns + 5 * ms, &head, &first[i]);
            const struct fv_gaze *g = &first[i];
            assert_true(g->t_ns <= now_ns && g->t_ns > now_ns - 2 * period_ns);
            int64_t length_ns = FRAMES * period_ns,
                    on_tape_ns = g->t_ns >= length_ns - ms ? g->t_ns - length_ns : g->t_ns;
            fv_sim_gaze(5, 300 * ms + on_tape_ns, &truth);
            near += !g->held && angle_deg(g->direction[0], truth.direction[0]) < 1.5 &&
                    angle_deg(g->direction[1], truth.direction[1]) < 1.5;
        }
        print_message("%d of %d within 1.5 degrees\n", near, FRAMES * 2);
        assert_true(near >= FRAMES * 2 * 9 / 10);
    }
}

/* A small tape in memory, with what is wrong put between good frames. */
static size_t tape(const char *head, int frames, size_t bytes)
{
    size_t at = (size_t)snprintf(text, sizeof text, "%s", head);
    for (int i = 0; i < frames; i++, at += 12 + bytes) {
        memset(text + at, 0, 12 + bytes);
        text[at] = (char)(10 * i + 1);
        text[at + 8] = (char)bytes;
    }
    return at;
}

static void tapes_that_are_none(void **state)
{
    (void)state;
    static const struct {
        const char *head, *expected;
    } cases[] = {{"", "no frames; must begin"},
                 {"# foveola gaze 1\n", "no frames; must begin"},
                 {"# foveola frames 2, 4x2, GREY\n", "no frames; must begin"},
                 {"# foveola frames 1, 4x2, GREY and more\n", "no frames; must begin"},
                 {"# foveola frames 1, 4x2, MJPG\n", "frames of MJPG; must be"},
                 {"# foveola frames 1, 0x2, GREY\n", "cannot be"},
                 {"# foveola frames 1, 3x2, YUYV\n", "cannot be"},
                 {"# foveola frames 1, 4x3, GREY\n", "0 frames are good and 5 are not"},
                 {"# foveola frames 1, 4x2, GREY", "no frames; must begin"}};
    struct fv_frame_tape t;
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        size_t size = tape(cases[i].head, 5, 8);
        assert_int_equal(fv_frame_tape_parse(&t, "x", (uint8_t *)text, size, &error), -1);
        if (!strstr(error.text, cases[i].expected)) fail_msg("%s: %s", cases[i].head, error.text);
    }
    static const char head[] = "# foveola frames 1, 4x2, GREY\n";
    size_t size = tape(head, 5, 8), first = sizeof head - 1, one = 20;
    assert_int_equal(fv_frame_tape_parse(&t, "x", (uint8_t *)text, size, &error), 0);
    assert_true(t.frames == 5 && t.rejected == 0 && t.first_ns == 1 && t.last_ns == 41);
    /* Cut off anywhere: what is whole is good; a time that goes back, a time of other ages are left out. */
    for (size_t cut = first + one; cut <= size; cut++) {
        uint8_t *exact = malloc(cut);
        memcpy(exact, text, cut);
        assert_int_equal(fv_frame_tape_parse(&t, "x", exact, cut, &error), 0);
        assert_int_equal(t.frames, (cut - first) / one);
        assert_int_equal(t.rejected, (cut - first) % one != 0);
        free(exact);
    }
    text[first + 2 * one] = 5;        /* before the second */
    text[first + 3 * one + 7] = 0x7f; /* far away */
    assert_int_equal(fv_frame_tape_parse(&t, "x", (uint8_t *)text, size, &error), 0);
    assert_true(t.frames == 3 && t.rejected == 2 && t.last_ns == 41);
    size_t at = t.begin;
    int64_t t_ns = INT64_MIN;
    for (int i = 0; i < 3; i++) {
        assert_non_null(fv_frame_tape_next(&t, &at, t_ns, &t_ns));
        assert_int_equal(t_ns, i < 2 ? 10 * i + 1 : 41);
    }
    assert_null(fv_frame_tape_next(&t, &at, t_ns, &t_ns));
}

static void source_errors(void **state)
{
    (void)state;
    struct fv_sensors *sensors;
    assert_int_equal(fv_sensors_open(&sensors, playing("/nowhere"), &error), -1);
    assert_non_null(strstr(error.text, "eye.device: "));
    assert_non_null(strstr(error.text, "/nowhere/left.frames"));
}

/* What is recorded is read again, byte for byte; frames that do not fit, or for which there is no room, are
 * dropped and counted; a disk that is full ends the recording with its reason. */
static void recording(void **state)
{
    (void)state;
    static const int width[2] = {40, 24}, height[2] = {30, 20};
    struct fv_frame_recorder *r;
    struct fv_frame_tape t[2];
    char path[256];
    if (fv_frame_recorder_open(&r, program_folder(), 2, width, height, &error)) fail_msg("%s", error.text);
    for (int i = 0; i < 2000; i++) {
        int eye = i % 2;
        for (int k = 0; k < 64 * 30; k++) pixels[k] = (uint8_t)(i + k % 64);
        struct fv_eye_frame frame = {pixels, width[eye], height[eye], 64};
        fv_frame_recorder_put(r, eye, 1000 + i, &frame);
        if (i % 20 == 0) usleep(1000);
        frame.width++;
        if (i == 0) fv_frame_recorder_put(r, eye, 1, &frame);
    }
    assert_int_equal(fv_frame_recorder_close(r, &error), 0);
    assert_true(r->dropped >= 1);
    for (int eye = 0; eye < 2; eye++) {
        snprintf(path, sizeof path, "%s/%s.frames", program_folder(), eye ? "right" : "left");
        if (fv_frame_tape_read(&t[eye], path, &error)) fail_msg("%s", error.text);
        assert_true(t[eye].layout.width == width[eye] && t[eye].layout.height == height[eye] &&
                    t[eye].rejected == 0);
        size_t at = t[eye].begin;
        int64_t t_ns = INT64_MIN;
        for (const uint8_t *f; (f = fv_frame_tape_next(&t[eye], &at, t_ns, &t_ns));)
            for (int k = 0; k < width[eye] * height[eye]; k++)
                if (f[k] != (uint8_t)(t_ns - 1000 + k % width[eye]))
                    fail_msg("frame %d, pixel %d", (int)t_ns, k);
    }
    for (int eye = 0; eye < 2; eye++) free((void *)t[eye].bytes);
    assert_int_equal(t[0].frames + t[1].frames + r->dropped, 2001);
    print_message("%d of 2000 dropped\n", (int)r->dropped - 1);
    /* A folder that is none; a disk without room. */
    assert_int_equal(fv_frame_recorder_open(&r, "/nowhere", 1, width, height, &error), -1);
    struct stat full;
    if (stat("/dev/full", &full) != 0) return;
    assert_int_equal(fv_frame_recorder_open(&r, program_folder(), 1, width, height, &error), 0);
    int device = open("/dev/full", O_WRONLY);
    assert_true(dup2(device, r->writer[0].fd) >= 0);
    close(device);
    for (int i = 0; i < 200; i++) {
        struct fv_eye_frame frame = {pixels, width[0], height[0], 64};
        fv_frame_recorder_put(r, 0, i, &frame);
        usleep(100);
    }
    assert_int_equal(fv_frame_recorder_close(r, &error), -1);
    assert_non_null(strstr(error.text, "No space left"));
    assert_true(r->dropped > 0);
}

/* A file that may grow no more ends there: what fitted is a tape, what did not is counted. */
static void files_that_are_full(void **state)
{
    (void)state;
    static struct fv_frame_recorder *r;
    const int width[2] = {64, 0}, height[2] = {48, 0};
    char path[256];
    struct rlimit before, small;
    getrlimit(RLIMIT_FSIZE, &before);
    small = before;
    small.rlim_cur = 1 << 20;
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(fv_frame_recorder_open(&r, program_folder(), 1, width, height, &error), 0);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    for (int i = 0; i < 1000; i++) {
        fv_frame_recorder_put(r, 0, i, &(struct fv_eye_frame){pixels, 64, 48, 64});
        usleep(100);
    }
    int closed = fv_frame_recorder_close(r, &error);
    setrlimit(RLIMIT_FSIZE, &before);
    signal(SIGXFSZ, handler);
    assert_int_equal(closed, -1);
    assert_non_null(strstr(error.text, "not whole: File too large"));
    struct fv_frame_tape tape;
    snprintf(path, sizeof path, "%s/left.frames", program_folder());
    assert_int_equal(fv_frame_tape_read(&tape, path, &error), 0);
    assert_true(tape.frames >= 200 && tape.frames <= (1 << 20) / (64 * 48) && r->dropped >= 600);
    free((void *)tape.bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(recorded_frames_are_a_source),
                                       cmocka_unit_test(tapes_that_are_none), cmocka_unit_test(recording), cmocka_unit_test(files_that_are_full),
                                       cmocka_unit_test(source_errors)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
