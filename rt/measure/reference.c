/* reference: see reference.h. */
#include "rt/measure/reference.h"

#include "platform/arena.h"
#include "rt/measure/flicker.h"
#include "rt/measure/picture.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PICTURES = FV_SWEEP_SEGMENTS + FV_SWEEP_SEGMENTS / 2 };

static const char about_name[] = "about.txt",
                  about_form[] = "foveola-reference 1\nkey %31s\nsamples %d\nagreement %lf\n";

void fv_reference_paths(struct fv_config *c, int spp)
{
    c->denoise_p = 0;
    c->denoise_history = 0;
    snprintf(c->denoise_despeckle, sizeof c->denoise_despeckle, "off");
    for (int n = 0; n < c->denoise_spp.count; n++) c->denoise_spp.value[n] = spp;
    for (int n = 0; n < c->denoise_iterations.count; n++) c->denoise_iterations.value[n] = 0;
}

/* Of whichever method it is by. */
static void set_samples(struct fv_config *c, int spp)
{
    c->method_spp = spp;
    fv_reference_paths(c, spp);
}

void fv_reference_open(struct fv_reference *r, const struct fv_config *config, bool by_paths, const struct fv_tracer *tracer,
                       struct fv_workers *workers)
{
    struct fv_arena *arena = fv_arena();
    struct fv_frame *f = &r->loop.frame;
    *r = (struct fv_reference){.config = *config, .workers = workers};
    r->config.display_eyes = 1;
    set_samples(&r->config, 1);
    fv_frame_size(f, &r->config);
    fv_plan_make(&r->plan, fv_method_find(by_paths ? "denoise" : "full"), tracer->data, &r->config, f);
    fv_loop_open(&r->loop, &r->config, &r->plan, tracer, workers, &r->session, 1);
    size_t pixels = (size_t)f->width * (size_t)f->height;
    for (int s = 0; s < FV_SWEEP_SEGMENTS; s++) {
        struct fv_reference_segment *to = &r->segment[s];
        for (int i = fv_reference_flickers(s) ? 0 : FV_REFERENCE_LAST; i < FV_REFERENCE_PICTURES; i++) {
            to->picture[i] = (struct fv_metrics_picture){f->width, f->height, 3, 3 * (int64_t)f->width,
                                                         fv_arena_take(arena, "reference", 3 * pixels, 64)};
            if (fv_reference_flickers(s))
                to->inverse_depth[i] =
                    fv_arena_take(arena, "exact depth", (size_t)(f->stride * f->rows) * 4, 64);
        }
        to->zone = fv_arena_take(arena, "zones", pixels, 64);
    }
}

/* 1 and the values where the folder has a reference of the key, 0 where it has none; -1: of another. */
static int read_about(const char *folder, const char *key, int *spp, double *agreement_db,
                      struct fv_error *error)
{
    char path[FV_PATH_MAX + 32], found[32], *text;
    size_t size;
    snprintf(path, sizeof path, "%s/%s", folder, about_name);
    if (!fv_file_exists(path)) return 0;
    if (fv_file_read(path, 4096, &text, &size, error)) return -1;
    int n = sscanf(text, about_form, found, spp, agreement_db);
    free(text);
    if (n != 3 || *spp < 1 || *spp > FV_REFERENCE_SPP_MAX)
        return fv_error_set(
            error, "%s: not a reference of this version's measure; remove the folder or give another --out",
            path);
    if (strcmp(found, key) == 0) return 1;
    return fv_error_set(error,
                        "%s: the reference of another scene, version or other settings; remove the "
                        "folder or give another --out",
                        folder);
}

int fv_reference_check(const char *folder, const char *key, struct fv_error *error)
{
    int spp;
    double agreement_db;
    return read_about(folder, key, &spp, &agreement_db, error) < 0 ? -1 : 0;
}

