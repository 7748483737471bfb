/* imu_tape: raw samples of a sensor recorded while it streams, stalls, is unplugged and garbles its reports, and played:
 * the same rotation to the bit; tapes that are not sound; played as a source of head poses. */
#include "platform/spool.h"
#include "sensors/imu/player.h"

#include "tests/support/made_up_imu.h"
#include "tests/support/opened_sensors.h"

enum { STATES = 4000 };

static struct fv_spooler spooler; /* its thread is not started: the test is it */
static struct fv_imu_player player;
static struct fv_imu_tape tape;
static char text[4 << 20], path[512];
static struct fv_imu_state state_at[STATES];
static const struct fv_neck neck = {0.075, 0.0805};

static void drain(void)
{
    for (int i = 0; i < spooler.spools; i++) fv_spool_drain(spooler.spool[i]);
}

static struct fv_imu_recorder *begin_recording(void)
{
    struct fv_imu_recorder *recorder;
    spooler = (struct fv_spooler){0};
    snprintf(path, sizeof path, "%s/imu.csv", program_folder());
    if (fv_imu_recorder_open(&recorder, program_folder(), &spooler, &error)) fail_msg("%s", error.text);
    atomic_store(&feed.recorder, recorder);
    return recorder;
}

/* Readings that jump, repeat, are late or none of the report's, at times. */
static void garble(struct host *h)
{
    if (h->sent % 97 == 0) put(h->report + 1 + 12, 123456789u * (uint32_t)h->sent, 4);
    if (h->sent % 211 == 0) put(h->report + 1 + 34 + 12, h->ticks, 4);
    if (h->sent % 331 == 0) h->ticks += 48000u * 50; /* lost */
    if (h->sent % 1009 == 0) h->ticks -= 0x70000000u; /* the clock begins anew */
    if (h->sent % 5 == 0) put(h->report + 1 + 34 + 6, (uint64_t)(h->sent * 37), 2);
}

/* Records some seconds of a bad day; returns the number of states that were kept, after each step. */
static int record(const struct fv_imu_calibration *calibration)
{
    int states = 0;
    struct fv_imu_recorder *recorder;
    host.calibration = calibration;
    recorder = begin_recording();
    assert_int_equal(fv_imu_feed_search(&feed, &error), 0);
    for (int i = 0; i < 16000 && states < STATES; i++) {
        host.spoil = i > 1000 ? garble : NULL;
        host.plugged = i < 3000 || i > 5000;
        host.rate_deg_s = 90 * sin(i * 1e-3);
        if (i == 4000) host.ticks = 77;
        fv_imu_feed_step(&feed);
        if (i % 64 == 0) drain();
        if (host.plugged && i % 4 == 0) assert_true(fv_mailbox_get(&feed.box, &state_at[states++], sizeof state_at[0]));
    }
    fv_imu_feed_close(&feed);
    drain();
    assert_true(fv_spooler_counts(&spooler).dropped == 0);
    if (fv_imu_recorder_close(recorder, INT64_MIN, &error)) fail_msg("%s", error.text);
    return states;
}

static void a_recorded_stream_gives_the_same_rotation_again(void **state)
{
    (void)state;
    static const struct fv_imu_calibration calibration = {
        {1.01, 0.99, 1}, {0.1, -0.2, 0.05}, {0.98, 1, 1.03}, {0.01, -0.02, 0.003}};
    for (int calibrated = 0; calibrated < 2; calibrated++) {
        fresh(NULL);
        int states = record(calibrated ? &calibration : NULL), compared = 0;
        const struct fv_imu_feed_counts live = state_at[states - 1].counts;
        assert_true(live.connects >= 2 && live.lost > 0 && live.restarts > 0 && live.repeated > 0);
        assert_int_equal(fv_imu_player_open(&player, path, &error), 0);
        assert_true(player.tape.rejected == 0 && player.tape.streams == 1 && player.tape.rows >= live.samples);
        assert_true(player.tape.rows < live.samples * 5 / 4); /* a ring's old readings are left out */
        for (int i = 0; i < states; i++) {
            const struct fv_imu_state *a = &state_at[i], *b = &player.feed.state;
            struct fv_pose head;
            if (a->good == 0) continue;
            fv_imu_player_head(&player, &neck, true, a->arrival_ns - player.tape.session_ns, 0, &head);
            if (b->good != a->good) continue; /* a sample was refused since then */
            compared++;
            assert_memory_equal(a->rotation, b->rotation, sizeof a->rotation);
            assert_memory_equal(a->rate, b->rate, sizeof a->rate);
            assert_int_equal(a->t_ns - player.tape.session_ns, b->t_ns);
        }
        print_message("%d states of %d compared, %lld rows, %lld samples\n", compared, states, (long long)player.tape.rows,
                      (long long)live.samples);
        assert_true(compared > states * 9 / 10);
        const struct fv_imu_feed_counts played = player.feed.state.counts;
        assert_true(played.samples == live.samples && played.lost == live.lost && played.restarts == live.restarts &&
                    played.connects == live.connects && played.rejected == live.rejected);
    }
}

