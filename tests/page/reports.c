/* reports: the report pages of `run` and `measure` in headless Chromium, at 1280 and at 400 pixels: plots
 * have their curves, nothing overlaps or sticks out, images are loaded, the console is quiet. Skipped with
 * a notice where there is no Chromium. */
#include "cli/calibrate.h"
#include "cli/measure_table.h"
#include "cli/report.h"
#include "rt/measure/picture.h"
#include "tests/support/measure_rows.h"
#include "tests/support/program.h"
#include "tests/support/sample_session.h"

#include <stdbool.h>

static struct fv_error error;
static struct fv_measure_row row[FV_ROWS_MAX];
static struct fv_numeric_row numeric[FV_NUMERICS_MAX];

static bool browser_is_there(void)
{
    if (system("command -v chromium >/dev/null 2>&1") == 0) return true;
    print_message("no chromium here\n");
    return false;
}

static const char *path_of(const char *name)
{
    static char path[FV_PATH_MAX];
    fv_path_join(path, program_folder(), name);
    return path;
}

static char *read_whole(const char *path)
{
    char *text;
    size_t size;
    if (fv_file_read(path, 1 << 28, &text, &size, &error)) fail_msg("%s", error.text);
    return text;
}

/* checked.html: the page and behind it the checking script. frame.html: shows it as wide as is asked, which
 * windows are not below 500 pixels, and becomes its findings. */
static void make_checked(const char *page, int width)
{
    static const char frame[] =
        "<!doctype html><html><style>body{margin:0}iframe{border:0;width:%dpx;height:900px}</style>"
        "<iframe src=\"checked.html\"></iframe><script>onload = () => "
        "document.documentElement.textContent = '\\n' + frames[0].findings + '\\n'</script>";
    char *html = read_whole(path_of(page)), *script = read_whole(FV_SOURCE_DIR "/tests/page/check.js");
    char framed[512];
    FILE *f = fopen(path_of("checked.html"), "wb");
    assert_non_null(f);
    fprintf(f, "%s<script>const EXPECTED_WIDTH = %d;\n%s</script>\n", html, width, script);
    fclose(f);
    snprintf(framed, sizeof framed, frame, width);
    program_write("frame.html", framed, strlen(framed));
    free(html);
    free(script);
}

/* Opens the page; returns the browser's findings, or NULL where it gave none. The caller frees it. */
static char *browse(void)
{
    char command[2048];
    snprintf(
        command, sizeof command,
        "cd %s && rm -rf browser && mkdir browser && HOME=$PWD/browser timeout -k 5 60 chromium --headless "
        "--no-sandbox --disable-gpu --disable-dev-shm-usage --user-data-dir=$PWD/browser --no-first-run "
        "--disable-background-networking --disable-component-update --disable-sync --disable-extensions "
        "--disable-default-apps --host-resolver-rules='MAP * ~NOTFOUND' --hide-scrollbars "
        "--allow-file-access-from-files --window-size=1280,900 --enable-logging=stderr --v=0 --dump-dom "
        "file://$PWD/frame.html "
        ">findings.txt 2>console.txt </dev/null; grep CONSOLE console.txt >>findings.txt; true",
        program_folder());
    assert_int_equal(system(command), 0);
    char *findings = read_whole(path_of("findings.txt"));
    if (strstr(findings, "looked at:")) return findings;
    free(findings);
    return NULL;
}

/* A browser may fail to start on a busy machine: it has a second try. */
static char *findings_of(const char *page, int width)
{
    make_checked(page, width);
    char *findings = browse();
    if (!findings) findings = browse();
    if (!findings) fail_msg("%s: chromium gave no findings:\n%s", page, read_whole(path_of("console.txt")));
    return findings;
}

/* No finding, and as many plots and images as there should be. */
static void assert_fine(const char *page, int plots, int images)
{
    static const int widths[] = {1280, 400};
    char expected[128];
    snprintf(expected, sizeof expected, "<!DOCTYPE html>\n<html>\nlooked at: %d plots, %d images.\n</html>\n",
             plots, images);
    for (int i = 0; i < 2; i++) {
        char *findings = findings_of(page, widths[i]);
        if (strcmp(findings, expected) != 0) fail_msg("%s at %d pixels:\n%.4000s", page, widths[i], findings);
        free(findings);
    }
}

