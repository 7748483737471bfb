/* calibrate_picture: what the user looks at: a dot, and a ring that closes in on it so that the eye finds it
 * and stays there. Drawn where the display's camera has the direction, in each eye. */
#include "cli/calibrate.h"

#include "platform/arena.h"

#include <math.h>
#include <string.h>

/* Eyes turn by so much with ease; beyond, the head turns too. */
static const struct fv_target_reach with_ease = {18, 12, 12};
static const double part_of_view = 0.6;
/* Degrees. */
static const double ring_widest = 2.2, ring_least = 0.7, ring_line = 0.16, dot_radius = 0.3,
                    hole_radius = 0.08;
static const uint8_t ground[4] = {20, 20, 24, 0}, light[4] = {235, 235, 235, 0};

struct fv_target_reach fv_target_reach(const struct fv_config *c)
{
    return (struct fv_target_reach){
        fmin(with_ease.side, part_of_view * fmin(c->display_fov_in_deg, c->display_fov_out_deg)),
        fmin(with_ease.up, part_of_view * c->display_fov_up_deg),
        fmin(with_ease.down, part_of_view * c->display_fov_down_deg)};
}

/* A rectangle of the ground's colour. */
static void clear(struct fv_target_picture *p, int eye, const int box[4])
{
    for (int y = box[1]; y < box[3]; y++)
        for (int x = box[0]; x < box[2]; x++)
            memcpy(p->pixels[eye] + y * p->picture.stride_bytes + 4 * x, ground, 4);
}

void fv_target_picture_open(struct fv_target_picture *p, struct fv_config *config)
{
    memset(p, 0, sizeof *p);
    p->config = config;
    fv_frame_size(&p->loop.frame, config);
    p->loop.config = config; /* all that fv_loop_view wants */
    p->picture = (struct fv_picture){.eyes = p->loop.frame.eyes,
                                     .width = p->loop.frame.width,
                                     .height = p->loop.frame.height,
                                     .stride_bytes = 4 * p->loop.frame.width};
    for (int eye = 0; eye < p->picture.eyes; eye++) {
        size_t bytes = (size_t)p->picture.stride_bytes * (size_t)p->picture.height;
        p->pixels[eye] = fv_arena_take(fv_arena(), "display", bytes, 64);
        p->picture.pixels[eye] = p->pixels[eye];
        clear(p, eye, (const int[4]){0, 0, p->picture.width, p->picture.height});
    }
}

/* 1 inside, 0 outside, softly over a pixel. */
static double inside(double radius, double distance)
{
    return fmin(fmax(radius - distance + 0.5, 0), 1);
}

static void draw_eye(struct fv_target_picture *p, int eye, const double at[2], double px_per_deg,
                     double ring_deg)
{
    double reach = (ring_widest + ring_line) * px_per_deg + 2;
    const int side[2] = {p->picture.width, p->picture.height};
    int *box = p->drawn[eye];
    clear(p, eye, box);
    for (int i = 0; i < 2; i++) {
        box[i] = (int)fmin(fmax(floor(at[i] - reach), 0), side[i]);
        box[2 + i] = (int)fmin(fmax(ceil(at[i] + reach), 0), side[i]);
    }
    for (int y = box[1]; y < box[3]; y++)
        for (int x = box[0]; x < box[2]; x++) {
            double away = hypot(x + 0.5 - at[0], y + 0.5 - at[1]), line = 0.5 * ring_line * px_per_deg;
            double ring = inside(fmax(line, 0.5), fabs(away - ring_deg * px_per_deg));
            double dot = inside(dot_radius * px_per_deg, away) - inside(hole_radius * px_per_deg, away);
            uint8_t *pixel = p->pixels[eye] + y * p->picture.stride_bytes + 4 * x;
            for (int i = 0; i < 3; i++)
                pixel[i] = (uint8_t)lround(ground[i] + fmax(ring, dot) * (light[i] - ground[i]));
        }
}

void fv_target_picture_draw(struct fv_target_picture *p, const double at_deg[2], double part)
{
    static const struct fv_pose ahead = {.rotation = {1, 0, 0, 0}};
    double direction[3], closed = fmin(fmax(part, 0), 1);
    fv_gaze_vector(at_deg, direction);
    for (int eye = 0; eye < p->picture.eyes; eye++) {
        struct fv_view view;
        fv_loop_view(&p->loop, eye, &ahead, direction, &view);
        const double at[2] = {(double)view.gaze_px[0], (double)view.gaze_px[1]};
        draw_eye(p, eye, at, 1 / (double)view.pixel_deg, ring_widest + closed * (ring_least - ring_widest));
    }
}
