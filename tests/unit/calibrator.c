/* calibrator: a calibration stepped on a made-up clock, with eyes that look, blink, look elsewhere or are
 * never seen; what is refused and why; a made-up camera whose frames are recorded, and the same calibration,
 * bit for bit, from the recording. */
#include "sensors/eye/calibrated.h"
#include "sensors/eye/calibration.h"
#include "sensors/eye/look_feed.h"
#include "tests/support/fake_camera.h"
#include "tests/support/random.h"

#include <math.h>

static const int64_t ms = 1000000;
static struct fv_calibrator calibrator;
static struct fv_calibrated calibrated, again;
static struct fv_error error;
static struct fv_writer out;

static void begin(int points, int eyes)
{
    struct fv_calibrator_settings s = {eyes, points, {18, 12, 12}, 0, 2.7};
    if (fv_calibrator_begin(&calibrator, &s, &error)) fail_msg("%s", error.text);
}

/* What a camera would tell of an eye that looks there. */
static struct fv_eye_look eye_at(const double at_deg[2], int64_t t_ns, uint64_t *seed)
{
    struct fv_eye_look l = {.t_ns = t_ns, .seen = true, .confidence = 0.9};
    double x = at_deg[0] * (M_PI / 180), y = at_deg[1] * (M_PI / 180);
    l.feature.pupil[0] = 320 - 157 * sin(x) + random_between(seed, -0.2, 0.2);
    l.feature.pupil[1] = 220 - 157 * sin(y) + random_between(seed, -0.2, 0.2);
    return l;
}

/* How the eyes behave at the n-th time that a target is shown. */
struct story {
    int unseen[2];    /* of each eye, the target (from 1) at which it is not seen ... */
    int times;        /* ... for so many times that it is shown */
    bool still;       /* the eyes do not move */
    bool line;        /* they move sideways only */
    bool random;      /* they look anywhere */
    int elsewhere;    /* the target (from 1) beside which they look */
    int64_t delay_ns; /* of the right eye's frames */
};

static void tell(const struct story *s, uint64_t *seed)
{
    int row;
    int64_t now_ns = 0;
    double where[2] = {0, 0};
    for (int last = -1; (row = fv_calibrator_step(&calibrator, now_ns)) >= 0; now_ns += 10 * ms) {
        const double *at = calibrator.show[row].at_deg;
        if (row != last) {
            memcpy(where, at, sizeof where);
            if (s->random) where[0] = random_between(seed, -20, 20), where[1] = random_between(seed, -14, 14);
            if (s->still) where[0] = where[1] = 3;
            if (s->line) where[1] = 0;
            if (s->elsewhere == calibrator.target + 1) where[0] -= 25;
        }
        last = row;
        for (int eye = 0; eye < calibrator.settings.eyes; eye++) {
            struct fv_eye_look l = eye_at(where, now_ns - (eye ? s->delay_ns : 0), seed);
            if (s->unseen[eye] == calibrator.target + 1 && calibrator.tries <= s->times)
                l = (struct fv_eye_look){.t_ns = l.t_ns};
            fv_calibrator_look(&calibrator, eye, &l);
        }
        assert_true(now_ns < 120000 * ms);
    }
}

