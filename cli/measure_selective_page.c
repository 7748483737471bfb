/* measure_selective_page: see measure_selective_page.h. Tables 2 and 3 of Kim, Ko and Ihm 2021, the paper's
 * numbers beside ours; what is not there is left out. */
#include "cli/measure_selective_page.h"

#include "cli/page.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const scenes[] = {"sponza", "pipes", "sibenik", "atrium"};
static const char *const ways[][2] = {{"36spp", "36 samples a pixel"},
                                      {"1spp", "1 sample a pixel"},
                                      {"selective", "selective-only"},
                                      {"every", "selective, every peripheral pixel"},
                                      {"sparse", "selective, sparse periphery"}};
enum { SCENES = sizeof scenes / sizeof scenes[0], WAYS = sizeof ways / sizeof ways[0], OURS = 3 };

struct fv_shown fv_selective_decibels(double value)
{
    return fv_shown_fixed(value, 1);
}

static struct fv_shown shown_ratio(double value)
{
    return fv_shown_fixed(value, 2);
}

static struct fv_shown shown_ms(double value)
{
    return fv_shown_fixed(value, 1);
}

void fv_selective_cell(struct fv_writer *out, const struct fv_sheet *sheet, const char *row,
                       const char *quantity, struct fv_shown (*show)(double))
{
    double paper = fv_sheet_paper(sheet, row, quantity), ours = fv_sheet_ours(sheet, row, quantity);
    fv_writer_print(out, "<td class=\"n\">");
    if (!isnan(ours) || isnan(paper)) fv_writer_print(out, "%s ", show(ours).text);
    if (!isnan(paper)) fv_writer_print(out, "<small>%s</small>", show(paper).text);
    fv_writer_print(out, "</td>");
}

static const char *row_of(int scene, int way)
{
    static char row[64];
    snprintf(row, sizeof row, "%s/%s", scenes[scene], ways[way][0]);
    return row;
}

static bool is_there(const struct fv_sheet *sheet, int scene)
{
    return fv_sheet_find(sheet, row_of(scene, OURS), "rays") != NULL;
}

static void write_group(struct fv_writer *out, int scene, int columns)
{
    fv_writer_print(out, "<tr class=\"group\"><th colspan=\"%d\" scope=\"rowgroup\">%s%s</th></tr>\n",
                    columns, scenes[scene],
                    strcmp(scenes[scene], "pipes") == 0 ? " <small>the paper's: Power Plant</small>" : "");
}

static void write_facts(struct fv_writer *out, const struct fv_sheet *sheet)
{
    static const struct {
        const char *name, *way, *quantity, *unit;
        struct fv_shown (*show)(double);
    } facts[] = {{"against 36 samples", "every", "speedup_vs_36spp", " \xC3\x97", shown_ratio},
                 {"the same, sparse periphery", "sparse", "speedup_vs_36spp", " \xC3\x97", shown_ratio},
                 {"against selective-only", "sparse", "speedup_vs_selective", " \xC3\x97", shown_ratio},
                 {"PSNR, fovea", "every", "psnr_fovea", " dB", fv_selective_decibels}};
    int scene = 0;
    while (scene < SCENES && !is_there(sheet, scene)) scene++;
    if (scene == SCENES) return;
    fv_writer_print(out, "<dl class=\"facts\">\n");
    for (size_t i = 0; i < sizeof facts / sizeof facts[0]; i++) {
        char row[64], name[96], more[64] = "not in the paper";
        snprintf(row, sizeof row, "%s/%s", scenes[scene], facts[i].way);
        snprintf(name, sizeof name, "%s, %s", scenes[scene], facts[i].name);
        double paper = fv_sheet_paper(sheet, row, facts[i].quantity);
        if (!isnan(paper))
            snprintf(more, sizeof more, "paper %s%s", facts[i].show(paper).text, facts[i].unit);
        fv_fact(out, name, facts[i].show(fv_sheet_ours(sheet, row, facts[i].quantity)), facts[i].unit, more);
    }
    fv_writer_print(out, "</dl>\n");
}

/* ---- Table 2 ---- */

