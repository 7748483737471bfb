/* measure_table_page: report.html of `measure --table weier2016`: Table 1 and Figure 5 of Weier et al. 2016, the
 * paper's numbers beside ours. A row that is not there is left out. */
#include "cli/measure_table.h"

#include "cli/page.h"
#include "cli/plot.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

struct page {
    struct fv_writer *out;
    const struct fv_sheet *sheet;
};

static const struct {
    const char *key, *name;
} lights[] = {{"point", "point light"}, {"area", "area light, 8 samples"}, {"ao", "ambient occlusion, 16 rays"}};
enum { LIGHTS = sizeof lights / sizeof lights[0] };

static const char *const regions[] = {"small", "medium", "large", "full", NULL};
enum { REGIONS = 4, PAPER_SLOT = 0, OURS_SLOT = 1 };

static struct fv_shown shown_speedup(double value)
{
    return fv_shown_fixed(value, 2);
}

static struct fv_shown shown_ms(double value)
{
    return fv_shown_fixed(value, value < 100 ? 2 : 1);
}

/* Rows by scene: "sponza" of "sponza/point". */
static int scene_length(const struct fv_cell *c)
{
    return (int)strcspn(c->row, "/");
}

/* The row of Table 1, not of Figure 5, that this cell begins; false where it begins none. */
static bool begins_row(const struct fv_sheet *s, int i)
{
    const struct fv_cell *c = &s->cell[i];
    return strcmp(c->quantity, "rays_full") == 0 && !strchr(c->row + scene_length(c) + 1, '/');
}

static const char *light_name(const struct fv_cell *c)
{
    for (int i = 0; i < LIGHTS; i++)
        if (strcmp(c->row + scene_length(c) + 1, lights[i].key) == 0) return lights[i].name;
    return c->row;
}

/* ---- Table 1 ---- */

static void write_pair(const struct page *p, const char *row, const char *quantity, struct fv_shown (*show)(double))
{
    double paper = fv_sheet_paper(p->sheet, row, quantity), ours = fv_sheet_ours(p->sheet, row, quantity);
    fv_writer_print(p->out, "<td class=\"n out\">%s</td><td class=\"n\">%s</td>", show(paper).text,
                    show(ours).text);
}

static void write_group(const struct page *p, const struct fv_cell *c, int columns)
{
    char scene[48];
    snprintf(scene, sizeof scene, "%.*s", scene_length(c), c->row);
    fv_writer_print(p->out, "<tr class=\"group\"><th colspan=\"%d\" scope=\"rowgroup\">", columns);
    fv_html_text(p->out, scene);
    fv_writer_print(p->out, "</th></tr>\n");
}

static void write_table(const struct page *p)
{
    static const struct {
        const char *quantity, *heading;
        struct fv_shown (*show)(double);
    } pairs[] = {{"rays_full", "rays, full", fv_shown_count},
                 {"rays", "rays", fv_shown_count},
                 {"frame_ms_full", "full, ms", shown_ms},
                 {"frame_ms", "reproject, ms", shown_ms},
                 {"speedup", "speed-up", shown_speedup}};
    enum { PAIRS = sizeof pairs / sizeof pairs[0] };
    const char *scene = "";
    fv_section_open(p->out, "Table 1",
                    "Rays and times of a frame of one eye, medium foveal region (10\xC2\xB0, 20\xC2\xB0, 0.05). Rays "
                    "are means, times medians; the speed-up is the median of the ratios of frames timed in turn at "
                    "the same pose. The paper's times are a graphics card's.");
    fv_writer_print(p->out, "<div class=\"scroll\"><table class=\"rows\">\n<thead><tr><th></th>");
    for (int i = 0; i < PAIRS; i++)
        fv_writer_print(p->out, "<th scope=\"colgroup\" colspan=\"2\" class=\"n\">%s</th>", pairs[i].heading);
    fv_writer_print(p->out, "<th scope=\"col\" class=\"n\">sampled</th></tr>\n<tr><th></th>");
    for (int i = 0; i < PAIRS; i++)
        fv_writer_print(p->out,
                        "<th scope=\"col\" class=\"n\">paper</th><th scope=\"col\" class=\"n\">ours</th>");
    fv_writer_print(p->out, "<th scope=\"col\" class=\"n\">ours</th></tr></thead>\n<tbody>\n");
    for (int i = 0; i < p->sheet->cells; i++) {
        const struct fv_cell *c = &p->sheet->cell[i];
        if (!begins_row(p->sheet, i)) continue;
        if (strncmp(c->row, scene, (size_t)scene_length(c) + 1) != 0) write_group(p, c, 2 + 2 * PAIRS);
        scene = c->row;
        fv_writer_print(p->out, "<tr>");
        fv_name_cell(p->out, light_name(c));
        for (int k = 0; k < PAIRS; k++) write_pair(p, c->row, pairs[k].quantity, pairs[k].show);
        fv_number_cell(p->out, fv_shown_percent(fv_sheet_ours(p->sheet, c->row, "sampled_fraction")));
        fv_writer_print(p->out, "</tr>\n");
    }
    fv_table_close(p->out);
    fv_section_close(p->out);
}