/* Past its end the tape goes on from its beginning; asked again, a second player says the same. */
static void it_starts_again(void **state)
{
    (void)state;
    static struct fv_imu_player second;
    fresh(NULL);
    struct fv_imu_recorder *recorder = begin_recording();
    assert_int_equal(fv_imu_feed_search(&feed, &error), 0);
    for (int i = 0; i < 1000; i++) fv_imu_feed_step(&feed), drain();
    if (fv_imu_recorder_close(recorder, host.now_ns - 500 * ms, &error)) fail_msg("%s", error.text);
    assert_int_equal(fv_imu_player_open(&player, path, &error), 0);
    assert_int_equal(player.tape.session_ns, host.now_ns - 500 * ms);
    fv_imu_player_begin(&second, &player.tape);
    int64_t length_ns = player.length_ns;
    assert_int_equal(length_ns, 501 * ms);
    static const int64_t extremes[] = {INT64_MIN, -1, 0};
    struct fv_pose head, other;
    for (int i = 0; i < 3; i++) fv_imu_player_head(&second, &neck, true, extremes[i], 10 * ms, &head);
    assert_int_equal(second.feed.state.counts.reports, 500); /* of before the session */
    for (int64_t t = 0; t < 5 * length_ns; t += 7 * ms) {
        assert_true(fv_imu_player_head(&player, &neck, true, t, 5 * ms, &head));
        assert_true(fv_imu_player_head(&second, &neck, true, t, 5 * ms, &other));
        assert_memory_equal(&head, &other, sizeof head);
    }
    assert_true(player.round == 4 && player.feed.state.counts.connects == 5);
    assert_true(player.feed.state.counts.rejected == 0 && player.feed.state.counts.restarts == 0);
    fv_imu_player_head(&player, &neck, true, 1000000 * length_ns + 3 * ms, 0, &head); /* in no time */
    fv_imu_player_head(&player, &neck, true, INT64_MAX, INT64_MAX, &head);
    for (int i = 0; i < 4; i++) assert_true(isfinite(head.rotation[i]));
    fv_imu_player_head(&player, &neck, true, 0, 0, &head); /* back: as it was */
}

/* Where the ring is full whole streams of readings are missing, and what is there can be read. */
static void rows_that_were_dropped(void **state)
{
    (void)state;
    fresh(NULL);
    struct fv_imu_recorder *recorder = begin_recording();
    assert_int_equal(fv_imu_feed_search(&feed, &error), 0);
    for (int i = 0; i < FV_IMU_RECORDER_ROWS + 2000; i++) fv_imu_feed_step(&feed);
    drain();
    for (int i = 0; i < 100; i++) fv_imu_feed_step(&feed);
    drain();
    struct fv_spool_counts c = fv_spooler_counts(&spooler);
    assert_int_equal(c.rows, FV_IMU_RECORDER_ROWS + 100);
    assert_true(c.dropped > 1900);
    if (fv_imu_recorder_close(recorder, INT64_MIN, &error)) fail_msg("%s", error.text);
    assert_int_equal(fv_imu_player_open(&player, path, &error), 0);
    assert_true(player.tape.rows == c.rows - 1 && player.tape.rejected == 0);
}

