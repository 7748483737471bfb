/* table_kim2021_samples: where extra samples go: by two curves of tolerance (Figure 7 of Kim, Ko and Ihm
 * 2021), and by selective against selective-only (Figure 8); see table_kim2021.c. The left eye, at fixed
 * places of the path. Numbers are of the central region's pixels; maps of it, and its pictures, are written
 * beside the part. */
#include "rt/measure/table_kim2021.h"

#include "platform/arena.h"
#include "rt/measure/picture.h"
#include "rt/pass/selective.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define NONE ((double)NAN)

static struct bench {
    const struct fv_table_bench *of;
    struct fv_vantage vantage;
    struct fv_vantage_side foveated, uniform;
    int width, height, x0, y0, x1, y1; /* of the picture; and of the central region, the last one excluded */
    uint8_t *map;                      /* its colours */
    uint16_t *count;
} bench;

static void open_bench(const struct fv_table_bench *of, int places)
{
    fv_vantage_open(&bench.vantage, of->config, of->tracer, of->workers, of->io, places);
    bench.of = of;
    bench.width = (int)of->config->display_width;
    bench.height = (int)of->config->display_height;
    size_t pixels = (size_t)bench.width * (size_t)bench.height;
    bench.map = fv_arena_take(fv_arena(), "map of samples", 3 * pixels, 64);
    bench.count = fv_arena_take(fv_arena(), "counted samples", pixels * sizeof *bench.count, 64);
}

static void open_side(struct fv_vantage_side *side, const char *method)
{
    side->config = *bench.of->config;
    fv_vantage_side_open(&bench.vantage, side, method);
}

/* ---- counting ---- */

static void count_tile(struct fv_frame *f, const struct fv_tile *tile)
{
    uint16_t samples[FV_TILE * FV_TILE];
    fv_refine_counts(f, tile, samples);
    for (int y = 0; y < FV_TILE && tile->y0 + y < bench.height; y++)
        for (int x = 0; x < FV_TILE && tile->x0 + x < bench.width; x++)
            bench.count[(tile->y0 + y) * bench.width + tile->x0 + x] = samples[y * FV_TILE + x];
}

static void count(struct fv_vantage_side *side)
{
    struct fv_frame *f = &side->own.loop.frame;
    fv_zones_of_view(&f->view[0], bench.vantage.zone);
    for (int i = 0; i < f->tiles_x * f->tiles_y; i++) {
        struct fv_tile tile = fv_tile_at(f, i, 0);
        count_tile(f, &tile);
    }
    bench.x0 = bench.width, bench.y0 = bench.height, bench.x1 = bench.y1 = 0;
    for (int y = 0; y < bench.height; y++)
        for (int x = 0; x < bench.width; x++) {
            if (bench.vantage.zone[y * bench.width + x] >= FV_ZONE_FAR) continue;
            if (x < bench.x0) bench.x0 = x;
            if (y < bench.y0) bench.y0 = y;
            if (x >= bench.x1) bench.x1 = x + 1;
            if (y >= bench.y1) bench.y1 = y + 1;
        }
}

/* Extra samples of all, and a central pixel's and each zone's mean; and all primary rays, which are one a
 * pixel more. */
static void add_cells(struct fv_sheet *sheet, const char *row, const struct fv_frame_record *r, double paper)
{
    double sum[FV_ZONE_ALL] = {0}, pixels[FV_ZONE_ALL] = {0}, extra = 0, central = 0;
    char quantity[40];
    for (int i = 0; i < bench.width * bench.height; i++) {
        sum[bench.vantage.zone[i]] += bench.count[i];
        pixels[bench.vantage.zone[i]]++;
    }
    for (int z = 0; z < FV_ZONE_FAR; z++) extra += sum[z], central += pixels[z];
    fv_sheet_add(sheet, row, "primary_rays", "rays", NONE, (double)r->rays[FV_RAY_PRIMARY]);
    fv_sheet_add(sheet, row, "extra_samples", "samples", NONE, extra + sum[FV_ZONE_FAR]);
    fv_sheet_add(sheet, row, "extra_per_pixel", "samples", paper, central > 0 ? extra / central : NONE);
    for (int z = 0; z < FV_ZONE_FAR; z++) {
        snprintf(quantity, sizeof quantity, "extra_per_pixel_%s", fv_zones[z].name);
        fv_sheet_add(sheet, row, quantity, "samples", NONE, pixels[z] > 0 ? sum[z] / pixels[z] : NONE);
    }
}

/* ---- pictures ---- */

/* From violet at 0 to red at 1. */
static void rainbow(double share, uint8_t rgb[3])
{
    static const double violet = 280.0 / 60; /* of a hue of 6 */
    double hue = violet * (1 - fmin(fmax(share, 0), 1));
    for (int c = 0; c < 3; c++) {
        double from = fabs(fmod(hue + (c == 0 ? 0 : c == 1 ? 4 : 2), 6) - 3); /* 3 at the channel's own hue */
        rgb[c] = (uint8_t)lround(255 * fmin(fmax(from - 1, 0), 1));
    }
}

static struct fv_metrics_picture central(const uint8_t *pixel, int step, int64_t stride)
{
    return (struct fv_metrics_picture){bench.x1 - bench.x0, bench.y1 - bench.y0, step, stride,
                                       pixel + bench.y0 * stride + bench.x0 * step};
}

