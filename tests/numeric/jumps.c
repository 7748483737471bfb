/* jumps: reproject where what it carries along is worth least: first frames, gazes and heads that jump, places in,
 * on and far from geometry, views of nothing. The frame after a jump is judged by the full renderer's at the same
 * pose: sharp where the gaze is now, and nowhere of what was seen before. */
#include "tests/support/room.h"
#include "tests/support/shown.h"

enum { SIDE = 320, BEFORE = 8, AFTER = 24 /* frames */ };

struct stage {
    struct room room; /* with the full renderer's loop */
    struct fv_workers workers;
    struct fv_plan plan;
    struct fv_session session;
    struct fv_loop loop;
};

struct view {
    double at[3], turn_deg, gaze_deg; /* both to the right */
};

static void open_stage(struct stage *s, double density_deg)
{
    struct fv_config *c = &s->room.small.config;
    memset(s, 0, sizeof *s);
    fv_workers_start(&s->workers, 2);
    room_open(&s->room, &s->workers, FV_SCENE_POINT_LIGHTS | FV_SCENE_TEXTURES, 1, SIDE);
    for (int i = 0; i < 3; i++) s->room.small.scene.sky[i] = 0.3f;
    small_picture(c, SIDE);
    c->fovea_inner_deg = 6, c->fovea_outer_deg = 12, c->fovea_p_min = 0.05;
    c->method_density_deg = density_deg;
    fv_frame_size(&s->room.loop.frame, c);
    fv_plan_make(&s->room.plan, fv_method_find("full"), &s->room.small.scene, c, &s->room.loop.frame);
    fv_loop_open(&s->room.loop, c, &s->room.plan, &s->room.small.tracer, &s->workers, &s->room.session, 1);
    fv_frame_size(&s->loop.frame, c);
    fv_plan_make(&s->plan, fv_method_find("reproject"), &s->room.small.scene, c, &s->loop.frame);
    fv_loop_open(&s->loop, c, &s->plan, &s->room.small.tracer, &s->workers, &s->session, 1);
}

static void render(struct fv_loop *loop, const struct view *v, int n)
{
    struct fv_pose head = {.position_m = {v->at[0] + 0.004 * n, v->at[1], v->at[2]}};
    double a = v->gaze_deg * M_PI / 180, gaze[2][3] = {{sin(a), 0, -cos(a)}, {sin(a), 0, -cos(a)}};
    struct fv_frame_record record;
    fv_quat_from_yaw_pitch_roll(-(v->turn_deg + 0.2 * n) * M_PI / 180, 0, 0, head.rotation);
    fv_loop_frame(loop, &head, gaze, 0, 0, &record);
}

/* Mean difference of the pictures, of 1023, within some eccentricities. */
static double difference(const struct stage *s, float from_deg, float to_deg)
{
    const struct fv_frame *f = &s->loop.frame, *full = &s->room.loop.frame;
    double sum = 0, n = 0;
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            float e = fv_eccentricity_deg(&f->view[0], (float)x + 0.5f, (float)y + 0.5f);
            if (e < from_deg || e >= to_deg) continue;
            uint32_t a = shown_pixel(f, 0, x, y), b = shown_pixel(full, 0, x, y);
            for (int c = 0; c < 30; c += 10) sum += abs((int)(a >> c & 1023) - (int)(b >> c & 1023)), n++;
        }
    assert_true(n > 0);
    return sum / n;
}

static const struct view in_room = {{0, 0, -1.5}, 0, 0}, right_gaze = {{0, 0, -1.5}, 0, 30},
                         left_gaze = {{0, 0, -1.5}, 0, -30}, turned = {{0, 0, -1.5}, 180, 0},
                         quarter = {{0, 0, -1.5}, 90, 0}, beside = {{1.2, -1.2, -2}, -40, 10},
                         behind_wall = {{0, 0, -5.2}, 0, 0}, behind_and_back = {{0, 0, -5.2}, 180, 0},
                         on_wall = {{0, 0, -5}, 180, 20}, on_floor = {{0, -1.5, -2}, 0, -20},
                         at_screen = {{-0.6, 0, -4.0001}, 0, 0}, far_off = {{0, 0, 1e5}, 0, 0},
                         farther = {{3e6, -2e6, 1e7}, 200, 0};

static const struct {
    const char *name;
    const struct view *before, *after;
    double near, far; /* the most that may differ on the average, of 1023 */
    bool fades;       /* that is asked of the last frame only, else of the first two as well */
} jumps[] = {
    {"stays", &in_room, &in_room, 12, 35, false},
    {"gaze jumps", &left_gaze, &right_gaze, 15, 35, false},
    {"gaze comes back", &right_gaze, &in_room, 15, 35, false},
    /* Of 255: blended colours are dithered between their steps. */
    {"head turns half round, to nothing", &in_room, &turned, 0.6, 0.6, false},
    {"and back", &turned, &in_room, 12, 35, false},
    {"a quarter", &in_room, &quarter, 8, 30, false},
    {"steps aside, turning", &in_room, &beside, 10, 30, false},
    {"goes through the wall", &in_room, &behind_wall, 0.6, 0.6, false},
    {"looks back from behind it", &behind_wall, &behind_and_back, 2, 4, false},
    /* What history shows of the same place is, both ways, the wall's other side, which fades. */
    {"into the wall's plane", &in_room, &on_wall, 12, 120, true},
    {"out of it", &on_wall, &in_room, 12, 40, true},
    {"onto the floor", &beside, &on_floor, 12, 30, false},
    {"against a screen", &in_room, &at_screen, 30, 70, false},
    {"away from it: all is new", &at_screen, &in_room, 12, 35, false},
    {"far off", &in_room, &far_off, 0.6, 0.6, false},
    {"nothing from nothing", &far_off, &farther, 0.6, 0.6, false},
    {"from far off", &farther, &in_room, 12, 35, false},
};

/* All frames of one loop after another: each jump starts from what the one before left. */
static void follow(struct stage *s, double density_deg)
{
    for (unsigned j = 0; j < sizeof jumps / sizeof jumps[0]; j++) {
        int n = 0;
        for (; n < BEFORE; n++) render(&s->loop, jumps[j].before, n);
        for (; n < BEFORE + AFTER; n++) {
            int after = n - BEFORE;
            render(&s->loop, jumps[j].after, n);
            if (after != AFTER - 1 && (jumps[j].fades || after > 1)) continue;
            render(&s->room.loop, jumps[j].after, n);
            double near = difference(s, 0, 6), far = difference(s, 14, 180);
            print_message("%s (half density from %g degrees), frame %d: %.1f in the fovea, %.1f beyond\n",
                          jumps[j].name, density_deg, after, near, far);
            if (!(near <= jumps[j].near && far <= jumps[j].far))
                fail_msg("more than %g and %g", jumps[j].near, jumps[j].far);
        }
    }
}

static void frames_after_jumps(void **state)
{
    static struct stage stages[2];
    (void)state;
    for (int i = 0; i < 2; i++) {
        open_stage(&stages[i], i ? 12 : 181);
        follow(&stages[i], i ? 12 : 181);
        fv_workers_stop(&stages[i].workers);
        fv_tracer_close(&stages[i].room.small.tracer);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(frames_after_jumps)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
