/* table: `measure --table` as users run it, on small pictures of the built-in scenes; cells as text and back; which
 * frames of the way a fly-through takes. */
#include "rt/measure/flight.h"
#include "rt/measure/table.h"
#include "tests/support/program.h"

#include <math.h>
#include <signal.h>

#define SMALL "--set display.width=48 --set display.height=40 --frames 3 --set scene.library= "

static struct fv_error error;
static struct fv_sheet sheet, again;

static const char *path_of(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", program_folder(), name);
    return path;
}

static const char *text_of(const char *name)
{
    static char text[1 << 19];
    program_slurp(path_of(name), text, sizeof text);
    return text;
}

static double ours(const char *csv, const char *cell)
{
    const char *at = strstr(csv, cell);
    if (!at) fail_msg("no cell %s", cell);
    at = strchr(at + strlen(cell), ',') + 1;
    return *at == '\n' ? NAN : strtod(at, NULL);
}

static void cells_come_back(void **state)
{
    static const double values[] = {0, 1.5, -2, 1e300, 1e-300, NAN};
    enum { VALUES = sizeof values / sizeof values[0] };
    struct fv_part_heading heading = {"0123", "a machine; 3 frames, 2 threads"}, back;
    char row[16];
    (void)state;
    sheet.cells = again.cells = 0;
    for (int i = 0; i < VALUES * VALUES; i++) {
        snprintf(row, sizeof row, "scene/%d", i);
        fv_sheet_add(&sheet, row, "quantity", i % 2 ? "ms" : "", values[i / VALUES], values[i % VALUES]);
    }
    assert_int_equal(fv_part_write(&heading, &sheet, path_of("a.part"), &error), 0);
    if (fv_part_read(&back, &again, path_of("a.part"), &error)) fail_msg("%s", error.text);
    assert_string_equal(back.key, heading.key);
    assert_string_equal(back.about, heading.about);
    assert_int_equal(again.cells, sheet.cells);
    for (int i = 0; i < sheet.cells; i++) {
        const struct fv_cell *a = &sheet.cell[i], *b = fv_sheet_find(&again, a->row, a->quantity);
        assert_non_null(b);
        assert_true(isnan(a->paper) ? isnan(b->paper) : a->paper == b->paper);
        assert_true(isnan(a->ours) ? isnan(b->ours) : a->ours == b->ours);
    }
    assert_null(fv_sheet_find(&again, "scene/0", "quantit"));
    assert_true(isnan(fv_sheet_ours(&again, "scene", "quantity")));
}

static void damaged_parts_are_refused(void **state)
{
#define HEAD "foveola table part 1\nkey\nabout\n"
#define COLUMNS "row,quantity,unit,paper,ours\n"
    static const char *const bad[] = {
        "", "foveola table part 2\nkey\nabout\n" COLUMNS, HEAD, HEAD "row,quantity\n", "foveola table part 1\nkey\n",
        HEAD COLUMNS "a,b,c,1\n", HEAD COLUMNS "a,b,c,1,2", HEAD COLUMNS "a,b,c,x,2\n", HEAD COLUMNS "a,b,c,1,2x\n",
        HEAD COLUMNS "a,b,c,inf,2\n", HEAD COLUMNS "a,b,c,1,2,3\n", HEAD COLUMNS "a\nb,c,1,2\n",
        HEAD COLUMNS "a,b,a unit that is too long,1,2\n"};
    struct fv_part_heading heading;
    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        program_write("bad.part", bad[i], strlen(bad[i]));
        again.cells = 0;
        if (fv_part_read(&heading, &again, path_of("bad.part"), &error) == 0) fail_msg("taken: '%s'", bad[i]);
        assert_non_null(strstr(error.text, "bad.part: "));
    }
    program_write("bad.part", HEAD COLUMNS "a,b,c,1,2\0", sizeof HEAD COLUMNS "a,b,c,1,2");
    assert_int_equal(fv_part_read(&heading, &again, path_of("bad.part"), &error), -1);
}

/* Counted frames rise; as many as the way has are the way; fewer reach from its beginning to near its end in
 * pieces. */
