/* measure_selective_figures: see measure_selective_page.h. */
#include "cli/measure_selective_page.h"

#include "cli/embed.h"
#include "cli/page.h"
#include "cli/plot.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { CENTRAL = FV_ZONE_FAR }; /* zones of the central region */

static void write_key(struct fv_writer *out, int slot, const char *name)
{
    fv_writer_print(out, "<li>");
    fv_plot_key(out, slot);
    fv_html_text(out, name);
    fv_writer_print(out, "</li>");
}

static struct fv_shown shown_samples(double value)
{
    return fv_shown_fixed(value, 3);
}

static struct fv_shown shown_ms(double value)
{
    return fv_shown_fixed(value, 1);
}

static const char *zone_quantity(const char *before, int zone)
{
    static char quantity[40];
    snprintf(quantity, sizeof quantity, "%s_%s", before, fv_zones[zone].name);
    return quantity;
}

static void open_columns(struct fv_writer *out, const char *const *heading, int columns)
{
    fv_writer_print(out, "<div class=\"scroll\"><table class=\"rows\">\n<thead><tr><th></th>");
    for (int i = 0; i < columns; i++)
        fv_writer_print(out, "<th scope=\"col\" class=\"n\">%s</th>", heading[i]);
    fv_writer_print(out, "</tr></thead>\n<tbody>\n");
}

/* ---- Figure 6 ---- */

static const char *const reuses[][2] = {{"sponza/reuse/0", "none"},
                                        {"sponza/reuse/0.25", "\xCF\x84 0.25"},
                                        {"sponza/reuse/0.5", "\xCF\x84 0.5"},
                                        {"sponza/reuse/1", "\xCF\x84 1"},
                                        {"sponza/reuse/2", "\xCF\x84 2"},
                                        {"sponza/reuse/4", "\xCF\x84 4"},
                                        {"sponza/reuse/8", "\xCF\x84 8"},
                                        {"sponza/reuse/paper-a", "paper, (a)"},
                                        {"sponza/reuse/paper-b", "paper, (b)"}};
enum { REUSES = sizeof reuses / sizeof reuses[0], FIRST_PAPER = REUSES - 2 };

static double reuse_of(const struct fv_sheet *sheet, int i, const char *quantity)
{
    return i < FIRST_PAPER ? fv_sheet_ours(sheet, reuses[i][0], quantity)
                           : fv_sheet_paper(sheet, reuses[i][0], quantity);
}

enum { PAPER_SLOT = 0, OURS_SLOT = 1 };

/* Rows first to end - 1, ours or the paper's. */
static void draw_rows(struct fv_plot *plot, const struct fv_sheet *sheet, int first, int end, int zone)
{
    int slot = first == FIRST_PAPER ? PAPER_SLOT : OURS_SLOT;
    char class[32], what[96];
    snprintf(class, sizeof class, "curve c%d", slot);
    fv_path_open(plot, class);
    for (int i = first; i < end; i++)
        fv_path_point(plot, 100 * reuse_of(sheet, i, "reused_fraction"),
                      reuse_of(sheet, i, zone_quantity("psnr", zone)));
    fv_path_close(plot);
    for (int i = first; i < end; i++) {
        double x = 100 * reuse_of(sheet, i, "reused_fraction"),
               y = reuse_of(sheet, i, zone_quantity("psnr", zone));
        snprintf(what, sizeof what, "%s: %.1f %%, %.1f dB", reuses[i][1], x, y);
        fv_plot_point(plot, x, y, &(struct fv_mark){.slot = slot, .what = what});
    }
}

static void draw_reuse(struct fv_writer *out, const struct fv_sheet *sheet, int zone)
{
    struct fv_plot plot = {.out = out, .x = fv_axis_empty(false), .y = fv_axis_empty(false)};
    char caption[64];
    for (int i = 1; i < REUSES; i++) {
        fv_axis_hold(&plot.x, 100 * reuse_of(sheet, i, "reused_fraction"));
        for (int z = 0; z < CENTRAL; z++) fv_axis_hold(&plot.y, reuse_of(sheet, i, zone_quantity("psnr", z)));
    }
    fv_axis_hold(&plot.x, 0);
    fv_axis_settle(&plot.x, 10, (struct fv_axis){0, 100, false});
    fv_axis_settle(&plot.y, 10, (struct fv_axis){30, 60, false});
    snprintf(caption, sizeof caption, "%s: PSNR, dB", fv_zones[zone].name);
    fv_plot_open(&plot, &(struct fv_plot_text){.caption = caption,
                                               .label = "PSNR by the share of reused pixels, paper and ours",
                                               .x_name = "reused of the central pixels, %",
                                               .height_px = 200,
                                               .narrow = true});
    draw_rows(&plot, sheet, FIRST_PAPER, REUSES, zone);
    draw_rows(&plot, sheet, 1, FIRST_PAPER, zone);
    fv_plot_close(&plot);
}

