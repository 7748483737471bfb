/* measure_pyramid_page: what report.html shows of `measure --table polychronakis2023`: Figures 11 and 12 and Table 1 of
 * Polychronakis et al. 2023, the paper's numbers beside ours where it prints them. A row that is not there is left
 * out. */
#include "cli/measure_table.h"

#include "cli/page.h"
#include "cli/plot.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const scenes[] = {"primitives", "columns", "temple"};
static const int ssaas[] = {1, 2, 4, 8, 16};
static const double foveas_deg[] = {2.5, 5, 7.5, 10, 12.5, 15};
enum {
    SCENES = sizeof scenes / sizeof scenes[0],
    SSAAS = sizeof ssaas / sizeof ssaas[0],
    FOVEAS = sizeof foveas_deg / sizeof foveas_deg[0]
};

static const char *row_of(int scene, const char *kind, int ssaa, double fovea_deg, int refresh)
{
    return fv_row_polychronakis2023(scenes[scene], kind, ssaa, fovea_deg, refresh);
}

/* ---- Figures 11 and 12 ---- */

/* A curve over places 1, 2, ... of the x axis. */
struct curve {
    int slot, count;
    double y[8];
    const char *name;
};

static void draw(struct fv_plot *plot, const struct curve *c)
{
    char class[32], what[96];
    snprintf(class, sizeof class, "curve c%d", c->slot);
    fv_path_open(plot, class);
    for (int i = 0; i < c->count; i++) fv_path_point(plot, i + 1, c->y[i]);
    fv_path_close(plot);
    for (int i = 0; i < c->count; i++) {
        snprintf(what, sizeof what, "%s: %s x", c->name, fv_shown_fixed(c->y[i], 2).text);
        fv_plot_point(plot, i + 1, c->y[i], &(struct fv_mark){.slot = c->slot, .what = what});
    }
}

static void draw_all(struct fv_writer *out, const struct curve *curve, int curves, const char *caption,
                     const char *x_name, const char *const *words)
{
    struct fv_plot plot = {.out = out, .x = {0.6, curve[0].count + 0.4, false}, .y = fv_axis_empty(true)};
    for (int c = 0; c < curves; c++)
        for (int i = 0; i < curve[c].count; i++) fv_axis_hold(&plot.y, curve[c].y[i]);
    fv_axis_settle(&plot.y, 3, (struct fv_axis){1, 10, true});
    fv_plot_open(&plot, &(struct fv_plot_text){.caption = caption,
                                               .label = caption,
                                               .x_name = x_name,
                                               .height_px = 240,
                                               .narrow = true,
                                               .x_words = words});
    for (int c = 0; c < curves; c++) draw(&plot, &curve[c]);
    fv_plot_close(&plot);
}

static void write_keys(struct fv_writer *out, const struct curve *curve, int curves)
{
    fv_writer_print(out, "<ul class=\"legend\">");
    for (int c = 0; c < curves; c++) {
        fv_writer_print(out, "<li>");
        fv_plot_key(out, curve[c].slot);
        fv_html_text(out, curve[c].name);
        fv_writer_print(out, "</li>");
    }
    fv_writer_print(out, "</ul>\n");
}

static void write_figure_11(struct fv_writer *out, const struct fv_sheet *sheet)
{
    static const char *const words[] = {"1", "2", "4", "8", "16", NULL};
    struct curve curve[SCENES];
    for (int s = 0; s < SCENES; s++) {
        curve[s] = (struct curve){.slot = s, .count = SSAAS, .name = scenes[s]};
        for (int i = 0; i < SSAAS; i++) curve[s].y[i] = fv_sheet_ours(sheet, row_of(s, "ipr", ssaas[i], 180, 1), "speedup");
    }
    fv_section_open(out, "Figure 11",
                    "Speed-up over full marching without foveation (IPR), by samples a pixel. The paper's lie between "
                    "1.22 and 4.28; which is whose its text does not say. The scale is logarithmic.");
    write_keys(out, curve, SCENES);
    draw_all(out, curve, SCENES, "IPR: speed-up", "samples a pixel", words);
    fv_section_close(out);
}

static void write_figure_12(struct fv_writer *out, const struct fv_sheet *sheet)
{
    static const char *const words[] = {"2.5", "5", "7.5", "10", "12.5", "15", NULL};
    static const struct {
        const char *name;
        int ssaa, refresh;
    } lines[] = {{"1 sample", 1, 1}, {"1 sample, refreshed in 1 of 4", 1, 4}, {"16 samples", 16, 1}, {"16 samples, 1 of 4", 16, 4}};
    enum { LINES = sizeof lines / sizeof lines[0] };
    struct curve curve[LINES];
    fv_section_open(out, "Figure 12",
                    "Speed-up over full marching of the same samples a pixel with foveation (FIPR), by the radius of "
                    "the fovea. The scales are logarithmic.");
    for (int s = 0; s < SCENES; s++) {
        char caption[64];
        for (int l = 0; l < LINES; l++) {
            curve[l] = (struct curve){.slot = l, .count = FOVEAS, .name = lines[l].name};
            for (int i = 0; i < FOVEAS; i++)
                curve[l].y[i] =
                    fv_sheet_ours(sheet, row_of(s, "fipr", lines[l].ssaa, foveas_deg[i], lines[l].refresh), "speedup");
        }
        if (s == 0) {
            write_keys(out, curve, LINES);
            fv_writer_print(out, "<div class=\"many\">\n");
        }
        snprintf(caption, sizeof caption, "%s: speed-up", scenes[s]);
        draw_all(out, curve, LINES, caption, "radius of the fovea, degrees", words);
    }
    fv_writer_print(out, "</div>\n");
    fv_section_close(out);
}

