/* eye_watch: made-up cameras that give simulated eye images, watched round by round on a made-up clock and by
 * the thread on the real one; simulated cameras as a source of the loop; calibration files. */
#include "platform/heap.h"
#include "sensors/eye/calibration.h"
#include "sensors/eye/image_sim.h"
#include "sensors/eye/watch.h"
#include "tests/support/fake_camera.h"
#include "tests/support/opened_sensors.h"

#include <math.h>
#include <time.h>

static const int64_t ms = 1000000;
static const double degree = M_PI / 180;
static struct fv_watch *watch;
static struct fv_error error;
static char said[4096];

static void say(const char *line)
{
    size_t used = strlen(said);
    snprintf(said + used, sizeof said - used, "%s\n", line);
}

/* Draws the eye into the next buffer that is queued: 64 x 64 pixels, an iris of half the frame. */
static bool shows(const double at_deg[2], double open)
{
    static uint8_t pixels[FAKE_SIDE * FAKE_SIDE];
    struct fv_eye_camera camera = fv_eye_camera_usual(FAKE_SIDE, FAKE_SIDE, 1);
    struct fv_eye_state state = {.t_ns = fake.t_ns, .pupil_mm = 5.5, .open = open};
    camera.px_per_mm = 3;
    camera.leds = 0;
    fv_gaze_vector(at_deg, state.direction);
    state.direction[0] = -state.direction[0];
    struct v4l2_buffer *b = fills(0, fake.t_ns - 3 * ms, V4L2_BUF_FLAG_TSTAMP_SRC_SOE);
    if (!b) return false;
    fv_eye_image(&camera, &state, pixels, FAKE_SIDE, NULL);
    memcpy(fake.memory[b->index], pixels, sizeof pixels);
    return true;
}

/* The made-up clock goes on by the wait; a frame that waits ends it at once. */
static void fake_wait(void *context, const int *fd, unsigned *ready, int devices, int64_t timeout_ns)
{
    struct fake *f = context;
    assert_int_equal(devices, 1);
    ready[0] = fd[0] < 0 ? 0 : !f->plugged ? FV_CAMERA_BROKEN : f->waits > 0 ? FV_CAMERA_READABLE : 0;
    if (!ready[0]) f->t_ns += timeout_ns;
}

static struct fv_watch_settings settings(void)
{
    struct fv_watch_settings s = {.cameras = 1, .settle_s = 0.03};
    s.camera[0] =
        (struct fv_camera_settings){"eye.device", "/dev/eye", NULL, FAKE_SIDE, FAKE_SIDE, 120, 4 * ms};
    s.eye[0] = (struct fv_eye_settings){.model = {0.5, 0.55, 9.8 * 3 / FAKE_SIDE}, .confidence = 0.5};
    return s;
}

static struct fv_camera_io rounds_io(void)
{
    struct fv_camera_io io = fake_io;
    io.wait = fake_wait;
    return io;
}

static void begin_watch(const struct fv_camera_io *io)
{
    struct fv_watch_settings s = settings();
    said[0] = 0;
    plug();
    if (fv_watch_open(&watch, &s, io, say, &error)) fail_msg("%s", error.text);
    assert_non_null(strstr(said, "GREY 64x64, 120 Hz"));
}

