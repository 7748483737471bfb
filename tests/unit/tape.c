/* Tapes, good and bad: what is written reads back to the same bits, bad rows are counted, unusable
 * files are named, and real recordings come out human. */
#include "sensors/tape.h"
#include "tests/support/random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define HEAD                                                                                                 \
    "# foveola head "                                                                                        \
    "1\nt_ns,position_x_m,position_y_m,position_z_m,rotation_w,rotation_x,rotation_y,rotation_z\n"
#define GAZE "# foveola gaze 1\nt_ns,left_x,left_y,left_z,right_x,right_y,right_z,valid\n"
#define GAZE_SURE                                                                                            \
    "# foveola gaze 1\nt_ns,left_x,left_y,left_z,right_x,right_y,right_z,valid,uncertainty_deg\n"
#define TEXT "timestamp viewpoint w x y z\n"
#define VARJO                                                                                                \
    "raw_timestamp,status,left_status,right_status,gaze_forward_x,gaze_forward_y,gaze_forward_z,left_"       \
    "forward_x,"                                                                                             \
    "left_forward_y,left_forward_z,right_forward_x,right_forward_y,right_forward_z,HMD_position_x,HMD_"      \
    "position_y,"                                                                                            \
    "HMD_position_z,HMD_rotation_x,HMD_rotation_y,HMD_rotation_z\n"
#define AHEAD "0,0,-1,0,0,-1,1\n"

static const int64_t ms = 1000000;
static const double degree = M_PI / 180;
static struct fv_head_sample heads[100000];
static struct fv_gaze_sample gazes[100000];

static int parse_bytes(struct fv_tape *tape, const char *text, size_t size, struct fv_error *error)
{
    struct fv_tape counted;
    char *copy = malloc(size + 1); /* so that the sanitizer sees every step over the end */
    memcpy(copy, text, size);
    copy[size] = 0;
    error->text[0] = 0;
    int first = fv_tape_parse(&counted, "tape.csv", copy, size, NULL, NULL, error);
    int result = fv_tape_parse(tape, "tape.csv", copy, size, heads, gazes, error);
    free(copy);
    assert_int_equal(first, result);
    assert_true(counted.heads == tape->heads && counted.gazes == tape->gazes);
    return result;
}

static int parse(struct fv_tape *tape, const char *text, struct fv_error *error)
{
    return parse_bytes(tape, text, strlen(text), error);
}

