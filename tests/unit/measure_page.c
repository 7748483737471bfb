/* measure_page: measure's report of made-up rows: every curve and table, whole pages whatever the numbers,
 * names and files, nothing from outside. With a folder as its argument it leaves a sample there. */
#include "tests/support/markup_check.h"
#include "tests/support/measure_rows.h"

#include "cli/plot_ticks.h"
#include "platform/heap.h"

#include <sys/stat.h>
#include <unistd.h>

static char folder[256];
static struct fv_error error;
static struct fv_measure_row row[FV_ROWS_MAX];
static struct fv_numeric_row numeric[FV_NUMERICS_MAX];
static struct fv_measure_report report;

static const char *path_of(const char *name)
{
    static char path[FV_PATH_MAX];
    fv_path_join(path, folder, name);
    return path;
}

/* A sample of one scene, without pictures. */
static void make_report(void)
{
    int rows = sample_scene("cornell", 38.2, 0, row);
    report = (struct fv_measure_report){.rows = rows,
                                        .row = row,
                                        .numerics = sample_numerics(numeric),
                                        .numeric = numeric,
                                        .period_ms = 1000.0 / 75};
}

/* Writes the page, checks what holds of every page, and returns its text. */
static char *write_page(void)
{
    char *text;
    size_t size;
    if (fv_measure_page(&report, path_of("report.html"), &error)) fail_msg("%s", error.text);
    assert_int_equal(fv_file_read(path_of("report.html"), 1 << 28, &text, &size, &error), 0);
    assert_int_equal(strlen(text), size);
    markup_check(text);
    return text;
}

static void assert_has(const char *text, const char *part)
{
    if (!strstr(text, part)) fail_msg("no '%s'", part);
}

static void page_holds_its_parts(void **unused)
{
    (void)unused;
    static const char *const parts[] = {
        "<h1>Error against run time: cornell</h1>",
        "AMD EPYC, avx512",
        "pyramid level 4 is 3.91 times",
        "with 30.6 dB in the fovea against 31.1 dB",
        "The fastest, pyramid level 6, is 6.10 times",
        "display&#39;s period 13.33 ms",
        "Error in the fovea",
        "Error in the whole picture",
        "Fovea, to 3.3",
        "Far periphery",
        "SSIM (1 is identical)",
        "FLIP (0 is identical)",
        "Flicker above",
        "Pareto front",
        "Time to error",
        "not reached",
        "All rows",
        "r0=10 r1=20 p_min=0.05",
        "2.10 <small>2.00–2.21</small>",
        "IMU integration",
        "exact rotation",
        "ns/sample",
        "How it was measured",
    };
    make_report();
    char *text = write_page();
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) assert_has(text, parts[i]);
    /* Two plots of the main section, five zones, three other measures: each has each method's curve and
     * each row's point; labels and rings only in the first two. */
    assert_int_equal(markup_count(text, "<figure class=\"plot"), 10);
    for (int m = 0; m < SAMPLE_METHODS; m++) {
        char part[64];
        snprintf(part, sizeof part, "\"><path class=\"curve c%d\"", m);
        assert_true(markup_count(text, part) >= 10);
    }
    assert_int_equal(markup_count(text, "<g class=\"point"), 10 * report.rows);
    int front = 0;
    for (int i = 0; i < report.rows; i++)
        front += fv_row_is_pareto(row, report.rows, i, FV_ZONE_FOVEA) +
                 fv_row_is_pareto(row, report.rows, i, FV_ZONE_ALL);
    assert_int_equal(markup_count(text, "class=\"ring\""), front + 1);
    assert_null(strstr(text, "not here"));
    assert_null(strstr(text, "<img"));
    assert_int_equal(markup_count(text, "<tr class=\"group\""), 4);
    free(text);
}

/* Of the first level that reaches it: frame time, level, and the ratio of speed-ups to full's. */
static void time_to_error_is_a_ratio_of_speedups(void **unused)
{
    (void)unused;
    char part[160];
    make_report();
    int full = fv_rows_reach(row, report.rows, "full", FV_ZONE_FOVEA, 35);
    int selective = fv_rows_reach(row, report.rows, "selective", FV_ZONE_FOVEA, 35);
    assert_true(full > 0 && selective > full);
    row[selective].frame_ms.value = 4321; /* the clock drifted: the ratio must not follow */
    char *text = write_page();
    snprintf(part, sizeof part,
             "<b>4321.00 ms</b><br><small><span>level %d,</span> <span>%.2f ×</span></small>",
             row[selective].level, row[selective].speedup.value / row[full].speedup.value);
    assert_has(text, part);
    free(text);
}

