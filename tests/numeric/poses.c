/* poses: rotations in double against long double, at and around every place where a formula could cancel,
 * overflow or divide 0 by 0. */
#include "platform/pose.h"
#include "tests/support/long_rotation.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <float.h>

#define COUNT(table) (sizeof table / sizeof table[0])
static const double eps = DBL_EPSILON;
static const double directions[][3] = {{1, 0, 0},          {0, -1, 0},        {0, 0, 1},
                                       {0.6, -0.8, 0},     {1e-200, 1, 1e-9}, {0.48, 0.6, 0.64},
                                       {-0.36, 0.48, -0.8}};
/* Angles from the smallest denormal to half a turn; pi as the nearest double lies just below it. */
static const double angles[] = {0,
                                5e-324,
                                1e-310,
                                DBL_MIN,
                                1e-300,
                                1e-200,
                                1e-162,
                                1e-160,
                                1e-154,
                                1e-100,
                                1e-30,
                                1e-16,
                                1e-13,
                                9e-13,
                                2.1e-12,
                                1e-9,
                                1e-8,
                                1.9e-4,
                                2.1e-4,
                                1e-3,
                                0.1,
                                1,
                                1.5707963267948966,
                                2,
                                3,
                                3.1415,
                                3.14159265,
                                3.1415926535,
                                3.14159265358979};

static double length_of(const double *v, int n)
{
    long double exact[4] = {0};
    for (int i = 0; i < n; i++) exact[i] = v[i];
    return (double)long_length(exact, n);
}

/* Whatever comes in, a unit quaternion goes out, along the given one where that has a direction. */
static void normalise(void **state)
{
    (void)state;
    static const double odd[][4] = {{0, 0, 0, 0},          {-0.0, 0, 0, 0},     {NAN, 0, 0, 0},
                                    {0, 1, NAN, 0},        {INFINITY, 0, 0, 0}, {1, -INFINITY, 0, 0},
                                    {NAN, INFINITY, 0, 0}, {1e308, NAN, 0, 0}};
    for (unsigned i = 0; i < COUNT(odd); i++) {
        double q[4];
        memcpy(q, odd[i], sizeof q);
        fv_quat_normalise(q);
        assert_true(q[0] == 1 && q[1] == 0 && q[2] == 0 && q[3] == 0);
    }
    static const double sizes[] = {5e-324, 1e-320, DBL_MIN, 1e-160, 1e-150, 1e-140, 1e-8,
                                   1,      1e8,    1e139,   1e141,  1e154,  1e300,  4e307};
    static const double shapes[][4] = {
        {1, 0, 0, 0}, {0, -1, 0, 0}, {1, 1, 1, 1}, {-3, 1, 2, 0}, {1, 1e-9, 0, 1e-200}};
    for (unsigned i = 0; i < COUNT(sizes); i++)
        for (unsigned k = 0; k < COUNT(shapes); k++) {
            double q[4], given[4];
            for (int c = 0; c < 4; c++) q[c] = given[c] = sizes[i] * shapes[k][c];
            fv_quat_normalise(q);
            if (!(fabs(length_of(q, 4) - 1) < 2 * eps))
                fail_msg("size %g, shape %u: length %.17g", sizes[i], k, length_of(q, 4));
            assert_true(long_angle(q, long_unit(long_of(given))) < 2 * eps);
        }
}

/* Exponential against long double; logarithm of it gives the vector back, relative to its length. */
static void exponential_and_logarithm(void **state)
{
    (void)state;
    for (unsigned d = 0; d < COUNT(directions); d++)
        for (unsigned a = 0; a < COUNT(angles); a++)
            for (int sign = -1; sign <= 1; sign += 2) {
                double r[3], q[4], back[3], worst = 0;
                long double exact[3];
                for (int i = 0; i < 3; i++) exact[i] = r[i] = sign * angles[a] * directions[d][i];
                struct long_rotation e = long_exp(exact);
                fv_quat_from_vector(r, q);
                fv_quat_to_vector(q, back);
                assert_true(fabs(length_of(q, 4) - 1) < 2 * eps);
                for (int i = 0; i < 3; i++) {
                    /* The smallest double is the limit below 1e-308. */
                    double limit = 3 * eps * (double)fabsl(e.v[i]) + 5e-324;
                    if (!(fabsl(q[i + 1] - e.v[i]) <= limit)) fail_msg("exp of %g along %u", angles[a], d);
                    worst = fmax(worst, fabs(back[i] - r[i]));
                }
                assert_true(fabsl(q[0] - e.w) <= 2 * eps);
                if (!(worst <= 4 * eps * angles[a] + 1e-323))
                    fail_msg("log of exp of %g along %u: off by %g", angles[a], d, worst);
            }
}