/* ---- stages ---- */

enum { STAGES_MAX = 24 };

static bool is_stage(const char *quantity)
{
    return strncmp(quantity, "stage_", 6) == 0;
}

/* Their quantities, each once, in the order of the cells. */
static int stages_of(const struct fv_sheet *s, const char *stage[STAGES_MAX])
{
    int stages = 0;
    for (int i = 0; i < s->cells; i++) {
        const char *quantity = s->cell[i].quantity;
        bool known = !is_stage(quantity) || stages == STAGES_MAX;
        for (int k = 0; k < stages && !known; k++) known = strcmp(stage[k], quantity) == 0;
        if (!known) stage[stages++] = quantity;
    }
    return stages;
}

static void write_stage(const struct page *p, const char *row, const char *quantity)
{
    double paper = fv_sheet_paper(p->sheet, row, quantity), ours = fv_sheet_ours(p->sheet, row, quantity);
    fv_writer_print(p->out, "<td class=\"n\">%s", isnan(ours) && !isnan(paper) ? "" : shown_ms(ours).text);
    if (!isnan(paper)) fv_writer_print(p->out, " <small>%s</small>", shown_ms(paper).text);
    fv_writer_print(p->out, "</td>");
}

static void write_stages(const struct page *p)
{
    const char *stage[STAGES_MAX], *scene = "";
    char name[40];
    int stages = stages_of(p->sheet, stage);
    fv_section_open(p->out, "Stages",
                    "Median milliseconds; the paper's small beside them. Ours that trace (support, sample) also blend "
                    "what they traced into history, which the paper counts as cache update and merging. present, "
                    "making the display's picture, is not in the frame times above.");
    fv_writer_print(p->out, "<div class=\"scroll\"><table class=\"rows\">\n<thead><tr><th></th>");
    for (int k = 0; k < stages; k++) {
        snprintf(name, sizeof name, "%.*s", (int)strlen(stage[k]) - 9, stage[k] + 6); /* stage_NAME_ms */
        for (char *at = name; *at; at++)
            if (*at == '_') *at = ' ';
        fv_writer_print(p->out, "<th scope=\"col\" class=\"n\">");
        fv_html_text(p->out, name);
        fv_writer_print(p->out, "</th>");
    }
    fv_writer_print(p->out, "</tr></thead>\n<tbody>\n");
    for (int i = 0; i < p->sheet->cells; i++) {
        const struct fv_cell *c = &p->sheet->cell[i];
        if (!begins_row(p->sheet, i)) continue;
        if (strncmp(c->row, scene, (size_t)scene_length(c) + 1) != 0) write_group(p, c, 1 + stages);
        scene = c->row;
        fv_writer_print(p->out, "<tr>");
        fv_name_cell(p->out, light_name(c));
        for (int k = 0; k < stages; k++) write_stage(p, c->row, stage[k]);
        fv_writer_print(p->out, "</tr>\n");
    }
    fv_table_close(p->out);
    fv_section_close(p->out);
}

