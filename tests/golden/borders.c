/* borders: where everything has one colour the picture has it too, whatever the gaze and the head do: nothing shows
 * where tiles of full, half and a quarter of the density meet, where the radii lie, nor where the picture ends. */
#include "rt/frame/loop.h"
#include "tests/support/small_scene.h"

enum { SIDE = 400, FRAMES = 24 };

struct stage {
    struct small_scene small;
    struct fv_workers workers;
    struct fv_plan plan;
    struct fv_session session;
    struct fv_loop loop;
};

/* A plate behind the viewer, for a scene that is not empty; all else is sky. */
static void open_stage(struct stage *s, const char *filter)
{
    const double corner[3] = {-1, -1, 1000}, u[3] = {2, 0, 0}, v[3] = {0, 2, 0};
    struct fv_config *c = &s->small.config;
    struct fv_material grey = fv_material_default();
    memset(s, 0, sizeof *s);
    small_begin(&s->small);
    small_picture(c, SIDE);
    c->fovea_inner_deg = 5;
    c->fovea_outer_deg = c->method_density_deg = 12;
    c->method_quarter_deg = 20;
    snprintf(c->method_history_filter, sizeof c->method_history_filter, "%s", filter);
    small_plate(&s->small, corner, u, v, 1, fv_build_material(s->small.build, &grey));
    small_finish(&s->small);
    for (int i = 0; i < 3; i++) s->small.scene.sky[i] = 0.2f;
    fv_workers_start(&s->workers, 2);
    fv_frame_size(&s->loop.frame, c);
    fv_plan_make(&s->plan, fv_method_find("reproject"), &s->small.scene, c, &s->loop.frame);
    fv_loop_open(&s->loop, c, &s->plan, &s->small.tracer, &s->workers, &s->session, 1);
}

static void render(struct stage *s, double head_deg, double gaze_deg)
{
    struct fv_pose head = {{0, 0, 0}, {1, 0, 0, 0}};
    double gaze[2][3] = {{sin(gaze_deg * M_PI / 180), 0, -cos(gaze_deg * M_PI / 180)}};
    struct fv_frame_record record;
    memcpy(gaze[1], gaze[0], sizeof gaze[1]);
    fv_quat_from_yaw_pitch_roll(head_deg * M_PI / 180, head_deg / 3 * M_PI / 180, head_deg / 5 * M_PI / 180,
                                head.rotation);
    fv_loop_frame(&s->loop, &head, gaze, 0, 0, &record);
    fv_pass_run(&fv_pass_present, &s->loop.frame, &s->workers);
}

static int tiles_of(const struct fv_frame *f, int density)
{
    int n = 0;
    for (int i = 0; i < f->tiles; i++) n += f->state[i].density == density;
    return n;
}

static void one_colour_stays_one_colour(void **state)
{
    static const struct {
        const char *name, *filter;
        double head_deg, gaze_deg; /* a frame */
    } motions[] = {{"rest", "cubic", 0, 0},        {"head turns", "cubic", 0.6, 0},
                   {"gaze moves", "cubic", 0, 0.7}, {"both, linear", "linear", -0.37, 0.5}};
    static struct stage s;
    (void)state;
    for (size_t m = 0; m < sizeof motions / sizeof motions[0]; m++) {
        open_stage(&s, motions[m].filter);
        const struct fv_frame *f = &s.loop.frame;
        for (int n = 0; n < FRAMES; n++) {
            render(&s, n * motions[m].head_deg, n * motions[m].gaze_deg - 8);
            const uint8_t *pixel = f->buffer[FV_PICTURE][0], *first = pixel;
            for (int d = 0; d < FV_DENSITIES; d++) assert_true(tiles_of(f, d) > f->tiles / 16);
            for (int y = 0; y < SIDE; y++)
                for (int x = 0; x < SIDE; x++)
                    for (int c = 0; c < 3; c++)
                        if (abs(pixel[4 * (y * f->stride + x) + c] - first[c]) > 1)
                            fail_msg("%s, frame %d: pixel %d, %d has %d, not %d", motions[m].name, n, x, y,
                                     pixel[4 * (y * f->stride + x) + c], first[c]);
        }
        assert_true(*(uint8_t *)f->buffer[FV_PICTURE][0] > 60);
        fv_workers_stop(&s.workers);
        fv_tracer_close(&s.small.tracer);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(one_colour_stays_one_colour)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
