/* profile: what reports say of stages, adaptation, cuts and eccentricity, on made-up sessions. With a folder
 * as its argument (and a number of frames) it leaves the files of a session that adapts there, to be looked
 * at. */
#include "cli/columns.h"
#include "cli/plot.h"
#include "cli/plot_ticks.h"
#include "cli/profile.h"
#include "cli/report.h"
#include "tests/support/markup_check.h"
#include "tests/support/sample_session.h"

#include <jansson.h>
#include <unistd.h>

static char folder[256];
static struct fv_error error;
static struct fv_config config;
static struct fv_session session;
static struct fv_frame_record records[SAMPLE_RECORDS];

static const char *path_of(const char *name)
{
    static char path[FV_PATH_MAX];
    fv_path_join(path, folder, name);
    return path;
}

static char *page_text(void)
{
    char *text;
    size_t size;
    assert_int_equal(fv_report_html(&session, &config, NULL, NULL, path_of("report.html"), &error), 0);
    assert_int_equal(fv_file_read(path_of("report.html"), 1 << 26, &text, &size, &error), 0);
    markup_check(text);
    return text;
}

static json_t *report_json(void)
{
    assert_int_equal(fv_report_json(&session, &config, path_of("report.json"), &error), 0);
    json_t *root = json_load_file(path_of("report.json"), JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(root);
    return root;
}

/* The number at "a/b/c". */
static double number_at(json_t *root, const char *path)
{
    char part[64];
    for (const char *from = path; *from;) {
        size_t n = strcspn(from, "/");
        snprintf(part, sizeof part, "%.*s", (int)n, from);
        root = json_object_get(root, part);
        from += n + (from[n] == '/');
    }
    if (!json_is_number(root)) fail_msg("%s is no number", path);
    return json_number_value(root);
}

static void assert_near(double value, double expected)
{
    if (!(fabs(value - expected) <= 1e-6 * fmax(1, fabs(expected))))
        fail_msg("%.9g, not %.9g", value, expected);
}

/* Four frames of 10, 10, 20 and 40 ms, numbers that can be checked by hand. */
static void make_four(void)
{
    static const float frame_ms[] = {10, 10, 20, 40};
    memset(records, 0, sizeof records);
    session = (struct fv_session){.scene = "room",
                                  .method = "full",
                                  .threads = 4,
                                  .period_ms = 25,
                                  .stages = 2,
                                  .stage = {"trace", "present"},
                                  .frames = 4,
                                  .capacity = 4,
                                  .record = records};
    for (int i = 0; i < 4; i++) {
        records[i] = (struct fv_frame_record){.frame = i,
                                              .t_ns = 25000000 * i,
                                              .frame_ms = frame_ms[i],
                                              .stage_ms = {frame_ms[i] / 2, i == 3 ? 4 : 0},
                                              .control_ms = frame_ms[i] / 100,
                                              .idle_ms = frame_ms[i] / 5,
                                              .late_stages = i == 3   ? 3
                                                             : i == 2 ? 1
                                                                      : 0};
    }
}

static void stages_by_hand(void **unused)
{
    (void)unused;
    static const struct fv_stage_row expected[] = {
        {"trace", 40, 5, 20, 20, 0.5, 2},
        {"present", 10, 0, 4, 4, 0.05, 1},
        {"control", 40, 0.1, 0.4, 0.4, 0.01, -1},
        {"idle", 40, 0.5, 2, 2, 0.05, -1},
        {"in no stage", NAN, NAN, NAN, NAN, 0.44, -1},
    };
    struct fv_stage_row rows[FV_STAGE_ROWS_MAX];
    make_four();
    assert_near(fv_stage_seconds(&session), 0.1);
    assert_int_equal(fv_stage_rows(&session, rows), 5);
    for (int i = 0; i < 5; i++) {
        assert_string_equal(rows[i].name, expected[i].name);
        assert_int_equal(rows[i].late, expected[i].late);
        assert_near(rows[i].share, expected[i].share);
        assert_int_equal(isnan(rows[i].rate_hz), isnan(expected[i].rate_hz));
        if (isnan(expected[i].rate_hz)) continue;
        assert_near(rows[i].rate_hz, expected[i].rate_hz);
        assert_near(rows[i].p50_ms, expected[i].p50_ms);
        assert_near(rows[i].p99_ms, expected[i].p99_ms);
        assert_near(rows[i].max_ms, expected[i].max_ms);
    }
    assert_near(fv_idle_share(&session), 0.05);
    json_t *root = report_json();
    assert_near(number_at(root, "stage_ms/trace/max"), 20);
    assert_near(number_at(root, "stage_ms/trace/rate_hz"), 40);
    assert_near(number_at(root, "stage_ms/trace/late"), 2);
    assert_near(number_at(root, "stage_ms/present/share"), 0.05);
    assert_near(number_at(root, "control_ms/max"), 0.4);
    assert_near(number_at(root, "idle"), 0.05);
    json_decref(root);
}

/* A run that nothing paces: session time runs slower than frames take. */
static void rates_are_of_the_time_that_frames_took(void **unused)
{
    (void)unused;
    struct fv_stage_row rows[FV_STAGE_ROWS_MAX];
    make_four();
    for (int i = 0; i < 4; i++) records[i].t_ns = 1000000 * i;
    session.period_ms = 1;
    assert_near(fv_stage_seconds(&session), 0.08);
    fv_stage_rows(&session, rows);
    assert_near(rows[0].rate_hz, 50);
}

static void strange_sessions_have_rows(void **unused)
{
    (void)unused;
    struct fv_stage_row rows[FV_STAGE_ROWS_MAX];
    make_four();
    session.frames = 0;
    assert_int_equal(fv_stage_rows(&session, rows), 2);
    assert_true(isnan(rows[0].rate_hz) && isnan(rows[0].p50_ms) && isnan(rows[0].share) && rows[0].late == 0);
    assert_true(isnan(fv_idle_share(&session)));
    make_four();
    session.threads = 0;
    session.period_ms = NAN;
    for (int i = 0; i < 4; i++) {
        records[i].stage_ms[0] = i ? NAN : INFINITY;
        records[i].control_ms = records[i].idle_ms = 0;
        records[i].stage_ms[1] = 1e9f;
    }
    assert_int_equal(fv_stage_rows(&session, rows), 2); /* no control, no idling, nothing in no stage */
    assert_true(isnan(rows[0].share) && rows[0].rate_hz == 0);
    for (int i = 0; i < 4; i++) records[i].frame_ms = NAN;
    assert_int_equal(fv_stage_rows(&session, rows), 2);
    assert_true(isnan(rows[1].share));
    free(page_text());
    json_decref(report_json());
    session.stages = 1 << 20; /* names are kept of FV_STAGES_MAX */
    assert_true(fv_stage_rows(&session, rows) <= FV_STAGE_ROWS_MAX);
}

static void rings_reach_the_reports(void **unused)
{
    (void)unused;
    static const struct fv_ring rings[] = {{5e6, 1000, 10, 0}, {0, 0, 0, 0}, {1e6, 100, 4, 12}, {0, 0, 0, 0}};
    make_four();
    memcpy(session.ring, rings, sizeof rings);
    session.cut_frames = 3;
    assert_int_equal(fv_rings(&session), 3);
    json_t *root = report_json(), *array = json_object_get(root, "eccentricity");
    assert_int_equal(json_array_size(array), 3);
    assert_near(number_at(json_array_get(array, 0), "us_per_unit"), 5);
    assert_true(json_is_null(json_object_get(json_array_get(array, 1), "us_per_unit")));
    assert_near(number_at(json_array_get(array, 2), "from_deg"), 2 * FV_RING_DEG);
    assert_near(number_at(json_array_get(array, 2), "to_deg"), 3 * FV_RING_DEG);
    assert_near(number_at(json_array_get(array, 2), "units"), 100);
    assert_near(number_at(json_array_get(array, 2), "tiles"), 4);
    assert_near(number_at(json_array_get(array, 2), "cut"), 12);
    json_decref(root);
    char *text = page_text();
    assert_non_null(strstr(text, "Cost against eccentricity"));
    assert_non_null(strstr(text, "sampled was nearer to the gaze than 5 degrees"));
    free(text);
    session.ring[FV_RINGS - 1] = (struct fv_ring){NAN, INT64_MAX, INT64_MAX, INT64_MAX};
    session.ring[5] = (struct fv_ring){INFINITY, 1, 0, 0};
    session.ring[6] = (struct fv_ring){-1, -5, 3, -3};
    root = report_json();
    assert_int_equal(json_array_size(json_object_get(root, "eccentricity")), FV_RINGS);
    json_decref(root);
    free(page_text());
}

/* Each part is there where it says something and left out where it does not. */
static void parts_that_say_nothing_are_left_out(void **unused)
{
    (void)unused;
    static const char *const adaptive[] = {"Quality level: sharper is up",
                                           "Foveal radius r0",
                                           "sampling probability p_min",
                                           "Pixels sampled (%)",
                                           "Tiles cut at the deadline",
                                           "What was cut",
                                           "Cost against eccentricity",
                                           "The quality level changed",
                                           "idle: workers waiting for each other",
                                           ">control<",
                                           "sample in ",
                                           "3 display periods",
                                           "p99.9"};
    sample_session(&session, records, 3000);
    char *text = page_text();
    for (size_t i = 0; i < sizeof adaptive / sizeof adaptive[0]; i++)
        if (!strstr(text, adaptive[i])) fail_msg("no '%s'", adaptive[i]);
    assert_null(strstr(text, "Display periods a frame"));
    assert_null(strstr(text, "The same in every frame"));
    assert_true(strlen(text) < 400000);
    free(text);
    make_four();
    for (int i = 0; i < 4; i++) {
        records[i].r0_deg = 10;
        records[i].p_min = 0.05f;
        records[i].control_ms = records[i].idle_ms = 0;
    }
    text = page_text();
    for (size_t i = 0; i + 1 < sizeof adaptive / sizeof adaptive[0]; i++)
        if (strstr(text, adaptive[i])) fail_msg("'%s' has nothing to say", adaptive[i]);
    assert_non_null(strstr(
        text, "The same in every frame: quality level 0, r0 10.0°, p_min 0.050, pixels sampled 0.0 %"));
    free(text);
    records[2].periods = 2;
    text = page_text();
    assert_non_null(strstr(text, "Display periods a frame"));
    assert_non_null(strstr(text, "class=\"given\""));
    free(text);
}

/* An axis that falls upwards has the ticks of one that rises, the other way up. */
static void axes_run_both_ways(void **unused)
{
    (void)unused;
    static const double ranges[][2] = {{0.5, 12.5}, {-3, 4}, {0, 1e-9}, {1e6, 1e9}, {-0.5, 2.5}};
    for (size_t i = 0; i < sizeof ranges / sizeof ranges[0]; i++) {
        struct fv_plot up = {.y = {ranges[i][0], ranges[i][1], false}};
        struct fv_plot down = {.y = {ranges[i][1], ranges[i][0], false}};
        struct fv_ticks rising, falling;
        fv_ticks_of(&up.y, 5, &rising);
        fv_ticks_of(&down.y, 5, &falling);
        assert_true(rising.count >= 2 && rising.count == falling.count);
        for (int k = 0; k < rising.count; k++) {
            assert_true(rising.value[k] == falling.value[k]);
            assert_near(fv_plot_part_y(&up, rising.value[k]) + fv_plot_part_y(&down, rising.value[k]), 1);
        }
        assert_true(fv_plot_part_y(&down, ranges[i][0]) == 0); /* smallest at the top */
    }
}

int main(int argc, char **argv)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(stages_by_hand),
        cmocka_unit_test(rates_are_of_the_time_that_frames_took),
        cmocka_unit_test(strange_sessions_have_rows),
        cmocka_unit_test(rings_reach_the_reports),
        cmocka_unit_test(parts_that_say_nothing_are_left_out),
        cmocka_unit_test(axes_run_both_ways),
    };
    const struct fv_config_request request = {0};
    if (fv_config_load(&config, &request, &error)) printf("settings without presets: %s\n", error.text);
    if (argc > 1) {
        int frames = argc > 2 ? atoi(argv[2]) : 3000;
        snprintf(folder, sizeof folder, "%s", argv[1]);
        sample_session(&session, records, frames > 0 && frames < SAMPLE_RECORDS ? frames : SAMPLE_RECORDS);
        return fv_report_json(&session, &config, path_of("report.json"), &error) ||
               fv_report_html(&session, &config, NULL, NULL, path_of("report.html"), &error);
    }
    char command[300];
    snprintf(folder, sizeof folder, "/tmp/foveola-profile-XXXXXX");
    if (!mkdtemp(folder)) return 1;
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    snprintf(command, sizeof command, "rm -r %s", folder);
    return failed || system(command) != 0;
}