/* ---- Figure 5 ---- */

static const char *bar_row(int light, int region)
{
    static char row[48];
    snprintf(row, sizeof row, "sponza/%s/%s", lights[light].key, regions[region]);
    return row;
}

static double bar_of(const struct page *p, int light, int region, const char *quantity, bool paper)
{
    const char *row = bar_row(light, region);
    return paper ? fv_sheet_paper(p->sheet, row, quantity) : fv_sheet_ours(p->sheet, row, quantity);
}

static void draw_bars(struct fv_plot *plot, const struct page *p, int light, bool paper)
{
    char class[32], what[96];
    int slot = paper ? PAPER_SLOT : OURS_SLOT;
    snprintf(class, sizeof class, "curve c%d", slot);
    fv_path_open(plot, class);
    for (int r = 0; r < REGIONS; r++) {
        double y = bar_of(p, light, r, "speedup", paper);
        if (!isnan(y)) fv_path_point(plot, r + 1, y); /* across what the paper does not say */
    }
    fv_path_close(plot);
    for (int r = 0; r < REGIONS; r++) {
        double y = bar_of(p, light, r, "speedup", paper);
        snprintf(what, sizeof what, "%s, %s: %s x", paper ? "paper" : "ours", regions[r], shown_speedup(y).text);
        struct fv_shown label = shown_speedup(y);
        const struct fv_mark mark = {slot, false, r + 1 < REGIONS && !paper ? label.text : NULL, what};
        fv_plot_point(plot, r + 1, y, &mark);
    }
}

static void draw_light(const struct page *p, int light, const struct fv_axis *y)
{
    char caption[96], label[192];
    struct fv_plot plot = {.out = p->out, .x = {0.6, 4.4, false}, .y = *y};
    snprintf(caption, sizeof caption, "(%c) %s: speed-up", 'a' + light, lights[light].name);
    snprintf(label, sizeof label, "Speed-up over the full renderer by foveal region, %s, paper and ours",
             lights[light].name);
    fv_plot_open(&plot, &(struct fv_plot_text){.caption = caption,
                                               .label = label,
                                               .x_name = "foveal region",
                                               .height_px = 220,
                                               .narrow = true,
                                               .x_words = regions});
    draw_bars(&plot, p, light, true);
    draw_bars(&plot, p, light, false);
    fv_plot_close(&plot);
}

static void write_figure_rows(const struct page *p)
{
    fv_table_open(p->out, "rows",
                  "<th></th><th scope=\"col\" class=\"n\">rays, paper</th><th scope=\"col\" class=\"n\">ours</th>"
                  "<th scope=\"col\" class=\"n\">frames/s, paper</th><th scope=\"col\" class=\"n\">ours</th>"
                  "<th scope=\"col\" class=\"n\">speed-up, paper</th><th scope=\"col\" class=\"n\">ours</th>");
    for (int light = 0; light < LIGHTS; light++) {
        if (!fv_sheet_find(p->sheet, bar_row(light, 0), "fps")) continue;
        fv_writer_print(p->out, "<tr class=\"group\"><th colspan=\"7\" scope=\"rowgroup\">%s</th></tr>\n",
                        lights[light].name);
        for (int r = 0; r < REGIONS; r++) {
            char row[48];
            snprintf(row, sizeof row, "%s", bar_row(light, r));
            fv_writer_print(p->out, "<tr>");
            fv_name_cell(p->out, regions[r]);
            write_pair(p, row, "rays", fv_shown_count);
            write_pair(p, row, "fps", shown_ms);
            write_pair(p, row, "speedup", shown_speedup);
            fv_writer_print(p->out, "</tr>\n");
        }
    }
    fv_table_close(p->out);
}

