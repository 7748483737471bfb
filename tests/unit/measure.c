/* measure: the verb as users run it: rows and columns, going on after an interruption, shares and their
 * joining, and what it refuses. On a small picture of a built-in scene. */
#include "tests/support/program.h"

#include "rt/measure/row.h"
#include "rt/method/method.h"

#include <math.h>
#include <signal.h>

#define SMALL "--set scene.name=cornell --set display.eyes=1 --set display.width=48 --set display.height=40 --seconds 60 "

static const char header[] = "scene,method,level,parameters,frame_ms_p50,frame_ms_p99,full_frame_ms_p50,speedup,rays,"
                             "sampled_fraction,psnr_all,psnr_fovea,psnr_para,psnr_peri,psnr_near,psnr_far,rmse,ssim,"
                             "flip,flicker\n";

static int whole_sweep(void)
{
    int rows = 0;
    for (int n = 0; fv_method_at(n); n++) rows += fv_method_at(n)->by_paths ? 0 : fv_method_at(n)->measured;
    return rows;
}

static void slurp(const char *name, char *out, size_t size)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", program_folder(), name);
    program_slurp(path, out, size);
}

static int lines(const char *text)
{
    int n = 0;
    for (; *text; text++) n += *text == '\n';
    return n;
}

/* Cell `column` of the line that begins so; NaN where it is empty. */
static double cell(const char *csv, const char *line, int column)
{
    const char *at = strstr(csv, line);
    assert_non_null(at);
    for (; column > 0; column--) at = strchr(at, ',') + 1;
    return *at == ',' || *at == '\n' ? NAN : strtod(at, NULL);
}

static void a_whole_sweep_has_every_row(void **state)
{
    char csv[16384];
    (void)state;
    struct program_result r = program("measure " SMALL "--out whole");
    if (r.code != 0) fail_msg("%s", r.errors);
    slurp("whole/measure.csv", csv, sizeof csv);
    assert_int_equal(strncmp(csv, header, sizeof header - 1), 0);
    assert_int_equal(lines(csv), 1 + whole_sweep());
    /* More samples, less error; more speed, fewer rays. */
    double one = cell(csv, "cornell,full,0,", 10), sixteen = cell(csv, "cornell,full,4,", 10);
    assert_true(one > 15 && one < 60 && sixteen > one + 6);
    assert_true(cell(csv, "cornell,full,4,", 8) > 15.9 * cell(csv, "cornell,full,0,", 8));
    assert_true(cell(csv, "cornell,full,4,", 7) < 0.2);
    double self = cell(csv, "cornell,full,0,", 7);
    assert_true(self > 0.5 && self < 2);
    assert_true(cell(csv, "cornell,reproject,0,", 9) < 0.9);
    assert_true(cell(csv, "cornell,reproject,7,", 8) < cell(csv, "cornell,reproject,0,", 8));
    for (int column = 4; column < 20; column++) assert_false(isnan(cell(csv, "cornell,full,1,", column)));
    slurp("whole/report.html", csv, sizeof csv);
    assert_non_null(strstr(csv, "<html"));
}

/* By paths without its filter; a folder holds one or the other. */
static void denoise_has_a_sweep_of_its_own(void **state)
{
    char csv[16384];
    (void)state;
    struct program_result r = program("measure " SMALL "--method denoise --level 1 --out paths");
    if (r.code != 0) fail_msg("%s", r.errors);
    slurp("paths/measure.csv", csv, sizeof csv);
    assert_int_equal(lines(csv), 2);
    double all = cell(csv, "cornell,denoise,1,", 10);
    print_message("denoise: %.1f dB\n", all);
    assert_true(all > 22 && all < 60);
    r = program("measure " SMALL "--method full --level 1 --out paths");
    assert_int_equal(r.code, 2);
    assert_non_null(strstr(r.errors, "reference of another scene"));
}

static void what_is_there_is_not_measured_again(void **state)
{
    static char before[16384], after[16384];
    (void)state;
    slurp("whole/measure.csv", before, sizeof before);
    struct program_result r = program("measure " SMALL "--out whole");
    assert_int_equal(r.code, 0);
    slurp("whole/measure.csv", after, sizeof after);
    assert_string_equal(before, after);
    char path[256];
    snprintf(path, sizeof path, "%s/whole/rows/cornell-full-1.row", program_folder());
    assert_int_equal(remove(path), 0);
    r = program("measure " SMALL "--out whole");
    assert_int_equal(r.code, 0);
    assert_non_null(strstr(r.errors, "full level 1 (spp=2)"));
    assert_non_null(strstr(r.errors, "full level 0 is there already"));
}

