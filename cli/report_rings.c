/* report_rings: what samples cost and which tiles were cut, by eccentricity. */
#include "cli/columns.h"
#include "cli/markup.h"
#include "cli/page.h"
#include "cli/plot.h"
#include "cli/profile.h"
#include "cli/report_sections.h"

#include <math.h>
#include <stdio.h>

/* A number of each ring, NaN where it has none. */
typedef double ring_value(const struct fv_session *session, const struct fv_ring *ring);

static double ns_per_unit(const struct fv_session *s, const struct fv_ring *ring)
{
    (void)s;
    return fv_ring_ns_per_unit(ring);
}

static double cost_percent(const struct fv_session *s, const struct fv_ring *ring)
{
    double sum = 0;
    for (int i = 0; i < FV_RINGS; i++) sum += s->ring[i].cpu_ns;
    return sum > 0 ? 100 * ring->cpu_ns / sum : (double)NAN;
}

static double cut_percent(const struct fv_session *s, const struct fv_ring *ring)
{
    (void)s;
    double tiles = (double)ring->tiles + (double)ring->cut;
    return tiles > 0 ? 100 * (double)ring->cut / tiles : (double)NAN;
}

/* A bar for each ring; nothing where no ring has a number. */
static void draw_rings(struct fv_report_page *page, const char *caption, ring_value *value, const char *class)
{
    const struct fv_session *s = page->session;
    int rings = fv_rings(s);
    double most = 0;
    for (int i = 0; i < rings; i++) most = fmax(most, value(s, &s->ring[i]));
    if (!(most > 0) || isinf(most)) return;
    struct fv_plot plot = {
        .out = page->out, .x = {0, rings * FV_RING_DEG, false}, .y = {0, 1.1 * most, false}};
    fv_plot_open(&plot, &(struct fv_plot_text){.caption = caption,
                                               .label = caption,
                                               .x_name = "degrees from the gaze",
                                               .height_px = 180,
                                               .narrow = true});
    fv_path_open(&plot, class);
    for (int i = 0; i < rings; i++) {
        double y = value(s, &s->ring[i]);
        if (y > 0) fv_path_box(&plot, (i + 0.06) * FV_RING_DEG, (i + 0.94) * FV_RING_DEG, 0, y);
    }
    fv_path_close(&plot);
    fv_plot_close(&plot);
}

void fv_report_eccentricity(struct fv_report_page *page)
{
    const struct fv_session *s = page->session;
    double cpu_ns = 0;
    for (int i = 0; i < FV_RINGS; i++) cpu_ns += s->ring[i].cpu_ns;
    if (!(cpu_ns > 0)) return;
    fv_section_open(
        page->out, "Cost against eccentricity",
        "Stages that trace samples, by the angle of their tiles from the gaze; all frames together.");
    draw_rings(page, "CPU time of a sample, with all its rays (ns)", ns_per_unit, "bars");
    draw_rings(page, "Share of the CPU time (%)", cost_percent, "bars");
    fv_section_close(page->out);
}

/* Stages that were cut, and in how many frames. */
static void write_cut_stages(struct fv_report_page *page)
{
    const struct fv_session *s = page->session;
    const char *before = "<p class=\"note\">By stage: ";
    for (int stage = 0; stage < fv_stages(s); stage++) {
        int64_t frames = 0;
        for (int64_t i = 0; i < fv_recorded(s); i++)
            frames += s->record[i].cut && s->record[i].decision.done[stage] >= 0;
        if (frames == 0) continue;
        fv_writer_print(page->out, "%s", before);
        fv_html_text(page->out, fv_stage_name(s, stage));
        fv_writer_print(page->out, " in %lld frame%s", (long long)frames, frames == 1 ? "" : "s");
        before = ", ";
    }
    if (before[0] == ',') fv_writer_print(page->out, ".</p>\n");
}

void fv_report_cuts(struct fv_report_page *page)
{
    const struct fv_session *s = page->session;
    struct fv_summary tiles = fv_column_summary(s, &fv_columns[FV_COLUMN_CUT_TILES]);
    int64_t recorded = 0;
    int nearest = 0;
    char note[400];
    if (s->cut_frames < 1) return;
    for (int64_t i = 0; i < fv_recorded(s); i++) recorded += s->record[i].cut;
    int n = snprintf(note, sizeof note,
                     "%lld of %lld frames (%s) stopped work in the periphery at the deadline; what was left "
                     "shows the frame before, moved with the head, or the support image.",
                     (long long)s->cut_frames, (long long)s->frames,
                     fv_shown_percent((double)s->cut_frames / (double)s->frames).text);
    if (recorded > 0 && tiles.max > 0)
        n += snprintf(note + n, sizeof note - (size_t)n,
                      " Such a frame left out %s tiles on average, %.0f at most, of all stages together.",
                      fv_shown_fixed(tiles.mean * (double)fv_recorded(s) / (double)recorded, 1).text,
                      tiles.max);
    while (nearest < fv_rings(s) && s->ring[nearest].cut == 0) nearest++;
    if (nearest < fv_rings(s))
        snprintf(note + n, sizeof note - (size_t)n,
                 " None of those to be sampled was nearer to the gaze than %.4g degrees.",
                 nearest * FV_RING_DEG);
    fv_section_open(page->out, "What was cut", note);
    write_cut_stages(page);
    draw_rings(page, "Tiles to be sampled that were cut (% of those at that angle)", cut_percent, "cuts");
    fv_section_close(page->out);
}
