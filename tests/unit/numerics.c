/* numerics: the whole table on a small scene, with tapes, and numerics.csv written, read and damaged. */
#include "cli/numerics.h"
#include "sensors/tape.h"
#include "tests/support/program.h"

#include <math.h>

static struct fv_setup setup;
static struct fv_numeric_row row[FV_NUMERICS_MAX], again[FV_NUMERICS_MAX + 1];
static int rows;

/* Tapes as a recorder would leave them: 5 s of the simulated sensors. */
static void write_tapes(char head_path[256], char gaze_path[256])
{
    static struct fv_writer out;
    struct fv_error error;
    snprintf(head_path, 256, "%s/head.csv", program_folder());
    snprintf(gaze_path, 256, "%s/gaze.csv", program_folder());
    assert_int_equal(fv_writer_open(&out, head_path, &error), 0);
    fv_tape_begin_head(&out);
    for (int64_t t_ns = 0; t_ns < 5000000000; t_ns += 4000000) {
        struct fv_head_sample s = {.t_ns = t_ns};
        fv_sim_head(7, t_ns, &s.pose);
        fv_tape_write_head(&out, &s);
    }
    assert_int_equal(fv_writer_close(&out, &error), 0);
    assert_int_equal(fv_writer_open(&out, gaze_path, &error), 0);
    fv_tape_begin_gaze(&out);
    for (int64_t t_ns = 0; t_ns < 5000000000; t_ns += 10000000) {
        struct fv_gaze_sample s;
        fv_sim_gaze(7, t_ns, &s);
        fv_tape_write_gaze(&out, &s);
    }
    assert_int_equal(fv_writer_close(&out, &error), 0);
}

static const struct fv_numeric_row *find(const char *quantity, const char *method, const char *condition)
{
    for (int i = 0; i < rows; i++)
        if (strcmp(row[i].quantity, quantity) == 0 && strcmp(row[i].method, method) == 0 &&
            strcmp(row[i].condition, condition) == 0)
            return &row[i];
    fail_msg("no row %s, %s, %s", quantity, method, condition);
    return NULL;
}

static double error_of(const char *quantity, const char *method, const char *condition)
{
    return find(quantity, method, condition)->error_p50;
}

static void the_whole_table(void **state)
{
    (void)state;
    char head[256], gaze[256], imu_tape[300], eye_tape[300];
    struct fv_error error;
    write_tapes(head, gaze);
    snprintf(imu_tape, sizeof imu_tape, "imu.tape=%s", head);
    snprintf(eye_tape, sizeof eye_tape, "eye.tape=%s", gaze);
    struct fv_config_request request = {.sets = 7, .set = {"scene.name=cornell", "display.headset=small", "display.sink=none",
                                                           "imu.source=tape", "eye.source=tape", imu_tape, eye_tape}};
    if (fv_setup_open(&setup, &request, &error) || fv_setup_take(&setup, 1, &error)) fail_msg("%s", error.text);
    volatile int stopped = 1;
    assert_int_equal(fv_numerics_measure(&setup, row, &stopped), 0);
    rows = fv_numerics_measure(&setup, row, NULL);
    assert_int_equal(rows, 3 + 27 + 12 + 2 * 20 + 2 * 10);
    for (int i = 0; i < rows; i++) {
        const struct fv_numeric_row *r = &row[i];
        if (!(r->error_p50 >= 0 && r->error_p50 <= r->error_p95 && r->error_p95 <= 180) || !r->error_unit[0] ||
            isnan(r->cost) != !r->cost_unit[0] || r->cost <= 0)
            fail_msg("%s, %s, %s: %g %g, cost %g", r->quantity, r->method, r->condition, r->error_p50, r->error_p95, r->cost);
    }
}

/* What must come out whatever the machine. */
static void better_methods_are_better(void **state)
{
    (void)state;
    assert_true(error_of("IMU integration", "exact rotation", "2000 deg/s at 100 Hz") < 1e-8);
    assert_true(error_of("IMU integration", "midpoint", "2000 deg/s at 100 Hz") > 1);
    assert_true(error_of("IMU integration", "midpoint", "2000 deg/s at 1000 Hz") <
                0.2 * error_of("IMU integration", "Euler", "2000 deg/s at 1000 Hz"));
    assert_true(error_of("IMU integration", "exact rotation", "simulated head at 1000 Hz") < 0.01);
    assert_true(error_of("IMU integration", "exact rotation", "simulated head at 285.7 Hz") <
                error_of("IMU integration", "Euler", "simulated head at 285.7 Hz"));
    assert_true(error_of("depth interpolation", "bilinear in inverse depth", "a node every 8 pixels") <
                error_of("depth interpolation", "nearest node", "a node every 8 pixels"));
    assert_true(error_of("head prediction", "velocity over 20 ms", "simulated head 20 ms ahead") <
                0.3 * error_of("head prediction", "hold", "simulated head 20 ms ahead"));
    assert_true(error_of("head prediction", "velocity over 20 ms", "imu.tape 20 ms ahead") <
                0.3 * error_of("head prediction", "hold", "imu.tape 20 ms ahead"));
    assert_true(error_of("gaze prediction", "hold", "simulated eyes 5 ms ahead") <
                error_of("gaze prediction", "hold", "simulated eyes 80 ms ahead"));
    assert_true(error_of("gaze prediction", "hold", "eye.tape 5 ms ahead") > 0);
}

