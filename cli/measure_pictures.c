/* measure_pictures: pictures of chosen levels and how they differ from the reference, embedded in the page.
 * The files' grey levels (FLIP) become colours in the page, by a filter. */
#include "cli/measure_sections.h"

#include "cli/embed.h"
#include "rt/measure/picture.h"

#include <stdio.h>
#include <string.h>

/* The picture with its description, or nothing where there is none. */
static void write_image(struct fv_measure_page *page, const char *class, const char *name, const char *what)
{
    page->failed |= fv_embed_picture(page->out, page->report->pictures, name, class, what, page->error) != 0;
}

static bool picture_exists(const struct fv_measure_page *page, const char *name)
{
    return fv_embed_exists(page->report->pictures, name);
}

struct names {
    char picture[160], difference[160];
};
static struct names names_of(const struct fv_measure_row *row)
{
    struct names names;
    snprintf(names.picture, sizeof names.picture, "%s-%s-%d.jpg", row->scene, row->method, row->level);
    snprintf(names.difference, sizeof names.difference, "%s-%s-%d-difference.jpg", row->scene, row->method,
             row->level);
    return names;
}

/* Of a method the first, middle and last level, of full the first; fewer where they are the same. */
static int choose(const struct fv_measure_page *page, const struct fv_measure_method *method, int chosen[3])
{
    const int last = method->end - 1, candidates[] = {method->first, (method->first + last) / 2, last};
    int most = strcmp(method->name, "full") == 0 ? 1 : 3, count = 0;
    for (int i = 0; i < most; i++) {
        if (count > 0 && chosen[count - 1] == candidates[i]) continue;
        if (picture_exists(page, names_of(&page->row[candidates[i]]).picture))
            chosen[count++] = candidates[i];
    }
    return count;
}

static void write_level(struct fv_measure_page *page, const struct fv_measure_row *r)
{
    struct names names = names_of(r);
    char what[160];
    fv_writer_print(page->out, "<figure>");
    snprintf(what, sizeof what, "%s level %d", r->method, r->level);
    write_image(page, "shot", names.picture, what);
    snprintf(what, sizeof what, "How %s level %d differs from the reference", r->method, r->level);
    write_image(page, "shot flip", names.difference, what);
    fv_writer_print(page->out,
                    "<figcaption><b>level %d</b> · %s ms · %s dB fovea, %s dB all</figcaption></figure>\n",
                    r->level, fv_shown_fixed(r->frame_ms.value, 2).text,
                    fv_shown_infinite(r->psnr[FV_ZONE_FOVEA].value, 1).text,
                    fv_shown_infinite(r->psnr[FV_ZONE_ALL].value, 1).text);
}

/* The scale of FLIP's own pictures (matplotlib's magma, at eighths). */
enum { COLOURS = 9 };
static const unsigned char colours[COLOURS][3] = {{0, 0, 4},      {29, 17, 71},    {81, 18, 124},
                                                  {130, 38, 129}, {182, 54, 121},  {230, 81, 100},
                                                  {251, 136, 97}, {254, 194, 135}, {252, 253, 191}};

void fv_measure_flip_filter(struct fv_measure_page *page)
{
    fv_writer_print(page->out, "<svg class=\"shapes\" width=\"0\" height=\"0\" aria-hidden=\"true\"><filter "
                               "id=\"flip\" color-interpolation-filters=\"sRGB\"><feComponentTransfer>");
    for (int c = 0; c < 3; c++) {
        fv_writer_print(page->out, "<feFunc%c type=\"table\" tableValues=\"", "RGB"[c]);
        for (int i = 0; i < COLOURS; i++)
            fv_writer_print(page->out, "%s%.3f", i ? " " : "", colours[i][c] / 255.0);
        fv_writer_print(page->out, "\"/>");
    }
    fv_writer_print(page->out, "</feComponentTransfer></filter></svg>\n");
}

static void write_scale(struct fv_measure_page *page)
{
    fv_writer_print(page->out, "<div class=\"scale\"><i style=\"background:linear-gradient(90deg");
    for (int i = 0; i < COLOURS; i++)
        fv_writer_print(page->out, ",rgb(%d,%d,%d)", colours[i][0], colours[i][1], colours[i][2]);
    fv_writer_print(page->out,
                    ")\"></i><span>0</span><span>FLIP: visible difference</span><span>%.2g and more</span></div>\n",
                    (double)fv_difference_white);
}

void fv_measure_pictures(struct fv_measure_page *page)
{
    char name[160];
    int total = 0, chosen[3];
    for (int k = 0; k < page->methods; k++) total += choose(page, &page->method[k], chosen);
    if (total == 0) return;
    fv_section_open(page->out, "Pictures",
                    "Some levels as they look, and beside each where it differs from the reference: black "
                    "where nobody would see a difference, bright where everybody would.");
    fv_writer_print(page->out, "<div class=\"gallery\"><div class=\"reference\"><figure>");
    snprintf(name, sizeof name, "%s-reference.jpg", page->row[0].scene);
    write_image(page, "shot", name, "Reference");
    fv_writer_print(page->out, "<figcaption><b>%s</b></figcaption></figure>\n",
                    picture_exists(page, name) ? "reference" : "no picture of the reference");
    write_scale(page);
    fv_writer_print(page->out, "</div><div>\n");
    for (int k = 0; k < page->methods && !page->failed; k++) {
        int count = choose(page, &page->method[k], chosen);
        if (count == 0) continue;
        fv_writer_print(page->out, "<h3>");
        fv_measure_name(page, &page->method[k]);
        fv_writer_print(page->out, "</h3>\n<div class=\"shots\">\n");
        for (int i = 0; i < count && !page->failed; i++) write_level(page, &page->row[chosen[i]]);
        fv_writer_print(page->out, "</div>\n");
    }
    fv_writer_print(page->out, "</div></div>\n");
    fv_section_close(page->out);
}