static void frames_become_samples(void **state)
{
    (void)state;
    static struct fv_camera_io io;
    struct fv_watch_news news = {.samples = -1};
    io = rounds_io();
    begin_watch(&io);
    assert_false(fv_watch_read(watch, &news));
    assert_int_equal(news.samples, -1);
    int good = 0;
    for (int i = 0; i < 60; i++) {
        double at[2] = {i < 30 ? -8 : 8, 4}, v[3];
        fake.t_ns += 8 * ms;
        assert_true(shows(at, 1));
        fv_watch_round(watch, 100 * ms);
        assert_true(fv_watch_read(watch, &news));
        const struct fv_gaze_sample *s = &news.sample[news.samples - 1];
        assert_true(news.samples == (i < FV_WATCH_HISTORY ? i + 1 : FV_WATCH_HISTORY));
        assert_int_equal(s->t_ns, fake.t_ns - ms); /* start of exposure, 3 ms ago, and half of it */
        fv_gaze_vector(at, v);
        double dot = v[0] * s->direction[0][0] + v[1] * s->direction[0][1] + v[2] * s->direction[0][2];
        good += s->valid && acos(fmin(dot, 1)) / degree < 2.5 && s->uncertainty_deg >= FV_EYE_MODEL_ERROR_DEG;
        assert_memory_equal(s->direction[0], s->direction[1], sizeof s->direction[0]);
    }
    print_message("%d of 60 within 2.5 degrees\n", good);
    assert_true(good >= 58);
    for (int i = 0; i < 5; i++) { /* lids closed: lost, not held here */
        double at[2] = {8, 4};
        fake.t_ns += 8 * ms;
        assert_true(shows(at, 0));
        fv_watch_round(watch, 100 * ms);
        assert_true(fv_watch_read(watch, &news) && !news.sample[news.samples - 1].valid);
    }
    struct fv_watch_tally tally;
    assert_true(fv_watch_count(watch, &tally) && tally.unseen.no_pupil >= 5 && tally.unseen.no_pupil <= 7);
    assert_int_equal(tally.unseen.unsure, 0);
    assert_true(tally.unseen.blinks >= 1 && tally.unseen.blinks <= 2);
    fv_watch_round(watch, 100 * ms); /* no frame: nothing new */
    assert_true(fv_watch_read(watch, &news) && fake.t_ns - news.sample[news.samples - 1].t_ns > 50 * ms);
    fv_watch_stop(watch);
    assert_true(fake.opened == 0 && fake.mapped == 0);
}

/* What each frame told, a row each: seen ones, closed lids, events that are told later. */
static void looks_are_recorded(void **state)
{
    (void)state;
    static struct fv_camera_io io;
    static struct fv_spooler spooler; /* its thread is not started: the test is it */
    static char text[1 << 16];
    struct fv_eye_recorder *recorder;
    double right_deg;
    long long t_ns, arrival_ns;
    char path[256], event[16];
    int rows = 0, seen = 0, saccades = 0, found;
    io = rounds_io();
    begin_watch(&io);
    if (fv_eye_recorder_open(&recorder, program_folder(), &spooler, &error)) fail_msg("%s", error.text);
    atomic_store(&watch->looks, recorder);
    for (int i = 0; i < 80; i++) {
        double at[2] = {i < 30 ? -8 : 8, 4};
        fake.t_ns += 8 * ms;
        assert_true(shows(at, i < 70));
        fv_watch_round(watch, 100 * ms);
    }
    fv_watch_stop(watch);
    fv_spool_drain(spooler.spool[0]);
    if (fv_eye_recorder_close(recorder, 4711, &error)) fail_msg("%s", error.text);
    snprintf(path, sizeof path, "%s/eye.csv", program_folder());
    program_slurp(path, text, sizeof text);
    assert_int_equal(strncmp(text, "# foveola eye 1\neye,t_ns,", 25), 0);
    assert_non_null(strstr(text, "\n# session 0 = 4711 ns\n"));
    for (char *at = text; (at = strstr(at, "\nleft,")) != NULL; rows++) {
        int known, commas = 0;
        at++;
        for (const char *c = at; *c != '\n'; c++) commas += *c == ',';
        assert_int_equal(commas, 18);
        assert_int_equal(sscanf(at, "left,%lld,%lld,%d,%*f,%*f,%*f,%*f,%*f,%*f,0,0,0,%d,%lf,%*f,%*f,%15[a-z]", &t_ns,
                                &arrival_ns, &found, &known, &right_deg, event), 6);
        assert_true(arrival_ns - t_ns == ms && t_ns == 5000 * ms + (rows + 1) * 8 * ms - ms);
        seen += known && fabs(right_deg - (rows < 30 ? -8 : 8)) < 2.5;
        assert_true(rows < 70 || (!known && !found));
        saccades += strcmp(event, "saccade") == 0;
    }
    assert_true(rows == 80 && seen >= 66 && saccades > 0 && saccades < 20);
}

