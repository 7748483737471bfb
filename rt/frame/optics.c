/* optics: see optics.h. */
#include "rt/frame/optics.h"

#include <math.h>
#include <string.h>

static const double degree = 0.017453292519943295;

static void set_pinhole(const struct fv_config *c, int eye, struct fv_lens *lens)
{
    double in = tan(c->display_fov_in_deg * degree), out = tan(c->display_fov_out_deg * degree);
    lens->tan_left = eye == 0 ? out : in;
    lens->tan_right = eye == 0 ? in : out;
    lens->tan_up = tan(c->display_fov_up_deg * degree);
    lens->tan_down = tan(c->display_fov_down_deg * degree);
}

/* Straight coordinates are those of the panel as a pinhole with the lens's power at its axis would show it. */
static void set_radial(const struct fv_config *c, int eye, struct fv_lens *lens, struct fv_bend *bend)
{
    struct fv_lens_settings s = {
        .unit_px = c->display_lens_unit_px,
        .visible_deg = c->display_lens_visible_deg,
        .width = lens->width,
        .height = lens->height,
    };
    const struct fv_list *channel[2] = {&c->display_lens_red, &c->display_lens_blue};
    s.centre_px[0] = eye == 0 ? c->display_lens_x_px : lens->width - c->display_lens_x_px;
    s.centre_px[1] = c->display_lens_y_px;
    for (int i = 0; i < FV_LENS_TERMS; i++) s.k[i] = c->display_lens_k.value[i];
    for (int i = 0; i < 2; i++) s.channel[i] = (struct fv_lens_channel){channel[i]->value[0], channel[i]->value[1]};
    lens->tan_left = s.centre_px[0] / s.unit_px;
    lens->tan_right = (lens->width - s.centre_px[0]) / s.unit_px;
    lens->tan_up = s.centre_px[1] / s.unit_px;
    lens->tan_down = (lens->height - s.centre_px[1]) / s.unit_px;
    fv_bend_set(bend, &s);
}

void fv_optics_lens(const struct fv_config *c, int eye, struct fv_lens *lens, struct fv_bend *bend)
{
    *lens = (struct fv_lens){.width = (int)c->display_width, .height = (int)c->display_height};
    *bend = (struct fv_bend){.on = false};
    if (strcmp(c->display_lens, "radial") == 0) set_radial(c, eye, lens, bend);
    else set_pinhole(c, eye, lens);
}

int64_t fv_optics_unseen(const struct fv_lens *lens, const struct fv_bend *bend)
{
    int64_t unseen = 0;
    for (int y = 0; y < lens->height && bend->masks; y++) {
        int from, to;
        fv_bend_row(bend, y, lens->width, &from, &to);
        unseen += lens->width - (to - from);
    }
    return unseen;
}
