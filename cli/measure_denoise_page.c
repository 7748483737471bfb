/* measure_denoise_page: report.html of `measure --table peres2023`: its Tables 3 and 4, ours beside the paper's. */
#include "cli/measure_table.h"

#include "cli/page.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct {
    const char *quantity, *name;
    int places;
} columns[] = {{"frame_ms", "ms", 1},        {"speedup", "speed-up", 2}, {"cpu_speedup", "by CPU time", 2}, {"rmse_percent", "RMSE, %", 2},
               {"rmse_fovea_percent", "RMSE of the fovea, %", 2}, {"ssim", "SSIM", 4}, {"psnr", "PSNR, dB", 2}};
enum { COLUMNS = sizeof columns / sizeof columns[0] };

/* The row's name up to its last slash. */
static size_t group_of(const char *row)
{
    const char *last = strrchr(row, '/');
    return last ? (size_t)(last - row) : strlen(row);
}

static void write_cell(struct fv_writer *out, const struct fv_sheet *sheet, const char *row, int c)
{
    double ours = fv_sheet_ours(sheet, row, columns[c].quantity), paper = fv_sheet_paper(sheet, row, columns[c].quantity);
    fv_writer_print(out, "<td class=\"n\">");
    if (!isnan(ours)) fv_writer_print(out, "%.*f", columns[c].places, ours);
    if (!isnan(paper)) fv_writer_print(out, "<br><small>%.*f</small>", columns[c].places, paper);
    fv_writer_print(out, "</td>");
}

static void write_rows(struct fv_writer *out, const struct fv_sheet *sheet)
{
    const char *before = "";
    for (const struct fv_cell *c = sheet->cell; c < sheet->cell + sheet->cells; c++) {
        if (strcmp(c->quantity, columns[0].quantity) != 0) continue;
        size_t group = group_of(c->row);
        if (strncmp(c->row, before, group + 1) != 0)
            fv_writer_print(out, "<tr class=\"group\"><th scope=\"colgroup\" colspan=\"%d\">%.*s</th></tr>\n", COLUMNS + 1, (int)group, c->row);
        before = c->row;
        fv_writer_print(out, "<tr>");
        fv_name_cell(out, c->row + group + 1);
        for (int i = 0; i < COLUMNS; i++) write_cell(out, sheet, c->row, i);
        fv_writer_print(out, "</tr>\n");
    }
}

int fv_table_page_peres2023(struct fv_writer *out, const struct fv_table_report *report, struct fv_error *error)
{
    static const char *const terms[][2] = {
        {"base", "4 paths a pixel, and the inner layer's iterations of the filter, everywhere."},
        {"nh2ld, nh3ld", "4, 3 and 2 paths by layer; the filter by two layers and by three."},
        {"nh3ld-p0.5", "Half of the outer layer's pixels left out. The paper has no such row."},
        {"unfiltered", "3 paths everywhere, no filter: a little slower than nh3ld. The paper has no such row."},
        {"nh3ld-history", "nh3ld, light accumulated over the frames that lead to each place. The paper has no such row."},
        {"Errors", "The left eye's, against 1024 paths a pixel without a filter, or as many as method.spp says. Fovea: within 3.3\xC2\xB0 of the gaze, which is straight ahead."},
        {"Places", "Along the scene's path; numbers are medians over them. At each all ways are rendered in turn, three frames each."},
        {"Scenes", "Sponza is the paper's, with a sun of ours. forest is ours, after its own; atrium is ours and stands for its Pink Room, without numbers beside it."},
        {"Paper", "Peres et al. 2023, on a GeForce RTX 2080; it does not say of which size its errors are."},
    };
    (void)error;
    fv_section_open(out, "Tables 3 and 4", "Time of both eyes' frames, and errors; the paper's small below ours.");
    fv_writer_print(out, "<div class=\"scroll\"><table class=\"rows\">\n<thead><tr><th></th>");
    for (int i = 0; i < COLUMNS; i++) fv_writer_print(out, "<th scope=\"col\" class=\"n\">%s</th>", columns[i].name);
    fv_writer_print(out, "</tr></thead>\n<tbody>\n");
    write_rows(out, report->sheet);
    fv_table_close(out);
    fv_section_close(out);
    fv_terms(out, "How it was measured", terms, sizeof terms / sizeof terms[0]);
    return 0;
}