static void flights_cover_the_way(void **state)
{
    static const int frames[] = {1, 2, 49, 50, 51, 99, 100, 333, 999, 1000, 1001, 5000};
    static struct fv_flight f;
    (void)state;
    for (size_t i = 0; i < sizeof frames / sizeof frames[0]; i++) {
        f = (struct fv_flight){.frames = frames[i], .path_frames = 1000};
        int last = fv_flight_at(&f, frames[i] - 1);
        assert_int_equal(fv_flight_at(&f, 0), 0);
        for (int n = 1; n < frames[i]; n++) assert_true(fv_flight_at(&f, n) > fv_flight_at(&f, n - 1));
        assert_true(last < (frames[i] > 1000 ? frames[i] : 1000));
        if (frames[i] >= 1000) assert_int_equal(last, frames[i] - 1);
        if (frames[i] > 50 && frames[i] < 1000) assert_true(last >= 500);
    }
}

static void a_table_has_every_row(void **state)
{
    static const char *const rows[] = {"atrium/point", "atrium/area", "atrium/ao",
                                       "cornell/point", "cornell/area", "cornell/ao"};
    static const char *const quantities[] = {"rays_full,rays", "rays,rays", "frame_ms_full,ms", "frame_ms,ms",
                                             "speedup,", "sampled_fraction,", "stage_reproject_ms,ms"};
    char cell[96];
    (void)state;
    struct program_result r = program("measure --table weier2016 " SMALL "--out whole");
    if (r.code != 0) fail_msg("%s", r.errors);
    assert_non_null(strstr(r.errors, "rows of sponza are left out"));
    assert_non_null(strstr(r.errors, "rows of sibenik are left out"));
    assert_non_null(strstr(r.errors, "6 of 12 parts"));
    const char *csv = text_of("whole/table-weier2016.csv");
    assert_int_equal(strncmp(csv, "row,quantity,unit,paper,ours\n", 29), 0);
    assert_null(strstr(csv, "sponza"));
    for (int i = 0; i < 6; i++)
        for (int k = 0; k < 7; k++) {
            snprintf(cell, sizeof cell, "\n%s,%s,", rows[i], quantities[k]);
            assert_true(ours(csv, cell) > 0);
        }
    /* One, two or nine rays a pixel, as far as surfaces face the light; more of them with more light. */
    double pixels = 48 * 40, occluded = ours(csv, "\ncornell/ao,rays_full,rays,"),
           point = ours(csv, "\ncornell/point,rays_full,rays,"), area = ours(csv, "\ncornell/area,rays_full,rays,");
    assert_true(point > pixels && point < 3 * pixels);
    assert_true(area > 3 * point);
    assert_true(occluded >= pixels);
    assert_true(ours(csv, "\ncornell/point,rays,rays,") < point);
    assert_non_null(strstr(text_of("whole/report.html"), "<html"));
}

static double row_of(const char *csv, const char *scene, const char *row, const char *quantity)
{
    char cell[128];
    snprintf(cell, sizeof cell, "\n%s/%s,%s,", scene, row, quantity);
    const char *at = strstr(csv, cell);
    if (!at) fail_msg("no cell %s", cell);
    for (int comma = 0; comma < 2; comma++) at = strchr(at + (comma ? 1 : (int)strlen(cell)), ',');
    return at[1] == '\n' ? NAN : strtod(at + 1, NULL);
}