/* ---- tables ---- */

struct column {
    const char *quantity, *heading;
    int decimals;
    bool paper; /* it has a column of its own */
};

static const struct column columns[] = {{"speedup", "speed-up", 2, true}, {"steps_ratio", "by steps", 2, false},
                                        {"ssim", "SSIM", 4, true},        {"flip", "FLIP", 4, true},
                                        {"cpu_ms", "CPU ms", 1, false},   {NULL, NULL, 0, false}};
static const struct column by_area[] = {{"ssim_fovea", "SSIM to 7.5\xC2\xB0", 4, false}, {"ssim_mid", "to 20\xC2\xB0", 4, false},
                                        {"ssim_far", "beyond", 4, false},   {"ssim", "all", 4, false},
                                        {"flip_fovea", "FLIP to 7.5\xC2\xB0", 4, false}, {"flip_mid", "to 20\xC2\xB0", 4, false},
                                        {"flip_far", "beyond", 4, false},   {"flip", "all", 4, false}, {NULL, NULL, 0, false}};
static const struct column turning[] = {{"speedup", "speed-up", 2, false},  {"steps_ratio", "by steps", 2, false},
                                        {"ssim_fovea", "SSIM to 7.5\xC2\xB0", 4, false}, {"ssim_mid", "to 20\xC2\xB0", 4, false},
                                        {"ssim_far", "beyond", 4, false},   {"ssim", "all", 4, false},
                                        {"flip", "FLIP", 4, false},         {NULL, NULL, 0, false}};
static const struct column starts[] = {{"speedup", "speed-up", 2, false}, {"steps_ratio", "by steps", 2, false},
                                       {"cpu_ms", "CPU ms", 1, false},    {"ssim", "SSIM", 4, false},
                                       {"flip", "FLIP", 4, false},        {"off_pixels", "pixels off, in a million", 0, false},
                                       {NULL, NULL, 0, false}};

static void write_row(struct fv_writer *out, const struct fv_sheet *sheet, const struct column *column, const char *row,
                      const char *name)
{
    fv_writer_print(out, "<tr>");
    fv_name_cell(out, name);
    for (; column->quantity; column++) {
        if (column->paper)
            fv_number_cell(out, fv_shown_fixed(fv_sheet_paper(sheet, row, column->quantity), column->decimals));
        fv_number_cell(out, fv_shown_fixed(fv_sheet_ours(sheet, row, column->quantity), column->decimals));
    }
    fv_writer_print(out, "</tr>\n");
}

static void open_rows(struct fv_writer *out, const struct column *column)
{
    fv_writer_print(out, "<div class=\"scroll\"><table class=\"rows\">\n<thead><tr><th></th>");
    for (; column->quantity; column++) {
        if (column->paper) fv_writer_print(out, "<th scope=\"col\" class=\"n\">%s, paper</th>", column->heading);
        fv_writer_print(out, "<th scope=\"col\" class=\"n\">%s</th>", column->paper ? "ours" : column->heading);
    }
    fv_writer_print(out, "</tr></thead>\n<tbody>\n");
}

/* A row of each scene's group. */
struct line {
    const char *kind, *name;
    int ssaa, refresh;
    double fovea_deg;
};

enum { LINES_MAX = 8 };

