/* compare: how far a picture is from its reference, as `name value` lines. */
#include "cli/cli.h"

#include "platform/arena.h"
#include "platform/log.h"
#include "rt/measure/metrics.h"
#include "rt/scene/build.h"

#include <math.h>
#include <stdlib.h>

enum { FILE_BYTES_MAX = 1 << 28 };

/* Grey becomes three equal channels; alpha is skipped. What it takes stays to the end. */
static int read_picture(struct fv_metrics_picture *picture, const char *path, struct fv_error *error)
{
    char *file;
    size_t size;
    uint8_t *pixels;
    int width, height, channels;
    if (fv_file_read(path, FILE_BYTES_MAX, &file, &size, error)) return -1;
    int result =
        fv_image_decode((const uint8_t *)file, size, path, &pixels, &width, &height, &channels, error);
    free(file);
    if (result) return -1;
    if (channels < 3) {
        int64_t n = (int64_t)width * height;
        uint8_t *colour = fv_arena_take(fv_arena(), "pictures", (size_t)n * 3, 64);
        for (int64_t i = 0; i < 3 * n; i++) colour[i] = pixels[i / 3 * channels];
        free(pixels);
        pixels = colour;
        channels = 3;
    }
    *picture = (struct fv_metrics_picture){width, height, channels, (int64_t)width * channels, pixels};
    return 0;
}

static int read_both(struct fv_metrics_picture picture[2], const struct fv_arguments *a,
                     struct fv_error *error)
{
    const char *const *name = a->operand;
    if (a->operands < 2)
        return fv_error_set(error, "compare: name two pictures: foveola compare REFERENCE.png TEST.png");
    if (read_picture(&picture[0], name[0], error) || read_picture(&picture[1], name[1], error)) return -1;
    if (picture[0].width == picture[1].width && picture[0].height == picture[1].height) return 0;
    return fv_error_set(error, "%.200s: %d x %d pixels, must be %d x %d as %.200s is", name[1],
                        picture[1].width, picture[1].height, picture[0].width, picture[0].height, name[0]);
}

static void print_value(struct fv_writer *out, double value, const char *metric, const char *joint,
                        const char *zone)
{
    fv_writer_print(out, "%s%s%s ", metric, joint, zone);
    if (isnan(value)) fv_writer_print(out, "nan\n"); /* whatever its sign */
    else fv_writer_print(out, "%.6f\n", value);
}

static void print_zones(struct fv_writer *out, const char *metric, const double value[FV_ZONES])
{
    for (int z = 0; z < FV_ZONE_ALL; z++) print_value(out, value[z], metric, "_", fv_zones[z].name);
}

/* In the order of measure.csv's columns, and then what it has no columns for. */
static void print_errors(struct fv_writer *out, const struct fv_errors *e)
{
    const struct {
        const char *name;
        const double *value;
    } rest[] = {{"rmse", e->rmse}, {"ssim", e->ssim}, {"flip", e->flip}};
    print_value(out, e->psnr[FV_ZONE_ALL], "psnr", "_", fv_zones[FV_ZONE_ALL].name);
    print_zones(out, "psnr", e->psnr);
    for (int i = 0; i < 3; i++) print_value(out, rest[i].value[FV_ZONE_ALL], rest[i].name, "", "");
    for (int i = 0; i < 3; i++) print_zones(out, rest[i].name, rest[i].value);
}

int fv_verb_compare(const struct fv_arguments *a)
{
    static struct fv_workers workers;
    static struct fv_writer out;
    static struct fv_errors errors;
    struct fv_metrics_picture picture[2];
    struct fv_error error;
    if (read_both(picture, a, &error)) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    int width = picture[0].width, height = picture[0].height;
    double gaze_x = a->has_gaze ? a->gaze_px[0] : 0.5 * width;
    double gaze_y = a->has_gaze ? a->gaze_px[1] : 0.5 * height;
    double degree = M_PI / 180;
    double focal_px = a->fov_deg > 0 ? 0.5 * width / tan(0.5 * a->fov_deg * degree) : a->ppd / degree;
    uint8_t *zone = fv_arena_take(fv_arena(), "zones", (size_t)width * (size_t)height, 64);
    struct fv_metrics *metrics = fv_metrics_open(width, height, a->ppd);
    fv_zones_of_picture(width, height, gaze_x, gaze_y, focal_px, zone);
    fv_workers_start(&workers, fv_threads_cores());
    fv_metrics_compare(metrics, &workers, &picture[0], &picture[1], zone, &errors);
    if (fv_writer_open(&out, "-", &error)) return FV_EXIT_NOT_HELD;
    print_errors(&out, &errors);
    return fv_writer_close(&out, &error) ? FV_EXIT_NOT_HELD : FV_EXIT_DONE;
}