static void unusable_tapes_are_named(void **state)
{
    (void)state;
    static const struct {
        const char *text, *expected;
    } cases[] = {
        {"", "tape.csv:1: the tape is empty"},
        {"\n", "tape.csv:1: not a tape"},
        {"\xef\xbb\xbf", "tape.csv:1: the tape is empty"},
        {"\x89PNG\r\n\x1a\n\x01\x02\x03", "tape.csv:1: not a tape"},
        {"a,b,c\n1,2,3\n", "tape.csv:1: not a tape"},
        {"# foveola head 2\n", "tape.csv:1: not a version"},
        {"# foveola head 1", "tape.csv:2: column names"},
        {"# foveola head 1\nt_ns,position_x_m\n0,0\n", "tape.csv:2: column names"},
        {"# foveola gaze 1\nt_ns,position_x_m,position_y_m\n", "tape.csv:2: column names"},
        {HEAD, "tape.csv:2: no rows follow"},
        {HEAD "\n\n\n", "no rows follow"},
        {HEAD "1,2,3\n", "tape.csv:3: the row is short; 1 rows are bad, 0 good"},
        {HEAD "0,0,0,0,1,0,0\n", "tape.csv:3: the row is short"},
        {HEAD "0,0,0,0,0,0,0,0\n", "tape.csv:3: not a finite position and unit quaternion"},
        {HEAD "0,0,0,0,1,nan,0,0\n", "tape.csv:3: not a finite number"},
        {HEAD "0,inf,0,0,1,0,0,0\n", "tape.csv:3: not a finite number"},
        {HEAD "0,1e9,0,0,1,0,0,0\n", "tape.csv:3: not a finite position"},
        {HEAD "0,,0,0,1,0,0,0\n", "tape.csv:3: not a finite number"},
        {HEAD "0,0,0,0,1,0,0,\n1\n", "tape.csv:3: not a finite number"},
        {HEAD "0,0,0,0,1,0,0,zero\n", "tape.csv:3: not a finite number"},
        {HEAD "soon,0,0,0,1,0,0,0\n", "tape.csv:3: the time is not a number"},
        {HEAD "1.5,0,0,0,1,0,0,0\n", "tape.csv:3: the time is not a number"},
        {HEAD "99999999999999999999,0,0,0,1,0,0,0\n", "tape.csv:3: the time is not a number in range"},
        {HEAD "-1,0,0,0,1,0,0,0\n", "tape.csv:3: the time is out of range"},
        {HEAD "61000000000,0,0,0,1,0,0,0\n", "tape.csv:3: session time starts at 0"},
        {GAZE "0,0,0,-1,0,0,-1,2\n", "tape.csv:3: valid must be 0 or 1"},
        {GAZE_SURE "0,0,0,-1,0,0,-1,1,-0.1\n", "tape.csv:3: uncertainty_deg must be 0 to 180"},
        {GAZE_SURE "0,0,0,-1,0,0,-1,1,181\n", "tape.csv:3: uncertainty_deg must be 0 to 180"},
        {GAZE_SURE "0,0,0,-1,0,0,-1,1,inf\n", "tape.csv:3: not a finite number"},
        {GAZE_SURE "0,0,0,-1,0,0,-1,1\n", "tape.csv:3: the row is short"},
        {TEXT "0 0 2 0 0 0\n", "tape.csv:2: not a finite position and unit quaternion"},
        {TEXT "1e300 0 1 0 0 0\n", "tape.csv:2: the time is not a number in range"},
        {HEAD "5,0,0,0,1,0,0,0\n5,0,0,0,1,0,0,0\n4,0,0,0,1,0,0,0\n",
         "tape.csv:4: the time does not grow; 2 rows are bad, 1 good"},
    };
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct fv_tape tape;
        struct fv_error error;
        if (parse(&tape, cases[i].text, &error) == 0) fail_msg("accepted: %s", cases[i].text);
        if (!strstr(error.text, cases[i].expected))
            fail_msg("'%s' instead of '%s'", error.text, cases[i].expected);
    }
}

static void bad_rows_are_counted(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int heads, gazes, valid, rejected;
    } cases[] = {
        {HEAD "0,0,0,0,1,0,0,0\n5,0,0,0,1,0,0,0\n3,0,0,0,1,0,0,0\n5,0,0,0,1,0,0,0\n9,0,0,0,1,0,0,0", 3, 0, 0,
         2},
        {HEAD "0,0,0,0,1,0,0,0\r\n\r\n5,0,0,0,1,0,0,0\r\n", 2, 0, 0, 0},
        {"\xef\xbb\xbf" HEAD "0 , 0,\t0,0,1,0,0,0\n", 1, 0, 0, 0},
        {HEAD "0,0,0,0,1,0,0,0\n1,0,0,0,NaN,0,0,0\n2,0,0,0,1,0,0,0\n3,0,0,0,1,0", 2, 0, 0, 2},
        {HEAD "0,0,0,0,1,0,0,0,more,columns\n", 1, 0, 0, 0},
        {HEAD "0,0,0,0,1.0005,0,0,0\n1,0,0,0,0.9,0,0,0\n", 1, 0, 0, 1},
        {HEAD "0,0,0,0,1,0,0,0\n2000000000000000,0,0,0,1,0,0,0\n", 1, 0, 0, 1},
        {GAZE "0," AHEAD "1,0,0,0,0,0,0,0\n2,0,0,-1,0,0,-2,1\n3,0,0,1,0,0,-1,1\n", 0, 4, 1, 0},
        {"# foveola gaze 1\nvalid,right_x,right_y,right_z,t_ns,left_x,left_y,left_z\n1,0,0,-1,7,0,0,-1\n", 0,
         1, 1, 0},
        {"# foveola gaze 1\nuncertainty_deg,valid,right_x,right_y,right_z,t_ns,left_x,left_y,left_z\n"
         "0.5,1,0,0,-1,7,0,0,-1\n181,1,0,0,-1,8,0,0,-1\n180,1,0,0,-1,9,0,0,-1\n",
         0, 2, 2, 1},
        {TEXT "100.5 0 1 0 0 0\n100.6 0 -1 0 0 0\n100.6 0 1 0 0 0\n", 2, 0, 0, 1},
        /* Varjo: not tracked; tracked; one eye; status adjust; rotation impossible. */
        {VARJO "1000,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0\n1010,2,2,2,0,0,1,0,0,1,0,0,1,0,0,0,0,0,0\n"
               "1020,2,2,0,0,0,1,0,0,1,0,0,0,0,0,0,0,0,0\n1030,1,2,2,0,0,1,0,0,1,0,0,1,0,0,0,0,0,0\n"
               "1040,2,2,2,0,0,1,0,0,1,0,0,1,0,0,0,1,1,0\n",
         4, 5, 3, 1},
    };
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct fv_tape tape;
        struct fv_error error;
        int valid = 0;
        if (parse(&tape, cases[i].text, &error)) fail_msg("%u: %s", i, error.text);
        for (int g = 0; g < tape.gazes; g++) valid += gazes[g].valid;
        assert_int_equal(tape.heads, cases[i].heads);
        assert_int_equal(tape.gazes, cases[i].gazes);
        assert_int_equal(valid, cases[i].valid);
        assert_int_equal(tape.rejected, cases[i].rejected);
    }
}

