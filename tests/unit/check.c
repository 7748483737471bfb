/* check: boards made up as trees of files in place of /sys, /dev and /proc, cameras made up behind their system calls:
 * what is ready is told to be, and each thing that is not is a fault with what would have to change. */
#include "cli/check.h"

#include "tests/support/fake_camera.h"

#include <jansson.h>

#define QUICK "--seconds 0.1 --set scene.name=cornell --set display.headset=small --set threads.workers=1 "
#define EASY "--set budget.hz=1 "

static void put(const char *root, const char *path, const char *text)
{
    char command[1024];
    snprintf(command, sizeof command, "cd %s && mkdir -p $(dirname %s/%s) && printf '%%s\\n' '%s' >%s/%s", program_folder(),
             root, path, text, root, path);
    assert_int_equal(system(command), 0);
}

#define CLOCK "sys/devices/system/clocksource/clocksource0/"
#define POLICY "sys/devices/system/cpu/cpufreq/policy0/"
#define ZONE "sys/class/thermal/thermal_zone0/"
#define USB "sys/bus/usb/devices/1-1/"

/* A board that lacks nothing; then a test spoils one thing. */
static void build_board(const char *root)
{
    put(root, CLOCK "current_clocksource", "arch_sys_counter");
    put(root, CLOCK "available_clocksource", "arch_sys_counter ");
    put(root, POLICY "scaling_governor", "performance");
    put(root, POLICY "scaling_driver", "cpufreq-dt");
    put(root, POLICY "affected_cpus", "4 5 6 7");
    put(root, POLICY "scaling_cur_freq", "2256000");
    put(root, POLICY "scaling_max_freq", "2256000");
    put(root, POLICY "cpuinfo_max_freq", "2256000");
    put(root, ZONE "type", "soc-thermal");
    put(root, ZONE "temp", "41500");
    put(root, ZONE "trip_point_0_type", "active");
    put(root, ZONE "trip_point_0_temp", "40000");
    put(root, ZONE "trip_point_1_type", "passive");
    put(root, ZONE "trip_point_1_temp", "85000");
    put(root, "sys/class/thermal/cooling_device0/type", "pwm-fan");
    put(root, "sys/class/thermal/cooling_device0/cur_state", "3");
    put(root, "proc/meminfo", "MemAvailable: 8000000 kB");
    put(root, USB "idVendor", "28de");
    put(root, USB "idProduct", "2000");
    put(root, USB "busnum", "1");
    put(root, USB "devnum", "7");
    put(root, "dev/bus/usb/001/007", "");
}

/* The row of that name: its state; `found` and `change` into the row. */
static const char *state_of(json_t *all, const char *what, const char **found, const char **change)
{
    size_t i;
    json_t *row;
    json_array_foreach(json_object_get(all, "rows"), i, row)
    {
        if (strcmp(json_string_value(json_object_get(row, "what")), what) != 0) continue;
        *found = json_string_value(json_object_get(row, "found"));
        *change = json_string_value(json_object_get(row, "change"));
        return json_string_value(json_object_get(row, "state"));
    }
    fail_msg("no row %s", what);
    return NULL;
}

static json_t *checked(const char *root, const char *more, int *code)
{
    json_error_t why;
    struct program_result r = program("check --json --root %s " QUICK "%s", root, more);
    json_t *all = json_loads(r.output, 0, &why);
    if (!all) fail_msg("exit %d, no JSON (%s): %s %s", r.code, why.text, r.output, r.errors);
    *code = r.code;
    assert_int_equal(json_is_true(json_object_get(all, "ready")), r.code == 0);
    return all;
}