static void targets_are_shown_until_seen(void **state)
{
    (void)state;
    static const struct {
        int points, eyes;
        struct story story;
        int shown, seen[2];
    } table[] = {{5, 2, {.times = 0}, 5, {5, 5}},
                 {9, 1, {.times = 0}, 9, {9, 0}},
                 {13, 2, {.delay_ns = 90 * ms}, 13, {13, 13}},
                 {9, 2, {.unseen = {0, 4}, .times = 1}, 10, {9, 9}},
                 {9, 2, {.unseen = {4, 4}, .times = 2}, 11, {9, 9}},
                 {9, 2, {.unseen = {0, 9}, .times = 3}, 11, {9, 8}},
                 {9, 2, {.unseen = {2, 5}, .times = 3}, 13, {8, 8}}};
    uint64_t seed = 1;
    for (unsigned i = 0; i < sizeof table / sizeof table[0]; i++) {
        begin(table[i].points, table[i].eyes);
        tell(&table[i].story, &seed);
        assert_int_equal(calibrator.shown, table[i].shown);
        if (fv_calibrated_make(&calibrated, &calibrator, &error)) fail_msg("%u: %s", i, error.text);
        assert_int_equal(calibrated.eyes, table[i].eyes);
        for (int eye = 0; eye < table[i].eyes; eye++) {
            const struct fv_calibrated_eye *e = &calibrated.eye[eye];
            assert_int_equal(e->targets, table[i].points);
            assert_int_equal(e->seen, table[i].seen[eye]);
            assert_true(e->fit.worst < 0.5 && e->left_out.median < 1.5 && e->fit.mean <= e->left_out.mean);
            for (int k = 0; k < e->targets; k++)
                assert_true((e->target[k].frames >= 8) == isfinite(e->target[k].off_deg));
        }
        for (int row = 1; row < calibrator.shown; row++)
            assert_true(calibrator.show[row].t_ns >= calibrator.show[row - 1].until_ns);
    }
    struct fv_calibrator_settings wrong = {2, 7, {18, 12, 12}, 0, 2.7};
    assert_int_equal(fv_calibrator_begin(&calibrator, &wrong, &error), -1);
}

static void refusals(void **state)
{
    (void)state;
    static const struct {
        int points;
        struct story story;
        const char *expected;
    } table[] = {{9, {.still = true}, "left eye: the pupil did not move"},
                 {9, {.line = true}, "left eye: the pupil moved along one line"},
                 {9, {.random = true}, "left eye: the pupil's movement does not follow"},
                 {5, {.unseen = {0, 3}, .times = 3}, "right eye: fewer than 5 targets"},
                 {13, {.elsewhere = 5}, "left eye: at the target 18.0 degrees right, 12.0 up the gaze is"},
                 {9, {.elsewhere = 6}, "left eye: at the target -18.0 degrees right, 0.0 up the gaze is"},
                 {5, {.elsewhere = 2}, "left eye: left out in turn, targets are up to"}};
    uint64_t seed = 2;
    for (unsigned i = 0; i < sizeof table / sizeof table[0]; i++) {
        begin(table[i].points, 2);
        tell(&table[i].story, &seed);
        assert_int_equal(fv_calibrated_make(&calibrated, &calibrator, &error), -1);
        if (!strstr(error.text, table[i].expected)) fail_msg("%s: %s", table[i].expected, error.text);
    }
    /* All targets at the same place, by a log. */
    struct fv_target_shown same[6];
    begin(5, 1);
    for (int i = 0; i < 6; i++)
        same[i] = (struct fv_target_shown){i * 1000 * ms, i * 1000 * ms, (i + 1) * 1000 * ms, {1, 2}};
    fv_calibrator_replay(&calibrator, same, 6);
    for (int64_t t_ns = 0; t_ns < 6000 * ms; t_ns += 10 * ms) {
        struct fv_eye_look l = eye_at(same[0].at_deg, t_ns, &seed);
        fv_calibrator_look(&calibrator, 0, &l);
    }
    assert_int_equal(fv_calibrated_make(&calibrated, &calibrator, &error), -1);
    assert_non_null(strstr(error.text, "all targets are at the same place"));
    assert_int_equal(calibrated.eye[0].targets, 1);
    assert_int_equal(calibrated.eye[0].target[0].shown, 6);
}

