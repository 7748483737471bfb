/* long_rotation: rotations in long double, against which those in double are checked. Written by other
 * formulas than platform/pose where there are others: rotation by the matrix, logarithm by atan2 of
 * the whole vector part. For tests only. */
#ifndef FV_TESTS_LONG_ROTATION_H
#define FV_TESTS_LONG_ROTATION_H

#include <math.h>
#include <string.h>

#define LONG_PI 3.14159265358979323846264338327950288L

struct long_rotation {
    long double w, v[3];
};

static inline struct long_rotation long_of(const double q[4])
{
    return (struct long_rotation){q[0], {q[1], q[2], q[3]}};
}

static inline long double long_length(const long double *v, int n)
{
    long double largest = 0, sum = 0;
    for (int i = 0; i < n; i++) largest = fmaxl(largest, fabsl(v[i]));
    if (!(largest > 0)) return 0;
    for (int i = 0; i < n; i++) sum += v[i] / largest * (v[i] / largest);
    return largest * sqrtl(sum);
}

static inline struct long_rotation long_unit(struct long_rotation q)
{
    long double all[4] = {q.w, q.v[0], q.v[1], q.v[2]}, length = long_length(all, 4);
    return (struct long_rotation){q.w / length, {q.v[0] / length, q.v[1] / length, q.v[2] / length}};
}

static inline struct long_rotation long_inverse(struct long_rotation q)
{
    return (struct long_rotation){q.w, {-q.v[0], -q.v[1], -q.v[2]}};
}

static inline struct long_rotation long_product(struct long_rotation a, struct long_rotation b)
{
    struct long_rotation r = {a.w * b.w, {0}};
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        r.w -= a.v[i] * b.v[i];
        r.v[i] = a.w * b.v[i] + b.w * a.v[i] + a.v[j] * b.v[k] - a.v[k] * b.v[j];
    }
    return r;
}

/* The rotation by |r| radians about r. */
static inline struct long_rotation long_exp(const long double r[3])
{
    long double angle = long_length(r, 3), sine = sinl(angle / 2);
    struct long_rotation q = {cosl(angle / 2), {0}};
    for (int i = 0; i < 3 && angle > 0; i++) q.v[i] = r[i] / angle * sine;
    return q;
}

/* Shortest rotation vector, along the vector part at half a turn; returns its length. */
static inline long double long_log(struct long_rotation q, long double r[3])
{
    long double sine = long_length(q.v, 3), angle = 2 * atan2l(sine, fabsl(q.w));
    for (int i = 0; i < 3; i++) r[i] = sine > 0 ? (q.w < 0 ? -angle : angle) * (q.v[i] / sine) : 0;
    return angle;
}

static inline struct long_rotation long_slerp(struct long_rotation a, struct long_rotation b, long double t)
{
    long double r[3];
    long_log(long_product(long_inverse(a), b), r);
    for (int i = 0; i < 3; i++) r[i] *= t;
    return long_product(a, long_exp(r));
}

/* By the rotation matrix of q. */
static inline void long_rotate(struct long_rotation q, const long double v[3], long double out[3])
{
    long double r[3] = {0};
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        r[i] = (1 - 2 * (q.v[j] * q.v[j] + q.v[k] * q.v[k])) * v[i] +
               2 * (q.v[i] * q.v[j] - q.w * q.v[k]) * v[j] + 2 * (q.v[i] * q.v[k] + q.w * q.v[j]) * v[k];
    }
    memcpy(out, r, sizeof r);
}

/* Angle in radians between a rotation in double, of any length, and one in long double. */
static inline double long_angle(const double q[4], struct long_rotation exact)
{
    long double r[3];
    return (double)long_log(long_product(long_inverse(long_unit(long_of(q))), exact), r);
}

#endif