static void long_lines_and_noise_are_survived(void **state)
{
    (void)state;
    static char text[200000];
    struct fv_tape tape;
    struct fv_error error;
    int used = snprintf(text, sizeof text, "%s0,0,0,0,1,0,0,0\n1,", HEAD);
    memset(text + used, '1', 100000); /* a number of 100,000 digits */
    used += 100000;
    used += snprintf(text + used, sizeof text - (size_t)used, ",0,0,1,0,0,0\n2,0,0,0,1,0,0,0\n");
    assert_int_equal(parse(&tape, text, &error), 0);
    assert_true(tape.heads == 2 && tape.rejected == 1);
    memset(text, ',', sizeof text); /* one line of nothing but commas, and as a header */
    assert_int_equal(parse_bytes(&tape, text, sizeof text, &error), -1);
    memcpy(text, HEAD "0,0,0,0,1,0,0,0\n", strlen(HEAD) + 17);
    assert_int_equal(parse_bytes(&tape, text, sizeof text, &error), 0);
    assert_int_equal(tape.rejected, 1);
    uint64_t random = 1;
    for (size_t i = strlen(HEAD); i < 20000; i++) {
        uint64_t bits = random_bits(&random);
        text[i] = bits >> 60 ? "0123456789,.-e\n"[bits % 15] : (char)(bits >> 32);
    }
    (void)parse_bytes(&tape, text, 20000, &error);
    for (int i = 0; i < tape.heads; i++) assert_true(fv_head_pose_good(&heads[i].pose));
}

static void near_unit_is_made_unit(void **state)
{
    (void)state;
    struct fv_tape tape;
    struct fv_error error;
    assert_int_equal(parse(&tape, HEAD "0,1,2,3,0.7071,0,0.7071,0\n", &error), 0);
    const double *q = heads[0].pose.rotation;
    assert_true(fabs(q[0] * q[0] + q[2] * q[2] - 1) < 1e-15 && heads[0].pose.position_m[2] == 3);
    assert_int_equal(parse(&tape, GAZE "0,0.6,0,-0.8001,0,0,-1,1\n", &error), 0);
    assert_true(fabs(hypot(gazes[0].direction[0][0], gazes[0].direction[0][2]) - 1) < 1e-15);
}

