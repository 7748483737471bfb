/* moving: maps of what is fixed to moving objects against long double, far out, thrown about and turned by any
 * angle; spins of ten thousand turns; rays at objects that are far, minute or not there at all. */
#include "rt/scene/scene.h"
#include "tests/support/long_rotation.h"
#include "tests/support/random.h"
#include "tests/support/small_scene.h"

#include <float.h>

#define COUNT(table) (sizeof table / sizeof table[0])

static const struct fv_lens lens = {1.1, 0.9, 1.2, 1.3, 1182, 1464};
static const double ahead[3] = {0, 0, -1};

/* A point of the world fixed to an object, by its pose, in long double. */
static void to_world(const struct fv_pose *pose, const long double own[3], long double out[3])
{
    long_rotate(long_unit(long_of(pose->rotation)), own, out);
    for (int i = 0; i < 3; i++) out[i] += pose->position_m[i];
}

static void to_own(const struct fv_pose *pose, const long double world[3], long double out[3])
{
    long double way[3];
    for (int i = 0; i < 3; i++) way[i] = world[i] - pose->position_m[i];
    long_rotate(long_inverse(long_unit(long_of(pose->rotation))), way, out);
}

static void pixel_of(const struct fv_pose *eye, const long double world[3], long double out[3])
{
    long double p[3];
    to_own(eye, world, p);
    out[0] = (p[0] / -p[2] + lens.tan_left) * lens.width / ((long double)lens.tan_left + lens.tan_right);
    out[1] = (lens.tan_up - p[1] / -p[2]) * lens.height / ((long double)lens.tan_up + lens.tan_down);
    out[2] = -1 / p[2];
}

static void random_pose(uint64_t *random, const double at[3], double reach, double turn, struct fv_pose *pose)
{
    double axis[3];
    random_direction(random, axis);
    for (int i = 0; i < 3; i++) {
        pose->position_m[i] = at[i] + random_between(random, -reach, reach);
        axis[i] *= turn;
    }
    fv_quat_from_vector(axis, pose->rotation);
}

/* Eyes and objects anywhere, together up to a thousand kilometres out: a pixel of a point of the object is
 * found again where the point was before. */
static void maps_follow_objects(void **state)
{
    (void)state;
    static const double places[] = {0, 1, 1e3, 1e6}, jumps[] = {0, 1e-9, 1e-3, 0.3, 3};
    static const double turns[] = {0, 1e-12, 1e-6, 0.01, 0.5, M_PI / 2, M_PI};
    uint64_t random = 21;
    double worst = 0;
    int compared = 0;
    for (unsigned p = 0; p < COUNT(places); p++)
        for (unsigned j = 0; j < COUNT(jumps); j++)
            for (unsigned t = 0; t < COUNT(turns); t++)
                for (int n = 0; n < 100; n++) {
                    double at[3] = {places[p], -places[p], places[p] * 0.5};
                    struct fv_pose eye[2], object[2];
                    struct fv_view view[2];
                    struct fv_map map;
                    random_pose(&random, at, 0.1, 0.2, &eye[0]);
                    random_pose(&random, eye[0].position_m, jumps[j], 0.1, &eye[1]);
                    at[2] -= 8;
                    random_pose(&random, at, 1, turns[t], &object[0]);
                    random_pose(&random, object[0].position_m, jumps[j], turns[(t + n) % COUNT(turns)], &object[1]);
                    for (int i = 0; i < 2; i++) fv_view_set(&view[i], &lens, &eye[i], ahead);
                    fv_map_set_moving(&map, &view[1], &view[0], &object[1], &object[0]);
                    long double own[3], world[3], now[3], before[3];
                    for (int i = 0; i < 3; i++) own[i] = random_between(&random, -1, 1);
                    to_world(&object[1], own, world);
                    pixel_of(&eye[1], world, now);
                    to_world(&object[0], own, world);
                    pixel_of(&eye[0], world, before);
                    if (!(now[2] > 0 && before[2] > 0 && before[2] < 10 && fabsl(before[0]) < 3000 && fabsl(before[1]) < 3000 &&
                          fabsl(now[0]) < 3000 && fabsl(now[1]) < 3000))
                        continue;
                    double to[3];
                    for (int r = 0; r < 3; r++)
                        to[r] = (double)map.m[r][0] * (double)now[0] + (double)map.m[r][1] * (double)now[1] +
                                (double)map.m[r][2] + (double)map.t[r] * (double)now[2];
                    double off = fmax(fabs(to[0] / to[2] - (double)before[0]), fabs(to[1] / to[2] - (double)before[1]));
                    worst = fmax(worst, off);
                    compared++;
                    /* Of a pixel; the numbers of the map are floats. */
                    if (!(off < 0.002) || !(fabs((double)now[2] / to[2] / (double)before[2] - 1) < 1e-4))
                        fail_msg("place %g, jump %g, turn %g: off by %g px", places[p], jumps[j], turns[t], off);
                }
    assert_true(compared > 5000);
    print_message("maps: off by at most %.1e px\n", worst);
}