static void refused(const char *arguments, const char *message)
{
    struct program_result r = program("measure " SMALL "%s", arguments);
    if (r.code != 2 || !strstr(r.errors, message)) fail_msg("%s: code %d, %s", arguments, r.code, r.errors);
    assert_string_equal(r.output, "");
}

static void bad_input_is_refused(void **state)
{
    (void)state;
    refused("--out whole --set scene.name=atrium", "another scene");
    refused("--out whole --set fovea.p_min=0.5", "other settings");
    refused("--method nothing --out other", "there are: full reproject");
    refused("--method full --level 9 --out other", "levels 0 to 4");
    refused("--level x --out other", "--level x");
    refused("--seconds 0 --out other", "--seconds 0");
    refused("--seconds nan --out other", "--seconds nan");
    refused("--shard 0/2 --out other", "I/N");
    refused("--shard 3/2 --out other", "I/N");
    refused("--shard 1 --out other", "I/N");
    refused("folder --out other", "--merge");
    refused("--merge nowhere --out other", "holds no rows");
    char path[256];
    snprintf(path, sizeof path, "%s/other", program_folder());
    assert_int_equal(access(path, F_OK), -1);
}

static void a_damaged_row_is_named(void **state)
{
    static char row[16384];
    (void)state;
    slurp("whole/rows/cornell-full-2.row", row, sizeof row);
    program_write("whole/rows/cornell-full-2.row", row, strlen(row) / 2);
    refused("--out whole", "cornell-full-2.row: not a whole row");
    program_write("whole/rows/cornell-full-2.row", row, strlen(row));
    slurp("whole/reference/about.txt", row, sizeof row);
    program_write("whole/reference/about.txt", "something else", 14);
    refused("--out whole", "not a reference");
    program_write("whole/reference/about.txt", row, strlen(row));
}

/* The first share is stopped after its first row, and goes on. */
static void an_interrupted_sweep_goes_on(void **state)
{
    static char command[4096], text[16384];
    (void)state;
    snprintf(command, sizeof command,
             "cd %s && (%s measure " SMALL "--shard 1/2 --seconds 300 --out part1 2>stderr.txt & p=$!; "
             "while kill -0 $p 2>/dev/null && ! ls part1/rows/*.row >/dev/null 2>&1; do sleep 0.02; done; kill -INT $p; wait $p)",
             program_folder(), FV_PROGRAM);
    int status = system(command);
    slurp("stderr.txt", text, sizeof text);
    if (WEXITSTATUS(status) != 1) fail_msg("%s", text);
    assert_non_null(strstr(text, "the same command goes on"));
    slurp("part1/measure.csv", text, sizeof text);
    assert_true(lines(text) >= 2 && lines(text) < 1 + (whole_sweep() + 1) / 2);
    struct program_result r = program("measure " SMALL "--shard 1/2 --out part1");
    assert_int_equal(r.code, 0);
    assert_non_null(strstr(r.errors, "is there already"));
    slurp("part1/measure.csv", text, sizeof text);
    assert_int_equal(lines(text), 1 + (whole_sweep() + 1) / 2);
}

static void shares_are_joined(void **state)
{
    static char part[16384], joined[16384];
    (void)state;
    assert_int_equal(program("measure " SMALL "--shard 2/2 --out part2").code, 0);
    struct program_result r = program("measure --merge part1 part2 --out joined");
    if (r.code != 0) fail_msg("%s", r.errors);
    slurp("joined/measure.csv", joined, sizeof joined);
    assert_int_equal(lines(joined), 1 + whole_sweep());
    slurp("joined/numerics.csv", part, sizeof part);
    assert_true(lines(part) > 10);
    for (int i = 1; i <= 2; i++) {
        char name[32];
        snprintf(name, sizeof name, "part%d/measure.csv", i);
        slurp(name, part, sizeof part);
        for (char *line = strtok(part, "\n"); line; line = strtok(NULL, "\n")) assert_non_null(strstr(joined, line));
    }
    assert_int_equal(program("measure --merge=part1 --merge=part2 --out joined2").code, 0);
    slurp("joined2/measure.csv", part, sizeof part);
    assert_string_equal(joined, part);
    /* Of more shares than there are rows, some are empty. */
    assert_int_equal(program("measure " SMALL "--shard 99/100 --out part99").code, 0);
    assert_int_equal(program("measure --merge part99 part1 --out joined4").code, 0);
    assert_int_equal(program("measure --merge part99 --out joined5").code, 2);
    /* Of other settings: nothing is joined. */
    assert_int_equal(program("measure " SMALL "--set fovea.p_min=0.5 --method reproject --level 0 --out different").code, 0);
    /* Too little time: the dearest levels are left out, the others measured with fewer frames. */
    r = program("measure " SMALL "--seconds 0.01 --out hasty");
    assert_int_equal(r.code, 0);
    /* How many depends on the machine's mood. */
    const char *said = strstr(r.errors, " rows would take too long");
    assert_non_null(said);
    while (said > r.errors && said[-1] >= '0' && said[-1] <= '9') said--;
    assert_true(atoi(said) >= 3);
    slurp("hasty/measure.csv", part, sizeof part);
    assert_int_equal(lines(part), 1 + whole_sweep() - atoi(said));
    r = program("measure --merge part1 different --out joined3");
    assert_int_equal(r.code, 2);
    assert_non_null(strstr(r.errors, "different versions or settings"));
    /* One scene beside another. */
    assert_int_equal(program("measure " SMALL "--set scene.name=atrium --method full --level 0 --out hall").code, 0);
    assert_int_equal(program("measure --merge part1 hall --out both").code, 0);
    slurp("both/measure.csv", joined, sizeof joined);
    assert_non_null(strstr(joined, "\natrium,full,0,"));
}

