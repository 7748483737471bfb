/* report: report.json and report.html of made-up sessions: every key, whole pages, nothing allocated.
 * With a folder as its argument it leaves the files of a sample session there, to be looked at. */
#include "cli/columns.h"
#include "cli/markup.h"
#include "cli/report.h"
#include "platform/arena.h"
#include "platform/heap.h"
#include "platform/json.h"
#include "tests/support/made_session.h"
#include "tests/support/markup_check.h"

#include <jansson.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static const char hostile[] = "at\"rium \\ <b>'&\n\x01\x1f\xff\xc0\xaf\xed\xa0\x80 \xc3\xa9";
static const char hostile_as_read[] =
    "at\"rium \\ <b>'&\n\x01\x1f\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD"
    "\xEF\xBF\xBD\xEF\xBF\xBD \xc3\xa9";

static json_t *write_json(void)
{
    json_error_t where;
    assert_int_equal(fv_report_json(&session, &config, path_of("report.json"), &error), 0);
    json_t *root = json_load_file(path_of("report.json"), JSON_REJECT_DUPLICATES, &where);
    if (!root) print_message("report.json:%d: %s\n", where.line, where.text);
    assert_non_null(root);
    return root;
}

/* The value at "a/b/c"; fails where there is none. */
static json_t *at(json_t *root, const char *path)
{
    char part[64];
    for (const char *from = path; root && *from;) {
        size_t n = strcspn(from, "/");
        snprintf(part, sizeof part, "%.*s", (int)n, from);
        root = json_object_get(root, part);
        from += n + (from[n] == '/');
    }
    if (!root) print_message("no %s\n", path);
    assert_non_null(root);
    return root;
}

static void json_has_every_key(void **unused)
{
    (void)unused;
    static const char *const strings[] = {"version", "host/cpu",           "host/isa",         "scene/name",
                                          "method",  "config/method.name", "config/scene.file"};
    static const char *const numbers[] = {"host/threads",
                                          "scene/triangles",
                                          "scene/fields",
                                          "frames",
                                          "missed",
                                          "late_corrected",
                                          "cut_frames",
                                          "period_ms",
                                          "frame_ms/p50",
                                          "frame_ms/p95",
                                          "frame_ms/p99",
                                          "frame_ms/max",
                                          "stage_ms/trace/p50",
                                          "stage_ms/present/p99",
                                          "rays_per_frame/primary",
                                          "rays_per_frame/shadow",
                                          "rays_per_frame/secondary",
                                          "rays_per_frame/march_steps",
                                          "sampled_fraction",
                                          "level/min",
                                          "level/mean",
                                          "level/max",
                                          "r0_deg/min",
                                          "r0_deg/mean",
                                          "r0_deg/max",
                                          "p_min/min",
                                          "p_min/mean",
                                          "p_min/max",
                                          "gaze/samples",
                                          "gaze/lost",
                                          "gaze/latency_ms_p50",
                                          "imu/samples",
                                          "imu/rejected",
                                          "imu/lost",
                                          "imu/reconnects",
                                          "arena/capacity",
                                          "arena/used",
                                          "arena/by/png",
                                          "sealed/heap_calls",
                                          "sealed/memory_syscalls",
                                          "config/budget.hz",
                                          "config/display.width"};
    make_session(500, RECORDS);
    json_t *root = write_json();
    for (size_t i = 0; i < sizeof strings / sizeof strings[0]; i++)
        assert_true(json_is_string(at(root, strings[i])));
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        assert_true(json_is_number(at(root, numbers[i])));
    assert_int_equal(json_object_size(at(root, "config")), fv_keys_count);
    assert_true(json_is_array(at(root, "config/scene.ambient")));
    assert_int_equal(json_array_size(at(root, "config/scene.ambient")), 3);
    assert_int_equal(json_array_size(at(root, "plan")), 6);
    assert_true(json_is_false(json_object_get(json_array_get(at(root, "plan"), 5), "kept")));
    assert_int_equal(json_integer_value(at(root, "frames")), 500);
    assert_int_equal(json_integer_value(at(root, "missed")), session.missed);
    assert_true(json_number_value(at(root, "period_ms")) == session.period_ms);
    assert_true(fabs(json_number_value(at(root, "rays_per_frame/primary")) - (412345 + 249.5)) < 1e-6);
    assert_true(json_number_value(at(root, "r0_deg/min")) == 7.5);
    assert_true((float)json_number_value(at(root, "p_min/max")) == 0.05f);
    json_decref(root);
}