/* Draws the eye, which looks at the target that is shown, into the next buffer that is queued. */
static void fake_wait(void *context, const int *fd, unsigned *ready, int devices, int64_t timeout_ns)
{
    static uint8_t pixels[FAKE_SIDE * FAKE_SIDE];
    struct fake *f = context;
    struct fv_eye_camera camera = fv_eye_camera_usual(FAKE_SIDE, FAKE_SIDE, 1);
    struct fv_eye_state s = {.t_ns = f->t_ns, .pupil_mm = 5.5, .open = 1};
    assert_int_equal(devices, 1);
    (void)timeout_ns;
    f->t_ns += 20 * ms;
    camera.px_per_mm = 3;
    camera.leds = 0;
    const struct fv_target_shown *now = &calibrator.show[calibrator.shown > 0 ? calibrator.shown - 1 : 0];
    fv_gaze_vector(now->at_deg, s.direction);
    s.direction[0] = -s.direction[0];
    struct v4l2_buffer *b = fills(0, f->t_ns - 3 * ms, V4L2_BUF_FLAG_TSTAMP_SRC_SOE);
    assert_non_null(b);
    fv_eye_image(&camera, &s, pixels, FAKE_SIDE, NULL);
    memcpy(f->memory[b->index], pixels, sizeof pixels);
    ready[0] = fd[0] < 0 ? 0 : FV_CAMERA_READABLE;
}

static void recorded_again(void **state)
{
    (void)state;
    static struct fv_look_feed feed, player;
    static struct fv_watch_settings s = {.cameras = 1, .settle_s = 0.03};
    struct fv_camera_io io = fake_io;
    char path[256];
    io.wait = fake_wait;
    s.camera[0] =
        (struct fv_camera_settings){"eye.device", "/dev/eye", NULL, FAKE_SIDE, FAKE_SIDE, 120, 4 * ms};
    s.eye[0] = (struct fv_eye_settings){.model = {0.5, 0.55, 9.8 * 3 / FAKE_SIDE}, .confidence = 0.5};
    plug();
    memset(&feed, 0, sizeof feed);
    if (fv_look_feed_watch(&feed, &s, &io, &error)) fail_msg("%s", error.text);
    assert_true(feed.eyes == 1 && feed.width == FAKE_SIDE && feed.height == FAKE_SIDE);
    if (fv_look_feed_record(&feed, program_folder(), &error)) fail_msg("%s", error.text);
    struct fv_calibrator_settings settings = {
        1, 5, {18, 12, 12}, 300 * ms, fv_calibrator_near_px(&s.eye[0].model, FAKE_SIDE)};
    assert_int_equal(fv_calibrator_begin(&calibrator, &settings, &error), 0);
    feed.calibrator = &calibrator;
    while (fv_calibrator_step(&calibrator, fv_look_feed_now_ns(&feed)) >= 0) {
        fv_look_feed_until(&feed, fv_look_feed_now_ns(&feed) + 15 * ms);
        usleep(200); /* the recorder's thread keeps up */
    }
    assert_int_equal(atomic_load(&feed.recorder->dropped), 0);
    if (fv_look_feed_close(&feed, &error)) fail_msg("%s", error.text);
    if (fv_calibrated_make(&calibrated, &calibrator, &error)) fail_msg("%s", error.text);
    print_message("64x64: %d frames, %.2f degrees off, %.2f left out\n", calibrated.eye[0].rows,
                  calibrated.eye[0].fit.mean, calibrated.eye[0].left_out.mean);
    assert_true(calibrated.eye[0].fit.mean < 1);
    snprintf(path, sizeof path, "%s/targets.csv", program_folder());
    assert_int_equal(fv_writer_open(&out, path, &error), 0);
    fv_targets_begin(&out);
    for (int i = 0; i < calibrator.shown; i++) fv_targets_row(&out, &calibrator.show[i]);
    assert_int_equal(fv_writer_close(&out, &error), 0);
    /* The tape. */
    static struct fv_config config;
    strcpy(config.eye_source, "tape");
    snprintf(config.eye_device, sizeof config.eye_device, "%s", program_folder());
    config.eye_model = (struct fv_list){3, {0.5, 0.55, 9.8 * 3 / FAKE_SIDE}};
    config.eye_confidence = 0.5;
    if (fv_look_feed_open(&player, &config, &error)) fail_msg("%s", error.text);
    assert_true(player.recorded && player.eyes == 1);
    assert_int_equal(fv_calibrator_begin(&calibrator, &settings, &error), 0);
    player.calibrator = &calibrator;
    fv_calibrator_replay(&calibrator, player.shown, player.rows);
    fv_look_feed_play(&player);
    if (fv_calibrated_make(&again, &calibrator, &error)) fail_msg("%s", error.text);
    assert_int_equal(again.eye[0].rows, calibrated.eye[0].rows);
    assert_memory_equal(&again.eye[0], &calibrated.eye[0], sizeof again.eye[0]);
    /* And through the file. */
    struct fv_calibration c;
    snprintf(path, sizeof path, "%s/c.csv", program_folder());
    assert_int_equal(fv_calibrated_write(&again, FAKE_SIDE, FAKE_SIDE, path, &out, &error), 0);
    if (fv_calibration_read(&c, path, &error)) fail_msg("%s", error.text);
    assert_memory_equal(&c.map[0], &again.eye[0].map, sizeof c.map[0]);
    assert_true(c.width == FAKE_SIDE && c.rows[0] == again.eye[0].rows && c.rows[1] == 0);
    assert_int_equal(fv_calibrated_write(&again, 1, 1, "/nowhere/c.csv", &out, &error), -1);
}

