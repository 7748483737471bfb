/* trails: a textured body crosses the view before a textured wall, slow and fast, turning, before eyes that
 * stand or turn: what reproject shows where the body has just been, and on the body itself, is no worse than on
 * the wall beside it, which nothing ever covered. Judged by full rendering. */
#include "rt/frame/loop.h"
#include "tests/support/random.h"
#include "tests/support/small_scene.h"

enum { SIDE = 384, FRAMES = 14, JUDGED = 8, PIXELS = SIDE * SIDE };
enum { REST, TRAIL, BODY, REGIONS };

static struct fv_workers workers;

/* Smooth blobs of high contrast, `cycles` of them across. */
static int texture(struct fv_build *build, int cycles, double red, double blue)
{
    enum { TEXELS = 512 };
    static uint8_t pixels[TEXELS * TEXELS * 3];
    for (int i = 0; i < TEXELS * TEXELS; i++) {
        double x = i % TEXELS * 2 * M_PI / TEXELS, y = i / TEXELS * 2 * M_PI / TEXELS;
        double a = 0.5 + 0.5 * sin(cycles * x + sin(y)) * cos(cycles * y + sin(2 * x));
        pixels[3 * i] = (uint8_t)(40 + 200 * a * red);
        pixels[3 * i + 1] = (uint8_t)(60 + 120 * a);
        pixels[3 * i + 2] = (uint8_t)(40 + 200 * a * blue);
    }
    return fv_build_texture(build, FV_TEXEL_COLOUR, pixels, TEXELS, TEXELS, 3, 0);
}

struct stage {
    struct small_scene small;
    struct fv_plan plan[2];
    struct fv_session session[2];
    struct fv_loop loop[2]; /* full, reproject */
    uint8_t seen[JUDGED + 1][PIXELS]; /* masks of the body, of the newest frames */
};

struct motion {
    const char *name;
    double metres_s, spin_deg_s, head_deg_s, density_deg, quarter_deg;
    bool sun; /* the body throws a shadow, which moves on the wall */
};

static void open_stage(struct stage *s, const struct motion *motion)
{
    struct fv_moving body = {.ways = 2,
                             .way = {{-2, 0, -2.5, 0}, {2, 0, -2.5, 0}},
                             .seconds = 4 * 1.9 / motion->metres_s, /* eased: 1.9 times as fast in the middle */
                             .spin_deg_s = {0, 0, motion->spin_deg_s}};
    const double zero[3] = {0}, wall[3] = {-8, -8, -4}, u[3] = {16, 0, 0}, v[3] = {0, 16, 0};
    const double corner[3] = {-0.4, -0.5, 0}, bu[3] = {0.8, 0, 0}, bv[3] = {0, 1, 0};
    const struct fv_light sun = {FV_LIGHT_SUN, {1.2f, 0.2f, 1}, {0}, {0}, {3, 3, 3}};
    struct fv_material m = fv_material_default();
    struct fv_config *c = &s->small.config;
    struct fv_error error;
    memset(s, 0, sizeof *s);
    small_begin(&s->small);
    small_picture(c, SIDE);
    c->fovea_inner_deg = 5;
    c->fovea_outer_deg = 10;
    c->method_density_deg = motion->density_deg;
    c->method_quarter_deg = motion->quarter_deg;
    c->method_spp = 4;
    m.base_texture = texture(s->small.build, 25, 1, 0.2);
    small_plate(&s->small, wall, u, v, 8, fv_build_material(s->small.build, &m));
    m.base_texture = texture(s->small.build, 2, 0.1, 1);
    fv_build_moving(s->small.build, &body, 1);
    fv_build_object(s->small.build, 1, zero, &error);
    small_plate(&s->small, corner, bu, bv, 4, fv_build_material(s->small.build, &m));
    if (motion->sun) fv_build_light(s->small.build, &sun, &error);
    small_finish(&s->small);
    for (int i = 0; i < 3; i++) s->small.scene.ambient[i] = motion->sun ? 0.3f : 1;
    for (int i = 0; i < 2; i++) {
        struct fv_loop *l = &s->loop[i];
        fv_frame_size(&l->frame, c);
        fv_plan_make(&s->plan[i], fv_method_find(i ? "reproject" : "full"), &s->small.scene, c, &l->frame);
        fv_loop_open(l, c, &s->plan[i], &s->small.tracer, &workers, &s->session[i], 1);
    }
}

/* Which pixels' centres show the body, in the newest frame. */
static void look(struct stage *s)
{
    static struct fv_samples samples;
    int64_t rays[FV_RAY_KINDS] = {0};
    memmove(s->seen[1], s->seen[0], JUDGED * sizeof s->seen[0]);
    for (int first = 0; first < PIXELS; first += FV_SAMPLES_MAX) {
        samples.count = FV_SAMPLES_MAX;
        for (int i = 0; i < FV_SAMPLES_MAX; i++) {
            samples.x[i] = (float)((first + i) % SIDE) + 0.5f;
            samples.y[i] = (float)((first + i) / SIDE) + 0.5f;
        }
        s->loop[0].frame.kernels->trace(&s->small.tracer, &s->loop[0].frame.view[0], &samples, 0, rays);
        for (int i = 0; i < FV_SAMPLES_MAX; i++)
            s->seen[0][first + i] = (samples.surface[i] & FV_SURFACE_OBJECT) != 0;
    }
}