#define FIRST "# foveola imu 1\n"
#define NAMES "arrival_ns,reading,counter,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2\n"
#define REST " acc_scale=1,1,1 acc_bias_m_s2=0,0,0 rate_scale=1,1,1 rate_bias_rad_s=0,0,0"
#define STREAM "# stream tick_ns=1000 counter_bits=32 hz=1000 acc_full=inf rate_full=inf axes=1,2,3" REST " device=made up\n"
#define ROW "5000,0,7,0.1,0,0,0,9.8,0\n"

static void what_is_read(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int rows, rejected;
        const char *error; /* NULL: none */
    } cases[] = {
        {FIRST NAMES STREAM ROW, 1, 0, NULL},
        {FIRST NAMES STREAM ROW "5000,1,8,nan,inf,-inf,0,9.8,0\n6000,0,9,1,2,3,4,5,6", 2, 0, NULL}, /* cut off */
        {FIRST "\r\n" NAMES "\n# a remark\n" STREAM ROW "# session 0 = 4000 ns\n" STREAM ROW, 2, 0, NULL},
        {FIRST NAMES STREAM ROW ROW ROW "4000,0,7,0,0,0,0,0,0\n5000,2,7,0,0,0,0,0,0\n", 3, 2, NULL},
        {FIRST NAMES STREAM ROW ROW ROW "6000,0,-7,0,0,0,0,0,0\n6000,0,7,0,0,0,0,0\n6000,0,7,0,0,0,0,0,0,0\n", 3, 3, NULL},
        {FIRST NAMES STREAM ROW ROW "6000,0,7,0,0,0,0,0,\n,,,,,,,,\n", 2, 2, NULL},
        {FIRST NAMES STREAM ROW "# session 0 = soon\n", 1, 1, NULL},
        {FIRST NAMES STREAM ROW ROW "9e18,0,7,0,0,0,0,0,0\n9000000000000000000,0,7,0,0,0,0,0,0\n", 2, 2, NULL},
        {FIRST NAMES STREAM ROW "5000000000000000,0,7,0,0,0,0,0,0\n", 1, 1, NULL},
        {FIRST NAMES STREAM "5000,1,7,0,0,0,0,0,0\n", 0, 0, ":4: not the next reading of its report; 1 rows are bad, 0 good"},
        {FIRST NAMES ROW, 0, 0, ":3: stream: none is told before the first row"},
        {FIRST NAMES STREAM, 0, 0, "no rows follow"},
        {FIRST, 0, 0, "no rows follow"},
        {FIRST STREAM ROW, 0, 0, ":3: column names are missing"},
        {"# foveola imu 2\n", 0, 0, ":1: must begin with '# foveola imu 1'"},
        {FIRST NAMES "# stream\n" ROW, 1, 0, ":4: stream: none is told"},
        {FIRST NAMES "# stream tick_ns=1000 hz=3\n" ROW, 0, 0, ":3: stream: counter_bits="},
        {FIRST NAMES "# stream tick_ns=0 counter_bits=32 hz=1000 acc_full=1 rate_full=1 axes=1,2,3" REST "\n" ROW, 0, 0,
         ":3: stream: a counter of 32 bits and 0 ns"},
        {FIRST NAMES "# stream tick_ns=1 counter_bits=1e300 hz=1000 acc_full=1 rate_full=1 axes=1,2,3" REST "\n" ROW, 0, 0,
         ":3: stream: counter_bits"},
        {FIRST NAMES "# stream tick_ns=1 counter_bits=32 hz=1000 acc_full=1 rate_full=1 axes=1,2,2" REST "\n" ROW, 0, 0,
         ":3: stream: an axis is named twice"},
        {FIRST NAMES "# stream tick_ns=1 counter_bits=32 hz=1000 acc_full=0 rate_full=1 axes=1,2,3" REST "\n" ROW, 0, 0,
         ":3: stream: a full scale"},
        {FIRST NAMES "# stream tick_ns=1 counter_bits=32 hz=nan acc_full=1 rate_full=1 axes=1,2,3" REST "\n" ROW, 0, 0,
         ":3: stream: nan readings"},
    };
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct fv_imu_tape_row row[8];
        int result = fv_imu_tape_parse(&tape, "tape", cases[i].text, strlen(cases[i].text), NULL, &error);
        if ((result == 0) != !cases[i].error || (result && !strstr(error.text, cases[i].error)))
            fail_msg("case %u: %d, '%s'", i, result, error.text);
        if (result) continue;
        assert_int_equal(fv_imu_tape_parse(&tape, "tape", cases[i].text, strlen(cases[i].text), row, &error), 0);
        if (tape.rows != cases[i].rows || tape.rejected != cases[i].rejected)
            fail_msg("case %u: %lld rows, %lld rejected", i, (long long)tape.rows, (long long)tape.rejected);
        assert_true(row[0].arrival_ns == 5000 && row[0].reading.counter == 7 && row[0].reading.rate[0] == 0.1 &&
                    row[0].begins && row[0].number == 0);
    }
    /* More kinds of streams than are told apart. */
    int used = snprintf(text, sizeof text, FIRST NAMES);
    for (int i = 0; i <= FV_IMU_TAPE_DEVICES; i++)
        used += snprintf(text + used, sizeof text - (size_t)used, "# stream tick_ns=%d counter_bits=32 hz=1000 acc_full=1 "
                         "rate_full=1 axes=1,2,3" REST "\n" ROW, i + 1);
    assert_int_equal(fv_imu_tape_parse(&tape, "tape", text, (size_t)used, NULL, &error), -1);
    assert_non_null(strstr(error.text, "more kinds of them"));
}

