/* pose: rotations and rigid motions in double, for everything that depends on time.
 *
 * Quaternions are w x y z, unit length, and turn device coordinates into world ones.
 * Axes: x right, y up, -z forward (glTF, OpenXR). cglm has these in float only; pixels use
 * cglm, poses use this. */
#ifndef FV_PLATFORM_POSE_H
#define FV_PLATFORM_POSE_H

#include <stdbool.h>
#include <stdint.h>

struct fv_pose {
    double position_m[3];
    double rotation[4]; /* w x y z */
};

/* Scales to unit length; the identity where the length is 0, infinite or NaN. */
void fv_quat_normalise(double q[4]);

/* out = a * b (first b, then a); out may be a or b. */
void fv_quat_multiply(const double a[4], const double b[4], double out[4]);

/* out = the inverse of a unit quaternion. */
void fv_quat_conjugate(const double q[4], double out[4]);

/* Rotates v by q; out may be v. */
void fv_quat_rotate(const double q[4], const double v[3], double out[3]);

/* The rotation by |r| radians about r: exponential map, exact to rounding near 0. The identity where
 * |r| is NaN or above 1e154, where it says nothing about the angle. */
void fv_quat_from_vector(const double r[3], double out[4]);

/* Its inverse: the shortest rotation vector of q, radians; exact to rounding near 0. */
void fv_quat_to_vector(const double q[4], double out[3]);

/* The shortest rotation vector from a to b, radians, in a's axes: that of the inverse of a, times b. */
void fv_quat_between(const double a[4], const double b[4], double out[3]);

/* Its length: the angle from a to b, radians, 0 to pi. */
double fv_quat_angle(const double a[4], const double b[4]);

/* Spherical interpolation along the shorter arc; goes on at the same speed for t outside [0, 1]. At t = 1 it
 * is b or -b, the same rotation; half a turn apart, either arc. */
void fv_quat_slerp(const double a[4], const double b[4], double t, double out[4]);

/* From yaw (about +y, left positive), pitch (about +x, up positive), roll (about +z), radians,
 * applied roll first. */
void fv_quat_from_yaw_pitch_roll(double yaw, double pitch, double roll, double out[4]);

/* out = a then b inside a: position a + R_a * b, rotation a * b. */
void fv_pose_compose(const struct fv_pose *a, const struct fv_pose *b, struct fv_pose *out);

/* True when the pose can be one: each coordinate finite and at most 1e9 m, the rotation of unit length (to
 * 1e-3). */
bool fv_pose_sound(const struct fv_pose *pose);

#endif