static int write_about(const struct fv_reference *r, const char *folder, const char *key,
                       struct fv_error *error)
{
    static struct fv_writer out;
    char path[FV_PATH_MAX + 32];
    snprintf(path, sizeof path, "%s/%s", folder, about_name);
    if (fv_writer_open(&out, path, error)) return -1;
    fv_writer_print(&out, "foveola-reference 1\nkey %s\nsamples %d\nagreement %.9g\n", key, r->spp,
                    r->agreement_db);
    return fv_writer_close(&out, error);
}

/* Exact depth at each pixel's centre, into the plane that stands as the frame's FV_CACHE. */
static int depth_tile(struct fv_frame *f, const struct fv_tile *tile)
{
    struct fv_worker_scratch *s = &f->scratch[tile->worker];
    float *depth = f->buffer[FV_CACHE][0];
    fv_tile_place(f, tile, fv_tile_inside(f, tile));
    f->kernels->trace(f->tracer, &f->view[0], &s->samples, 0, s->rays);
    for (int i = 0; i < s->samples.count; i++)
        depth[(int64_t)s->samples.y[i] * f->stride + (int64_t)s->samples.x[i]] = s->samples.inverse_depth[i];
    return s->samples.count;
}

static const struct fv_pass depth_pass = {.name = "depth", .writes = FV_BIT(FV_CACHE), .run = depth_tile};

/* Returns the rays that it took. */
static double render(struct fv_reference *r, const struct fv_sweep_frame *frame, int spp)
{
    struct fv_frame_record record;
    set_samples(&r->config, spp);
    fv_loop_restart(&r->loop); /* the same random numbers whatever was rendered before */
    fv_loop_frame(&r->loop, &frame->head, frame->gaze, frame->uncertainty_deg, frame->t_ns, &record);
    double rays = 0;
    for (int k = 0; k < FV_RAY_MARCH_STEPS; k++) rays += (double)record.rays[k];
    return rays;
}

/* The loop's picture, packed. */
static void take_picture(struct fv_reference *r, uint8_t *rgb)
{
    struct fv_metrics_picture picture = fv_picture_present(&r->loop.frame, r->workers);
    fv_picture_pack(&picture, rgb);
}

/* Doubles the samples of the first picture until they no longer change it. 1: stopped. */
static int settle_samples(struct fv_reference *r, const struct fv_sweep_frame *frame,
                          struct fv_metrics *metrics, bool (*stopped)(void *), void *context)
{
    struct fv_metrics_picture *half = &r->segment[1].picture[FV_REFERENCE_BEFORE]; /* not rendered yet */
    struct fv_metrics_picture *all = &r->segment[0].picture[FV_REFERENCE_LAST];
    struct fv_errors errors;
    double rays = render(r, frame, FV_REFERENCE_SPP_MIN / 4) * PICTURES / (FV_REFERENCE_SPP_MIN / 4);
    take_picture(r, (uint8_t *)all->pixel);
    for (r->spp = FV_REFERENCE_SPP_MIN / 2;; r->spp *= 2) {
        if (stopped(context)) return 1;
        memcpy((uint8_t *)half->pixel, all->pixel, (size_t)(all->stride_bytes * all->height));
        render(r, frame, r->spp);
        take_picture(r, (uint8_t *)all->pixel);
        fv_metrics_compare(metrics, r->workers, all, half, r->segment[0].zone, &errors);
        r->agreement_db = fmin(errors.psnr[FV_ZONE_ALL], 99);
        bool settled = r->agreement_db >= FV_REFERENCE_DB && r->spp >= FV_REFERENCE_SPP_MIN;
        if (settled || 2 * r->spp > FV_REFERENCE_SPP_MAX || 2 * r->spp * rays > FV_REFERENCE_RAYS) return 0;
    }
}

static void picture_path(char *path, size_t size, const char *folder, int segment, int which)
{
    snprintf(path, size, "%s/%d-%s.png", folder, segment + 1, which == FV_REFERENCE_LAST ? "last" : "before");
}