static void written_reads_back_to_the_bit(void **state)
{
    (void)state;
    enum { ROWS = 3000 };
    static struct fv_writer head_writer, gaze_writer;
    static struct fv_head_sample head[ROWS];
    static struct fv_gaze_sample gaze[ROWS];
    char head_path[FV_PATH_MAX], gaze_path[FV_PATH_MAX];
    struct fv_error error;
    snprintf(head_path, sizeof head_path, "%s/unit_tape_head_%ld.csv", FV_BINARY_DIR, (long)getpid());
    snprintf(gaze_path, sizeof gaze_path, "%s/unit_tape_gaze_%ld.csv", FV_BINARY_DIR, (long)getpid());
    assert_int_equal(fv_writer_open(&head_writer, head_path, &error), 0);
    assert_int_equal(fv_writer_open(&gaze_writer, gaze_path, &error), 0);
    fv_tape_begin_head(&head_writer);
    fv_tape_begin_gaze(&gaze_writer);
    for (int64_t i = 0; i < ROWS; i++) { /* uneven steps, the first not at 0 */
        head[i].t_ns = gaze[i].t_ns = 6666667 + i * 13333333 + i % 3 * 1000001;
        fv_sim_head(3, head[i].t_ns, &head[i].pose);
        fv_sim_gaze(3, gaze[i].t_ns, &gaze[i]);
        gaze[i].uncertainty_deg = i % 2 ? 0.1 * (double)i / 3 : 0;
        fv_tape_write_head(&head_writer, &head[i]);
        fv_tape_write_gaze(&gaze_writer, &gaze[i]);
    }
    assert_int_equal(fv_writer_close(&head_writer, &error), 0);
    assert_int_equal(fv_writer_close(&gaze_writer, &error), 0);
    struct fv_tape head_tape, gaze_tape;
    if (fv_tape_read(&head_tape, head_path, &error)) fail_msg("%s", error.text);
    if (fv_tape_read(&gaze_tape, gaze_path, &error)) fail_msg("%s", error.text);
    assert_true(head_tape.heads == ROWS && head_tape.gazes == 0 && head_tape.rejected == 0);
    assert_true(gaze_tape.gazes == ROWS && gaze_tape.heads == 0 && gaze_tape.rejected == 0);
    for (int i = ROWS - 1; i >= 0; i--) {
        struct fv_pose pose;
        struct fv_gaze_sample g;
        fv_tape_head_at(&head_tape, head[i].t_ns, &pose);
        fv_tape_gaze_at(&gaze_tape, gaze[i].t_ns, &g);
        assert_memory_equal(&pose, &head[i].pose, sizeof pose);
        assert_true(g.t_ns == gaze[i].t_ns && g.valid == gaze[i].valid);
        assert_true(g.uncertainty_deg == gaze[i].uncertainty_deg);
        if (g.valid) assert_memory_equal(g.direction, gaze[i].direction, sizeof g.direction);
    }
    unlink(head_path), unlink(gaze_path);
}

static void lookup_interpolates_and_starts_again(void **state)
{
    (void)state;
    struct fv_tape tape;
    struct fv_error error;
    struct fv_pose p;
    struct fv_gaze_sample g;
    /* Half a turn is the quaternion's sign away: 0, then 90 degrees with the sign flipped. */
    assert_int_equal(parse(&tape,
                           HEAD "10,0,0,0,1,0,0,0\n20,1,2,4,-0.70710678118654752,0,-0.70710678118654752,0\n",
                           &error),
                     0);
    fv_tape_head_at(&tape, 15, &p);
    assert_true(fabs(p.position_m[2] - 2) < 1e-15 && fabs(fabs(p.rotation[2]) - sin(M_PI / 8)) < 1e-15);
    /* The mean step is 10: 20 lasts until 30, where 10 comes again. */
    static const struct {
        int64_t t_ns;
        double x;
    } cases[] = {{INT64_MIN, 0}, {-1, 0}, {0, 0},    {10, 0}, {12, 0.2}, {20, 1},       {21, 1},
                 {29, 1},        {30, 0}, {39, 0.9}, {40, 1}, {50, 0},   {INT64_MAX, 1}};
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        fv_tape_head_at(&tape, cases[i].t_ns, &p);
        if (fabs(p.position_m[0] - cases[i].x) > 1e-12)
            fail_msg("%g instead of %g at %lld", p.position_m[0], cases[i].x, (long long)cases[i].t_ns);
        assert_true(fv_head_pose_good(&p));
    }
    assert_int_equal(parse(&tape, HEAD "7,1,0,0,1,0,0,0\n", &error), 0);
    for (int64_t t = 0; t < 100; t += 9) {
        fv_tape_head_at(&tape, t, &p);
        assert_true(p.position_m[0] == 1);
    }
    /* Gaze: the newest sample, until it is stale. */
    assert_int_equal(
        parse(&tape, GAZE "1000000," AHEAD "2000000,0,0.6,-0.8,0,0,-1,1\n900000000," AHEAD, &error), 0);
    fv_tape_gaze_at(&tape, 0, &g);
    assert_false(g.valid);
    fv_tape_gaze_at(&tape, 2 * ms - 1, &g);
    assert_true(g.valid && g.t_ns == ms && g.direction[0][1] == 0);
    fv_tape_gaze_at(&tape, 102 * ms, &g);
    assert_true(g.valid && g.t_ns == 2 * ms && g.direction[0][1] == 0.6);
    fv_tape_gaze_at(&tape, 102 * ms + 1, &g);
    assert_false(g.valid);
    int64_t period = tape.last_ns - tape.first_ns + (tape.last_ns - tape.first_ns) / 2;
    fv_tape_gaze_at(&tape, 2 * ms + 3 * period, &g);
    assert_true(g.valid && g.t_ns == 2 * ms + 3 * period && g.direction[0][1] == 0.6);
    fv_tape_gaze_at(&tape, INT64_MAX, &g);
    fv_tape_gaze_at(&tape, INT64_MIN, &g);
    assert_false(g.valid);
}

