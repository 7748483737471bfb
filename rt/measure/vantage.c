/* vantage: see vantage.h. */
#include "rt/measure/vantage.h"

#include "platform/arena.h"
#include "rt/measure/picture.h"

#include <math.h>
#include <string.h>

void fv_vantage_open(struct fv_vantage *v, const struct fv_config *config, const struct fv_tracer *tracer,
                     struct fv_workers *workers, const struct fv_sweep_io *io, int places)
{
    size_t pixels = (size_t)config->display_width * (size_t)config->display_height;
    *v = (struct fv_vantage){.config = config, .tracer = tracer, .workers = workers, .io = io};
    v->places = places < FV_VANTAGE_PLACES_MAX ? places : FV_VANTAGE_PLACES_MAX;
    v->kept = fv_arena_take(fv_arena(), "kept picture", 3 * pixels, 64);
    v->zone = fv_arena_take(fv_arena(), "zones", pixels, 64);
}

void fv_vantage_side_open(const struct fv_vantage *v, struct fv_vantage_side *side, const char *method)
{
    fv_contender_plan(&side->own, fv_method_find(method), &side->config, v->tracer);
    fv_contender_open(&side->own, &side->config, v->tracer, v->workers);
}

void fv_vantage_truth_open(const struct fv_vantage *v, struct fv_vantage_side *side, int spp)
{
    side->config = *v->config;
    side->config.display_eyes = 1;
    side->config.method_spp = spp;
    fv_vantage_side_open(v, side, "full");
}

void fv_vantage_go(struct fv_vantage *v, int place)
{
    const struct fv_config *c = v->config;
    int64_t period_ns = llround(1e9 / c->budget_hz);
    double lead_s = FV_VANTAGE_LEAD / c->budget_hz, apart_s = fmax(c->scene_path_seconds / v->places, lead_s);
    int64_t at_ns = llround(1e9 * fmax((place + 0.5) * apart_s, place * apart_s + lead_s));
    for (int n = 0; n < FV_VANTAGE_LEAD; n++) {
        struct fv_sweep_frame *f = &v->frame[n];
        double gaze[2][3], uncertainty_deg;
        *f = (struct fv_sweep_frame){.t_ns = at_ns - (FV_VANTAGE_LEAD - 1 - n) * period_ns};
        v->io->latch(v->io->context, f->t_ns, &f->head, gaze, &uncertainty_deg);
        double aside = v->drift_deg_s * 1e-9 * (double)(f->t_ns - at_ns) * M_PI / 180;
        for (int e = 0; e < 2; e++)
            memcpy(f->gaze[e], (double[3]){sin(aside), 0, -cos(aside)}, sizeof f->gaze[e]);
    }
}

void fv_vantage_render(struct fv_vantage *v, struct fv_vantage_side *side, int n,
                       struct fv_frame_record *record)
{
    const struct fv_sweep_frame *f = &v->frame[n];
    fv_loop_frame(&side->own.loop, &f->head, f->gaze, f->uncertainty_deg, f->t_ns, record);
}

struct fv_frame_record fv_vantage_arrive(struct fv_vantage *v, struct fv_vantage_side *side, int frames)
{
    struct fv_frame_record record = {0};
    fv_loop_settings(&side->own.loop);
    fv_loop_restart(&side->own.loop);
    for (int n = FV_VANTAGE_LEAD - frames; n < FV_VANTAGE_LEAD; n++) fv_vantage_render(v, side, n, &record);
    return record;
}

void fv_vantage_keep(struct fv_vantage *v, struct fv_vantage_side *side)
{
    struct fv_frame *f = &side->own.loop.frame;
    struct fv_metrics_picture picture = fv_picture_present(f, v->workers);
    if (!v->metrics)
        v->metrics = fv_metrics_open(f->width, f->height, M_PI / 180 / (double)f->view[0].pixel_size);
    fv_picture_pack(&picture, v->kept);
    fv_zones_of_view(&f->view[0], v->zone);
}

void fv_vantage_judge(struct fv_vantage *v, struct fv_vantage_side *side, struct fv_errors *errors)
{
    struct fv_metrics_picture own = fv_picture_present(&side->own.loop.frame, v->workers);
    const struct fv_metrics_picture kept = {own.width, own.height, 3, 3 * (int64_t)own.width, v->kept};
    fv_metrics_compare(v->metrics, v->workers, &kept, &own, v->zone, errors);
    for (int z = 0; z < FV_ZONES; z++)
        if (errors->psnr[z] > FV_VANTAGE_SAME_DB) errors->psnr[z] = FV_VANTAGE_SAME_DB; /* NaN stays */
}