static int by_size(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Against sorting, on values of every size and sign. */
static void percentiles_are_nearest_rank(void **unused)
{
    (void)unused;
    static const double percents[] = {0.001, 1, 25, 50, 50.1, 95, 99, 99.99, 100};
    static const int counts[] = {1, 2, 3, 10, 99, 100, 101, 4096};
    static float sorted[4096];
    const struct fv_column *column = &fv_columns[FV_COLUMN_FRAME_MS];
    uint32_t state = 3;
    make_session(4096, RECORDS);
    for (int c = 0; c < 8; c++) {
        for (int i = 0; i < counts[c]; i++) {
            double size = pow(10, 60 * noise(&state) - 30);
            sorted[i] = records[i].frame_ms = (float)(i % 7 == 3   ? 0
                                                      : i % 5 == 0 ? -size
                                                      : i % 3 == 0 ? 1 + 1e-7 * (i % 9)
                                                                   : size);
        }
        qsort(sorted, (size_t)counts[c], sizeof sorted[0], by_size);
        for (size_t p = 0; p < sizeof percents / sizeof percents[0]; p++) {
            int rank = (int)fmax(1, ceil(percents[p] / 100 * counts[c]));
            assert_true(fv_column_percentile(&session, column, 0, counts[c], percents[p]) ==
                        sorted[rank - 1]);
        }
    }
    records[5].frame_ms = NAN;
    records[6].frame_ms = INFINITY;
    assert_true(isnan(fv_column_percentile(&session, column, 5, 2, 50)));
    assert_true(fv_column_percentile(&session, column, 5, 3, 50) == records[7].frame_ms);
    assert_true(isnan(fv_column_percentile(&session, column, 0, 0, 50)));
}

static void hostile_names_and_values_stay_json(void **unused)
{
    (void)unused;
    make_session(500, RECORDS);
    session.scene = session.cpu = hostile;
    session.method = session.isa = NULL;
    session.stage[1] = hostile;
    session.stage[2] = NULL;
    session.period_ms = INFINITY;
    session.gaze_latency_ms_p50 = NAN;
    snprintf(session.plan[0].what, sizeof session.plan[0].what, "\"\\\x02");
    for (int i = 0; i < 500; i++) {
        records[i].p_min = NAN;
        records[i].stage_ms[4] = INFINITY;
        if (i % 2) records[i].frame_ms = i % 4 == 1 ? NAN : -INFINITY;
    }
    json_t *root = write_json();
    assert_string_equal(json_string_value(at(root, "scene/name")), hostile_as_read);
    assert_string_equal(json_string_value(at(root, "method")), "");
    assert_true(json_is_null(at(root, "period_ms")));
    assert_true(json_is_null(at(root, "gaze/latency_ms_p50")));
    assert_true(json_is_null(at(root, "p_min/mean")));
    assert_true(json_is_null(at(root, "stage_ms/present/p50")));
    assert_true(json_is_number(at(root, "frame_ms/p50")));
    assert_non_null(json_object_get(at(root, "stage_ms"), hostile_as_read));
    json_decref(root);
}

static void numbers_read_back_the_same(void **unused)
{
    (void)unused;
    static const struct {
        double value;
        const char *text;
    } rows[] = {{0, "0"},
                {0.1, "0.1"},
                {0.1f, "0.1"},
                {1.0 / 3, "0.3333333333333333"},
                {NAN, "null"},
                {-4, "-4"},
                {1e300, "1e+300"},
                {-INFINITY, "null"},
                {12345678, "12345678"},
                {1e-40, "1e-40"}};
    static struct fv_writer out;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        assert_int_equal(fv_writer_open(&out, path_of("number"), &error), 0);
        fv_json_number(&out, rows[i].value);
        assert_int_equal(fv_writer_close(&out, &error), 0);
        char *text = text_of("number");
        assert_string_equal(text, rows[i].text);
        free(text);
    }
    assert_string_equal(fv_shown_count(999.6).text, "1.00 k");
    assert_string_equal(fv_shown_count(812).text, "812");
    assert_string_equal(fv_shown_count(99960).text, "100 k");
    assert_string_equal(fv_shown_bytes(1536).text, "1.50 KB");
    assert_string_equal(fv_shown_bytes(-1).text, "-1 B");
    assert_string_equal(fv_shown_percent(0.1234).text, "12.3 %");
    assert_string_equal(fv_shown_fixed(NAN, 2).text, "\xE2\x80\x93");
}