static void write_figure_6(struct fv_writer *out, const struct fv_sheet *sheet)
{
    static const char *const heading[] = {"reused", "fovea, dB", "para", "peri", "near", "rays", "CPU ms"};
    fv_section_open(out, "Figure 6",
                    "Central pixels that take their colour of the frame before, by \xCF\x84_reuse, on Sponza "
                    "while viewer and "
                    "gaze move; errors against the same frames without reuse. The paper does not say which "
                    "\xCF\x84_reuse its "
                    "two examples have.");
    fv_writer_print(out, "<ul class=\"legend\">");
    write_key(out, PAPER_SLOT, "paper");
    write_key(out, OURS_SLOT, "ours");
    fv_writer_print(out, "</ul>\n<div class=\"many\">\n");
    for (int z = 0; z < CENTRAL; z++) draw_reuse(out, sheet, z);
    fv_writer_print(out, "</div>\n");
    open_columns(out, heading, sizeof heading / sizeof heading[0]);
    for (int i = 0; i < REUSES; i++) {
        fv_writer_print(out, "<tr>");
        fv_name_cell(out, reuses[i][1]);
        fv_selective_cell(out, sheet, reuses[i][0], "reused_fraction", fv_shown_percent);
        for (int z = 0; z < CENTRAL; z++)
            fv_selective_cell(out, sheet, reuses[i][0], zone_quantity("psnr", z), fv_selective_decibels);
        fv_selective_cell(out, sheet, reuses[i][0], "rays", fv_shown_count);
        fv_selective_cell(out, sheet, reuses[i][0], "cpu_ms", shown_ms);
        fv_writer_print(out, "</tr>\n");
    }
    fv_table_close(out);
    fv_section_close(out);
}

/* ---- maps ---- */

struct map {
    const char *name, *what;
};

/* Pictures beside each other. Returns 0, or -1 with the error set. */
static int write_maps(struct fv_writer *out, const char *folder, const struct map *map, int maps,
                      struct fv_error *error)
{
    int result = 0;
    fv_writer_print(out, "<div class=\"eyes\">");
    for (int i = 0; i < maps && result == 0; i++) {
        if (!fv_embed_exists(folder, map[i].name)) continue;
        fv_writer_print(out, "<figure>");
        result = fv_embed_picture(out, folder, map[i].name, "map", map[i].what, error);
        fv_writer_print(out, "<figcaption>");
        fv_html_text(out, map[i].what);
        fv_writer_print(out, "</figcaption></figure>\n");
    }
    fv_writer_print(out, "</div>\n");
    return result;
}

/* The maps' colours, on a logarithmic scale from 1 to `most`. */
static void write_scale(struct fv_writer *out, int most)
{
    fv_writer_print(out, "<div class=\"scale\"><i style=\"background:linear-gradient(90deg");
    for (int hue = 280; hue >= 0; hue -= 20) fv_writer_print(out, ",hsl(%d 100%% 50%%)", hue);
    fv_writer_print(out,
                    ")\"></i><span>1</span><span>extra samples a pixel (black: none; in the middle %g)</span>"
                    "<span>%d</span></div>\n",
                    sqrt(most), most);
}

static void write_samples(struct fv_writer *out, const struct fv_sheet *sheet, const char *const (*row)[2],
                          int rows)
{
    static const char *const heading[] = {"extra samples", "a central pixel", "fovea", "para", "peri",
                                          "near"};
    open_columns(out, heading, sizeof heading / sizeof heading[0]);
    for (int i = 0; i < rows; i++) {
        fv_writer_print(out, "<tr>");
        fv_name_cell(out, row[i][1]);
        fv_selective_cell(out, sheet, row[i][0], "extra_samples", fv_shown_count);
        fv_selective_cell(out, sheet, row[i][0], "extra_per_pixel", shown_samples);
        for (int z = 0; z < CENTRAL; z++)
            fv_selective_cell(out, sheet, row[i][0], zone_quantity("extra_per_pixel", z), shown_samples);
        fv_writer_print(out, "</tr>\n");
    }
    fv_table_close(out);
}

/* ---- Figure 7 ---- */

static const char *const curves[][2] = {{"atrium/tolerance/low", "(1, 2, 0.5, 12)"},
                                        {"atrium/tolerance/high", "(9, 10, 1.5, 20)"}};
enum { CURVES = sizeof curves / sizeof curves[0], DEGREES = 30 };