/* Unplugged and plugged in again: one line each, rounds never spin, samples go on. */
static void lost_and_back(void **state)
{
    (void)state;
    static struct fv_camera_io io;
    double at[2] = {0, 0};
    struct fv_watch_news news;
    io = rounds_io();
    begin_watch(&io);
    for (int turn = 0; turn < 3; turn++) {
        said[0] = 0;
        fake.plugged = false;
        int64_t before_ns = fake.t_ns;
        for (int i = 0; i < 100; i++) fv_watch_round(watch, 100 * ms);
        assert_true(fake.t_ns - before_ns > 90 * 50 * ms);
        assert_non_null(strstr(said, "lost (No such device)"));
        assert_ptr_equal(strchr(said, '\n'), strrchr(said, '\n'));
        fake.plugged = true;
        for (int i = 0; i < 30; i++) {
            fv_watch_round(watch, 100 * ms);
            if (watch->camera[0].fd < 0) continue;
            fake.t_ns += 8 * ms;
            shows(at, 1);
        }
        assert_non_null(strstr(said, "GREY 64x64"));
        assert_true(fv_watch_read(watch, &news) && news.sample[FV_WATCH_HISTORY - 1].valid);
        assert_true(fake.t_ns - news.sample[FV_WATCH_HISTORY - 1].t_ns < 20 * ms);
    }
    assert_true(watch->camera[0].counts.lost == 3 && watch->camera[0].counts.restarts == 3);
    fv_watch_stop(watch);
}

static void refusals(void **state)
{
    (void)state;
    struct fv_watch_settings s = settings();
    plug();
    fake.plugged = false;
    assert_int_equal(fv_watch_open(&watch, &s, &fake_io, say, &error), -1);
    assert_non_null(strstr(error.text, "eye.device: /dev/eye: No such file"));
    plug();
    s.eye[0].width = 640, s.eye[0].height = 400;
    assert_int_equal(fv_watch_open(&watch, &s, &fake_io, say, &error), -1);
    assert_non_null(strstr(error.text, "eye.device: frames are 64x64, calibrated were 640x400"));
    assert_true(fake.opened == 0 && fake.mapped == 0);
}