/* Every scene has its own sections, and a method its colour in all of them. */
static void scenes_have_sections_each(void **unused)
{
    (void)unused;
    make_report();
    int more = sample_scene("hall & \"co\"", 210, 3, row + report.rows);
    snprintf(row[3].method, sizeof row[3].method, "full");
    for (int i = report.rows; i < report.rows + more; i++)
        if (strcmp(row[i].method, "denoise") == 0) strcpy(row[i].method, "another");
    report.rows += more;
    report.missing = 1;
    char *text = write_page();
    assert_int_equal(markup_count(text, "<h2 class=\"scene\""), 2);
    assert_int_equal(markup_count(text, "<h2>All rows</h2>"), 2);
    assert_int_equal(markup_count(text, "<h2>Other numerics</h2>"), 1);
    assert_has(text, "<h1>Error against run time</h1>");
    assert_has(text, ">hall &#38; &#34;co&#34;</a>");
    assert_has(text, "1 row of the whole sweep is not here");
    assert_has(text, "curve c5"); /* the method that has no place of its own */
    free(text);
}

static void hostile_names_stay_text(void **unused)
{
    (void)unused;
    static const char hostile[] = "</svg><script>\"'&\x01\xff";
    make_report();
    for (int i = 0; i < report.rows; i++) strcpy(row[i].scene, hostile);
    for (int i = 10; i < 14; i++) strcpy(row[i].method, hostile);
    strcpy(row[0].about, hostile);
    strcpy(row[11].parameters, hostile);
    memset(row[12].parameters, '<', sizeof row[12].parameters - 1);
    memset(row[13].method, '&', sizeof row[13].method - 1);
    strcpy(numeric[0].quantity, hostile);
    strcpy(numeric[1].method, hostile);
    strcpy(numeric[2].condition, hostile);
    strcpy(numeric[3].error_unit, "<\"&>");
    strcpy(numeric[4].cost_unit, "<\"&>");
    report.pictures = folder;
    free(write_page());
    /* A name that would leave the folder has no picture. */
    sample_picture(folder, "reference.jpg", 1);
    for (int i = 0; i < report.rows; i++) snprintf(row[i].scene, sizeof row[i].scene, "%.60s/x", folder);
    char *text = write_page();
    assert_null(strstr(text, "<img"));
    free(text);
}

static void set_all(double value)
{
    for (int i = 0; i < report.rows; i++) {
        for (double *v = &row[i].frame_ms.value; v <= &row[i].flicker.high; v++) *v = value;
    }
}

/* Every number of every row, or some, strange: the page is whole. */
static void every_number_has_a_page(void **unused)
{
    (void)unused;
    static const double values[] = {0,      -1,    NAN,  INFINITY, -INFINITY, 1e-320, 1e300,
                                    -1e300, 1e-12, 13.3, 40,       1e30,      1e-30,  0.1};
    enum { VALUES = sizeof values / sizeof values[0] };
    for (int i = 0; i < VALUES; i++) {
        make_report();
        set_all(values[i]);
        report.period_ms = values[i];
        free(write_page());
        /* Mixed with others. */
        for (int k = 0; k < VALUES; k++) {
            make_report();
            report.period_ms = values[k];
            for (int r = 0; r < report.rows; r++) {
                int count = (int)(&row[r].flicker.high - &row[r].frame_ms.value) + 1;
                for (int n = 0; n < count; n++)
                    if ((n + r) % 7 == 0) (&row[r].frame_ms.value)[n] = (n + r) % 2 ? values[i] : values[k];
            }
            if (k % 5 == i % 5) free(write_page());
        }
    }
}

static void no_error_is_shown_as_infinite(void **unused)
{
    (void)unused;
    make_report();
    row[5].psnr[FV_ZONE_FOVEA] = (struct fv_measured){INFINITY, INFINITY, INFINITY};
    row[5].rmse[FV_ZONE_FOVEA] = (struct fv_measured){0, 0, 0};
    row[4].psnr[FV_ZONE_FOVEA].value = NAN;
    row[4].rmse[FV_ZONE_FOVEA].value = NAN;
    char *text = write_page();
    assert_has(text, "<td class=\"n\">\xE2\x88\x9E</td>");
    assert_has(text, "full level 5: 1004.72 ms, \xE2\x88\x9E dB");
    assert_has(text, "Points at the upper edge");
    assert_null(strstr(text, "full level 4: 522.45 ms, \xE2\x80\x93 dB"));
    assert_int_equal(markup_count(text, "<g class=\"point"), 10 * report.rows - 2);
    free(text);
}