/* Every kind, number of samples, radius and refresh rate, once each, with the paper's number where it prints one. */
static void fields_have_their_table(void **state)
{
    static const char *const scenes[] = {"primitives", "columns", "temple"};
    static const char *const areas[] = {"_fovea", "_mid", "_far", ""};
    char row[96], name[32];
    int rows = 0;
    (void)state;
    struct program_result r = program("measure --table polychronakis2023 --set display.width=48 --set display.height=40 "
                                      "--frames 1 --out fields");
    if (r.code != 0) fail_msg("%s", r.errors);
    assert_non_null(strstr(r.errors, "15 of 15 parts"));
    const char *csv = text_of("fields/table-polychronakis2023.csv");
    for (const char *at = csv; (at = strstr(at, ",speedup,")); at++) rows++;
    assert_int_equal(rows, 3 * (1 + 18 + 2 + 5 + 4 * 37 + 2 * 7));
    for (int s = 0; s < 3; s++) {
        for (int ssaa = 1; ssaa <= 16; ssaa *= 4) {
            snprintf(row, sizeof row, "ipr/ssaa%d/fovea180/refresh1", ssaa);
            double ssim = row_of(csv, scenes[s], row, "ssim"), off = row_of(csv, scenes[s], row, "off_pixels");
            assert_true(ssim > 0.99 && ssim <= 1 && off >= 0 && off < 1e4);
            snprintf(row, sizeof row, "fipr/ssaa%d/fovea7.5/refresh4", ssaa);
            assert_true(row_of(csv, scenes[s], row, "steps_ratio") > 1.5);
            assert_true(row_of(csv, scenes[s], row, "speedup") > 0);
            for (int a = 0; a < 4; a++) {
                snprintf(name, sizeof name, "flip%s", areas[a]);
                double flip = row_of(csv, scenes[s], row, name);
                assert_true(flip >= 0 && flip < 0.5);
            }
            assert_true(row_of(csv, scenes[s], row, "ssim_fovea") > row_of(csv, scenes[s], row, "ssim"));
            assert_true(row_of(csv, scenes[s], row, "flip_fovea") < row_of(csv, scenes[s], row, "flip_far"));
        }
        /* Where the head turns, all refreshed is as where it rests, and what waits for its turn is not (which of the two
           is better depends on rounding, at this size). What is refined takes steps. */
        assert_true(row_of(csv, scenes[s], "fipr-turning/ssaa1/fovea7.5/refresh1", "ssim") ==
                    row_of(csv, scenes[s], "fipr/ssaa1/fovea7.5/refresh1", "ssim"));
        assert_true(row_of(csv, scenes[s], "fipr-turning/ssaa1/fovea7.5/refresh4", "ssim") !=
                    row_of(csv, scenes[s], "fipr/ssaa1/fovea7.5/refresh4", "ssim"));
        assert_true(row_of(csv, scenes[s], "fipr-turning-stays/ssaa1/fovea7.5/refresh4", "steps_ratio") > 1);
        assert_true(row_of(csv, scenes[s], "ipr-minimum/ssaa1/fovea180/refresh1", "off_pixels") >=
                    row_of(csv, scenes[s], "ipr/ssaa1/fovea180/refresh1", "off_pixels"));
        assert_true(row_of(csv, scenes[s], "fipr-paper/ssaa1/fovea7.5/refresh1", "steps_ratio") <
                    row_of(csv, scenes[s], "fipr-paper/ssaa1/fovea7.5/refresh4", "steps_ratio"));
        assert_true(row_of(csv, scenes[s], "fipr/ssaa1/fovea7.5/refresh1", "steps_ratio") <=
                    row_of(csv, scenes[s], "fipr-unrefined/ssaa1/fovea7.5/refresh1", "steps_ratio"));
    }
    assert_non_null(strstr(csv, "\ntemple/fipr/ssaa16/fovea7.5/refresh4,speedup,,8.83,"));
    assert_non_null(strstr(csv, "\ntemple/fipr-paper/ssaa16/fovea7.5/refresh4,speedup,,8.83,"));
    assert_non_null(strstr(csv, "\nprimitives/ipr/ssaa1/fovea180/refresh1,flip,,0.05056,"));
    const char *page = text_of("fields/report.html");
    assert_non_null(strstr(page, "Figure 12"));
    assert_non_null(strstr(page, "Under motion"));
    assert_non_null(strstr(page, "By eccentricity"));
    assert_non_null(strstr(page, "Where rays start"));
}