static void measure_is_readable(void **unused)
{
    (void)unused;
    if (!browser_is_there()) skip();
    int rows = sample_scene("cornell", 38.2, 0, row);
    rows += sample_scene("hall", 210, 3, row + rows);
    struct fv_measure_report report = {.rows = rows,
                                       .row = row,
                                       .numerics = sample_numerics(numeric),
                                       .numeric = numeric,
                                       .missing = 3,
                                       .period_ms = 1000.0 / 75,
                                       .pictures = program_folder()};
    sample_pictures(program_folder(), row, rows / 2);
    assert_int_equal(fv_measure_page(&report, path_of("measure.html"), &error), 0);
    assert_fine("measure.html", 20, 1 + 2 * (1 + 3 * 4));
}

/* All rows of the paper and of ours, and what a folder without scene files leaves: no figure. */
static void table_is_readable(void **unused)
{
    static const char *const scenes[] = {"sponza", "sibenik", "cornell"}, *const lights[] = {"point", "area", "ao"},
                             *const regions[] = {"small", "medium", "large", "full"},
                             *const stages[] = {"select", "support", "reproject", "sample", "present", "cache_update"};
    static struct fv_sheet sheet;
    char name[48];
    (void)unused;
    if (!browser_is_there()) skip();
    struct fv_table_report report = {.table = &fv_table_weier2016, .sheet = &sheet, .parts = 9, .about = "a CPU, avx512, 2 threads; 1000 frames at 75 Hz"};
    for (int i = 0; i < 9; i++) {
        double paper = i < 6 ? 1.92 : (double)NAN;
        snprintf(name, sizeof name, "%s/%s", scenes[i / 3], lights[i % 3]);
        fv_sheet_add(&sheet, name, "rays_full", "rays", 1e6 * paper, 2.65e6);
        fv_sheet_add(&sheet, name, "frame_ms_full", "ms", 100 * paper, 1179.01);
        fv_sheet_add(&sheet, name, "speedup", "", paper, i + 0.5);
        for (int k = 0; k < 6; k++) {
            char stage[40];
            snprintf(stage, sizeof stage, "stage_%s_ms", stages[k]);
            fv_sheet_add(&sheet, name, stage, "ms", k % 2 ? paper : (double)NAN, k < 5 ? k + 0.25 : (double)NAN);
        }
        if (i >= 3) continue;
        for (int r = 0; r < 4; r++) {
            snprintf(name, sizeof name, "sponza/%s/%s", lights[i], regions[r]);
            fv_sheet_add(&sheet, name, "fps", "Hz", r % 2 ? 137.7 : (double)NAN, 20 * r + 3.1);
            fv_sheet_add(&sheet, name, "speedup", "", r % 2 ? 4.18 - r : (double)NAN, 8 - 2 * r);
        }
    }
    assert_int_equal(fv_table_page(&report, path_of("table.html"), &error), 0);
    assert_fine("table.html", 3, 0);
    sheet.cells = 0;
    fv_sheet_add(&sheet, "cornell/point", "rays_full", "rays", (double)NAN, 1);
    report.parts = 1;
    assert_int_equal(fv_table_page(&report, path_of("table.html"), &error), 0);
    assert_fine("table.html", 0, 0);
}

/* The rows of a kind at a radius, by samples and refresh rate. */
static void add_field_rows(struct fv_sheet *sheet, const char *scene, const char *kind, double fovea_deg)
{
    static const char *const quantities[] = {"speedup", "steps_ratio", "ssim", "ssim_fovea", "ssim_mid", "ssim_far",
                                             "flip", "flip_fovea", "flip_mid", "flip_far", "off_pixels", "cpu_ms"};
    for (int i = 0; i < 5 * 3; i++) {
        int ssaa = 1 << i % 5, refresh = 1 << i / 5;
        const char *name = fv_row_polychronakis2023(scene, kind, ssaa, fovea_deg, refresh);
        for (int q = 0; q < (fovea_deg > 7 ? 12 : 2); q++)
            fv_sheet_add(sheet, name, quantities[q], "", q % 4 ? (double)NAN : 1.1 + q,
                         q > 1 && ssaa == 4 ? (double)NAN : 0.31 * ssaa * (q + refresh) + fovea_deg);
    }
}