static void few_or_many_rows(void **unused)
{
    (void)unused;
    make_report();
    for (int from = 0; from < 12; from += 11) { /* full only; reproject only */
        report.row = row + from;
        report.rows = 1;
        report.numerics = 0;
        report.missing = 31;
        report.period_ms = NAN;
        char *text = write_page();
        assert_int_equal(markup_count(text, "<g class=\"point"), 10);
        assert_has(text, "31 rows of the whole sweep are not here");
        assert_has(text,
                   from ? "Plain rendering (full at level 0) is not among the rows" : "Only plain rendering (full)");
        assert_null(strstr(text, "Other numerics"));
        free(text);
    }
    make_report();
    for (int i = 0; i < FV_ROWS_MAX; i++) { /* all of methods of their own */
        row[i] = row[i % 20];
        snprintf(row[i].method, sizeof row[i].method, "method-%03d", i);
    }
    report.rows = FV_ROWS_MAX;
    char *text = write_page();
    assert_int_equal(markup_count(text, "<g class=\"point"), 10 * FV_ROWS_MAX);
    free(text);
    for (int i = 0; i < FV_ROWS_MAX; i++) { /* all of one method */
        snprintf(row[i].method, sizeof row[i].method, "reproject");
        row[i].level = i;
    }
    free(write_page());
    for (int i = 0; i < FV_ROWS_MAX; i++) snprintf(row[i].scene, sizeof row[i].scene, "scene-%03d", i);
    text = write_page();
    assert_int_equal(markup_count(text, "<h2 class=\"scene\""), FV_ROWS_MAX);
    free(text);
}

static void pictures_are_embedded(void **unused)
{
    (void)unused;
    make_report();
    sample_pictures(folder, row, report.rows);
    report.pictures = folder;
    char *text = write_page();
    /* The reference; full's first; three levels of each of the four others; each with its difference. */
    assert_int_equal(markup_count(text, "<img"), 1 + 2 * (1 + 3 * 4));
    assert_int_equal(markup_count(text, "src=\"data:image/jpeg;base64,/9j/"), 1 + 2 * (1 + 3 * 4));
    free(text);
    /* Missing, empty, not a picture, a folder: left out, the rest stays. */
    unlink(path_of("cornell-reference.jpg"));
    unlink(path_of("cornell-reproject-0.jpg"));
    unlink(path_of("cornell-reproject-3-difference.jpg"));
    FILE *f = fopen(path_of("cornell-reproject-7.jpg"), "w");
    fprintf(f, "text");
    fclose(f);
    fclose(fopen(path_of("cornell-pyramid-0.jpg"), "w"));
    unlink(path_of("cornell-full-0.jpg"));
    assert_int_equal(mkdir(path_of("cornell-full-0.jpg"), 0777), 0);
    text = write_page();
    assert_int_equal(markup_count(text, "<img"), 2 * (1 + 3 + 3 + 2) - 1);
    assert_has(text, "no picture of the reference");
    free(text);
    report.pictures = "/nowhere";
    text = write_page();
    assert_int_equal(markup_count(text, "<img"), 0);
    free(text);
}

static void full_disk_is_an_error(void **unused)
{
    (void)unused;
    make_report();
    assert_int_equal(fv_measure_page(&report, "/nowhere/report.html", &error), -1);
    assert_has(error.text, "/nowhere/report.html");
    if (access("/dev/full", W_OK) != 0) {
        print_message("skipped: no /dev/full here\n");
        return;
    }
    assert_int_equal(symlink("/dev/full", path_of("full.part")), 0);
    assert_int_equal(fv_measure_page(&report, path_of("full"), &error), -1);
    assert_has(error.text, "No space left");
    assert_false(fv_file_exists(path_of("full")));
}