static bool same(double a, double b)
{
    return (isnan(a) && isnan(b)) || fabs(a - b) <= 1e-5 * fabs(a);
}

static void written_and_read_back(void **state)
{
    (void)state;
    char path[256];
    struct fv_error error;
    snprintf(path, sizeof path, "%s/numerics.csv", program_folder());
    row[3].error_p50 = row[3].error_p95 = NAN;
    row[4].condition[0] = 0;
    memset(row[5].quantity, 'q', sizeof row[5].quantity - 1);
    assert_int_equal(fv_numerics_write(row, rows, path, &error), 0);
    if (fv_numerics_read(again, path, &error) != rows) fail_msg("%s", error.text);
    for (int i = 0; i < rows; i++) {
        assert_string_equal(row[i].quantity, again[i].quantity);
        assert_string_equal(row[i].method, again[i].method);
        assert_string_equal(row[i].condition, again[i].condition);
        assert_string_equal(row[i].error_unit, again[i].error_unit);
        assert_string_equal(row[i].cost_unit, again[i].cost_unit);
        assert_true(same(row[i].error_p50, again[i].error_p50) && same(row[i].error_p95, again[i].error_p95));
        assert_true(same(row[i].cost, again[i].cost));
    }
    assert_int_equal(fv_numerics_write(row, 0, path, &error), 0);
    assert_int_equal(fv_numerics_read(again, path, &error), 0);
}

#define HEADING "quantity,method,condition,error_p50,error_p95,error_unit,cost,cost_unit\n"
#define LONG "0123456789012345678901234567890123456789012345678901234567890123456789"

static const struct {
    const char *text, *message;
} damaged[] = {
    {"", ":1: the file is empty"},
    {"a,b,c\n", ":1: not the columns"},
    {"quantity,method\n", ":1: not the columns"},
    {HEADING "q,m,c,1,2,deg,3", ":2: the line is cut short"},
    {HEADING "q,m,c,1,2,deg,3\n", ":2: not a row"},
    {HEADING "q,m,c,1,2,deg,3,ns,more\n", ":2: not a row"},
    {HEADING "q,m,c,1,2,deg,3,ns\nq,m,c,1,2,deg,x,ns\n", ":3: not a row"},
    {HEADING "q,m,c,nan,2,deg,3,ns\n", ":2: not a row"},
    {HEADING "q,m,c,-1,2,deg,3,ns\n", ":2: not a row"},
    {HEADING "q,m,c, 1,2,deg,3,ns\n", ":2: not a row"},
    {HEADING "q,m,c,1e999,2,deg,3,ns\n", ":2: not a row"},
    {HEADING "q,m,c,1 ,2,deg,3,ns\n", ":2: not a row"},
    {HEADING ",m,c,1,2,deg,3,ns\n", ":2: not a row"},
    {HEADING "q,,c,1,2,deg,3,ns\n", ":2: not a row"},
    {HEADING "q,\"m\",c,1,2,deg,3,ns\n", ":2: not a row"},
    {HEADING "q,m\x01,c,1,2,deg,3,ns\n", ":2: not a row"},
    {HEADING LONG ",m,c,1,2,deg,3,ns\n", ":2: not a row"},
    {HEADING "q,m," LONG ",1,2,deg,3,ns\n", ":2: not a row"},
    {HEADING "\n", ":2: not a row"},
};

static void damaged_files_are_refused(void **state)
{
    (void)state;
    char path[256], many[FV_NUMERICS_MAX * 8 + 4096] = HEADING;
    struct fv_error error;
    snprintf(path, sizeof path, "%s/damaged.csv", program_folder());
    for (unsigned i = 0; i < sizeof damaged / sizeof damaged[0]; i++) {
        program_write("damaged.csv", damaged[i].text, strlen(damaged[i].text));
        assert_int_equal(fv_numerics_read(again, path, &error), -1);
        if (!strstr(error.text, damaged[i].message) || !strstr(error.text, path))
            fail_msg("'%s' instead of '%s'", error.text, damaged[i].message);
    }
    /* One row more than there may be; a zero byte; binary; no file. */
    for (int i = 0; i <= FV_NUMERICS_MAX; i++) strcat(many, "q,m,,,,,,\n");
    program_write("damaged.csv", many, strlen(many));
    assert_int_equal(fv_numerics_read(again, path, &error), -1);
    assert_non_null(strstr(error.text, ":130: more rows"));
    program_write("damaged.csv", many, strlen(many) - 10);
    assert_int_equal(fv_numerics_read(again, path, &error), FV_NUMERICS_MAX);
    many[sizeof HEADING] = 0;
    program_write("damaged.csv", many, 200);
    assert_int_equal(fv_numerics_read(again, path, &error), -1);
    memset(many, 0xff, 1000);
    program_write("damaged.csv", many, 1000);
    assert_int_equal(fv_numerics_read(again, path, &error), -1);
    assert_int_equal(fv_numerics_read(again, "/no/such.csv", &error), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_whole_table), cmocka_unit_test(better_methods_are_better),
                                       cmocka_unit_test(written_and_read_back), cmocka_unit_test(damaged_files_are_refused)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