static char *write_html(struct fv_png *png)
{
    assert_int_equal(
        fv_report_html(&session, &config, png ? &picture : NULL, png, path_of("report.html"), &error), 0);
    char *text = text_of("report.html");
    markup_check(text);
    return text;
}

static struct fv_png *png_of_test(void)
{
    static struct fv_png *png;
    if (!png) png = fv_png_open(WIDTH, HEIGHT);
    return png;
}

static void page_holds_its_sections(void **unused)
{
    (void)unused;
    static const char *const parts[] = {"<h1>atrium, reproject</h1>",
                                        "frames were late",
                                        "Last frame, left eye",
                                        "Last frame, right eye",
                                        "Frame time (ms)",
                                        "budget 13.33 ms",
                                        "time (s)",
                                        "Quality level",
                                        "r0 (degrees)",
                                        "p_min",
                                        "<h2>Stages</h2>",
                                        ">trace<",
                                        "How frame times are spread",
                                        "<h2>Plan</h2>",
                                        "left out",
                                        "the scene has no masked materials",
                                        "<h2>Memory</h2>",
                                        ">png<",
                                        "heap calls after start-up",
                                        "All settings",
                                        "fovea.p_min",
                                        "262 k triangles",
                                        "ARM Cortex-A78AE, neon, 8 threads"};
    make_session(500, RECORDS);
    char *text = write_html(png_of_test());
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        if (!strstr(text, parts[i])) print_message("no '%s'\n", parts[i]);
        assert_non_null(strstr(text, parts[i]));
    }
    assert_int_equal(markup_count(text, "data:image/png;base64,iVBOR"), 2);
    free(text);
}

/* Strange sessions: each must give files that can be read. */
static void every_session_has_a_report(void **unused)
{
    (void)unused;
    static const struct {
        const char *what;
        int frames, capacity;
        double period_ms;
        float frame_ms; /* of every frame, 0: as made */
        int64_t t_ns;   /* of every frame, 0: as made */
        bool all_missed;
    } rows[] = {
        {"no frame", 0, RECORDS, 13.3, 0, 0, false},
        {"one frame", 1, RECORDS, 13.3, 0, 0, true},
        {"two frames", 2, RECORDS, 13.3, 0, 0, false},
        {"no room for records", 500, 0, 13.3, 0, 0, false},
        {"more than fit", 500, 300, 13.3, 0, 0, false},
        {"binned", 9000, RECORDS, 13.3, 0, 0, true},
        {"no period", 500, RECORDS, 0, 0, 0, false},
        {"period not a number", 500, RECORDS, NAN, 0, 0, false},
        {"period negative", 500, RECORDS, -1, 0, 0, false},
        {"period huge", 500, RECORDS, 1e300, 0, 0, false},
        {"period tiny", 500, RECORDS, 1e-300, 0, 0, true},
        {"times not a number", 500, RECORDS, 13.3, NAN, 0, false},
        {"times infinite", 500, RECORDS, NAN, INFINITY, 0, false},
        {"times all the same", 500, RECORDS, 13.3, 13.3f, 0, false},
        {"times all the same, no period", 500, RECORDS, 0, 5, 0, false},
        {"times huge", 500, RECORDS, 13.3, 3e38f, 0, true},
        {"times tiny", 500, RECORDS, 13.3, 1e-44f, 0, false},
        {"times negative", 500, RECORDS, 13.3, -7, 0, false},
        {"clock stands still", 500, RECORDS, 13.3, 0, 77, false},
        {"clock at its end", 500, RECORDS, 13.3, 0, INT64_MAX, false},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        make_session(rows[i].frames, rows[i].capacity);
        session.period_ms = rows[i].period_ms;
        for (int k = 0; k < rows[i].frames; k++) {
            if (rows[i].frame_ms != 0) records[k].frame_ms = rows[i].frame_ms;
            if (rows[i].t_ns) records[k].t_ns = k % 2 ? rows[i].t_ns : rows[i].t_ns - k;
            if (isnan(rows[i].frame_ms)) records[k].r0_deg = records[k].p_min = NAN;
            records[k].missed |= rows[i].all_missed;
        }
        if (rows[i].capacity == 0) session.record = NULL;
        json_decref(write_json());
        free(write_html(NULL));
    }
}