/* The logarithm of quaternions given as such: near the identity with either sign, near half a turn. */
static void logarithm(void **state)
{
    (void)state;
    static const double sines[] = {0,        5e-324, 1e-300, 1e-162, 1e-155, 9.9e-13,
                                   1.01e-12, 1e-9,   1e-8,   1e-4,   0.5};
    for (unsigned s = 0; s < COUNT(sines); s++)
        for (unsigned d = 0; d < COUNT(directions); d++)
            for (int k = 0; k < 4; k++) { /* identity and half a turn, q and -q */
                double sine = sines[s], cosine = sqrt(1 - sine * sine), sign = k % 2 ? -1 : 1, q[4], r[3];
                q[0] = sign * (k < 2 ? cosine : sine);
                for (int i = 0; i < 3; i++) q[i + 1] = sign * directions[d][i] * (k < 2 ? sine : cosine);
                long double exact[3], angle = long_log(long_unit(long_of(q)), exact);
                fv_quat_to_vector(q, r);
                for (int i = 0; i < 3; i++)
                    if (!(fabsl(r[i] - exact[i]) <= 4 * eps * angle + 1e-323L))
                        fail_msg("sine %g, direction %u, case %d", sine, d, k);
            }
}

/* Vectors that say nothing give the identity; many turns are taken as far as their digits go. */
static void exponential_of_huge_vectors(void **state)
{
    (void)state;
    static const double odd[][3] = {{NAN, 0, 0},
                                    {0, INFINITY, 0},
                                    {INFINITY, -INFINITY, NAN},
                                    {1e155, 0, 0},
                                    {DBL_MAX, DBL_MAX, DBL_MAX}};
    for (unsigned i = 0; i < COUNT(odd); i++) {
        double q[4];
        fv_quat_from_vector(odd[i], q);
        assert_true(q[0] == 1 && q[1] == 0 && q[2] == 0 && q[3] == 0);
    }
    static const double huge[] = {3.2, 6.283185307179586, 7, 100, 1e6, 1e9, 1e15, 1e20, 1e100, 1e153};
    for (unsigned i = 0; i < COUNT(huge); i++) {
        double r[3] = {0.6 * huge[i], 0, -0.8 * huge[i]}, q[4];
        long double exact[3] = {r[0], r[1], r[2]};
        fv_quat_from_vector(r, q);
        assert_true(fabs(length_of(q, 4) - 1) < 2 * eps);
        if (huge[i] < 1e15) assert_true(long_angle(q, long_exp(exact)) < 3 * eps * (1 + huge[i]));
    }
}

/* At every part of the way, also outside [0, 1], against long double; from 0 to just short of half a turn. */
static void slerp(void **state)
{
    (void)state;
    static const double parts[] = {0, 5e-324, 1e-300, 1e-9, 0.25, 0.5, 0.75, 1 - 1e-9, 1, 2, -1, 10, -3.5};
    uint64_t random = 1;
    for (unsigned d = 0; d < COUNT(directions); d++)
        for (unsigned a = 0; a < COUNT(angles); a++)
            for (unsigned p = 0; p < COUNT(parts); p++) {
                double from[4], to[4], r[3], step[4], out[4], minus[4];
                random_rotation(&random, from);
                fv_quat_normalise(from);
                for (int i = 0; i < 3; i++) r[i] = angles[a] * directions[d][i];
                fv_quat_from_vector(r, step);
                fv_quat_multiply(from, step, to);
                fv_quat_slerp(from, to, parts[p], out);
                struct long_rotation exact =
                    long_slerp(long_unit(long_of(from)), long_unit(long_of(to)), parts[p]);
                double limit = 6 * eps * (1 + fabs(parts[p]));
                assert_true(fabs(fv_quat_angle(from, to) - angles[a]) <= 6 * eps);
                if (!(long_angle(out, exact) <= limit))
                    fail_msg("angle %.17g, part %g: off by %g", angles[a], parts[p], long_angle(out, exact));
                for (int i = 0; i < 4; i++) minus[i] = -to[i];
                fv_quat_slerp(from, minus, parts[p], minus);
                assert_true(long_angle(minus, exact) <= limit);
            }
}

