/* reproject: at the medium foveal region, head and gaze moving, the pictures of reproject against those of full at one
 * sample a pixel, both by the reference of `measure`: the fovea must not be worse, nor the whole flicker more than
 * 1.2 times as much. Takes minutes. */
#include "tests/support/program.h"

#include "platform/files.h"

#include <math.h>

#define LIBRARY FV_SOURCE_DIR "/../shared/data/scenes"
static const double less_db = 0.1, more_flicker = 1.2;

/* The columns of measure.csv: see README. */
enum { PSNR_ALL = 10, PSNR_FOVEA = 11, PSNR_PARA = 12, FLICKER = 19 };

static double cell(const char *csv, const char *line, int column)
{
    const char *at = strstr(csv, line);
    if (!at) fail_msg("no row %s", line);
    for (; column > 0; column--) at = strchr(at, ',') + 1;
    return strtod(at, NULL);
}

static void measure(const char *scene, const char *method)
{
    struct program_result r =
        program("measure --set scene.name=%s --set scene.library=" LIBRARY " --set display.eyes=1 --set "
                "display.width=591 --set display.height=732 --method %s --level 0 --seconds 240 --out %s",
                scene, method, scene);
    if (r.code) fail_msg("%s", r.errors);
}

static void judge(const char *scene)
{
    static char csv[8192];
    char path[256], line[2][64];
    measure(scene, "full");
    measure(scene, "reproject");
    snprintf(path, sizeof path, "%s/%s/measure.csv", program_folder(), scene);
    program_slurp(path, csv, sizeof csv);
    snprintf(line[0], sizeof line[0], "%s,full,0,", scene);
    snprintf(line[1], sizeof line[1], "%s,reproject,0,", scene);
    double value[2][4];
    static const int columns[] = {PSNR_FOVEA, PSNR_PARA, PSNR_ALL, FLICKER};
    for (int m = 0; m < 2; m++)
        for (int i = 0; i < 4; i++) value[m][i] = cell(csv, line[m], columns[i]);
    print_message("%s: PSNR dB to 3.3 degrees %.2f (full %.2f), to 5.5 %.2f (%.2f), whole %.2f (%.2f); flicker %.5f "
                  "(%.5f)\n",
                  scene, value[1][0], value[0][0], value[1][1], value[0][1], value[1][2], value[0][2], value[1][3],
                  value[0][3]);
    assert_true(value[1][0] >= value[0][0] - less_db);
    assert_true(value[1][1] >= value[0][1] - less_db);
    assert_true(value[1][3] <= more_flicker * value[0][3]);
}

static void cornell(void **state)
{
    (void)state;
    judge("cornell");
}

static void atrium(void **state)
{
    (void)state;
    judge("atrium");
}

static void sponza(void **state)
{
    (void)state;
    if (!fv_file_exists(LIBRARY "/sponza")) {
        print_message("Sponza is not in " LIBRARY ": skipped\n");
        skip();
    }
    judge("sponza");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(cornell), cmocka_unit_test(sponza), cmocka_unit_test(atrium)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
