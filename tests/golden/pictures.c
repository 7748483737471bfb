/* pictures: the built-in scenes as they were when last looked at, on every instruction set; the same
 * bytes with one and two threads, and again from the tape.
 *
 * FOVEOLA_GOLDEN=write rewrites the pictures: look at them before committing them. */
#include "tests/support/picture.h"

static const struct {
    const char *name, *settings;
} cases[] = {
    {"cornell-full", "--set scene.name=cornell --set method.name=full --set method.spp=4"},
    {"cornell-reproject", "--set scene.name=cornell --set method.name=reproject"},
    {"atrium-full", "--set scene.name=atrium --set method.name=full"},
    {"atrium-reproject", "--set scene.name=atrium --set method.name=reproject --set fovea.inner_deg=8 --set fovea.outer_deg=16"},
    {"primitives-full", "--set scene.name=primitives --set method.name=full"},
    {"columns-full", "--set scene.name=columns --set method.name=full"},
    {"columns-reproject", "--set scene.name=columns --set method.name=reproject"},
    {"temple-full", "--set scene.name=temple --set method.name=full"},
    {"cornell-selective", "--set scene.name=cornell --set method.name=selective --set selective.periphery=every --set selective.smooth=0"},
    {"cornell-denoise", "--set scene.name=cornell --set method.name=denoise --set denoise.p=0.5 --set denoise.history=0"},
    {"atrium-selective", "--set scene.name=atrium --set method.name=selective --set selective.smooth=0"},
    {"cornell-history", "--set scene.name=cornell --set method.name=denoise"},
};
/* Races are the same on each; the thread sanitizer takes its time. */
#ifdef __SANITIZE_THREAD__
static const char *const isas[] = {"auto"};
#else
static const char *const isas[] = {"base", "avx2", "avx512"};
#endif

static void render(const char *settings, const char *isa, const char *out, int threads)
{
    struct program_result r = program("run %s --set threads.isa=%s --set threads.workers=%d --set display.headset=small --frames 8 --out %s",
                                      settings, isa, threads, out);
    if (r.code) fail_msg("%s: exit %d: %s", settings, r.code, r.errors);
}

static void compare_with_golden(void **state)
{
    (void)state;
    char ours[256], golden[512], command[1024];
    bool rewrite = getenv("FOVEOLA_GOLDEN") && strcmp(getenv("FOVEOLA_GOLDEN"), "write") == 0;
    for (unsigned c = 0; c < sizeof cases / sizeof cases[0]; c++)
        for (unsigned i = 0; i < sizeof isas / sizeof isas[0]; i++) {
            render(cases[c].settings, isas[i], "golden", 2);
            snprintf(ours, sizeof ours, "%s/golden/left-00007.png", program_folder());
            snprintf(golden, sizeof golden, "%s/tests/golden/%s.png", FV_SOURCE_DIR, cases[c].name);
            if (rewrite && i == 0) {
                snprintf(command, sizeof command, "cp %s %s", ours, golden);
                assert_int_equal(system(command), 0);
            }
            struct picture a = picture_read(ours), b = picture_read(golden);
            double psnr = picture_psnr(picture_mse(&a, &b)), mean = picture_difference(&a, &b);
            print_message("%s (%s): %.1f dB, mean difference %.2f of 255\n", cases[c].name, isas[i], psnr, mean);
            /* Compilers and instruction sets round differently: a hit that moves over the edge of a leaf
             * changes a pixel for good, but there are few of them. */
            if (psnr < 40 || mean > 0.1) fail_msg("%s (%s) is not its golden picture", cases[c].name, isas[i]);
            free(a.rgb);
            free(b.rgb);
        }
}

static void same_bytes(const char *a, const char *b)
{
    char command[512];
    for (int frame = 0; frame < 8; frame++)
        for (int eye = 0; eye < 2; eye++) {
            snprintf(command, sizeof command, "cd %s && cmp %s/%s-%05d.png %s/%s-%05d.png", program_folder(), a,
                     eye ? "right" : "left", frame, b, eye ? "right" : "left", frame);
            if (system(command)) fail_msg("%s", command);
        }
}

static void threads_and_tapes_change_nothing(void **state)
{
    (void)state;
    for (unsigned c = 1; c < sizeof cases / sizeof cases[0]; c += c < 3 ? 2 : c < 9 ? 3 : 1) {
        render(cases[c].settings, "auto", "one", 1);
        render(cases[c].settings, "auto", "two", 2);
        same_bytes("one", "two");
        struct program_result r = program("replay one --out again");
        if (r.code) fail_msg("replay: exit %d: %s", r.code, r.errors);
        same_bytes("one", "again");
    }
}

/* Where every pixel is sampled in every frame, at its centre, and its history dropped, nothing of any history may
 * show. */
static void everything_sampled_is_full(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        const char *scene = i ? "cornell" : "atrium";
        char full[128], all[256];
        snprintf(full, sizeof full, "--set scene.name=%s --set method.name=full", scene);
        snprintf(all, sizeof all, "--set scene.name=%s --set method.history=drop --set method.jitter=off --set fovea.p_min=1 "
                 "--set fovea.inner_deg=4 --set fovea.outer_deg=4", scene);
        render(full, "auto", "full", 2);
        render(all, "auto", "all", 2);
        same_bytes("full", "all");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(compare_with_golden), cmocka_unit_test(threads_and_tapes_change_nothing),
                                       cmocka_unit_test(everything_sampled_is_full)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