/* As imu.source=tape: the head turns as it did, predicted; before the first sample it is where it was. */
static void a_source_of_head_poses(void **state)
{
    (void)state;
    fresh(NULL);
    struct fv_imu_recorder *recorder = begin_recording();
    assert_int_equal(fv_imu_feed_search(&feed, &error), 0);
    for (int i = 0; i < 1000; i++) fv_imu_feed_step(&feed), drain();
    if (fv_imu_recorder_close(recorder, 990 * ms, &error)) fail_msg("%s", error.text);
    struct fv_config *config = sensor_settings("sim", "tape", 1, 1);
    snprintf(config->imu_tape, sizeof config->imu_tape, "%s", path);
    struct fv_sensors *sensors = opened(config);
    for (int64_t t = 0; t < 1000 * ms; t += 10 * ms) {
        struct fv_pose head;
        struct fv_gaze gaze;
        double turn[3];
        fv_sensors_latch(sensors, t, t + 20 * ms, &head, &gaze);
        fv_quat_to_vector(head.rotation, turn);
        double expected = t < 11 * ms ? 0 : (t + 9 * ms) * 1e-9 * M_PI / 2; /* 90 degrees a second, begun 11 ms ago */
        if (fabs(turn[1] - expected) > 0.01) fail_msg("%g at %g ms: %g", turn[1], t * 1e-6, expected);
    }
    struct fv_sensors_counts counts = fv_sensors_counts(sensors);
    assert_int_equal(counts.imu_samples, 98); /* at 0 and at 10 ms none was there yet */
    assert_int_equal(counts.imu_rejected, 2);
    assert_true(counts.imu_lost == 0 && counts.imu_reconnects == 0);
    snprintf(text, sizeof text, FIRST NAMES "# stream nonsense\n" ROW);
    program_write("bad.csv", text, strlen(text));
    snprintf(config->imu_tape, sizeof config->imu_tape, "%s/bad.csv", program_folder());
    assert_int_equal(fv_sensors_open(&sensors, config, &error), -1);
    assert_non_null(strstr(error.text, "bad.csv:3: stream: tick_ns="));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_recorded_stream_gives_the_same_rotation_again),
        cmocka_unit_test(it_starts_again),
        cmocka_unit_test(rows_that_were_dropped),
        cmocka_unit_test(what_is_read),
        cmocka_unit_test(a_source_of_head_poses),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
