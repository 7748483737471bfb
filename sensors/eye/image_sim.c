/* image_sim: draws the simulated eye pixel by pixel, then what lies on top of it: lashes, glints, lens and
 * sensor. */
#include "sensors/eye/image_sim.h"
#include "sensors/motion.h"
#include "sensors/sensors.h"

#include <math.h>
#include <string.h>

/* mm: middle of the eye to the pupil's plane and to the cornea's middle; radii; half the lids' width; how far
 * they open up and down. */
static const double pupil_plane_mm = 9.8, cornea_middle_mm = 5.6, cornea_mm = 7.8, iris_mm = 6,
                    glint_mm = 0.22, lids_mm = 15, upper_mm = 6.3, lower_mm = 5;
/* Corneal normals further from the gaze than this are sclera, which mirrors nothing. */
static const double cornea_cosine = 0.77;
/* Levels of grey under infrared light. */
static const double pupil_grey = 24, iris_grey = 62, sclera_grey = 95, skin_grey = 105, lash_grey = 40,
                    glint_grey = 250;
enum { LASHES = 70, IRIS_RAYS = 48 };

enum draw { SKIN = 1000, IRIS, LASH_AT, LASH_LENGTH, LASH_LEAN, LASH_BEND, PUPIL_SIZE };

/* What the loops need of camera and state. */
struct scene {
    const struct fv_eye_camera *camera;
    const struct fv_eye_state *state;
    double middle[2];      /* of the pupil, mm from the eye's middle, y up */
    double along[2], thin; /* direction in which discs are foreshortened, and by how much */
    double upper, lower;   /* height of the lids at the middle, mm */
    double soft_mm;        /* width of edges */
    float ray[IRIS_RAYS + 1], skin[17][17];
};

struct fv_eye_camera fv_eye_camera_usual(int width, int height, uint64_t seed)
{
    return (struct fv_eye_camera){.width = width,
                                  .height = height,
                                  .px_per_mm = 0.3 * width / (2 * iris_mm),
                                  .x = 0.5 * (width - 1),
                                  .y = 0.55 * (height - 1),
                                  .leds = 6,
                                  .blurs = 1,
                                  .noise = 2,
                                  .vignette = 0.4,
                                  .seed = seed};
}

void fv_eye_state_at(uint64_t seed, int eye, int64_t t_ns, struct fv_eye_state *state)
{
    struct fv_gaze_sample gaze, near;
    int shut = 0;
    fv_sim_gaze(seed, t_ns, &gaze);
    for (int i = -2; i <= 2; i++) {
        fv_sim_gaze(seed, t_ns + i * 20000000, &near);
        shut += !near.valid;
    }
    state->t_ns = t_ns;
    memcpy(state->direction, gaze.direction[eye != 0], sizeof state->direction);
    state->direction[0] = -state->direction[0]; /* the camera faces the eye */
    state->pupil_mm = 4.25 + 0.55 * fv_motion_noise(seed, PUPIL_SIZE, t_ns, 0.05, 0.5);
    state->pupil_mm = fmin(fmax(state->pupil_mm, 2.5), 6);
    /* Lids take some 60 ms to close. */
    state->open = gaze.valid ? 1 - 0.25 * shut : 0;
}

/* 0 below -1/2, 1 above 1/2 of a width. */
static double step(double distance, double width)
{
    double s = distance / width + 0.5;
    return s < 0 ? 0 : s > 1 ? 1 : s * s * (3 - 2 * s);
}

/* Numbers between those of a row. */
static double between(const float *value, double at)
{
    int i = (int)at;
    double u = at - i;
    return value[i] + (value[i + 1] - value[i]) * u * u * (3 - 2 * u);
}

static void prepare(const struct fv_eye_camera *camera, const struct fv_eye_state *state, struct scene *s)
{
    const double *g = state->direction;
    double aside = hypot(g[0], g[1]), open = fmin(fmax(state->open, 0), 1);
    s->camera = camera;
    s->state = state;
    s->middle[0] = pupil_plane_mm * g[0];
    s->middle[1] = pupil_plane_mm * g[1];
    s->along[0] = aside > 1e-9 ? g[0] / aside : 1;
    s->along[1] = aside > 1e-9 ? g[1] / aside : 0;
    s->thin = fmax(fabs(g[2]), 0.1);
    /* The upper lid follows the gaze; it does nearly all of the closing. */
    double follow = 0.6 * s->middle[1];
    s->lower = -lower_mm + 0.3 * (s->middle[1] < 0 ? s->middle[1] : 0) + 0.8 * (1 - open);
    s->upper = s->lower + open * fmax(upper_mm + follow - s->lower, 2);
    s->soft_mm = 1.5 / camera->px_per_mm;
    for (int i = 0; i < IRIS_RAYS; i++)
        s->ray[i] = (float)(16 * fv_motion_uniform(camera->seed, IRIS, i) - 8);
    s->ray[IRIS_RAYS] = s->ray[0];
    for (int j = 0; j <= 16; j++)
        for (int i = 0; i <= 16; i++)
            s->skin[j][i] = (float)(30 * fv_motion_uniform(camera->seed, SKIN, 17 * j + i) - 15);
}