static void write_figure(const struct page *p)
{
    struct fv_axis y = fv_axis_empty(true);
    bool there[LIGHTS];
    int plots = 0;
    for (int light = 0; light < LIGHTS; light++) {
        there[light] = fv_sheet_find(p->sheet, bar_row(light, 0), "speedup") != NULL;
        plots += there[light];
        for (int r = 0; r < REGIONS; r++)
            for (int paper = 0; paper < 2; paper++) fv_axis_hold(&y, bar_of(p, light, r, "speedup", paper));
    }
    if (plots == 0) return;
    fv_axis_settle(&y, 3, (struct fv_axis){1, 10, true});
    fv_section_open(p->out, "Figure 5",
                    "Speed against the foveal region on Sponza: small (5\xC2\xB0, 10\xC2\xB0, 0.01), medium (10\xC2\xB0, "
                    "20\xC2\xB0, 0.05), large (15\xC2\xB0, 30\xC2\xB0, 0.1), full. The paper's text gives medium and "
                    "full only. The scale is logarithmic.");
    fv_writer_print(p->out, "<ul class=\"legend\"><li>");
    fv_plot_key(p->out, PAPER_SLOT);
    fv_writer_print(p->out, "paper</li><li>");
    fv_plot_key(p->out, OURS_SLOT);
    fv_writer_print(p->out, "ours</li></ul>\n<div class=\"many\">\n");
    for (int light = 0; light < LIGHTS; light++)
        if (there[light]) draw_light(p, light, &y);
    fv_writer_print(p->out, "</div>\n");
    write_figure_rows(p);
    fv_section_close(p->out);
}

/* ---- the page ---- */

static void write_facts(const struct page *p)
{
    fv_writer_print(p->out, "<dl class=\"facts\">\n");
    for (int light = 0; light < LIGHTS; light++) {
        char row[48], name[96], more[96];
        snprintf(row, sizeof row, "sponza/%s", lights[light].key);
        if (!fv_sheet_find(p->sheet, row, "speedup")) snprintf(row, sizeof row, "cornell/%s", lights[light].key);
        if (!fv_sheet_find(p->sheet, row, "speedup")) continue;
        double paper = fv_sheet_paper(p->sheet, row, "speedup");
        snprintf(name, sizeof name, "%.*s, %s", (int)strcspn(row, "/"), row, lights[light].name);
        snprintf(more, sizeof more, isnan(paper) ? "not in the paper" : "paper %.2f \xC3\x97", paper);
        fv_fact(p->out, name, shown_speedup(fv_sheet_ours(p->sheet, row, "speedup")), " \xC3\x97", more);
    }
    fv_writer_print(p->out, "</dl>\n");
}

static void write_definitions(const struct page *p)
{
    static const char *const rows[][2] = {
        {"Fly-through", "Along the scene's path, the simulated head turning, the gaze straight ahead as in the paper's "
                        "benchmark. 1000 frames are the whole path; fewer are pieces of 50 spread over it, each after "
                        "five frames that are not counted."},
        {"full", "Every pixel, one sample: rendered in turn with the others at the same poses, beside about 100 of the "
                 "frames."},
        {"Light", "A point light; in its place a square of 0.5 m that shines up and down, as bright along its axis, "
                  "with 8 shadow rays; ambient occlusion of 16 rays without any other light, as the paper's numbers "
                  "of rays (2, 9 and 17 a pixel) say."},
        {"Paper", "Weier, Roth, Kruijff, Hinkenjann, P\xC3\xA9rard-Gayot, Slusallek and Li 2016, on a GeForce Titan X. "
                  "Its other scenes, Rungholt and Urban Sprawl, are not measured here; atrium and cornell are not in "
                  "the paper. Over its four scenes it samples 79 % fewer pixels and is 2.55 times as fast."},
    };
    fv_terms(p->out, "How it was measured", rows, sizeof rows / sizeof rows[0]);
}

int fv_table_page_weier2016(struct fv_writer *out, const struct fv_table_report *report, struct fv_error *error)
{
    struct page p = {out, report->sheet};
    (void)error;
    write_facts(&p);
    write_table(&p);
    write_figure(&p);
    write_stages(&p);
    write_definitions(&p);
    return 0;
}
