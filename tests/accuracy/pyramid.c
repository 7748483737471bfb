/* pyramid: foveated pictures of the three scenes of fields against full marching of the same settings, at the size, the
 * fovea and the sample a pixel that Polychronakis et al. 2023 give: SSIM and FLIP of the whole picture. Prints what the paper's own way (method.contrast=1) comes to beside it. Takes half a minute. */
#include "tests/support/program.h"

/* FLIP: the least of the paper's three, for all. */
static const struct {
    const char *scene;
    double ssim, flip;
} asked[] = {{"primitives", 0.98, 0.030}, {"columns", 0.985, 0.030}, {"temple", 0.99, 0.030}};

static void render(const char *scene, const char *method, const char *out)
{
    struct program_result r =
        program("run --config " FV_SOURCE_DIR "/config/headsets/vive-pro-eye.ini --frames 1 --set scene.name=%s --set "
                "method.name=%s --set display.eyes=1 --set display.sink=png --set eye.source=none --set imu.source=none "
                "--set output.tape=off --out %s",
                scene, method, out);
    if (r.code) fail_msg("%s", r.errors);
}

static double value_of(const char *lines, const char *name)
{
    const char *at = strstr(lines, name);
    if (!at) fail_msg("no %s in %s", name, lines);
    return strtod(at + strlen(name), NULL);
}

static void compare(const char *test, double *ssim, double *flip)
{
    struct program_result r = program("compare full/left-00000.png %s/left-00000.png", test);
    if (r.code) fail_msg("%s", r.errors);
    *ssim = value_of(r.output, "\nssim ");
    *flip = value_of(r.output, "\nflip ");
}

static void judge(int n)
{
    double ssim[2], flip[2];
    render(asked[n].scene, "full", "full");
    render(asked[n].scene, "pyramid", "pyramid");
    render(asked[n].scene, "pyramid --set method.contrast=1", "unrefined");
    compare("pyramid", &ssim[0], &flip[0]);
    compare("unrefined", &ssim[1], &flip[1]);
    print_message("%s: SSIM %.4f, FLIP %.4f (unrefined %.4f, %.4f)\n", asked[n].scene, ssim[0], flip[0], ssim[1], flip[1]);
    assert_true(ssim[0] >= asked[n].ssim);
    assert_true(flip[0] <= asked[n].flip);
}

static void primitives(void **state)
{
    (void)state;
    judge(0);
}

static void columns(void **state)
{
    (void)state;
    judge(1);
}

static void temple(void **state)
{
    (void)state;
    judge(2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(primitives), cmocka_unit_test(columns), cmocka_unit_test(temple)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