/* The real clock; one frame a wait. The device belongs to the thread alone. */
static int64_t real_now(void *context)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return ((struct fake *)context)->t_ns = (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static void real_wait(void *context, const int *fd, unsigned *ready, int devices, int64_t timeout_ns)
{
    static const double at[2] = {3, 3};
    struct timespec a_while = {0, 4000000};
    (void)fd, (void)devices;
    assert_true(timeout_ns <= 100 * ms);
    nanosleep(&a_while, NULL);
    real_now(context);
    ready[0] = shows(at, 1) ? FV_CAMERA_READABLE : 0;
}

static void the_thread(void **state)
{
    (void)state;
    static struct fv_camera_io io;
    struct fv_watch_news news = {0};
    int64_t newest_ns = 0, seen = 0;
    io = fake_io;
    io.wait = real_wait, io.now_ns = real_now;
    begin_watch(&io);
    static struct fv_frame_recorder *recorder;
    struct fv_frame_tape tape;
    int width[2], height[2];
    char path[256];
    fv_watch_size(watch, 0, &width[0], &height[0]);
    assert_int_equal(fv_frame_recorder_open(&recorder, program_folder(), 1, width, height, &error), 0);
    atomic_store(&watch->recorder, recorder);
    if (fv_watch_start(watch, &error)) fail_msg("%s", error.text);
    for (int i = 0; i < 4000 && seen < 30; i++) {
        struct timespec a_while = {0, 1000000};
        nanosleep(&a_while, NULL);
        if (!fv_watch_read(watch, &news)) continue;
        for (int k = 1; k < news.samples; k++) assert_true(news.sample[k].t_ns > news.sample[k - 1].t_ns);
        seen += news.sample[news.samples - 1].t_ns > newest_ns;
        newest_ns = news.sample[news.samples - 1].t_ns;
    }
    fv_heap_seal(false);
    assert_true(fv_watch_stop(watch));
    assert_int_equal(fv_heap_calls(), 0);
    assert_int_equal(seen, 30);
    struct fv_watch_tally tally;
    assert_true(fv_watch_count(watch, &tally) && tally.camera[0].frames == watch->camera[0].counts.frames);
    assert_int_equal(fv_frame_recorder_close(recorder, &error), 0);
    snprintf(path, sizeof path, "%s/left.frames", program_folder());
    assert_int_equal(fv_frame_tape_read(&tape, path, &error), 0);
    assert_int_equal(tape.frames + recorder->dropped, tally.camera[0].frames);
    free((void *)tape.bytes);
    assert_true(watch->latency.frames >= 30 && watch->latency.sum_ns > 0);
    print_message("frame in memory to gaze, 64x64: mean %.3f ms\n",
                  1e-6 * (double)watch->latency.sum_ns / (double)watch->latency.frames);
}

static double angle_deg(const double a[3], const double b[3])
{
    return acos(fmin(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], 1)) / degree;
}

/* eye.source=sim-camera: what the loop latches is near the true gaze, never later than what is known, the
 * same again. */
static void simulated_cameras(void **state)
{
    (void)state;
    enum { LATCHES = 40 };
    static struct fv_gaze first[LATCHES];
    for (int round = 0; round < 2; round++) {
        struct fv_config *config = sensor_settings("sim-camera", "none", 5, 1);
        config->eye_width = 320, config->eye_height = 240, config->eye_hz = 100, config->eye_confidence = 0.5;
        config->eye_settle_ms = 30;
        config->eye_model.count = 3;
        config->eye_model.value[0] = config->eye_model.value[1] = config->eye_model.value[2] = 0.5;
        struct fv_sensors *sensors = opened(config);
        struct fv_pose head;
        struct fv_gaze gaze;
        int near = 0, judged = 0, held = 0;
        for (int i = 0; i < LATCHES; i++) {
            int64_t now_ns = 300 * ms + i * 16 * ms;
            struct fv_gaze_sample truth;
            fv_sensors_latch(sensors, now_ns, i % 2 ? now_ns : now_ns + 10 * ms, &head, &gaze);
            assert_true(gaze.t_ns <= now_ns && (gaze.held || gaze.t_ns > now_ns - 11 * ms));
            assert_true(gaze.uncertainty_deg > 0 && isfinite(gaze.uncertainty_deg));
            if (round == 1) assert_memory_equal(&gaze, &first[i], sizeof gaze);
            first[i] = gaze;
            held += gaze.held;
            fv_sim_gaze(5, gaze.t_ns, &truth);
            if (gaze.held || !truth.valid) continue;
            judged++;
            near += angle_deg(gaze.direction[0], truth.direction[0]) < 1.5;
        }
        print_message("%d of %d within 1.5 degrees, %d held\n", near, judged, held);
        assert_true(judged > LATCHES / 2 && near >= judged * 9 / 10);
    }
}