/* All that the page may show, some of it without a number. */
static void fields_are_readable(void **unused)
{
    static const char *const scenes[] = {"primitives", "columns", "temple"},
                             *const every[] = {"ipr", "ipr-minimum"},
                             *const foveated[] = {"fipr-masked", "fipr-minimum", "fipr-paper", "fipr-turning", "fipr-turning-stays"};
    static struct fv_sheet sheet;
    (void)unused;
    if (!browser_is_there()) skip();
    struct fv_table_report report = {.table = &fv_table_polychronakis2023, .sheet = &sheet, .parts = 15, .about = "a CPU, avx512, 2 threads; 3 frames at 90 Hz"};
    for (int s = 0; s < 3; s++) {
        for (int k = 0; k < 2; k++) add_field_rows(&sheet, scenes[s], every[k], 180);
        for (int f = 1; f <= 6; f++) add_field_rows(&sheet, scenes[s], "fipr", 2.5 * f);
        for (int k = 0; k < 5; k++) add_field_rows(&sheet, scenes[s], foveated[k], 7.5);
    }
    assert_int_equal(fv_table_page(&report, path_of("fields.html"), &error), 0);
    assert_fine("fields.html", 4, 0);
}

/* Cells of Tables 2 and 3 and of Figures 6 to 8. */
static void add_selective_rows(struct fv_sheet *sheet)
{
    static const char *const rows[] = {
        "sponza/36spp", "sponza/1spp", "sponza/selective", "sponza/every", "sponza/sparse", "pipes/every", "atrium/sparse",
        "sponza/smoothing/off", "sponza/smoothing/0.5", "sponza/smoothing/foveated", "sponza/reuse/0", "sponza/reuse/0.25",
        "sponza/reuse/1", "sponza/reuse/8", "sponza/reuse/paper-a", "sponza/reuse/paper-b", "atrium/tolerance/low",
        "atrium/tolerance/high", "atrium/view1/foveated", "atrium/view1/selective", "atrium/view2/foveated"};
    static const char *const quantities[] = {
        "speedup_vs_36spp", "speedup_vs_36spp_p25", "cpu_speedup_vs_36spp", "speedup_vs_selective", "psnr_fovea", "psnr_para",
        "psnr_peri", "psnr_near", "psnr_far", "rays", "frame_ms", "cpu_ms", "reused_fraction", "extra_samples",
        "extra_per_pixel", "extra_per_pixel_fovea"};
    char quantity[40];
    for (int r = 0; r < (int)(sizeof rows / sizeof rows[0]); r++)
        for (int q = 0; q < (int)(sizeof quantities / sizeof quantities[0]); q++) {
            double paper = q == 9 ? 426806e3 : q == 12 ? 0.1 + 0.02 * r : 31.7 + q + r, ours = q == 12 ? 0.05 * r - 0.5 : paper * 3;
            bool printed = strstr(rows[r], "paper") != NULL;
            fv_sheet_add(sheet, rows[r], quantities[q], "", printed || r % 2 ? paper : (double)NAN, printed ? (double)NAN : ours);
        }
    for (int e = 0; e <= 30; e++) {
        snprintf(quantity, sizeof quantity, "tau_fov_at_%d", e);
        fv_sheet_add(sheet, "atrium/tolerance/low", quantity, "", (double)NAN, 1 + 0.3 * e);
        fv_sheet_add(sheet, "atrium/tolerance/high", quantity, "", (double)NAN, 9 + 0.3 * e);
    }
}