static void draw_curves(struct fv_writer *out, const struct fv_sheet *sheet)
{
    struct fv_plot plot = {.out = out, .x = {0, DEGREES, false}, .y = fv_axis_empty(false)};
    double value[CURVES][DEGREES + 1];
    for (int c = 0; c < CURVES; c++)
        for (int e = 0; e <= DEGREES; e++) {
            char quantity[40];
            snprintf(quantity, sizeof quantity, "tau_fov_at_%d", e);
            value[c][e] = fv_sheet_ours(sheet, curves[c][0], quantity);
            fv_axis_hold(&plot.y, value[c][e]);
        }
    fv_axis_settle(&plot.y, 1, (struct fv_axis){0, 20, false});
    fv_plot_open(&plot, &(struct fv_plot_text){.caption = "\xCF\x84_fov: factor on thresholds of contrast",
                                               .label = "Tolerance by eccentricity, two curves",
                                               .x_name = "eccentricity, degrees",
                                               .height_px = 220});
    for (int c = 0; c < CURVES; c++) {
        char class[32];
        snprintf(class, sizeof class, "curve c%d", 1 + c);
        fv_path_open(&plot, class);
        for (int e = 0; e <= DEGREES; e++) fv_path_point(&plot, e, value[c][e]);
        fv_path_close(&plot);
    }
    for (int z = 0; z + 1 < CENTRAL; z++) fv_plot_upright(&plot, fv_zones[z].upper_deg, fv_zones[z].name);
    fv_plot_close(&plot);
}

static int write_figure_7(struct fv_writer *out, const struct fv_table_report *report, struct fv_error *error)
{
    static const struct map maps[] = {{"figure7.jpg", "The central region of the atrium"},
                                      {"figure7-low.png", "Extra samples by (1, 2, 0.5, 12)"},
                                      {"figure7-high.png", "Extra samples by (9, 10, 1.5, 20)"}};
    fv_section_open(out, "Figure 7",
                    "Tolerance by eccentricity for two shapes (\xCF\x84_0, \xCF\x84_f, \xCF\x84'_f, "
                    "\xCF\x84_np), and where "
                    "samples go by them: up to 9, 4, 2 and 1 of a quarter of a pixel in the four zones.");
    fv_writer_print(out, "<ul class=\"legend\">");
    for (int c = 0; c < CURVES; c++) write_key(out, 1 + c, curves[c][1]);
    fv_writer_print(out, "</ul>\n");
    draw_curves(out, report->sheet);
    write_samples(out, report->sheet, curves, CURVES);
    if (write_maps(out, report->folder, maps, sizeof maps / sizeof maps[0], error)) return -1;
    write_scale(out, 36);
    fv_section_close(out);
    return 0;
}

/* ---- Figure 8 ---- */

static int write_figure_8(struct fv_writer *out, const struct fv_table_report *report, struct fv_error *error)
{
    static const char *const rows[][2] = {{"atrium/view1/foveated", "first view, selective"},
                                          {"atrium/view1/selective", "first view, selective-only"},
                                          {"atrium/view2/foveated", "second view, selective"},
                                          {"atrium/view2/selective", "second view, selective-only"}};
    static const struct map maps[2][3] = {{{"figure8-1.jpg", "First view of the atrium"},
                                           {"figure8-1-foveated.png", "Extra samples by selective"},
                                           {"figure8-1-selective.png", "Extra samples by selective-only"}},
                                          {{"figure8-2.jpg", "Second view"},
                                           {"figure8-2-foveated.png", "Extra samples by selective"},
                                           {"figure8-2-selective.png", "Extra samples by selective-only"}}};
    fv_section_open(
        out, "Figure 8",
        "Where samples go by selective with 4, 3, 2 and 1 samples of a quarter of a pixel in the four zones, "
        "and by "
        "selective-only with 4 everywhere; the paper's means, of its scene Interior, small beside ours.");
    write_samples(out, report->sheet, rows, sizeof rows / sizeof rows[0]);
    for (int view = 0; view < 2; view++)
        if (write_maps(out, report->folder, maps[view], 3, error)) return -1;
    write_scale(out, 16);
    fv_section_close(out);
    return 0;
}

int fv_selective_figures(struct fv_writer *out, const struct fv_table_report *report, struct fv_error *error)
{
    const struct fv_sheet *sheet = report->sheet;
    if (fv_sheet_find(sheet, reuses[0][0], "rays")) write_figure_6(out, sheet);
    if (fv_sheet_find(sheet, curves[0][0], "extra_samples") && write_figure_7(out, report, error)) return -1;
    if (fv_sheet_find(sheet, "atrium/view1/foveated", "extra_samples") && write_figure_8(out, report, error))
        return -1;
    return 0;
}
