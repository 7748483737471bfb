/* peres2023: Tables 3 and 4 of Peres et al. 2023 as `measure --table peres2023` measures them, on Sponza and the atrium: how many times
 * as fast as one layer, and how much worse. Speed-ups are of CPU time of all workers, which a busy machine disturbs less than
 * wall time. Each part has a process of its own.
 *
 * bench_peres2023 [PLACES [PATHS]]: places along the way, and paths a pixel of what errors are against (1024 in the paper). */
#include "rt/measure/table.h"
#include "tests/support/program.h"

static int places = 1, paths = 256;
static struct fv_sheet sheet;

/* What is to be reached: the least speed-up, and the most RMSE over base's, in points of %. */
static const struct {
    const char *row;
    double speedup, rmse;
} musts[] = {{"nh3ld", 1.5, 0.38}, {"nh3ld-p0.5", 2.1, 0.38}};

/* The part into the sheet; false where its scene is not at hand. */
static bool measure(const char *part)
{
    struct fv_part_heading heading;
    struct fv_error error;
    char path[256];
    struct program_result r = program("measure --table peres2023 --part %s --frames %d --set method.spp=%d --set scene.library=%s --out out", part,
                                      places, paths, FV_SOURCE_DIR "/../shared/data/scenes");
    if (strstr(r.errors, "foveola: rows of ")) return false;
    if (r.code != 0) fail_msg("%s", r.errors);
    snprintf(path, sizeof path, "%s/out/table-peres2023/%s.part", program_folder(), part);
    if (fv_part_read(&heading, &sheet, path, &error)) fail_msg("%s", error.text);
    print_message("%s: %s\n", part, heading.about);
    return true;
}

static double value(const char *part, const char *way, const char *quantity)
{
    char row[64], *dash;
    snprintf(row, sizeof row, "%s/%s", part, way);
    dash = strchr(row, '-');
    if (dash) *dash = '/';
    return fv_sheet_ours(&sheet, row, quantity);
}

static void print_part(const char *part)
{
    static const char *const ways[] = {"base", "nh2ld", "nh3ld", "nh3ld-p0.5", "unfiltered"};
    print_message("| %s | ms | CPU ms | speed-up | by CPU | RMSE %% | fovea %% | SSIM | PSNR |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n", part);
    for (size_t w = 0; w < sizeof ways / sizeof ways[0]; w++)
        print_message("| %s | %.0f | %.0f | %.2f | %.2f | %.2f | %.2f | %.4f | %.2f |\n", ways[w], value(part, ways[w], "frame_ms"),
                      value(part, ways[w], "cpu_ms"), value(part, ways[w], "speedup"), value(part, ways[w], "cpu_speedup"),
                      value(part, ways[w], "rmse_percent"), value(part, ways[w], "rmse_fovea_percent"), value(part, ways[w], "ssim"), value(part, ways[w], "psnr"));
}

/* What is asked for once; the number of what was missed. */
static int check(const char *what, double is, const char *limit, bool holds)
{
    print_message("%s: %.3f, to be %s%s\n", what, is, limit, holds ? "" : ": MISSED");
    return !holds;
}

/* Foveal errors: three layers' against one's, and against paths without a filter that take longer. */
static int check_fovea(const char *part)
{
    double of = value(part, "nh3ld", "rmse_fovea_percent"), more = of - value(part, "base", "rmse_fovea_percent");
    double share = of / value(part, "unfiltered", "rmse_fovea_percent"), time = value(part, "unfiltered", "cpu_ms") / value(part, "nh3ld", "cpu_ms");
    int missed = check("foveal RMSE over base's, points", more, "0 at most, to a hundredth", more < 0.01);
    missed += check("unfiltered paths' time over nh3ld's", time, "1 at least", time >= 1);
    return missed + check("foveal RMSE over theirs", share, "0.5 at most", share <= 0.5);
}

static void tables_hold(void **state)
{
    static const char *const parts[] = {"fhd-sponza", "fhd-atrium"};
    int missed = 0;
    (void)state;
    for (size_t p = 0; p < sizeof parts / sizeof parts[0]; p++) {
        if (!measure(parts[p])) continue;
        print_part(parts[p]);
        for (size_t i = 0; i < sizeof musts / sizeof musts[0]; i++) {
            double speedup = value(parts[p], musts[i].row, "cpu_speedup");
            double worse = value(parts[p], musts[i].row, "rmse_percent") - value(parts[p], "base", "rmse_percent");
            bool holds = speedup >= musts[i].speedup && worse <= musts[i].rmse;
            print_message("%s/%s: %.2f times as fast, to be %.2f; RMSE %+.2f points, at most %+.2f%s\n", parts[p], musts[i].row, speedup,
                          musts[i].speedup, worse, musts[i].rmse, holds ? "" : ": MISSED");
            missed += !holds;
        }
        missed += check_fovea(parts[p]);
    }
    assert_int_equal(missed, 0);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(tables_hold)};
    if (argc > 1) places = atoi(argv[1]);
    if (argc > 2) paths = atoi(argv[2]);
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