static void selective_is_readable(void **unused)
{
    static const char *const maps[] = {"figure7-low", "figure7-high", "figure8-1-foveated", "figure8-1-selective", "figure8-2-foveated"};
    static const uint8_t pixels[12 * 10 * 3] = {255};
    const struct fv_metrics_picture picture = {12, 10, 3, 36, pixels};
    static struct fv_sheet sheet;
    char name[48];
    (void)unused;
    if (!browser_is_there()) skip();
    struct fv_table_report report = {.table = &fv_table_kim2021, .sheet = &sheet, .parts = 8, .folder = program_folder(),
                                     .about = "a CPU, avx512, 2 threads; 2 x 1280 x 1440 px; 12 frames at 80 Hz"};
    for (int i = 0; i < 5; i++) {
        snprintf(name, sizeof name, "%s.png", maps[i]);
        assert_int_equal(fv_picture_png(&picture, path_of(name), &error), 0);
    }
    assert_int_equal(fv_picture_jpeg(&picture, path_of("figure7.jpg"), &error), 0);
    add_selective_rows(&sheet);
    assert_int_equal(fv_table_page(&report, path_of("selective.html"), &error), 0);
    assert_fine("selective.html", 5, 6);
    sheet.cells = 0;
    report.parts = 0;
    assert_int_equal(fv_table_page(&report, path_of("selective.html"), &error), 0);
    assert_fine("selective.html", 0, 0);
}

/* Numbers of every size, infinite and none, long names. */
static void strange_rows_are_readable(void **unused)
{
    (void)unused;
    static const double factors[] = {1e-9, 1e-4, 1, 1e5, 1e12};
    if (!browser_is_there()) skip();
    struct fv_measure_report report = {.rows = sample_scene("cornell", 38.2, 0, row), .row = row};
    for (int i = 0; i < report.rows; i++) {
        double by = factors[i % 5];
        struct fv_measured *scaled[] = {&row[i].frame_ms, &row[i].rmse[FV_ZONE_FOVEA], &row[i].flicker};
        for (int k = 0; k < 3; k++)
            *scaled[k] =
                (struct fv_measured){scaled[k]->value * by, scaled[k]->low * by, scaled[k]->high * by};
        memset(row[i].scene, 'W', sizeof row[i].scene - 1);
        memset(row[i].about, 'W', sizeof row[i].about - 1);
        memset(row[i].parameters, 'W', sizeof row[i].parameters - 1);
        if (i > 14) memset(row[i].method, i < 22 ? 'M' : 'W', sizeof row[i].method - 1);
    }
    row[3].psnr[FV_ZONE_FOVEA] = (struct fv_measured){INFINITY, INFINITY, INFINITY};
    row[3].rmse[FV_ZONE_FOVEA] = (struct fv_measured){0, 0, 0};
    row[4].psnr[FV_ZONE_FOVEA].value = row[5].rmse[FV_ZONE_FOVEA].value = NAN;
    report.missing = 1;
    assert_int_equal(fv_measure_page(&report, path_of("strange.html"), &error), 0);
    assert_fine("strange.html", 10, 0);
}

static void run_is_readable(void **unused)
{
    (void)unused;
    if (!browser_is_there()) skip();
    struct program_result r = program("run --frames 6 --set scene.name=cornell --set display.headset=small "
                                      "--set output.every=6 --out session");
    if (r.code != 0) fail_msg("run: %s", r.errors);
    char *html = read_whole(path_of("session/report.html"));
    int plots = 0;
    for (const char *at = html; (at = strstr(at, "<figure class=\"plot")); at++) plots++;
    free(html);
    assert_true(plots >= 3);
    assert_fine("session/report.html", plots, 2);
}

/* Every part of a report: a level that adapts, cuts, rings. */
static void adaptation_is_readable(void **unused)
{
    (void)unused;
    static struct fv_session session;
    static struct fv_frame_record records[SAMPLE_RECORDS];
    static struct fv_config config;
    if (!browser_is_there()) skip();
    sample_session(&session, records, 3000);
    assert_int_equal(fv_report_html(&session, &config, NULL, NULL, path_of("adapted.html"), &error), 0);
    assert_fine("adapted.html", 10, 0);
}