/* Half a turn apart, either arc is right; both lie in between. Odd t: a pose all the same. */
static void slerp_half_a_turn_apart(void **state)
{
    (void)state;
    static const double off[] = {0, 5e-324, 1e-300, 1e-17, 1e-16, -1e-16, -1e-300, 1e-12};
    for (unsigned i = 0; i < COUNT(off); i++)
        for (int part = 0; part <= 4; part++) {
            double from[4] = {1, 0, 0, 0}, to[4] = {off[i], 0.6, 0, -0.8}, out[4], t = part / 4.0;
            fv_quat_slerp(from, to, t, out);
            assert_true(fabs(long_angle(out, long_of(from)) - t * M_PI) < 1e-11);
            assert_true(fabs(long_angle(out, long_of(to)) - (1 - t) * M_PI) < 1e-11);
        }
    static const double odd[] = {NAN, INFINITY, -INFINITY, DBL_MAX};
    for (unsigned i = 0; i < COUNT(odd); i++) {
        double from[4] = {0.6, 0, 0.8, 0}, to[4] = {1, 0, 0, 0}, out[4];
        fv_quat_slerp(from, to, odd[i], out);
        assert_true(fabs(length_of(out, 4) - 1) < 2 * eps);
        fv_quat_slerp(from, from, odd[i], out);
        assert_true(fabs(length_of(out, 4) - 1) < 2 * eps);
    }
}

/* Product, rotation and composition on random rotations and vectors of all sizes. */
static void products_and_rotations(void **state)
{
    (void)state;
    uint64_t random = 2;
    for (int n = 0; n < 100000; n++) {
        double a[4], b[4], v[3], out[4], size = random_decade(&random, 1e-300, 1e300);
        random_rotation(&random, a);
        random_rotation(&random, b);
        random_direction(&random, v);
        for (int i = 0; i < 3; i++) v[i] *= size;
        struct long_rotation la = long_of(a), lb = long_of(b), product = long_product(la, lb);
        fv_quat_multiply(a, b, out);
        assert_true(fabsl(out[0] - product.w) < 2 * eps);
        for (int i = 0; i < 3; i++) assert_true(fabsl(out[i + 1] - product.v[i]) < 2 * eps);
        double rotated[3];
        long double lv[3] = {v[0], v[1], v[2]}, exact[3];
        fv_quat_rotate(a, v, rotated);
        long_rotate(long_unit(la), lv, exact);
        for (int i = 0; i < 3; i++) assert_true(fabsl(rotated[i] - exact[i]) < 6 * eps * size);
        struct fv_pose p = {{1e6, -1e6, 3e5}, {0}}, q = {{1e-6, 0, 2e-6}, {0}}, sum;
        memcpy(p.rotation, a, sizeof a);
        memcpy(q.rotation, b, sizeof b);
        fv_pose_compose(&p, &q, &sum);
        assert_true(long_angle(sum.rotation, long_unit(product)) < 4 * eps);
        long double small[3] = {q.position_m[0], q.position_m[1], q.position_m[2]};
        long_rotate(long_unit(la), small, exact);
        for (int i = 0; i < 3; i++)
            assert_true(fabsl(sum.position_m[i] - (p.position_m[i] + exact[i])) <=
                        eps * fabs(p.position_m[i]));
    }
}

/* Yaw, pitch and roll at all sizes and at the poles, against turns one after another. */
static void yaw_pitch_roll(void **state)
{
    (void)state;
    static const double turns[] = {0, 1e-300, 1e-9, 0.3, M_PI / 2, M_PI, -M_PI, 2 * M_PI, -2.5, 1e3, 1e9};
    for (unsigned y = 0; y < COUNT(turns); y++)
        for (unsigned p = 0; p < COUNT(turns); p++)
            for (unsigned r = 0; r < COUNT(turns); r++) {
                long double yaw[3] = {0, turns[y], 0}, pitch[3] = {turns[p], 0, 0},
                            roll[3] = {0, 0, turns[r]};
                double q[4];
                fv_quat_from_yaw_pitch_roll(turns[y], turns[p], turns[r], q);
                struct long_rotation exact =
                    long_product(long_product(long_exp(yaw), long_exp(pitch)), long_exp(roll));
                assert_true(fabs(length_of(q, 4) - 1) < 4 * eps && long_angle(q, exact) < 6 * eps);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(normalise),
                                       cmocka_unit_test(exponential_and_logarithm),
                                       cmocka_unit_test(logarithm),
                                       cmocka_unit_test(exponential_of_huge_vectors),
                                       cmocka_unit_test(slerp),
                                       cmocka_unit_test(slerp_half_a_turn_apart),
                                       cmocka_unit_test(products_and_rotations),
                                       cmocka_unit_test(yaw_pitch_roll)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