/* Adds up the pictures' difference by region, outside r1 and inside the wall's middle, `blur` pixels from
 * silhouettes. */
static void judge(const struct stage *s, int blur, double sum[REGIONS], double count[REGIONS])
{
    const struct fv_frame *a = &s->loop[0].frame, *b = &s->loop[1].frame;
    const uint8_t *p = a->buffer[FV_PICTURE][0], *q = b->buffer[FV_PICTURE][0];
    for (int i = 0; i < PIXELS; i++) {
        int x = i % SIDE, y = i / SIDE, was = 0, near = 0, now = s->seen[0][i];
        for (int k = 1; k <= JUDGED; k++) was |= s->seen[k][i];
        if (x < 8 || y < 8 || x >= SIDE - 8 || y >= SIDE - 8) continue;
        if (fv_eccentricity_deg(&a->view[0], (float)x, (float)y) < 11) continue;
        for (int k = 0; k < 9; k++) near |= s->seen[0][i + (k / 3 - 1) * blur * SIDE + (k % 3 - 1) * blur] != now;
        if (near) continue; /* silhouettes are no sharper than the pictures */
        int region = now ? BODY : was ? TRAIL : REST;
        for (int c = 0; c < 3; c++)
            sum[region] += abs(p[4 * (y * (int)a->stride + x) + c] - q[4 * (y * (int)b->stride + x) + c]);
        count[region] += 3;
    }
}

static void no_trail_and_no_smear(void **state)
{
    (void)state;
    static const struct motion motions[] = {
        {"stands", 1e-3, 0, 0, 181, 181, false},
        {"slow", 0.3, 0, 0, 181, 181, false},
        {"walks", 1.5, 0, 0, 181, 181, false},
        {"fast", 8, 0, 0, 181, 181, false},
        {"tumbles", 1.5, 200, 0, 181, 181, false},
        {"eyes turn with it", 1.5, 0, -30, 181, 181, false},
        {"eyes turn against it", 1.5, 0, 30, 181, 181, false},
        {"spins, eyes turn", 0.3, 400, 60, 181, 181, false},
        {"walks, half density", 1.5, 0, 0, 20, 181, false},
        {"tumbles, eyes turn, half density", 1.5, 200, 30, 20, 181, false},
        {"slow, a quarter", 0.3, 0, 0, 20, 20, false},
        {"walks, a quarter", 1.5, 0, 0, 20, 20, false},
        {"tumbles, eyes turn, a quarter", 1.5, 200, 30, 20, 20, false},
        {"walks, with a shadow", 1.5, 0, 0, 181, 181, true},
        {"tumbles, eyes turn, with a shadow", 1.5, 200, 30, 181, 181, true},
    };
    static const double gaze[2][3] = {{0.55, 0.55, -0.63}, {0.55, 0.55, -0.63}};
    static struct stage s;
    int bad = 0;
    for (unsigned n = 0; n < sizeof motions / sizeof motions[0]; n++) {
        const struct motion *m = &motions[n];
        double sum[REGIONS] = {0}, count[REGIONS] = {0}, mean[REGIONS];
        struct fv_frame_record record;
        open_stage(&s, m);
        int64_t middle_ns = (int64_t)(4 * 1.9 / m->metres_s * 0.5e9); /* where it is in front of the eyes */
        for (int f = 0; f < FRAMES; f++) {
            struct fv_pose head = {.rotation = {1, 0, 0, 0}};
            double since_s = (f - FRAMES + 4) / 75.0;
            fv_quat_from_yaw_pitch_roll(m->head_deg_s * since_s * M_PI / 180, 0, 0, head.rotation);
            for (int i = 0; i < 2; i++)
                fv_loop_frame(&s.loop[i], &head, gaze, 0, middle_ns + (int64_t)(since_s * 1e9), &record);
            for (int i = 0; i < 2; i++) fv_pass_run(&fv_pass_present, &s.loop[i].frame, &workers);
            look(&s);
            if (f >= FRAMES - 4) judge(&s, m->quarter_deg < 181 ? 6 : 2, sum, count);
        }
        for (int r = 0; r < REGIONS; r++) mean[r] = count[r] > 0 ? sum[r] / count[r] : 0;
        print_message("%-33s wall %.2f, where the body was %.2f, body %.2f (of 255)\n", m->name, mean[REST],
                      mean[TRAIL], mean[BODY]);
        assert_true(count[BODY] > 1000 && (m->metres_s < 1 || count[TRAIL] > 500));
        bad += m->sun && mean[REST] > 0.6; /* three times as much where the shadow is left to chance */
        bad += mean[TRAIL] > 1.5 * mean[REST] + (m->sun ? 1 : 0.5) || mean[BODY] > (m->quarter_deg < 181 ? 2.2 : 1.5) * mean[REST] + 0.5;
        fv_tracer_close(&s.small.tracer);
    }
    assert_int_equal(bad, 0);
}

static int start_workers(void **state)
{
    (void)state;
    return fv_workers_start(&workers, 2) != 2;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(no_trail_and_no_smear)};
    return cmocka_run_group_tests(tests, start_workers, NULL);
}
