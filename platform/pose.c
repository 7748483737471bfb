/* pose: see pose.h. Series are used where the closed form would cancel or divide 0 by 0. */
#include "platform/pose.h"

#include <float.h>
#include <math.h>
#include <string.h>

void fv_quat_normalise(double q[4])
{
    double n2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!(n2 > 1e-280 && n2 < 1e280)) { /* squares may have lost digits, or overflowed */
        double largest = fmax(fmax(fabs(q[0]), fabs(q[1])), fmax(fabs(q[2]), fabs(q[3])));
        n2 = 0;
        for (int i = 0; largest > 0 && largest <= DBL_MAX && i < 4; i++) {
            q[i] /= largest;
            n2 += q[i] * q[i];
        }
    }
    if (!(n2 > 0)) {
        q[0] = 1;
        q[1] = q[2] = q[3] = 0;
        return;
    }
    double s = 1 / sqrt(n2);
    for (int i = 0; i < 4; i++) q[i] *= s;
}

void fv_quat_multiply(const double a[4], const double b[4], double out[4])
{
    double r[4] = {
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    };
    memcpy(out, r, sizeof r);
}

void fv_quat_conjugate(const double q[4], double out[4])
{
    out[0] = q[0];
    for (int i = 1; i < 4; i++) out[i] = -q[i];
}

void fv_quat_rotate(const double q[4], const double v[3], double out[3])
{
    /* v + 2 w (u x v) + 2 u x (u x v), u the vector part. */
    double c[3] = {q[2] * v[2] - q[3] * v[1] + q[0] * v[0],
                   q[3] * v[0] - q[1] * v[2] + q[0] * v[1],
                   q[1] * v[1] - q[2] * v[0] + q[0] * v[2]};
    double r[3] = {v[0] + 2 * (q[2] * c[2] - q[3] * c[1]),
                   v[1] + 2 * (q[3] * c[0] - q[1] * c[2]),
                   v[2] + 2 * (q[1] * c[1] - q[2] * c[0])};
    memcpy(out, r, sizeof r);
}

void fv_quat_from_vector(const double r[3], double out[4])
{
    double half2 = 0.25 * (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]), half = sqrt(half2);
    double scale = half2 < 1e-8 ? 0.5 - half2 / 12 : 0.5 * sin(half) / half;
    out[0] = cos(half);
    for (int i = 0; i < 3; i++) out[i + 1] = r[i] * scale;
    fv_quat_normalise(out);
}

void fv_quat_to_vector(const double q[4], double out[3])
{
    double s = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]), sign = q[0] < 0 ? -1 : 1;
    double scale = s < 1e-12 ? 2 : 2 * atan2(s, sign * q[0]) / s;
    for (int i = 0; i < 3; i++) out[i] = sign * scale * q[i + 1];
}

void fv_quat_between(const double a[4], const double b[4], double out[3])
{
    double step[4];
    fv_quat_conjugate(a, step);
    fv_quat_multiply(step, b, step);
    fv_quat_to_vector(step, out);
}

double fv_quat_angle(const double a[4], const double b[4])
{
    double v[3];
    fv_quat_between(a, b, v);
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

void fv_quat_slerp(const double a[4], const double b[4], double t, double out[4])
{
    double step[4], vector[3];
    fv_quat_between(a, b, vector);
    for (int i = 0; i < 3; i++) vector[i] *= t;
    fv_quat_from_vector(vector, step);
    fv_quat_multiply(a, step, out);
    fv_quat_normalise(out);
}

void fv_quat_from_yaw_pitch_roll(double yaw, double pitch, double roll, double out[4])
{
    double y[4] = {cos(yaw / 2), 0, sin(yaw / 2), 0};
    double p[4] = {cos(pitch / 2), sin(pitch / 2), 0, 0};
    double r[4] = {cos(roll / 2), 0, 0, sin(roll / 2)};
    fv_quat_multiply(y, p, out);
    fv_quat_multiply(out, r, out);
}

void fv_pose_compose(const struct fv_pose *a, const struct fv_pose *b, struct fv_pose *out)
{
    struct fv_pose r;
    fv_quat_rotate(a->rotation, b->position_m, r.position_m);
    for (int i = 0; i < 3; i++) r.position_m[i] += a->position_m[i];
    fv_quat_multiply(a->rotation, b->rotation, r.rotation);
    fv_quat_normalise(r.rotation);
    *out = r;
}

bool fv_pose_sound(const struct fv_pose *pose)
{
    const double *p = pose->position_m, *q = pose->rotation;
    for (int i = 0; i < 3; i++)
        if (!(fabs(p[i]) <= 1e9)) return false;
    return fabs(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1) <= 2e-3;
}