static void a_board_that_lacks_nothing_is_ready(void **state)
{
    (void)state;
    static const char *const good[] = {"source", "cores 4 5 6 7", "soc-thermal", "arena", "inertial sensor", "copy", "rays", "as set"};
    int code;
    build_board("good");
    json_t *all = checked("good", EASY "--set imu.source=usb", &code);
    for (unsigned i = 0; i < sizeof good / sizeof good[0]; i++) {
        const char *found, *change, *is = state_of(all, good[i], &found, &change);
        if (strcmp(is, "ok") != 0 || change[0]) fail_msg("%s: %s: %s; %s", good[i], is, found, change);
    }
    assert_int_equal(code, 0);
    json_t *measured = json_object_get(all, "measured");
    assert_true(json_number_value(json_object_get(measured, "copy_bytes_per_s")) > 1e7);
    assert_true(json_number_value(json_object_get(measured, "primary_rays_per_s")) > 1e3);
    assert_true(json_number_value(json_object_get(measured, "rays_per_s")) > json_number_value(json_object_get(measured, "primary_rays_per_s")));
    assert_true(json_number_value(json_object_get(measured, "frame_ms_p50")) > 0);
    json_decref(all);
}

/* One thing at a time is spoilt: its row, what it becomes, and a word of what would have to change. */
static const struct {
    const char *path, *text, *what, *state, *change;
} spoilt[] = {
    {CLOCK "current_clocksource", "jiffies", "source", "fault", "clocksource=arch_sys_counter"},
    {CLOCK "current_clocksource", "hpet", "source", "note", "clocksource=arch_sys_counter"},
    {POLICY "scaling_governor", "powersave", "cores 4 5 6 7", "fault", "governor performance"},
    {POLICY "scaling_governor", "schedutil", "cores 4 5 6 7", "note", "governor performance"},
    {POLICY "scaling_max_freq", "1200000", "cores 4 5 6 7", "note", "scaling_max_freq"},
    {ZONE "temp", "86000", "soc-thermal", "fault", "cool it"},
    {ZONE "temp", "82000", "soc-thermal", "note", "cool it"},
    {"sys/class/thermal/cooling_device0/type", "cpufreq-cpu4", "cpufreq-cpu4", "fault", "cool it"},
    {"proc/meminfo", "MemAvailable: 2000 kB", "arena", "fault", "foveola plan"},
    {USB "idProduct", "0001", "inertial sensor", "fault", "plug it in"},
    {USB "devnum", "8", "inertial sensor", "fault", "70-foveola-imu.rules"},
};

static void what_is_spoilt_is_told_with_its_cure(void **state)
{
    (void)state;
    for (unsigned i = 0; i < sizeof spoilt / sizeof spoilt[0]; i++) {
        const char *found, *change;
        int code;
        build_board("bad");
        put("bad", spoilt[i].path, spoilt[i].text);
        json_t *all = checked("bad", EASY "--set imu.source=usb", &code);
        const char *is = state_of(all, spoilt[i].what, &found, &change);
        if (strcmp(is, spoilt[i].state) != 0 || !strstr(change, spoilt[i].change))
            fail_msg("%s = %s: %s: %s; %s", spoilt[i].path, spoilt[i].text, is, found, change);
        assert_int_equal(code, strcmp(spoilt[i].state, "fault") == 0);
        json_decref(all);
    }
}

static void an_empty_tree_is_told_of(void **state)
{
    (void)state;
    struct program_result r = program("check --root nowhere " QUICK EASY "--set imu.source=usb --set eye.source=v4l2");
    assert_int_equal(r.code, 1);
    assert_non_null(strstr(r.output, "not told by this kernel"));
    assert_non_null(strstr(r.output, "shows no USB"));
    assert_non_null(strstr(r.output, "eye.device is not set"));
    assert_non_null(strstr(r.output, "not ready: 2 of"));
}

static void a_budget_that_cannot_be_held_is_a_fault(void **state)
{
    (void)state;
    struct program_result r = program("check " QUICK "--set budget.hz=1000 --set display.width=400 --set display.height=400");
    assert_int_equal(r.code, 1);
    assert_non_null(strstr(r.output, "FAULT  as set: "));
    assert_non_null(strstr(r.output, "budget.hz="));
    r = program("check " QUICK "--set budget.hz=1000 --set display.width=400 --set display.height=400 --set budget.adapt=on --set budget.pace=vsync");
    assert_int_equal(r.code, 1);
    assert_non_null(strstr(r.output, "FAULT  adapting: "));
    r = program("check " QUICK "--set method.name=full --set budget.hz=1000 --set display.width=400 --set display.height=400");
    assert_int_equal(r.code, 1);
    assert_non_null(strstr(r.output, "method.name=reproject"));
}

