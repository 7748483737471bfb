/* kim2021: Table 2 of Kim, Ko and Ihm 2021 as `measure --table kim2021` measures it, on Sponza and on pipes:
 * how many times as fast as 36 samples a pixel and as selective-only, and how good by zone. Speed-ups are of
 * wall time; beside them stands what CPU time of all workers says, which a busy machine disturbs less. Each
 * scene has a process of its own.
 *
 * bench_kim2021 [PLACES] */
#include "rt/measure/table.h"
#include "tests/support/program.h"

#include <math.h>

enum { PLACES = 12, PLACES_MIN = 2, PLACES_TRUSTED = 8 };
static int places = PLACES;

/* The least that is to be reached. */
static const struct must {
    const char *scene, *row, *quantity;
    double least;
} musts[] = {{"sponza", "sponza/every", "speedup_vs_36spp", 14},
             {"sponza", "sponza/sparse", "speedup_vs_36spp", 21},
             {"sponza", "sponza/sparse", "speedup_vs_selective", 4},
             {"sponza", "sponza/every", "psnr_fovea", 47},
             {"sponza", "sponza/every", "psnr_para", 36.2},
             {"sponza", "sponza/every", "psnr_peri", 32.3},
             {"sponza", "sponza/every", "psnr_near", 33.2},
             {"sponza", "sponza/sparse", "psnr_far", 29},
             {"pipes", "pipes/every", "speedup_vs_36spp", 7},
             {"pipes", "pipes/every", "psnr_fovea", 35.2}};
enum { MUSTS = sizeof musts / sizeof musts[0] };

static struct fv_sheet sheet;

/* The scene's part into the sheet; false where its scene is not at hand. */
static bool measure(const char *scene)
{
    struct fv_part_heading heading;
    struct fv_error error;
    char path[256];
    struct program_result r =
        program("measure --table kim2021 --part table2-%s --frames %d --set scene.library=%s --out out",
                scene, places, FV_SOURCE_DIR "/../shared/data/scenes");
    if (strstr(r.errors, "foveola: rows of ")) return false; /* are left out */
    if (r.code != 0) fail_msg("%s", r.errors);
    snprintf(path, sizeof path, "%s/out/table-kim2021/table2-%s.part", program_folder(), scene);
    if (fv_part_read(&heading, &sheet, path, &error)) fail_msg("%s", error.text);
    print_message("%s: %s\n", scene, heading.about);
    return true;
}

static void print_scene(const char *scene)
{
    static const char *const ways[] = {"36spp", "1spp", "selective", "every", "sparse"};
    static const char *const quantities[] = {"frame_ms",  "cpu_ms",    "rays",      "psnr_fovea",
                                             "psnr_para", "psnr_peri", "psnr_near", "psnr_far"};
    char row[64];
    print_message("| | ms | CPU ms | rays | fovea | para | peri | near | far |\n"
                  "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
    for (size_t w = 0; w < sizeof ways / sizeof ways[0]; w++) {
        snprintf(row, sizeof row, "%s/%s", scene, ways[w]);
        print_message("| %s |", row);
        for (size_t q = 0; q < sizeof quantities / sizeof quantities[0]; q++)
            print_message(" %.5g |", fv_sheet_ours(&sheet, row, quantities[q]));
        print_message("\n");
    }
}

static void print_musts(const char *scene)
{
    print_message("\n| | ours | by CPU time | must be | paper |\n| --- | --- | --- | --- | --- |\n");
    for (const struct must *m = musts; m < musts + MUSTS; m++) {
        char cpu[64];
        if (strcmp(m->scene, scene) != 0) continue;
        snprintf(cpu, sizeof cpu, "cpu_%s", m->quantity);
        double by_cpu = fv_sheet_ours(&sheet, m->row, cpu);
        print_message("| %s, %s | %.2f |", m->row, m->quantity, fv_sheet_ours(&sheet, m->row, m->quantity));
        if (isnan(by_cpu)) print_message(" |");
        else print_message(" %.2f |", by_cpu);
        print_message(" %.1f | %.2f |\n", m->least, fv_sheet_paper(&sheet, m->row, m->quantity));
    }
    print_message("\n");
}

static void as_fast_and_as_good(const char *scene)
{
    sheet.cells = 0;
    if (!measure(scene)) {
        print_message("%s is not at hand: skipped\n", scene);
        skip();
    }
    print_scene(scene);
    print_musts(scene);
    if (places < PLACES_TRUSTED) {
        print_message("%d places are too few to judge by: nothing is asserted\n", places);
        return;
    }
    for (const struct must *m = musts; m < musts + MUSTS; m++)
        if (strcmp(m->scene, scene) == 0 && !(fv_sheet_ours(&sheet, m->row, m->quantity) >= m->least))
            fail_msg("%s, %s: %.2f, must be %.2f", m->row, m->quantity,
                     fv_sheet_ours(&sheet, m->row, m->quantity), m->least);
}

static void sponza(void **state)
{
    (void)state;
    as_fast_and_as_good("sponza");
}

static void pipes(void **state)
{
    (void)state;
    as_fast_and_as_good("pipes");
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(sponza), cmocka_unit_test(pipes)};
    if (argc > 1) places = atoi(argv[1]);
    if (argc > 2 || places < PLACES_MIN || places > FV_TABLE_FRAMES_MAX) {
        fprintf(stderr, "usage: bench_kim2021 [PLACES, from %d]\n", PLACES_MIN);
        return 2;
    }
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