/* A calibration of two eyes: 13 targets, one missed, and 5 that could not be judged one by one. */
static void calibration_is_readable(void **unused)
{
    static struct fv_calibrated calibrated = {.eyes = 2};
    (void)unused;
    if (!browser_is_there()) skip();
    for (int eye = 0; eye < 2; eye++) {
        struct fv_calibrated_eye *e = &calibrated.eye[eye];
        e->targets = e->seen = eye ? 5 : 13;
        e->fit = (struct fv_off){0.31, 0.27, 1.2};
        e->left_out = eye ? (struct fv_off){NAN, NAN, NAN} : (struct fv_off){0.9, 0.8, 2.9};
        e->map.pupil = (struct fv_gaze_polynomial){.terms = eye ? 4 : 8, .condition = 12.3};
        for (int i = 0; i < e->targets; i++) {
            struct fv_calibrated_target *t = &e->target[i];
            *t = (struct fv_calibrated_target){
                .at_deg = {9.0 * (i % 5 - 2), 6.0 * (i / 5 - 1)}, .shown = 1 + i % 3, .frames = 64, .spread_px = 0.21};
            for (int k = 0; k < 2; k++) {
                t->gaze_deg[k] = t->at_deg[k] + 0.1 * (i % 3);
                t->left_out_deg[k] = eye ? (double)NAN : t->at_deg[k] - 0.3 * (i % 4);
            }
            t->off_deg = 0.14 * (i % 3);
            t->left_out_off_deg = eye ? (double)NAN : 0.42 * (i % 4);
        }
        struct fv_calibrated_target *missed = &e->target[3];
        if (eye == 1) continue;
        missed->frames = 0;
        missed->gaze_deg[0] = missed->left_out_deg[1] = missed->off_deg = missed->left_out_off_deg = NAN;
    }
    assert_int_equal(fv_calibrated_page(&calibrated, "13 targets, frames of 640x400 from v4l2",
                                        path_of("calibration.html"), &error), 0);
    assert_fine("calibration.html", 2, 0);
}

/* The check itself finds what it looks for. */
static void faults_are_found(void **unused)
{
    (void)unused;
    static const char page[] =
        "<!doctype html><title>x</title><p style=\"margin-left:-90px\">left</p><div "
        "style=\"width:2000px;font-size:9px\">wide</div>"
        "<img src=\"data:image/png;base64,AAAA\"><figure class=plot><figcaption>caption</figcaption>"
        "<svg width=300 height=200><path d=\"\"/><g class=grid><text x=50 y=50>over</text>"
        "<text x=50 y=52>over</text></g></svg></figure>"
        "<figure class=plot><figcaption>x</figcaption><svg width=300 height=200><path class=\"curve c1\" "
        "d=\"M0,0L90,90\"/>"
        "<g class=\"point c1\"><use/></g></svg></figure><script>console.error('loud');nothing()</script>";
    static const char *const expected[] = {
        "the page is 2",        "small print",    "an empty marker",       "beside their curve",
        "an image not loaded",  "without curves", "text over the plot",    "texts over each other",
        "text beside the page", "\"loud\"",       "nothing is not defined"};
    if (!browser_is_there()) skip();
    program_write("faults.html", page, sizeof page - 1);
    make_checked("faults.html", 400);
    char *findings = browse();
    if (!findings) findings = browse();
    assert_non_null(findings);
    for (size_t i = 0; i < sizeof expected / sizeof expected[0]; i++)
        if (!strstr(findings, expected[i])) fail_msg("'%s' is not in:\n%s", expected[i], findings);
    free(findings);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(faults_are_found),          cmocka_unit_test(run_is_readable),
        cmocka_unit_test(adaptation_is_readable),    cmocka_unit_test(measure_is_readable),
        cmocka_unit_test(strange_rows_are_readable), cmocka_unit_test(table_is_readable),
        cmocka_unit_test(fields_are_readable),       cmocka_unit_test(calibration_is_readable),
        cmocka_unit_test(selective_is_readable),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