/* Axes of others: a known turn in their world is the same turn in ours. */
static void axes_of_others_become_ours(void **state)
{
    (void)state;
    struct fv_tape tape;
    struct fv_error error;
    double ahead[3] = {0, 0, -1};
    char text[2000];
    double half = 0.1, s = sin(half), c = cos(half);
    /* Unity, left-handed: +y turns right, +x turns down, z is forward. */
    snprintf(text, sizeof text,
             VARJO "0,0,0,0,0,0,0,0,0,0,0,0,0,5,5,5,0,0,0\n1,0,0,0,0,0,0,0,0,0,0,0,0,6,7,9,0,%.17g,0\n"
                   "2,0,0,0,0,0,0,0,0,0,0,0,0,5,5,5,%.17g,0,0\n",
             s, s);
    assert_int_equal(parse(&tape, text, &error), 0);
    const double *p = heads[1].pose.position_m;
    assert_true(p[0] == 1 && p[1] == 2 && p[2] == -4);
    fv_quat_rotate(heads[1].pose.rotation, ahead, ahead);
    assert_true(fabs(ahead[0] - sin(2 * half)) < 1e-15 && fabs(ahead[1]) < 1e-15);
    ahead[0] = ahead[1] = 0, ahead[2] = -1;
    fv_quat_rotate(heads[2].pose.rotation, ahead, ahead);
    assert_true(fabs(ahead[1] + sin(2 * half)) < 1e-15 && fabs(ahead[0]) < 1e-15);
    /* The text: +z turns left, +y turns up; its start, wherever it looks, is straight ahead. */
    snprintf(text, sizeof text, TEXT "9 0 %.17g 0 0 %.17g\n10 0 %.17g 0 0 %.17g\n11 0 %.17g 0 0 %.17g\n", c,
             s, -cos(2 * half), -sin(2 * half), c, s);
    assert_int_equal(parse(&tape, text, &error), 0);
    assert_true(fabs(heads[0].pose.rotation[0] - 1) < 1e-15 && heads[1].t_ns == 1000000000);
    ahead[0] = ahead[1] = 0, ahead[2] = -1;
    fv_quat_rotate(heads[1].pose.rotation, ahead, ahead);
    assert_true(fabs(ahead[0] + sin(2 * half)) < 1e-15 && fabs(ahead[1]) < 1e-15);
    assert_true(heads[1].pose.rotation[0] > 0);
    snprintf(text, sizeof text, TEXT "0 0 1 0 0 0\n1 0 %.17g 0 %.17g 0\n", c, s);
    assert_int_equal(parse(&tape, text, &error), 0);
    ahead[0] = ahead[1] = 0, ahead[2] = -1;
    fv_quat_rotate(heads[1].pose.rotation, ahead, ahead);
    assert_true(fabs(ahead[1] - sin(2 * half)) < 1e-15 && fabs(ahead[0]) < 1e-15);
}