/* A scene's rows, and the figures of samples: counted ones are as many as were traced. Parts can be had one by one. */
static void selective_has_its_table(void **state)
{
    static const char *const ways[] = {"36spp", "1spp", "selective", "every", "sparse"};
    static const char *const samples[] = {"tolerance/low", "tolerance/high", "view1/foveated", "view1/selective",
                                          "view2/foveated", "view2/selective"};
    char cell[96];
    (void)state;
    for (int part = 0; part < 2; part++) {
        struct program_result r = program("measure --table kim2021 --part %s --frames 1 --set display.width=48 --set "
                                          "display.height=40 --set scene.library= --set scene.detail=0.01 --out selective",
                                          part ? "figure" : "table2");
        if (r.code != 0) fail_msg("%s", r.errors);
        assert_non_null(strstr(r.errors, "rows of sponza are left out"));
        assert_non_null(strstr(r.errors, part ? "4 of 8 parts" : "2 of 8 parts"));
    }
    const char *csv = text_of("selective/table-kim2021.csv");
    for (int w = 0; w < 5; w++) {
        snprintf(cell, sizeof cell, "\natrium/%s,frame_ms,ms,", ways[w]);
        assert_true(ours(csv, cell) > 0);
        snprintf(cell, sizeof cell, "\natrium/%s,psnr_near,dB,", ways[w]);
        assert_true(ours(csv, cell) > 10 && ours(csv, cell) < 99);
    }
    assert_true(ours(csv, "\natrium/every,speedup_vs_36spp,,") > 1);
    assert_true(ours(csv, "\natrium/sparse,speedup_vs_selective,,") > 0);
    assert_true(ours(csv, "\natrium/36spp,rays,rays,") > 20 * ours(csv, "\natrium/1spp,rays,rays,"));
    assert_true(ours(csv, "\natrium/sparse,rays,rays,") < ours(csv, "\natrium/every,rays,rays,"));
    assert_true(ours(csv, "\natrium/36spp,psnr_near,dB,") > ours(csv, "\natrium/1spp,psnr_near,dB,"));
    for (int i = 0; i < 6; i++) {
        snprintf(cell, sizeof cell, "\natrium/%s,primary_rays,rays,", samples[i]);
        double rays = ours(csv, cell);
        snprintf(cell, sizeof cell, "\natrium/%s,extra_samples,samples,", samples[i]);
        assert_true(ours(csv, cell) > 0);
        assert_true(rays == 48 * 40 + ours(csv, cell));
    }
    assert_true(ours(csv, "\natrium/tolerance/low,extra_samples,samples,") >
                ours(csv, "\natrium/tolerance/high,extra_samples,samples,"));
    assert_true(ours(csv, "\natrium/tolerance/low,tau_fov_at_0,,") == 1);
    assert_true(ours(csv, "\natrium/tolerance/high,tau_fov_at_30,,") == 20);
    const char *page = text_of("selective/report.html");
    assert_non_null(strstr(page, "Table 2"));
    assert_non_null(strstr(page, "Figure 8"));
    assert_non_null(strstr(page, "data:image/png;base64,"));
}

/* Tiny pictures: rows and quantities, the paper's numbers, and that fewer paths are fewer rays. */
static void denoise_has_its_table(void **state)
{
    static const char *const ways[] = {"base", "nh2ld", "nh3ld", "nh3ld-p0.5", "unfiltered", "nh3ld-history"};
    char cell[96];
    (void)state;
    struct program_result r = program("measure --table peres2023 --part fhd-atrium --frames 1 --set display.width=64 --set display.height=48 "
                                      "--set denoise.inner_px=8 --set denoise.outer_px=16 --set method.spp=8 --set scene.library= --out denoise");
    if (r.code != 0) fail_msg("%s", r.errors);
    assert_non_null(strstr(r.errors, "1 of 6 parts"));
    const char *csv = text_of("denoise/table-peres2023.csv");
    for (int w = 0; w < 5; w++) {
        snprintf(cell, sizeof cell, "\nfhd/atrium/%s,frame_ms,ms,", ways[w]);
        assert_true(ours(csv, cell) > 0);
        snprintf(cell, sizeof cell, "\nfhd/atrium/%s,rmse_percent,%%,", ways[w]);
        assert_true(ours(csv, cell) > 0 && ours(csv, cell) < 50);
        snprintf(cell, sizeof cell, "\nfhd/atrium/%s,psnr,dB,", ways[w]);
        assert_true(ours(csv, cell) > 5 && ours(csv, cell) < 99);
    }
    assert_true(ours(csv, "\nfhd/atrium/base,speedup,,") == 1);
    assert_non_null(strstr(text_of("denoise/report.html"), "Tables 3 and 4"));
}