static const struct section {
    const char *heading, *note;
    const struct column *column;
    struct line line[LINES_MAX]; /* those without a name are none */
} sections[] = {
    {"Table 1",
     "Against full marching, one sample a pixel, fovea of 7.5\xC2\xB0, everything refreshed. The paper's numbers "
     "stand beside our way and beside its own, built here.",
     columns,
     {{"ipr", "IPR", 1, 1, 180},
      {"ipr-minimum", "IPR, least of 3 \xC3\x97 3", 1, 1, 180},
      {"fipr", "FIPR", 1, 1, 7.5},
      {"fipr-unrefined", "FIPR, colour edges as they are", 1, 1, 7.5},
      {"fipr-paper", "FIPR, as the paper", 1, 1, 7.5}}},
    {"By eccentricity",
     "The same errors within the fovea, from there to 20\xC2\xB0, and beyond: of the whole picture the fovea is "
     "hardly a fiftieth. Against full marching of as many samples a pixel.",
     by_area,
     {{"ipr", "IPR", 1, 1, 180},
      {"fipr", "FIPR", 1, 1, 7.5},
      {"fipr-unrefined", "FIPR, colour edges as they are", 1, 1, 7.5},
      {"fipr-paper", "FIPR, as the paper", 1, 1, 7.5},
      {"fipr", "FIPR, 16 samples", 16, 1, 7.5},
      {"fipr-masked", "FIPR, 16 where masked", 16, 1, 7.5}}},
    {"Under motion",
     "The head turns by 20\xC2\xB0/s and moves aside by 0.3 m/s, lights move; FIPR at 7.5\xC2\xB0, one sample, "
     "against full marching of the same instant. What is not refreshed moves with the head, or stands as in the "
     "paper.",
     turning,
     {{"fipr-turning", "all refreshed", 1, 1, 7.5},
      {"fipr-turning", "1 of 2, carried over", 1, 2, 7.5},
      {"fipr-turning-stays", "1 of 2, as it stood", 1, 2, 7.5},
      {"fipr-turning", "1 of 4, carried over", 1, 4, 7.5},
      {"fipr-turning-stays", "1 of 4, as it stood", 1, 4, 7.5}}},
    {"Where rays start",
     "At the ends of cones, or at the least of 3 \xC3\x97 3 distances of single rays, as in the paper. Pixels off: by "
     "more than 16 of 255 from full marching.",
     starts,
     {{"ipr", "IPR, cones", 1, 1, 180},
      {"ipr-minimum", "IPR, least of 3 \xC3\x97 3", 1, 1, 180},
      {"ipr", "IPR, 16 samples, cones", 16, 1, 180},
      {"ipr-minimum", "IPR, 16 samples, least of 3 \xC3\x97 3", 16, 1, 180},
      {"fipr", "FIPR, cones", 1, 1, 7.5},
      {"fipr-minimum", "FIPR, least of 3 \xC3\x97 3", 1, 1, 7.5},
      {"fipr", "FIPR, 16 samples, cones", 16, 1, 7.5},
      {"fipr-minimum", "FIPR, 16 samples, least of 3 \xC3\x97 3", 16, 1, 7.5}}}};

/* Every scene's rows, each group under its name; nothing where none is there. */
static void write_section(struct fv_writer *out, const struct fv_sheet *sheet, const struct section *section)
{
    int width = 1;
    bool open = false;
    for (const struct column *c = section->column; c->quantity; c++) width += c->paper ? 2 : 1;
    for (int s = 0; s < SCENES; s++) {
        bool named = false;
        for (const struct line *l = section->line; l < section->line + LINES_MAX && l->name; l++) {
            const char *row = row_of(s, l->kind, l->ssaa, l->fovea_deg, l->refresh);
            if (!fv_sheet_find(sheet, row, "ssim")) continue;
            if (!open) {
                fv_section_open(out, section->heading, section->note);
                open_rows(out, section->column);
            }
            if (!named) fv_writer_print(out, "<tr class=\"group\"><th colspan=\"%d\" scope=\"rowgroup\">%s</th></tr>\n", width, scenes[s]);
            open = named = true;
            write_row(out, sheet, section->column, row, l->name);
        }
    }
    if (!open) return;
    fv_table_close(out);
    fv_section_close(out);
}

static void write_rows(struct fv_writer *out, const struct fv_sheet *sheet)
{
    fv_section_open(out, "All rows", "scene / kind / samples a pixel / radius of the fovea / frames until all is refreshed.");
    open_rows(out, columns);
    for (int i = 0; i < sheet->cells; i++)
        if (strcmp(sheet->cell[i].quantity, "speedup") == 0)
            write_row(out, sheet, columns, sheet->cell[i].row, sheet->cell[i].row);
    fv_table_close(out);
    fv_section_close(out);
}

int fv_table_page_polychronakis2023(struct fv_writer *out, const struct fv_table_report *report, struct fv_error *error)
{
    const struct fv_sheet *sheet = report->sheet;
    (void)error;
    static const char *const terms[][2] = {
        {"Places", "Along the scene's path, one eye, the gaze straight ahead. At each, full marching and all the others are "
                   "rendered in turn, standing still; ratios are of CPU time of frames, medians over the places."},
        {"ipr, fipr", "Every pixel from its start; and foveated, with as many samples of the middle level as of what is "
                      "masked. fipr-masked: one sample of the middle level. ipr-unculled: parts of fields that a packet "
                      "cannot meet are left out on neither side; on both in all other rows."},
        {"As they are", "fipr-unrefined: nothing is traced between pixels of the lower levels that differ in colour."},
        {"As the paper", "fipr-paper: the same, and rays start at the least of 3 \xC3\x97 3 distances, colour never comes from the lowest "
                         "level, and what is not refreshed stays as it stood. fipr-minimum: only the first of these."},
        {"Scenes", "Ours, after the paper's; so times and errors compare in kind only."},
        {"Paper", "Polychronakis, Koulieris and Mania 2023, on a graphics card. Its text prints few of the figures' numbers."},
    };
    for (size_t i = 0; i < sizeof sections / sizeof sections[0]; i++) write_section(out, sheet, &sections[i]);
    write_figure_11(out, sheet);
    write_figure_12(out, sheet);
    write_rows(out, sheet);
    fv_terms(out, "How it was measured", terms, sizeof terms / sizeof terms[0]);
    return 0;
}