/* Share of steps of at least 10 ms whose rotation is faster than `deg_s`; the mean speed into *mean. */
static double faster(const struct fv_tape *tape, double deg_s, double *mean)
{
    int64_t fast = 0, count = 0, last = 0;
    double way = 0;
    for (int64_t i = 1; i < tape->heads; i++) {
        double step = fv_quat_angle(tape->head[last].pose.rotation, tape->head[i].pose.rotation) / degree;
        double seconds = (double)(tape->head[i].t_ns - tape->head[last].t_ns) * 1e-9;
        if (seconds < 0.03) continue;
        way += step, count++, fast += step / seconds > deg_s, last = i;
    }
    *mean = way / ((double)(tape->last_ns - tape->first_ns) * 1e-9);
    return (double)fast / (double)count;
}

static void real_tapes_come_out_human(void **state)
{
    (void)state;
    const char *varjo = FV_SOURCE_DIR "/../shared/data/gaze/varjo/p1_r1.csv";
    const char *text = FV_SOURCE_DIR "/../shared/data/head/user1_quaternion.txt";
    struct fv_tape tape;
    struct fv_error error;
    double mean, fast;
    if (!fv_file_exists(varjo) || !fv_file_exists(text)) {
        print_message("skipped: ../shared/data is not there\n");
        skip();
    }
    if (fv_tape_read(&tape, varjo, &error)) fail_msg("%s", error.text);
    assert_true(tape.heads == 5360 && tape.gazes == 5360 && tape.rejected == 0);
    int valid = 0, crossed = 0;
    double up = 0;
    for (int i = 0; i < tape.gazes; i++) {
        const struct fv_gaze_sample *g = &tape.gaze[i];
        if (!g->valid) continue;
        valid++;
        crossed += g->direction[0][0] >= g->direction[1][0]; /* the left eye looks more to the right */
        for (int eye = 0; eye < 2; eye++) assert_true(acos(-g->direction[eye][2]) < 45 * degree);
        up += g->direction[0][1] / 5360;
    }
    assert_false(tape.gaze[0].valid);
    assert_int_equal(valid, 5278);
    assert_true(crossed > 0.75 * valid && fabs(up) < 0.2);
    fast = faster(&tape, 200, &mean);
    print_message("varjo: %d of 5360 gazes valid, head at %.1f deg/s, %.2f%% above 200\n", valid, mean,
                  100 * fast);
    assert_true(fast < 0.01 && mean > 3 && mean < 60);
    assert_true(tape.head[0].pose.position_m[0] == 0 && tape.last_ns > 53000 * ms &&
                tape.last_ns < 56000 * ms);
    if (fv_tape_read(&tape, text, &error)) fail_msg("%s", error.text);
    assert_true(tape.heads == 16053 && tape.gazes == 0 && tape.rejected == 0);
    fast = faster(&tape, 250, &mean);
    double level = 0, pitch = 0, down = 0;
    for (int i = 0; i < tape.heads; i++) {
        double right[3] = {1, 0, 0}, ahead[3] = {0, 0, -1};
        fv_quat_rotate(tape.head[i].pose.rotation, right, right);
        fv_quat_rotate(tape.head[i].pose.rotation, ahead, ahead);
        level += right[1] * right[1], pitch += ahead[1] * ahead[1], down += ahead[1] < 0;
    }
    print_message("head text: %.1f deg/s, %.2f%% above 250; roll %.1f, pitch %.1f deg rms\n", mean,
                  100 * fast, sqrt(level / 16053) / degree, sqrt(pitch / 16053) / degree);
    assert_true(fast < 0.02 && mean > 10 && mean < 60);
    assert_true(level < 0.25 * pitch && down > 0.5 * 16053);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(unusable_tapes_are_named),
        cmocka_unit_test(bad_rows_are_counted),
        cmocka_unit_test(long_lines_and_noise_are_survived),
        cmocka_unit_test(near_unit_is_made_unit),
        cmocka_unit_test(written_reads_back_to_the_bit),
        cmocka_unit_test(lookup_interpolates_and_starts_again),
        cmocka_unit_test(axes_of_others_become_ours),
        cmocka_unit_test(real_tapes_come_out_human),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