/* Viewer and object moved as one rigid whole: every pixel is where it was. What does not move: fv_map_set. */
static void together_and_still(void **state)
{
    (void)state;
    uint64_t random = 22;
    for (int n = 0; n < 2000; n++) {
        struct fv_pose eye[2], object[2], whole;
        struct fv_view view[2];
        struct fv_map map, other;
        const double zero[3] = {0};
        random_pose(&random, zero, 1e3, 1, &eye[0]);
        random_pose(&random, zero, 1e3, 1, &object[0]);
        random_pose(&random, zero, 1e3, random_between(&random, 0, 3), &whole);
        fv_pose_compose(&whole, &eye[0], &eye[1]);
        fv_pose_compose(&whole, &object[0], &object[1]);
        for (int i = 0; i < 2; i++) fv_view_set(&view[i], &lens, &eye[i], ahead);
        fv_map_set_moving(&map, &view[1], &view[0], &object[1], &object[0]);
        for (int r = 0; r < 3; r++) {
            for (int c = 0; c < 3; c++) assert_true(fabsf(map.m[r][c] - (r == c)) < 2e-4f);
            assert_true(fabsf(map.t[r]) < 1e-6f);
        }
        fv_map_set_moving(&map, &view[1], &view[0], &object[0], &object[0]);
        fv_map_set(&other, &view[1], &view[0]);
        for (int r = 0; r < 3; r++) {
            for (int c = 0; c < 3; c++) assert_true(fabsf(map.m[r][c] - other.m[r][c]) < 2e-4f);
            assert_true(fabsf(map.t[r] - other.t[r]) <= 1e-6f * (1000 + fabsf(other.t[r])));
        }
    }
}

static void spins(void **state)
{
    (void)state;
    static const double speeds[] = {0, 1e-300, 1e-9, 0.1, 90, 360, 3600, 1e6};
    static const int64_t times[] = {0,  1, -1, 1000000000, INT64_C(86400000000000), INT64_MAX, INT64_MIN};
    for (unsigned s = 0; s < COUNT(speeds); s++)
        for (unsigned t = 0; t < COUNT(times); t++) {
            struct fv_moving m = {.body = FV_BODY_BOX, .ways = 1, .spin_deg_s = {speeds[s], -speeds[s], speeds[s]}};
            struct fv_pose pose;
            fv_moving_pose(&m, times[t], &pose);
            assert_true(fv_pose_sound(&pose));
        }
    /* 7 degrees, and ten thousand turns later. */
    for (int axis = 0; axis < 3; axis++) {
        struct fv_moving m = {.body = FV_BODY_BOX, .ways = 1, .spin_deg_s = {0}};
        struct fv_pose a, b;
        long double r[3] = {0};
        m.spin_deg_s[axis] = 360;
        r[axis] = 7 * LONG_PI / 180;
        const int64_t t_ns = 19444444; /* 7 degrees but for 1.6e-7 */
        fv_moving_pose(&m, t_ns, &a);
        fv_moving_pose(&m, t_ns + INT64_C(10000000000000), &b);
        assert_true(fv_quat_angle(a.rotation, b.rotation) < 1e-8);
        assert_true(long_angle(a.rotation, long_exp(r)) < 1e-8);
        m.spin_deg_s[axis] = -360;
        fv_moving_pose(&m, t_ns, &b);
        fv_quat_multiply(a.rotation, b.rotation, a.rotation);
        assert_true(fabs(fabs(a.rotation[0]) - 1) < 1e-15);
    }
}