static const struct {
    const char *quantity, *heading;
    struct fv_shown (*show)(double);
} columns[] = {{"frame_ms", "ms", shown_ms},
               {"cpu_ms", "CPU ms", shown_ms},
               {"rays", "rays", fv_shown_count},
               {"psnr_fovea", "fovea, dB", fv_selective_decibels},
               {"psnr_para", "para", fv_selective_decibels},
               {"psnr_peri", "peri", fv_selective_decibels},
               {"psnr_near", "near", fv_selective_decibels},
               {"psnr_far", "far", fv_selective_decibels}};
enum { COLUMNS = sizeof columns / sizeof columns[0] };

static void write_table_2(struct fv_writer *out, const struct fv_sheet *sheet)
{
    fv_section_open(
        out, "Table 2",
        "Time, rays and errors of frames of both eyes; the paper's small beside ours. PSNR of the left eye's "
        "picture by eccentricity from the gaze, against 144 samples a pixel. The paper's times are two "
        "graphics "
        "cards'.");
    fv_writer_print(out, "<div class=\"scroll\"><table class=\"rows\">\n<thead><tr><th></th>");
    for (int i = 0; i < COLUMNS; i++)
        fv_writer_print(out, "<th scope=\"col\" class=\"n\">%s</th>", columns[i].heading);
    fv_writer_print(out, "</tr></thead>\n<tbody>\n");
    for (int s = 0; s < SCENES; s++) {
        if (!is_there(sheet, s)) continue;
        write_group(out, s, 1 + COLUMNS);
        for (int w = 0; w < WAYS; w++) {
            fv_writer_print(out, "<tr>");
            fv_name_cell(out, ways[w][1]);
            for (int i = 0; i < COLUMNS; i++)
                fv_selective_cell(out, sheet, row_of(s, w), columns[i].quantity, columns[i].show);
            fv_writer_print(out, "</tr>\n");
        }
    }
    fv_table_close(out);
    fv_section_close(out);
}

static void write_speedup(struct fv_writer *out, const struct fv_sheet *sheet, const char *row,
                          const char *over)
{
    char quantity[64];
    snprintf(quantity, sizeof quantity, "speedup_vs_%s", over);
    fv_selective_cell(out, sheet, row, quantity, shown_ratio);
    snprintf(quantity, sizeof quantity, "speedup_vs_%s_p25", over);
    fv_writer_print(out, "<td class=\"n\">%s", shown_ratio(fv_sheet_ours(sheet, row, quantity)).text);
    snprintf(quantity, sizeof quantity, "speedup_vs_%s_p75", over);
    fv_writer_print(out, " to %s</td>", shown_ratio(fv_sheet_ours(sheet, row, quantity)).text);
    snprintf(quantity, sizeof quantity, "cpu_speedup_vs_%s", over);
    fv_number_cell(out, shown_ratio(fv_sheet_ours(sheet, row, quantity)));
}

static void write_speedups(struct fv_writer *out, const struct fv_sheet *sheet)
{
    fv_section_open(out, "Speed-up",
                    "Of the times above: medians and quartiles, over the places, of the ratios of frames "
                    "timed in turn at the "
                    "same pose; the paper's small beside them.");
    fv_writer_print(out, "<div class=\"scroll\"><table class=\"rows\">\n<thead><tr><th></th>");
    for (int i = 0; i < 2; i++)
        fv_writer_print(
            out,
            "<th scope=\"col\" class=\"n\">against %s</th><th scope=\"col\" class=\"n\">quartiles</th>"
            "<th scope=\"col\" class=\"n\">by CPU time</th>",
            i ? "selective-only" : "36 samples");
    fv_writer_print(out, "</tr></thead>\n<tbody>\n");
    for (int s = 0; s < SCENES; s++) {
        if (!is_there(sheet, s)) continue;
        write_group(out, s, 7);
        for (int w = OURS; w < WAYS; w++) {
            fv_writer_print(out, "<tr>");
            fv_name_cell(out, ways[w][1]);
            write_speedup(out, sheet, row_of(s, w), "36spp");
            write_speedup(out, sheet, row_of(s, w), "selective");
            fv_writer_print(out, "</tr>\n");
        }
    }
    fv_table_close(out);
    fv_section_close(out);
}