/* Height of the lid's edge at x, mm from the middle; both meet at the corners. */
static double lid_at(const struct scene *s, double height, double x)
{
    double u = x / lids_mm, corner = s->lower + 0.35 * lower_mm;
    u = fmin(u * u, 1);
    return height + (corner - height) * u;
}

/* Grey of the open eye. x, y: mm from its middle, y up. */
static double eye_grey(const struct scene *s, double x, double y)
{
    double dx = x - s->middle[0], dy = y - s->middle[1];
    double u = (dx * s->along[0] + dy * s->along[1]) / s->thin, v = dy * s->along[0] - dx * s->along[1];
    double off = hypot(u, v), grey = sclera_grey * (1 - 0.0012 * (x * x + y * y));
    double iris = step(iris_mm - off, 0.8); /* the limbus is soft */
    if (iris > 0) {
        double turn = (atan2(v, u) / (2 * M_PI) + 0.5) * IRIS_RAYS;
        double texture = between(s->ray, fmin(turn, IRIS_RAYS - 1e-6)) * (1 - 0.5 * off / iris_mm);
        grey += iris * (iris_grey + texture - grey);
    }
    return grey + step(0.5 * s->state->pupil_mm - off, s->soft_mm) * (pupil_grey - grey);
}

static double skin_grey_at(const struct scene *s, double u, double v)
{
    double x = 16 * fmin(fmax(u, 0), 0.9999), y = 16 * fmin(fmax(v, 0), 0.9999), w = y - (int)y;
    const float *row = s->skin[(int)y], *next = s->skin[(int)y + 1];
    return skin_grey + (1 - w) * between(row, x) + w * between(next, x);
}

static uint8_t to_grey(double value)
{
    return (uint8_t)(value > 255 ? 255 : value > 0 ? value + 0.5 : 0);
}

static void draw_row(const struct scene *s, int row, uint8_t *out)
{
    const struct fv_eye_camera *c = s->camera;
    double y = (c->y - row) / c->px_per_mm, v = (double)row / c->height;
    for (int i = 0; i < c->width; i++) {
        double x = (i - c->x) / c->px_per_mm, u = (double)i / c->width;
        double upper = lid_at(s, s->upper, x), lower = lid_at(s, s->lower, x);
        double seen = step(upper - y, s->soft_mm) * step(y - lower, s->soft_mm), grey = 0;
        if (seen < 1) grey = skin_grey_at(s, u, v) * (1 - 0.35 * exp(-fabs(y - upper) / 0.4));
        /* The upper lid's shadow lies on the eye. */
        if (seen > 0) grey += seen * (eye_grey(s, x, y) * (1 - 0.3 * exp((y - upper) / 0.7)) - grey);
        double corner = 2 * ((u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5));
        out[i] = to_grey(grey * (1 - c->vignette * corner));
    }
}

/* Draws towards `grey` at a place, over a pixel's width. */
static void dot(const struct scene *s, uint8_t *pixels, ptrdiff_t stride, double x, double y, double grey,
                double share)
{
    int left = (int)floor(x), top = (int)floor(y);
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < 2; i++) {
            int at_x = left + i, at_y = top + j;
            if (at_x < 0 || at_y < 0 || at_x >= s->camera->width || at_y >= s->camera->height) continue;
            double weight = share * (1 - fabs(x - at_x)) * (1 - fabs(y - at_y));
            uint8_t *p = &pixels[at_y * stride + at_x];
            *p = to_grey(*p + weight * (grey - *p));
        }
}

/* Lashes grow from the upper lid's edge, outwards and up when it is open, down when it is closed. */
static void draw_lashes(const struct scene *s, uint8_t *pixels, ptrdiff_t stride)
{
    const struct fv_eye_camera *c = s->camera;
    double up = fmin(fmax(s->state->open, 0), 1);
    for (int i = 0; i < LASHES; i++) {
        double x = lids_mm * (1.9 * fv_motion_uniform(c->seed, LASH_AT, i) - 0.95);
        double length = 2 + 3.5 * fv_motion_uniform(c->seed, LASH_LENGTH, i);
        double lean = x / lids_mm + 0.7 * (fv_motion_uniform(c->seed, LASH_LEAN, i) - 0.5);
        double bend = 0.12 * (fv_motion_uniform(c->seed, LASH_BEND, i) - 0.5);
        double y = lid_at(s, s->upper, x), px = x * c->px_per_mm + c->x, py = c->y - y * c->px_per_mm;
        double rise = -1 + 2 * up, steps = 2 * length * c->px_per_mm;
        steps = fmin(steps, 2000);
        for (int k = 0; k < (int)steps; k++) {
            double far = k / steps, norm = hypot(lean, 1);
            dot(s, pixels, stride, px, py, lash_grey, 0.45 * (1 - far));
            px += 0.5 * (lean + bend * k / 10) / norm;
            py -= 0.5 * rise / norm;
        }
    }
}