/* A plate of a metre four metres ahead, as the only thing that moves, in a scene whose other triangle is out of
 * sight. */
static void open_plate(struct small_scene *s, double size)
{
    static const struct fv_moving one;
    const double zero[3] = {0}, behind[3] = {0, 0, 9}, up[3] = {0, 1, 0}, right[3] = {1, 0, 0};
    const double corner[3] = {-size / 2, -size / 2, 0}, u[3] = {size, 0, 0}, v[3] = {0, size, 0};
    struct fv_material white = fv_material_default();
    struct fv_error error;
    small_begin(s);
    int material = fv_build_material(s->build, &white);
    small_plate(s, behind, right, up, 1, material);
    fv_build_moving(s->build, &one, 1);
    fv_build_object(s->build, 1, zero, &error);
    small_plate(s, corner, u, v, 4, material);
    small_finish(s);
    for (int i = 0; i < 3; i++) s->scene.ambient[i] = 1, s->scene.sky[i] = 0;
}

static void rays_at_extremes(void **state)
{
    (void)state;
    static const struct {
        double size, at[3], turn;
        int seen; /* of 1024 samples, about; -1: any number */
    } table[] = {
        {1, {0, 0, -2}, 0, 256},        {1, {0, 0, -2}, M_PI / 2, 256},   {1, {1e6, 0, -2}, 0.3, 256},
        {1e6, {0, 0, -2e6}, 0, 256},    {1e-3, {0, 0, -2e-3}, 0, 256},    {1e-3, {1e6, 1e6, -1e6}, 1, -1},
        {0, {0, 0, -2}, 0, 0},          {1, {0, 0, 1e8}, 0, 0},           {1e15, {0, 0, -2e15}, 0, -1},
        {1e30, {0, 0, -1e30}, 0, -1},   {1e-25, {0, 0, -1e-25}, 0, -1},   {1, {0, 0, 0}, 1, -1},
    };
    static struct small_scene s;
    static struct fv_samples samples;
    for (unsigned i = 0; i < COUNT(table); i++) {
        open_plate(&s, table[i].size);
        struct fv_pose pose = {.rotation = {cos(table[i].turn / 2), 0, 0, sin(table[i].turn / 2)}};
        double eye[3] = {table[i].at[0] >= 1e6 ? 1e6 : 0, 0, 0}, no_turn[4] = {1, 0, 0, 0};
        memcpy(pose.position_m, table[i].at, sizeof pose.position_m);
        fv_tracer_move(&s.tracer, &pose);
        struct fv_view view = small_view(eye, no_turn, 26.565051177, 256);
        for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++) {
            int64_t rays[FV_RAY_KINDS] = {0};
            int seen = 0;
            small_grid(&samples, &view);
            fv_kernels((enum fv_isa)isa)->trace(&s.tracer, &view, &samples, 0, rays);
            for (int k = 0; k < samples.count; k++) {
                seen += samples.surface[k] == 1;
                assert_true(samples.red[k] >= 0 && samples.red[k] <= FV_RADIANCE_MAX);
                assert_true((samples.inverse_depth[k] >= 0 && samples.inverse_depth[k] <= FV_INVERSE_DEPTH_MAX) ||
                            samples.inverse_depth[k] == FV_DEPTH_UNKNOWN);
            }
            if (table[i].seen >= 0 && abs(seen - table[i].seen) > (table[i].seen ? 24 : 0))
                fail_msg("row %u: seen by %d samples, not %d", i, seen, table[i].seen);
        }
        fv_tracer_close(&s.tracer);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(maps_follow_objects), cmocka_unit_test(together_and_still),
                                       cmocka_unit_test(spins), cmocka_unit_test(rays_at_extremes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