/* ---- Table 3 ---- */

static void write_table_3(struct fv_writer *out, const struct fv_sheet *sheet)
{
    static const char *const alphas[] = {"off", "0.1", "0.3", "0.5", "0.7", "0.9", "foveated"};
    enum { ALPHAS = sizeof alphas / sizeof alphas[0] };
    fv_section_open(out, "Table 3",
                    "Smoothing over earlier frames by the weight \xCE\xB1 of the newest: none, the same "
                    "everywhere, and by "
                    "eccentricity. PSNR, dB, against 256 samples a pixel, on Sponza while the viewer moves; "
                    "the paper's small "
                    "beside ours.");
    fv_writer_print(out, "<div class=\"scroll\"><table class=\"rows\">\n<thead><tr><th></th>");
    for (int a = 0; a < ALPHAS; a++) fv_writer_print(out, "<th scope=\"col\" class=\"n\">%s</th>", alphas[a]);
    fv_writer_print(out, "</tr></thead>\n<tbody>\n");
    for (int z = 0; z < FV_ZONE_ALL; z++) {
        char row[64], quantity[64];
        snprintf(quantity, sizeof quantity, "psnr_%s", fv_zones[z].name);
        fv_writer_print(out, "<tr>");
        fv_name_cell(out, fv_zones[z].name);
        for (int a = 0; a < ALPHAS; a++) {
            snprintf(row, sizeof row, "sponza/smoothing/%s", alphas[a]);
            fv_selective_cell(out, sheet, row, quantity, fv_selective_decibels);
        }
        fv_writer_print(out, "</tr>\n");
    }
    fv_table_close(out);
    fv_section_close(out);
}

int fv_table_page_kim2021(struct fv_writer *out, const struct fv_table_report *report, struct fv_error *error)
{
    static const char *const terms[][2] = {
        {"Places", "Along the scene's path, the viewer moving: twelve frames lead to each; the gaze is "
                   "straight ahead, in "
                   "Figure 6 it moves by 4\xC2\xB0 a second. Numbers are medians over the places. At each "
                   "all are rendered in "
                   "turn, three frames each, of 36 samples one."},
        {"Zones", "fovea up to 3.3\xC2\xB0, para 5.5\xC2\xB0, peri 12.1\xC2\xB0, near 30\xC2\xB0, far "
                  "beyond: eccentricity "
                  "from the gaze. 99 dB stand for no difference."},
        {"selective-only",
         "Jin et al. 2009, as published: always four samples of a subpixel that fails, the same tolerance everywhere; one "
         "sample of every peripheral pixel."},
        {"every, sparse",
         "The periphery as in the paper; and a share of its pixels sampled, the rest reprojected. The paper "
         "has no such: its numbers stand beside both."},
        {"Scenes", "Sponza is the paper's. pipes, atrium (for the paper's Interior) are ours, so their "
                   "numbers compare in kind "
                   "only; sibenik is not in the paper. Area lights, "
                   "which the paper has none of, are points as bright along their axis. Smoothing and reuse "
                   "are off but where they are what is measured."},
        {"Paper", "Kim, Ko and Ihm 2021, 1280 \xC3\x97 1440 pixels an eye, on two GeForce RTX 2080 Ti; "
                  "errors against 36 samples "
                  "a pixel."},
    };
    const struct fv_sheet *sheet = report->sheet;
    bool any = false;
    for (int s = 0; s < SCENES; s++) any |= is_there(sheet, s);
    if (any) {
        write_facts(out, sheet);
        write_table_2(out, sheet);
        write_speedups(out, sheet);
    }
    if (fv_sheet_find(sheet, "sponza/smoothing/off", "psnr_fovea")) write_table_3(out, sheet);
    if (fv_selective_figures(out, report, error)) return -1;
    fv_terms(out, "How it was measured", terms, sizeof terms / sizeof terms[0]);
    return 0;
}