static const char good[] =
    "# foveola targets 1\nt_ns,from_ns,until_ns,right_deg,up_deg\n0,500,1200,0,0\r\n\n# again\n"
    "1200,1700,2400,-18,12";

static void logs_of_targets(void **state)
{
    (void)state;
    static const struct {
        const char *find, *replace, *expected;
    } cases[] = {{"targets 1", "targets 2", "t.csv:1: no targets"},
                 {"t_ns,from", "t,from", "t.csv:2: must be"},
                 {"0,500,1200,0,0", "0,500,1200,0", "t.csv:3: must be t_ns"},
                 {"0,500,1200,0,0", "0,500,1200,0,0,0", "t.csv:3: must be t_ns"},
                 {"0,500,1200,0,0", "0,500,1200,70,70", "t.csv:3: must be a target at most 80"},
                 {"0,500,1200,0,0", "0,500,1200,nan,0", "t.csv:3: must be a target at most 80"},
                 {"0,500,1200,0,0", "501,500,1200,0,0", "t.csv:3: must appear"},
                 {"0,500,1200,0,0", "0,500,500,0,0", "t.csv:3: must appear"},
                 {"0,500,1200,0,0", "0,500,1201,0,0", "t.csv:6: must appear"},
                 {"0,500", "0,99999999999999999999", "t.csv:3: must be t_ns"}};
    struct fv_target_shown shown[FV_SHOWN_MAX];
    static char text[8192];
    assert_int_equal(fv_targets_parse(shown, "t.csv", good, sizeof good - 1, &error), 2);
    assert_true(shown[1].t_ns == 1200 && shown[1].until_ns == 2400 && shown[1].at_deg[0] == -18);
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *at = strstr(good, cases[i].find);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - good), good, cases[i].replace,
                 at + strlen(cases[i].find));
        assert_int_equal(fv_targets_parse(shown, "t.csv", text, strlen(text), &error), -1);
        if (!strstr(error.text, cases[i].expected)) fail_msg("%s: %s", cases[i].expected, error.text);
    }
    size_t head = (size_t)(strstr(good, "0,500") - good), used = head;
    memcpy(text, good, head);
    for (int i = 0; i <= FV_SHOWN_MAX; i++) {
        assert_int_equal(fv_targets_parse(shown, "t.csv", text, used, &error), i > 0 ? i : -1);
        used += (size_t)snprintf(text + used, sizeof text - used, "%d,%d,%d,1,1\n", i, i, i + 1);
    }
    assert_int_equal(fv_targets_parse(shown, "t.csv", text, used, &error), -1);
    assert_non_null(strstr(error.text, "more than 64 rows"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(targets_are_shown_until_seen),
                                       cmocka_unit_test(refusals), cmocka_unit_test(recorded_again),
                                       cmocka_unit_test(logs_of_targets)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