static void source_errors(void **state)
{
    (void)state;
    static const struct {
        const char *device, *calibration, *expected;
    } cases[] = {{"", "", "eye.device: no camera is named"},
                 {"/nowhere/camera", "", "eye.device: /nowhere/camera: No such file"},
                 {"/dev/null", "", "eye.device: /dev/null: no camera"},
                 {"/dev/null", "/nowhere/c.csv", "eye.calibration: /nowhere/c.csv"}};
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct fv_config *config = sensor_settings("v4l2", "none", 1, 1);
        struct fv_sensors *sensors;
        config->eye_width = 640, config->eye_height = 400, config->eye_hz = 120;
        config->eye_model.count = 3;
        config->eye_model.value[2] = 0.2;
        strcpy(config->eye_device, cases[i].device);
        strcpy(config->eye_calibration, cases[i].calibration);
        strcpy(config->eye_format, "any");
        assert_int_equal(fv_sensors_open(&sensors, config, &error), -1);
        if (!strstr(error.text, cases[i].expected) || strchr(error.text, '\n')) fail_msg("%s", error.text);
    }
}

static const char good[] =
    "# foveola calibration 1, 640x400\n"
    "eye,pupil_x_px,pupil_y_px,glint_x_px,glint_y_px,right_deg,up_deg,weight\n"
    "left,200,100,nan,nan,15,10,1\nleft,400,100,nan,nan,-15,10,0.9\r\n\n# five places\n"
    "left,300,200,nan,nan,0,0,1\nleft,200,300,nan,nan,15,-10,1\nleft,400,300,nan,nan,-15,-10,1";

static void calibration_files(void **state)
{
    (void)state;
    static const struct {
        const char *find, *replace, *expected;
    } cases[] = {{"# foveola", "# other", "c.csv:1: no calibration"},
                 {"calibration 1", "calibration 2", "c.csv:1: no calibration"},
                 {"640x400", "640x", "c.csv:1: no calibration"},
                 {"640x400", "0x400", "c.csv:1: frames of 0x400"},
                 {"eye,pupil", "eyes,pupil", "c.csv:2: must be"},
                 {"left,300", "both,300", "c.csv:7: eye 'both'"},
                 {"left,300", "leftleftleft,300", "c.csv:7: must be"},
                 {"0,0,1", "0,0", "c.csv:7: must be"},
                 {"0,0,1", "0,0,1,1", "c.csv:7: must be"},
                 {"0,0,1", "0,0,2", "c.csv:7: must be a pupil"},
                 {"0,0,1", "81,0,1", "c.csv:7: must be a pupil"},
                 {"0,0,1", "nan,0,1", "c.csv:7: must be a pupil"},
                 {"left,300,", "left,inf,", "c.csv:7: must be a pupil"},
                 {"left,300,200,nan,nan,0,0,1", "", "left eye: fewer than 5"},
                 {"0,0,1", "15,10,1", "left eye: fewer than 5"}};
    struct fv_calibration c;
    char text[1024];
    if (fv_calibration_parse(&c, "c.csv", good, sizeof good - 1, &error)) fail_msg("%s", error.text);
    assert_true(c.width == 640 && c.height == 400 && c.rows[0] == 5 && c.rows[1] == 0);
    assert_true(c.map[0].pupil.terms > 0 && c.map[0].difference.terms == 0 && c.map[1].pupil.terms == 0);
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *at = strstr(good, cases[i].find);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - good), good, cases[i].replace,
                 at + strlen(cases[i].find));
        assert_int_equal(fv_calibration_parse(&c, "c.csv", text, strlen(text), &error), -1);
        if (!strstr(error.text, cases[i].expected)) fail_msg("%s: %s", cases[i].expected, error.text);
    }
    assert_int_equal(fv_calibration_parse(&c, "c.csv", "", 0, &error), -1);
    assert_int_equal(
        fv_calibration_parse(&c, "c.csv", good, strlen("# foveola calibration 1, 640x400\n"), &error), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(frames_become_samples),
                                       cmocka_unit_test(looks_are_recorded), cmocka_unit_test(lost_and_back),
                                       cmocka_unit_test(refusals),
                                       cmocka_unit_test(the_thread),
                                       cmocka_unit_test(simulated_cameras),
                                       cmocka_unit_test(source_errors),
                                       cmocka_unit_test(calibration_files)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