/* Ticks rise, lie on the axis, are few and read differently, whatever the axis. */
static void ticks_are_few_and_differ(void **unused)
{
    (void)unused;
    static const double lows[] = {1e-30, 1e-7, 0.001, 0.0337, 0.9, 1, 3, 9.99, 1234, 1e29};
    static const double lengths[] = {1e-7, 0.01, 0.3, 1, 2.5, 9, 40, 99, 1e4, 1e9, 1e40};
    for (size_t i = 0; i < sizeof lows / sizeof lows[0]; i++) {
        for (size_t k = 0; k < sizeof lengths / sizeof lengths[0]; k++) {
            for (int most = 3; most <= 6; most += 3) {
                for (int log = 0; log < 2; log++) {
                    struct fv_ticks ticks;
                    const struct fv_axis axis = {lows[i], lows[i] * (1 + lengths[k]), log};
                    double slack = 1e-6 * (axis.high - axis.low);
                    fv_ticks_of(&axis, most, &ticks);
                    assert_true(ticks.count >= 1 && ticks.count <= most + 1);
                    for (int t = 0; t < ticks.count; t++) {
                        assert_true(ticks.value[t] >= axis.low - slack &&
                                    ticks.value[t] <= axis.high + slack);
                        if (t == 0) continue;
                        assert_true(ticks.value[t] > ticks.value[t - 1]);
                        if (lengths[k] > 0.1 && lows[i] > 1e-20 && axis.high < 1e20)
                            assert_string_not_equal(fv_tick_text(&ticks, t).text,
                                                    fv_tick_text(&ticks, t - 1).text);
                    }
                }
            }
        }
    }
}

static void axes_fit_what_they_hold(void **unused)
{
    (void)unused;
    static const double values[] = {NAN, INFINITY, -INFINITY, 0, -5, 1e-320, 1e308, -1e308, 3, 4};
    for (int log = 0; log < 2; log++) {
        for (int a = 0; a < 10; a++) {
            for (int b = 0; b < 10; b++) {
                struct fv_axis axis = fv_axis_empty(log);
                fv_axis_hold(&axis, values[a]);
                fv_axis_hold(&axis, values[b]);
                fv_axis_settle(&axis, log ? 2 : 0.5, (struct fv_axis){1, 2, log});
                assert_true(isfinite(axis.low) && axis.low < axis.high && isfinite(axis.high));
                if (log) assert_true(axis.low > 0 && axis.high / axis.low > 1.99);
                struct fv_plot plot = {.x = axis, .y = axis};
                for (int k = 0; k < 10; k++) {
                    double x = fv_plot_part_x(&plot, values[k]), y = fv_plot_part_y(&plot, values[k]);
                    assert_true(x >= 0 && x <= 1 && y >= 0 && y <= 1);
                }
                assert_true(fv_plot_part_x(&plot, INFINITY) == 1 && fv_plot_part_y(&plot, INFINITY) == 0);
                assert_true(fv_plot_part_x(&plot, log ? 0 : -INFINITY) == 0);
            }
        }
    }
}

static void writing_allocates_nothing(void **unused)
{
    (void)unused;
    make_report();
    report.pictures = folder;
    int64_t before = fv_heap_calls() + fv_heap_system_calls();
    assert_int_equal(fv_measure_page(&report, path_of("report.html"), &error), 0);
    assert_int_equal(fv_heap_calls() + fv_heap_system_calls(), before);
}

int main(int argc, char **argv)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(page_holds_its_parts),      cmocka_unit_test(time_to_error_is_a_ratio_of_speedups),
        cmocka_unit_test(scenes_have_sections_each), cmocka_unit_test(hostile_names_stay_text),
        cmocka_unit_test(every_number_has_a_page),   cmocka_unit_test(no_error_is_shown_as_infinite),
        cmocka_unit_test(few_or_many_rows),          cmocka_unit_test(pictures_are_embedded),
        cmocka_unit_test(full_disk_is_an_error),     cmocka_unit_test(ticks_are_few_and_differ),
        cmocka_unit_test(axes_fit_what_they_hold),   cmocka_unit_test(writing_allocates_nothing),
    };
    if (argc > 1) {
        snprintf(folder, sizeof folder, "%s", argv[1]);
        make_report();
        if (argc > 2) report.rows += sample_scene("hall", 210, 3, row + report.rows);
        report.pictures = folder;
        sample_pictures(folder, row, report.rows);
        return fv_measure_page(&report, path_of("report.html"), &error);
    }
    snprintf(folder, sizeof folder, "/tmp/foveola-page-XXXXXX");
    if (!mkdtemp(folder)) return 1;
    fv_heap_seal(false);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[300];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return failed || system(command) != 0;
}