/* Where the cornea mirrors each LED into the camera: its normal halves the angle between both. */
static void draw_glints(const struct scene *s, uint8_t *pixels, ptrdiff_t stride)
{
    const struct fv_eye_camera *c = s->camera;
    const double *g = s->state->direction;
    for (int i = 0; i < c->leds && i < FV_EYE_LEDS_MAX; i++) {
        double angle = 2 * M_PI * (i + 0.5) / c->leds, half = 0.5 * 0.7; /* LEDs 40 degrees aside */
        double n[3] = {sin(half) * cos(angle), sin(half) * sin(angle), -cos(half)};
        double x = cornea_middle_mm * g[0] + cornea_mm * n[0], y = cornea_middle_mm * g[1] + cornea_mm * n[1];
        if (n[0] * g[0] + n[1] * g[1] + n[2] * g[2] < cornea_cosine) continue;
        if (y > lid_at(s, s->upper, x) || y < lid_at(s, s->lower, x)) continue;
        double px = x * c->px_per_mm + c->x, py = c->y - y * c->px_per_mm,
               radius = fmax(glint_mm * c->px_per_mm, 1);
        int reach = (int)fmin(radius + 3, 200);
        for (int j = -reach; j <= reach; j++)
            for (int k = -reach; k <= reach; k++) {
                int at_x = (int)px + k, at_y = (int)py + j;
                if (at_x < 0 || at_y < 0 || at_x >= c->width || at_y >= c->height) continue;
                uint8_t *p = &pixels[at_y * stride + at_x];
                *p = to_grey(*p + step(radius - hypot(at_x - px, at_y - py), 2) * (glint_grey - *p));
            }
    }
}

/* 1-2-1 along n pixels that lie `apart`. */
static void blur_line(uint8_t *p, int n, ptrdiff_t apart)
{
    int before = p[0];
    for (int i = 0; i < n; i++) {
        int here = p[i * apart], after = p[(i + 1 < n ? i + 1 : i) * apart];
        p[i * apart] = (uint8_t)((before + 2 * here + after + 2) >> 2);
        before = here;
    }
}

/* Sum of four even numbers: normal enough for a sensor. */
static double noise(uint64_t seed, int64_t t_ns, int pixel)
{
    uint64_t z = seed + (uint64_t)t_ns * 0x9e3779b97f4a7c15u + (uint64_t)pixel * 0xd1342543de82ef95u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    int sum = (int)(z & 0xffff) + (int)(z >> 16 & 0xffff) + (int)(z >> 32 & 0xffff) + (int)(z >> 48);
    return (sum - 2 * 65535) * (1.7320508 / 65536);
}

/* The pupil's ellipse in pixels, and how much of it no lid hides. */
static void tell(const struct scene *s, struct fv_pupil *truth)
{
    const struct fv_eye_camera *c = s->camera;
    enum { POINTS = 72 };
    double radius = 0.5 * s->state->pupil_mm;
    int seen = 0;
    for (int i = 0; i < POINTS; i++) {
        double u = radius * cos(2 * M_PI * i / POINTS) * s->thin, v = radius * sin(2 * M_PI * i / POINTS);
        double x = s->middle[0] + u * s->along[0] - v * s->along[1],
               y = s->middle[1] + u * s->along[1] + v * s->along[0];
        seen += y < lid_at(s, s->upper, x) && y > lid_at(s, s->lower, x);
    }
    truth->x = c->x + s->middle[0] * c->px_per_mm;
    truth->y = c->y - s->middle[1] * c->px_per_mm;
    truth->major = s->state->pupil_mm * c->px_per_mm;
    truth->minor = truth->major * s->thin;
    /* The minor axis points along the gaze; y turns over. */
    truth->angle = atan2(s->along[0], s->along[1]);
    if (truth->angle > M_PI / 2) truth->angle -= M_PI;
    if (truth->angle <= -M_PI / 2) truth->angle += M_PI;
    truth->confidence = (double)seen / POINTS;
    truth->found = 2 * seen >= POINTS;
}

void fv_eye_image(const struct fv_eye_camera *camera, const struct fv_eye_state *state, uint8_t *pixels,
                  ptrdiff_t stride, struct fv_pupil *truth)
{
    struct scene s;
    prepare(camera, state, &s);
    for (int y = 0; y < camera->height; y++) draw_row(&s, y, pixels + y * stride);
    draw_glints(&s, pixels, stride);
    draw_lashes(&s, pixels, stride);
    for (int i = 0; i < camera->blurs && i < 8; i++) {
        for (int y = 0; y < camera->height; y++) blur_line(pixels + y * stride, camera->width, 1);
        for (int x = 0; x < camera->width; x++) blur_line(pixels + x, camera->height, stride);
    }
    for (int y = 0; y < camera->height && camera->noise > 0; y++)
        for (int x = 0; x < camera->width; x++) {
            uint8_t *p = &pixels[y * stride + x];
            *p = to_grey(*p + camera->noise * noise(camera->seed, state->t_ns, y * camera->width + x));
        }
    if (truth) tell(&s, truth);
}