/* Pictures that nothing says the key of. */
static void forget_pictures(const char *folder)
{
    char path[FV_PATH_MAX + 48];
    for (int s = 0; s < FV_SWEEP_SEGMENTS; s++)
        for (int i = 0; i < FV_REFERENCE_PICTURES; i++) {
            picture_path(path, sizeof path, folder, s, i);
            remove(path);
        }
}

static int load_or_render(struct fv_reference *r, const char *folder, int segment, int which,
                          const struct fv_sweep_frame *frame, struct fv_error *error)
{
    struct fv_metrics_picture *picture = &r->segment[segment].picture[which];
    char path[FV_PATH_MAX + 48];
    picture_path(path, sizeof path, folder, segment, which);
    if (fv_file_exists(path))
        return fv_picture_read(path, picture->width, picture->height, (uint8_t *)picture->pixel, error);
    render(r, frame, r->spp);
    take_picture(r, (uint8_t *)picture->pixel);
    return fv_picture_png(picture, path, error);
}

/* Zones; exact depth and the reference's own flicker. */
static void measure_segment(struct fv_reference *r, int segment, const struct fv_sweep_frame *frames)
{
    struct fv_reference_segment *s = &r->segment[segment];
    struct fv_frame *f = &r->loop.frame;
    struct fv_view before;
    render(r, &frames[FV_REFERENCE_LAST], 1);
    fv_zones_of_view(&f->view[0], s->zone);
    if (!fv_reference_flickers(segment)) return;
    for (int i = 0; i < FV_REFERENCE_PICTURES; i++) {
        before = f->view[0];
        render(r, &frames[i], 1);
        f->buffer[FV_CACHE][0] = s->inverse_depth[i];
        fv_pass_run(&depth_pass, f, r->workers);
    }
    f->buffer[FV_CACHE][0] = NULL;
    fv_map_set(&s->map, &f->view[0], &before);
    s->flicker =
        fv_flicker(&s->picture[FV_REFERENCE_LAST], &s->picture[FV_REFERENCE_BEFORE], &s->map,
                   s->inverse_depth[FV_REFERENCE_LAST], s->inverse_depth[FV_REFERENCE_BEFORE], f->stride);
}

int fv_reference_make(struct fv_reference *r, const char *folder, const char *key,
                      const struct fv_sweep_frame (*frames)[FV_REFERENCE_PICTURES],
                      struct fv_metrics *metrics, bool (*stopped)(void *context),
                      void (*progress)(void *context, const char *what, double done), void *context,
                      struct fv_error *error)
{
    char what[64], path[FV_PATH_MAX + 48];
    int done = 0;
    if (fv_folder_make(folder, error)) return -1;
    int state = read_about(folder, key, &r->spp, &r->agreement_db, error);
    if (state < 0) return -1;
    if (state == 0) {
        progress(context, "how many samples the reference needs", 0);
        if (settle_samples(r, &frames[0][FV_REFERENCE_LAST], metrics, stopped, context)) return 1;
        forget_pictures(folder);
        if (write_about(r, folder, key, error)) return -1;
        picture_path(path, sizeof path, folder, 0, FV_REFERENCE_LAST);
        if (fv_picture_png(&r->segment[0].picture[FV_REFERENCE_LAST], path, error)) return -1;
    }
    for (int s = 0; s < FV_SWEEP_SEGMENTS; s++) {
        for (int i = fv_reference_flickers(s) ? 0 : FV_REFERENCE_LAST; i < FV_REFERENCE_PICTURES;
             i++, done++) {
            if (stopped(context)) return 1;
            snprintf(what, sizeof what, "reference, %d samples a pixel: picture %d of %d", r->spp, done + 1,
                     PICTURES);
            progress(context, what, (double)done / PICTURES);
            if (load_or_render(r, folder, s, i, &frames[s][i], error)) return -1;
        }
        measure_segment(r, s, frames[s]);
    }
    return 0;
}
