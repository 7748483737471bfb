/* report_devices: what report.json and report.html tell of a display and of GPIO lines: nothing where there are none. */
#include "cli/report.h"

#include "tests/support/markup_check.h"
#include "tests/support/program.h"

static struct fv_error error;
static struct fv_config config;
static struct fv_session session;

static char *report_of(const char *name)
{
    static char text[1 << 19];
    char path[FV_PATH_MAX];
    snprintf(path, sizeof path, "%s/%s", program_folder(), name);
    bool html = strstr(name, ".html") != NULL;
    assert_int_equal(html ? fv_report_html(&session, &config, NULL, NULL, path, &error)
                          : fv_report_json(&session, &config, path, &error), 0);
    program_slurp(path, text, sizeof text);
    assert_true(strlen(text) < sizeof text - 1);
    if (html) markup_check(text);
    return text;
}

static void begin(void)
{
    struct fv_config_request request = {0};
    assert_int_equal(fv_config_load(&config, &request, &error), 0);
    session = (struct fv_session){.scene = "atrium", .method = "full", .cpu = "a core", .isa = "neon", .period_ms = 10};
}

static void expect(const char *text, const char *what, bool there)
{
    if (!strstr(text, what) == there) fail_msg("%s: '%s'", there ? "missing" : "there", what);
}

static void nothing_of_what_is_not_used(void **state)
{
    (void)state;
    begin();
    session.display.flips = 7, session.gpio.strobes = 7; /* no mode, no lines */
    const char *text = report_of("none.html");
    expect(text, "heap calls after start-up", true);
    expect(text, "pictures shown", false);
    expect(text, "GPIO", false);
}

static void what_a_display_did(void **state)
{
    (void)state;
    begin();
    session.display = (struct fv_session_display){.mode = "HDMI-A-1 <2160x1200>, 90.00 Hz",
                                                  .measured_hz = 89.987, .vblank = true,
                                                  .atomic = true, .flips = 123456, .dropped = 3, .copy_ms_mean = 1.25,
                                                  .copy_ms_most = 2.5, .bytes = 3 << 20};
    const char *text = report_of("display.html");
    static const char *const parts[] = {"HDMI-A-1 &#60;2160x1200&#62;", "90.00 Hz; atomic",
                                        "89.99 Hz", ">123456<", "<b>3</b>", "1.25 ms",
                                        "2.50 ms", "3.00 MB"};
    for (unsigned i = 0; i < sizeof parts / sizeof parts[0]; i++) expect(text, parts[i], true);
    expect(text, "GPIO", false);
    session.display.vblank = false, session.display.measured_hz = 0;
    expect(report_of("display.html"), "no vertical blank", true);
}

static void what_lines_did(void **state)
{
    (void)state;
    begin();
    session.gpio = (struct fv_session_gpio){.lines = 2, .vsyncs = 987, .presses = 4, .errors = 1, .vsync_hz = 74.5};
    const char *text = report_of("lines.html");
    static const char *const parts[] = {"<span>987</span>", "<span>4</span>", "<b>1</b>", "74.50 Hz"};
    for (unsigned i = 0; i < sizeof parts / sizeof parts[0]; i++) expect(text, parts[i], true);
    expect(text, "pictures shown", false);
    session.gpio.vsync_hz = 0;
    expect(report_of("lines.html"), "vertical syncs a second", false);
}

/* Each fault has a counter of its own, in both reports. */
static void what_went_wrong(void **state)
{
    (void)state;
    begin();
    session.cameras = 1;
    session.eye_no_pupil = 4001, session.eye_unsure = 4002, session.eye_blinks = 4003;
    session.imu_repeated = 4004, session.imu_clock_restarts = 4005, session.imu_mistimed = 4006, session.imu_bad = 4007;
    session.imu_stuck = 4008, session.imu_saturated = 4009;
    session.tape_dropped = 4010, session.tape_cut = 2;
    session.pictures = 4011, session.pictures_failed = 1;
    const char *text = report_of("faults.json");
    static const char *const json[] = {"\"no_pupil\":4001,\"unsure\":4002,\"blinks\":4003",
                                       "\"repeated\":4004,\"clock_restarts\":4005,\"mistimed\":4006,\"bad\":4007,",
                                       "\"stuck\":4008,\"saturated\":4009}", "\"dropped\":4010,\"cut\":2}",
                                       "\"pictures\":{\"taken\":4011,\"failed\":1}"};
    for (unsigned i = 0; i < sizeof json / sizeof json[0]; i++) expect(text, json[i], true);
    text = report_of("faults.html");
    static const char *const html[] = {"<span>4001</span>", "<span>4002</span>", "<span>4003</span>", "<b>12021</b>",
                                       "<b>4009</b>", "<b>4010</b>", "<b>2</b>", "<b>1</b>"};
    for (unsigned i = 0; i < sizeof html / sizeof html[0]; i++) expect(text, html[i], true);
    session.cameras = 0;
    expect(report_of("faults.html"), "frames without a pupil", false);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(nothing_of_what_is_not_used), cmocka_unit_test(what_a_display_did),
                                       cmocka_unit_test(what_lines_did), cmocka_unit_test(what_went_wrong)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