static void path_of(const char *name, const char *end, char path[FV_PATH_MAX])
{
    snprintf(path, FV_PATH_MAX, "%.900s/%s.%s", bench.of->folder, name, end);
}

/* From black where there is none, by the logarithm from one to `most`. Returns 0, or -1 with the error set.
 */
static int write_map(const char *name, int most)
{
    char path[FV_PATH_MAX];
    memset(bench.map, 0, 3 * (size_t)bench.width * (size_t)bench.height);
    for (int i = 0; i < bench.width * bench.height; i++)
        if (bench.count[i]) rainbow(log(bench.count[i]) / log(most), bench.map + 3 * i);
    struct fv_metrics_picture picture = central(bench.map, 3, 3 * (int64_t)bench.width);
    path_of(name, "png", path);
    return picture.width > 0 ? fv_picture_png(&picture, path, bench.of->error) : 0;
}

static int write_picture(const char *name, struct fv_vantage_side *side)
{
    char path[FV_PATH_MAX];
    struct fv_metrics_picture all = fv_picture_present(&side->own.loop.frame, bench.of->workers);
    struct fv_metrics_picture picture = central(all.pixel, all.step, all.stride_bytes);
    path_of(name, "jpg", path);
    return picture.width > 0 ? fv_picture_jpeg(&picture, path, bench.of->error) : 0;
}

static bool stopped(const char *what, double done)
{
    const struct fv_sweep_io *io = bench.of->io;
    if (io->stopped(io->context)) return true;
    io->progress(io->context, what, done);
    return false;
}

static void set_numbers(struct fv_list *list, const double *value)
{
    memcpy(list->value, value, (size_t)list->count * sizeof *value);
}

/* ---- Figure 7 ---- */

enum { CURVES = 2, PLACES = 3 };
static const struct {
    const char *name;
    double shape[4];
} curves[CURVES] = {{"low", {1, 2, 0.5, 12}}, {"high", {9, 10, 1.5, 20}}};

static void add_curve(struct fv_sheet *sheet, const char *row)
{
    const struct fv_selective *s = &bench.foveated.own.loop.frame.selective;
    char quantity[40];
    for (int e = 0; e <= 30; e++) {
        snprintf(quantity, sizeof quantity, "tau_fov_at_%d", e);
        fv_sheet_add(sheet, row, quantity, "", NONE, (double)fv_tolerance_at(&s->tolerance, (float)e));
    }
}

int fv_kim2021_tolerance(const char *scene, const struct fv_table_bench *of, struct fv_sheet *sheet)
{
    static const double samples[4] = {9, 4, 2, 1};
    char row[64], name[64];
    open_bench(of, PLACES);
    open_side(&bench.foveated, "selective");
    set_numbers(&bench.foveated.config.selective_samples, samples);
    fv_vantage_go(&bench.vantage, 0);
    for (int c = 0; c < CURVES; c++) {
        if (stopped("samples by tolerance", (double)c / CURVES)) return 1;
        set_numbers(&bench.foveated.config.selective_shape, curves[c].shape);
        struct fv_frame_record r = fv_vantage_arrive(&bench.vantage, &bench.foveated, 1);
        count(&bench.foveated);
        snprintf(row, sizeof row, "%s/tolerance/%s", scene, curves[c].name);
        add_cells(sheet, row, &r, NONE);
        add_curve(sheet, row);
        snprintf(name, sizeof name, "figure7-%s", curves[c].name);
        if (write_map(name, 36)) return -1;
    }
    return write_picture("figure7", &bench.foveated);
}

/* ---- Figure 8 ---- */

enum { VIEWS = 2, BOTH = 2 };

/* Of the paper's Interior, for each of its views, a pixel's mean. */
static const double printed[VIEWS][BOTH] = {{1.086, 3.182}, {0.617, 1.753}};

static int measure_view(const char *scene, int view, struct fv_sheet *sheet)
{
    static const char *const names[BOTH] = {"foveated", "selective"};
    char row[64], name[64];
    fv_vantage_go(&bench.vantage, view);
    for (int i = 0; i < BOTH; i++) {
        struct fv_vantage_side *side = i ? &bench.uniform : &bench.foveated;
        struct fv_frame_record r = fv_vantage_arrive(&bench.vantage, side, 1);
        count(side);
        snprintf(row, sizeof row, "%s/view%d/%s", scene, view + 1, names[i]);
        add_cells(sheet, row, &r, printed[view][i]);
        snprintf(name, sizeof name, "figure8-%d-%s", view + 1, names[i]);
        if (write_map(name, 16)) return -1;
    }
    snprintf(name, sizeof name, "figure8-%d", view + 1);
    return write_picture(name, &bench.foveated);
}

int fv_kim2021_density(const char *scene, const struct fv_table_bench *of, struct fv_sheet *sheet)
{
    static const double samples[4] = {4, 3, 2, 1};
    open_bench(of, VIEWS);
    open_side(&bench.foveated, "selective");
    open_side(&bench.uniform, "selective-uniform");
    set_numbers(&bench.foveated.config.selective_samples, samples);
    for (int view = 0; view < VIEWS; view++) {
        if (stopped("samples by region", (double)view / VIEWS)) return 1;
        if (measure_view(scene, view, sheet)) return -1;
    }
    return 0;
}