static void rows_are_kept_as_they_are(void **state)
{
    (void)state;
    char path[256];
    struct fv_error error;
    struct fv_measure_row row = {.scene = "a", .method = "full", .level = 3, .parameters = "spp=8", .about = "x, y; z",
                                 .key = "k", .frames = 7}, back;
    row.psnr[FV_ZONE_FAR] = (struct fv_measured){INFINITY, NAN, -INFINITY};
    row.speedup = (struct fv_measured){1.0 / 3, 1e-300, 1e300};
    snprintf(path, sizeof path, "%s/one.row", program_folder());
    assert_int_equal(fv_row_write(&row, path, &error), 0);
    assert_int_equal(fv_row_read(&back, path, &error), 0);
    assert_string_equal(back.about, row.about);
    assert_true(isinf(back.psnr[FV_ZONE_FAR].value) && isnan(back.psnr[FV_ZONE_FAR].low));
    assert_float_equal(back.speedup.value, 1.0 / 3, 1e-9);
    assert_int_equal(back.frames, 7);
}

static void the_pareto_front_is_what_nothing_beats(void **state)
{
    (void)state;
    static const struct {
        double speedup, psnr;
        bool front;
    } cases[] = {{1, 30, false}, {1, 31, true}, {2, 29, true}, {0.5, 30.5, false}, {0.5, INFINITY, true},
                 {3, NAN, false}, {0.4, INFINITY, false}, {2, 29, true}};
    enum { CASES = sizeof cases / sizeof cases[0] };
    struct fv_measure_row row[CASES];
    memset(row, 0, sizeof row);
    for (int i = 0; i < CASES; i++) {
        snprintf(row[i].method, sizeof row[i].method, "%s", i % 2 ? "reproject" : "full");
        row[i].speedup.value = cases[i].speedup;
        row[i].psnr[FV_ZONE_FOVEA].value = cases[i].psnr;
    }
    for (int i = 0; i < CASES; i++)
        if (fv_row_is_pareto(row, CASES, i, FV_ZONE_FOVEA) != cases[i].front) fail_msg("case %d", i);
    assert_int_equal(fv_rows_reach(row, CASES, "full", FV_ZONE_FOVEA, 29), 2);
    assert_int_equal(fv_rows_reach(row, CASES, "full", FV_ZONE_FOVEA, 30), 0);
    assert_int_equal(fv_rows_reach(row, CASES, "full", FV_ZONE_FOVEA, 35), 4);
    assert_int_equal(fv_rows_reach(row, CASES, "reproject", FV_ZONE_FOVEA, 35), -1);
    assert_int_equal(fv_rows_reach(row, CASES, "none", FV_ZONE_FOVEA, 0), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_whole_sweep_has_every_row),
        cmocka_unit_test(denoise_has_a_sweep_of_its_own), cmocka_unit_test(what_is_there_is_not_measured_again),
        cmocka_unit_test(bad_input_is_refused),
        cmocka_unit_test(a_damaged_row_is_named),
        cmocka_unit_test(an_interrupted_sweep_goes_on),
        cmocka_unit_test(shares_are_joined),
        cmocka_unit_test(rows_are_kept_as_they_are),
        cmocka_unit_test(the_pareto_front_is_what_nothing_beats),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