static void hostile_names_stay_text_in_the_page(void **unused)
{
    (void)unused;
    make_session(500, RECORDS);
    session.scene = session.method = session.cpu = hostile;
    session.isa = NULL;
    session.stage[0] = hostile;
    snprintf(session.plan[0].reason, sizeof session.plan[0].reason, "</td><script>");
    strcpy(config.eye_tape, "\"><script>");
    free(write_html(NULL));
    config.eye_tape[0] = 0;
}

static void long_sessions_are_binned(void **unused)
{
    (void)unused;
    static struct fv_series series;
    const struct fv_column *column = &fv_columns[FV_COLUMN_FRAME_MS];
    make_session(9000, RECORDS);
    records[4321].frame_ms = 1e6f;
    fv_column_series(&session, column, &series);
    double most = 0, previous = -1;
    assert_true(series.binned && series.count == FV_BINS);
    for (int i = 0; i < series.count; i++) {
        assert_true(series.min[i] <= series.y[i] && series.y[i] <= series.max[i] && series.t_s[i] > previous);
        previous = series.t_s[i];
        most = fmax(most, series.max[i]);
    }
    assert_true(most == 1e6);
    session.frames = FV_POINTS_MAX;
    fv_column_series(&session, column, &series);
    assert_true(!series.binned && series.count == FV_POINTS_MAX);
    char *text = write_html(NULL);
    assert_true(strlen(text) < 400000);
    free(text);
}

static void full_disk_is_an_error(void **unused)
{
    (void)unused;
    if (access("/dev/full", W_OK) != 0) {
        print_message("skipped: no /dev/full here\n");
        return;
    }
    make_session(500, RECORDS);
    for (int kind = 0; kind < 2; kind++) {
        assert_int_equal(symlink("/dev/full", path_of("full.part")), 0);
        int result =
            kind == 0 ? fv_report_json(&session, &config, path_of("full"), &error)
                      : fv_report_html(&session, &config, &picture, png_of_test(), path_of("full"), &error);
        assert_int_equal(result, -1);
        assert_non_null(strstr(error.text, "No space left"));
        assert_false(fv_file_exists(path_of("full")));
    }
    assert_int_equal(fv_report_json(&session, &config, "/nowhere/report.json", &error), -1);
    /* A picture that the encoder was not opened for. */
    assert_int_equal(
        fv_report_html(&session, &config, &picture, fv_png_open(16, 16), path_of("full"), &error), -1);
    assert_non_null(strstr(error.text, "236 x 292"));
}

static void writing_allocates_nothing(void **unused)
{
    (void)unused;
    make_session(9000, RECORDS);
    struct fv_png *png = png_of_test();
    int64_t before = fv_heap_calls() + fv_heap_system_calls();
#ifdef FV_HEAP
    void *volatile taken = malloc(1);
    free(taken);
    assert_int_equal(fv_heap_calls() + fv_heap_system_calls(), before + 2); /* calls are counted */
    before += 2;
#endif
    assert_int_equal(fv_report_json(&session, &config, path_of("report.json"), &error), 0);
    assert_int_equal(fv_report_html(&session, &config, &picture, png, path_of("report.html"), &error), 0);
    assert_int_equal(fv_heap_calls() + fv_heap_system_calls(), before);
}

int main(int argc, char **argv)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(json_has_every_key),
        cmocka_unit_test(percentiles_are_nearest_rank),
        cmocka_unit_test(hostile_names_and_values_stay_json),
        cmocka_unit_test(numbers_read_back_the_same),
        cmocka_unit_test(page_holds_its_sections),
        cmocka_unit_test(every_session_has_a_report),
        cmocka_unit_test(hostile_names_stay_text_in_the_page),
        cmocka_unit_test(long_sessions_are_binned),
        cmocka_unit_test(full_disk_is_an_error),
        cmocka_unit_test(writing_allocates_nothing),
    };
    const struct fv_config_request request = {0};
    if (fv_config_load(&config, &request, &error)) printf("settings without presets: %s\n", error.text);
    make_picture();
    png_of_test();
    if (argc > 1) {
        snprintf(folder, sizeof folder, "%s", argv[1]);
        make_session(argc > 2 ? atoi(argv[2]) : 500, RECORDS);
        return fv_report_json(&session, &config, path_of("report.json"), &error) ||
               fv_report_html(&session, &config, &picture, png_of_test(), path_of("report.html"), &error);
    }
    snprintf(folder, sizeof folder, "/tmp/foveola-report-XXXXXX");
    if (!mkdtemp(folder)) return 1;
    fv_heap_seal(false);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[300];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return failed || system(command) != 0;
}