static void bad_arguments_end_with_2(void **state)
{
    (void)state;
    assert_int_equal(program("check --json=yes").code, 2);
    assert_int_equal(program("check --set scene.name=atlantis").code, 2);
    assert_int_equal(program("check --frames 3").code, 2);
    assert_int_equal(program("plan --json").code, 2);
}

/* A camera that gives a frame every interval_ns, or none. jump: between the numbers of its first and second one. */
static int64_t interval_ns;
static uint32_t jump;

static void fake_wait(void *context, const int *fd, unsigned *ready, int devices, int64_t timeout_ns)
{
    struct fake *f = context;
    (void)fd, (void)devices;
    bool comes = interval_ns > 0 && interval_ns <= timeout_ns;
    f->t_ns += comes ? interval_ns : timeout_ns;
    if (comes) fills(90, f->t_ns, 0), f->sequence += jump, jump = 0;
    *ready = comes ? FV_CAMERA_READABLE : 0;
}

static struct fv_check_row camera_row(const char *device)
{
    static struct fv_check check;
    static struct fv_config config;
    static struct fv_camera_io io;
    struct fv_config_request request = {0};
    struct fv_error error;
    assert_int_equal(fv_config_load(&config, &request, &error), 0);
    strcpy(config.eye_source, "v4l2");
    strcpy(config.eye_device, device);
    strcpy(config.eye_format, "GREY");
    config.eye_width = config.eye_height = FAKE_SIDE;
    config.eye_hz = 120;
    io = fake_io;
    io.wait = fake_wait;
    check = (struct fv_check){.root = "", .camera = &io};
    fv_check_devices(&check, &config);
    assert_int_equal(fake.opened, 0);
    assert_int_equal(fake.mapped, 0);
    assert_string_equal(check.row[0].what, "eye camera");
    return check.row[0];
}

static void cameras_are_opened_and_their_rate_is_measured(void **state)
{
    (void)state;
    double hz = 0;
    plug();
    interval_ns = 8333333;
    struct fv_check_row row = camera_row("/dev/eye");
    assert_int_equal(row.state, FV_CHECK_OK);
    assert_int_equal(sscanf(row.found, "%lf Hz measured", &hz), 1);
    assert_true(hz > 119 && hz < 121);
    plug();
    jump = 400; /* the first one is of before */
    row = camera_row("/dev/eye");
    assert_int_equal(sscanf(row.found, "%lf Hz measured", &hz), 1);
    assert_true(hz > 119 && hz < 121);
    plug();
    interval_ns = 33333333;
    row = camera_row("/dev/eye");
    assert_int_equal(row.state, FV_CHECK_NOTE);
    assert_int_equal(sscanf(row.found, "%lf Hz measured", &hz), 1);
    assert_true(hz > 29 && hz < 31);
    plug();
    interval_ns = 0;
    row = camera_row("/dev/eye");
    assert_int_equal(row.state, FV_CHECK_FAULT);
    assert_non_null(strstr(row.change, "cable"));
    plug();
    fake.plugged = false;
    row = camera_row("/dev/eye");
    assert_int_equal(row.state, FV_CHECK_FAULT);
    assert_non_null(strstr(row.change, "plug it in"));
    plug();
    fake.busy = true;
    row = camera_row("/dev/eye");
    assert_int_equal(row.state, FV_CHECK_FAULT);
    assert_non_null(strstr(row.found, "in use"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_board_that_lacks_nothing_is_ready),
                                       cmocka_unit_test(what_is_spoilt_is_told_with_its_cure),
                                       cmocka_unit_test(an_empty_tree_is_told_of),
                                       cmocka_unit_test(a_budget_that_cannot_be_held_is_a_fault),
                                       cmocka_unit_test(bad_arguments_end_with_2),
                                       cmocka_unit_test(cameras_are_opened_and_their_rate_is_measured)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