static void what_is_there_is_not_measured_again(void **state)
{
    static char before[65536];
    (void)state;
    snprintf(before, sizeof before, "%s", text_of("whole/table-weier2016.csv"));
    assert_int_equal(unlink(path_of("whole/table-weier2016/cornell-point.part")), 0);
    struct program_result r = program("measure --table weier2016 " SMALL "--out whole");
    assert_int_equal(r.code, 0);
    assert_non_null(strstr(r.errors, "atrium-ao is there already"));
    assert_null(strstr(r.errors, "cornell-point is there already"));
    const char *after = text_of("whole/table-weier2016.csv");
    size_t same = (size_t)(strstr(before, "\ncornell/point") - before);
    assert_memory_equal(before, after, same);
    assert_non_null(strstr(after, "\ncornell/point,"));
    /* Other settings, or a damaged part: nothing is run, nothing written. */
    r = program("measure --table weier2016 " SMALL "--set scene.exposure=2 --out whole");
    assert_int_equal(r.code, 2);
    assert_non_null(strstr(r.errors, "other settings; remove it or give another --out"));
    program_write("whole/table-weier2016/cornell-area.part", "nothing", 7);
    r = program("measure --table weier2016 " SMALL "--out whole");
    assert_int_equal(r.code, 2);
    assert_non_null(strstr(r.errors, "cornell-area.part: not a whole part"));
}

static void bad_requests_are_refused(void **state)
{
    static const struct {
        const char *arguments, *message;
    } bad[] = {{"--table", "a value must follow"},
               {"--table nix", "--table nix: not known; there are: weier2016"},
               {"--table weier2016 --shard 1/2", "no --shard"},
               {"--table weier2016 --seconds 9", "no --seconds; --frames"},
               {"--table weier2016 --method full", "no --method"},
               {"--table weier2016 --level 1", "no --level"},
               {"--table weier2016 --merge whole", "no --merge"},
               {"--table weier2016 --frames 0", "--frames 0"},
               {"--table weier2016 --frames 1000000", "--frames 1000000: at most"},
               {"--table weier2016 whole", "not expected here"},
               {"--table weier2016 --part nix", "no part's name begins so; there are: sponza-point"},
               {"--part sponza", "goes with --table"},
               {"--table weier2016 --set fovea.p_min=2", "out of range"},
               {"--table weier2016 --out a.part", "Not a directory"},
               {"--frames 3", "--frames 3: goes with --table"}};
    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct program_result r = program("measure %s", bad[i].arguments);
        if (r.code != 2) fail_msg("%s: exit %d: %s", bad[i].arguments, r.code, r.errors);
        if (!strstr(r.errors, bad[i].message)) fail_msg("%s: %s", bad[i].arguments, r.errors);
    }
}

/* Told to end while a part is measured: that part is given up, and its process with it. */
static void stops_when_told(void **state)
{
    char command[512], code[32] = "";
    (void)state;
    snprintf(command, sizeof command,
             "cd %s && (timeout -s TERM 3 %s measure --table weier2016 --set scene.library= --set display.width=640 "
             "--set display.height=640 --frames 5000 --out stopped 2>errors; echo $? >code)",
             program_folder(), FV_PROGRAM);
    assert_int_equal(system(command), 0);
    program_slurp(path_of("code"), code, sizeof code);
    assert_int_equal(atoi(code), 124); /* timeout's own for having ended it */
    assert_non_null(strstr(text_of("errors"), "stopped; the same command goes on"));
    assert_non_null(strstr(text_of("stopped/table-weier2016.csv"), "row,quantity"));
    assert_null(strstr(text_of("stopped/table-weier2016.csv"), "cornell"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cells_come_back),       cmocka_unit_test(damaged_parts_are_refused),
        cmocka_unit_test(flights_cover_the_way), cmocka_unit_test(a_table_has_every_row),
        cmocka_unit_test(fields_have_their_table), cmocka_unit_test(selective_has_its_table), cmocka_unit_test(denoise_has_its_table),
        cmocka_unit_test(what_is_there_is_not_measured_again), cmocka_unit_test(bad_requests_are_refused),
        cmocka_unit_test(stops_when_told)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
