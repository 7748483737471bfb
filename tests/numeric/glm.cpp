/* glm: rotations, poses, lenses and maps against GLM in double, and the cglm calls that building scenes uses
 * against GLM in float: a million random inputs and the edges. GLM is written by others and by other
 * formulas, so that a mistake in convention (order, handedness, sign) shows as well as one in rounding.
 *
 * Tolerances are in units of the type's epsilon times the largest term that is summed: a sum of n products
 * rounds by up to n halves of that, and so does GLM's; each is allowed some twice of what was found. */
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstring>

extern "C" {
#include "rt/fovea/view.h"

#include <cmocka.h>
}
#include "tests/support/random.h"

#include <cglm/cglm.h>
#include <cglm/struct.h>

#define GLM_ENABLE_EXPERIMENTAL
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/gtx/euler_angles.hpp>
#include <glm/gtx/quaternion.hpp>

namespace
{

const int inputs = 1000000;
const double eps = 0x1p-52;
const float epsf = 0x1p-23f;
const double angles[] = {0,    1e-300, 1e-160, 1e-17,    3e-16, 1e-12,       1e-9,         1e-8,
                         1e-4, 0.5,    1.5,    M_PI / 2, 3,     M_PI - 1e-6, M_PI - 1e-12, M_PI};
const int edges = sizeof angles / sizeof angles[0];

glm::dquat quat(const double q[4])
{
    return glm::dquat(q[0], q[1], q[2], q[3]);
}

glm::dvec3 vec(const double v[3])
{
    return glm::dvec3(v[0], v[1], v[2]);
}

double difference(const double q[4], const glm::dquat &g)
{
    return std::fmax(std::fmax(std::fabs(q[0] - g.w), std::fabs(q[1] - g.x)),
                     std::fmax(std::fabs(q[2] - g.y), std::fabs(q[3] - g.z)));
}

double difference(const double v[3], const glm::dvec3 &g)
{
    return std::fmax(std::fabs(v[0] - g.x), std::fmax(std::fabs(v[1] - g.y), std::fabs(v[2] - g.z)));
}

/* The largest difference found, in units of eps; fails above the limit. */
struct worst {
    const char *what;
    double limit, found;
    void take(double off)
    {
        if (!(off <= limit)) fail_msg("%s: off by %g units, at most %g are allowed", what, off, limit);
        found = std::fmax(found, off);
    }
    void print() const
    {
        print_message("%-22s %8.2f of %g units\n", what, found, limit);
    }
};

/* Rotation n: the first ones about the axes by the edges' angles, with either sign; random ones then. */
void rotation(uint64_t *random, int n, double q[4])
{
    random_rotation(random, q);
    if (n >= edges * 6) return;
    double r[3] = {0, 0, 0};
    r[n / edges % 3] = angles[n % edges];
    fv_quat_from_vector(r, q);
    for (int i = 0; i < 4 && n >= edges * 3; i++) q[i] = -q[i];
}

void quaternions(void **)
{
    uint64_t random = 1;
    worst product = {"product", 4, 0}, turn = {"rotate", 8, 0}, compose = {"compose, position", 6, 0},
          both = {"compose, rotation", 6, 0};
    for (int n = 0; n < inputs; n++) {
        double a[4], b[4], out[4], v[3], rotated[3], size = random_decade(&random, 1e-150, 1e150);
        rotation(&random, n, a);
        rotation(&random, n / 7, b);
        random_direction(&random, v);
        for (int i = 0; i < 3; i++) v[i] *= size;
        fv_quat_multiply(a, b, out);
        product.take(difference(out, quat(a) * quat(b)) / eps);
        fv_quat_conjugate(a, out);
        assert_true(difference(out, glm::conjugate(quat(a))) == 0);
        fv_quat_rotate(a, v, rotated);
        turn.take(difference(rotated, quat(a) * vec(v)) / eps / size);
        /* Poses as 4 x 4 matrices. */
        fv_pose p = {{v[0], v[1], v[2]}, {a[0], a[1], a[2], a[3]}},
                r = {{size, -size, 0}, {b[0], b[1], b[2], b[3]}}, sum;
        fv_pose_compose(&p, &r, &sum);
        if (n % 4) continue;
        glm::dmat4 m = glm::translate(glm::dmat4(1), vec(p.position_m)) * glm::mat4_cast(quat(a)) *
                       glm::translate(glm::dmat4(1), vec(r.position_m)) * glm::mat4_cast(quat(b));
        glm::dquat turned = glm::quat_cast(glm::dmat3(m));
        if (glm::dot(turned, quat(sum.rotation)) < 0) turned = -turned;
        compose.take(difference(sum.position_m, glm::dvec3(m[3])) / eps / (2 * size));
        both.take(difference(sum.rotation, turned) / eps);
    }
    product.print(), turn.print(), compose.print(), both.print();
}

/* GLM's log takes less than epsilon for nothing, so that the unit is eps itself, not the value; its exp gives
 * no quaternion at all there, and is left out. */
void exponential_and_logarithm(void **)
{
    uint64_t random = 2;
    worst exponential = {"exponential", 3, 0}, axis = {"angle and axis", 3, 0},
          logarithm = {"logarithm", 4, 0};
    for (int n = 0; n < inputs; n++) {
        double direction[3], r[3], q[4], back[3],
            angle = n < 3 * edges ? angles[n % edges]
                    : n % 2       ? random_between(&random, 0, M_PI)
                                  : random_decade(&random, 1e-20, M_PI);
        random_direction(&random, direction);
        for (int i = 0; i < 3; i++) r[i] = direction[i] * angle;
        fv_quat_from_vector(r, q);
        if (angle > 5e-16) exponential.take(difference(q, glm::exp(glm::dquat(0, 0.5 * vec(r)))) / eps);
        axis.take(difference(q, glm::angleAxis(angle, vec(direction))) / eps);
        if (n % 2) random_rotation(&random, q);
        fv_quat_to_vector(q, back);
        glm::dquat shorter = q[0] < 0 ? -quat(q) : quat(q), l = glm::log(shorter);
        logarithm.take(difference(back, 2.0 * glm::dvec3(l.x, l.y, l.z)) / eps);
    }
    exponential.print(), axis.print(), logarithm.print();
}

/* Ours goes through the logarithm of the turn between, GLM's through the sines of parts of its half. */
void slerp(void **)
{
    uint64_t random = 3;
    worst between = {"slerp", 6, 0};
    const double parts[] = {0, 1, 0.5, 1e-9, 1 - 1e-9, 1e-300, 0.25};
    for (int n = 0; n < inputs; n++) {
        double a[4], b[4], out[4], t = n % 2 ? parts[n / 2 % 7] : random_between(&random, 0, 1);
        rotation(&random, n, a);
        random_rotation(&random, b);
        if (n % 3 == 0) { /* close to each other, or nearly half a turn apart */
            double r[3], step[4];
            random_direction(&random, r);
            for (int i = 0; i < 3; i++)
                r[i] *= n % 2 ? random_decade(&random, 1e-18, 1) : M_PI - random_decade(&random, 1e-6, 1);
            fv_quat_from_vector(r, step);
            fv_quat_multiply(a, step, b);
        }
        glm::dquat x = quat(a), y = quat(b);
        if (std::fabs(glm::dot(x, y)) < 1e-9) continue; /* half a turn: either arc */
        fv_quat_slerp(a, b, t, out);
        glm::dquat g = glm::normalize(glm::slerp(x, y, t));
        if (glm::dot(g, quat(out)) < 0) g = -g;
        between.take(difference(out, g) / eps);
    }
    between.print();
}

void yaw_pitch_roll(void **)
{
    uint64_t random = 4;
    worst quaternion = {"yaw, pitch, roll", 6, 0}, matrix = {"the same as matrices", 12, 0};
    for (int n = 0; n < inputs; n++) {
        double turn[3], q[4];
        for (int i = 0; i < 3; i++)
            turn[i] = n % 5 == i ? angles[(n / 5 + 3 * i) % edges] * (n % 2 ? 1 : -1)
                                 : random_between(&random, -7, 7);
        fv_quat_from_yaw_pitch_roll(turn[0], turn[1], turn[2], q);
        quaternion.take(difference(q, glm::angleAxis(turn[0], glm::dvec3(0, 1, 0)) *
                                          glm::angleAxis(turn[1], glm::dvec3(1, 0, 0)) *
                                          glm::angleAxis(turn[2], glm::dvec3(0, 0, 1))) /
                        eps);
        double ahead[3] = {0.48, 0.6, -0.64};
        glm::dvec4 g =
            glm::eulerAngleYXZ(turn[0], turn[1], turn[2]) * glm::dvec4(ahead[0], ahead[1], ahead[2], 0);
        fv_quat_rotate(q, ahead, ahead);
        matrix.take(difference(ahead, glm::dvec3(g)) / eps);
    }
    quaternion.print(), matrix.print();
}

struct camera {
    fv_lens lens;
    fv_view view;
    glm::dmat4 world_to_eye, frustum;
    glm::dvec4 viewport;
};

/* Lopsided lenses from a degree to 87.5 on each side; the viewport's origin is at its lower left. */
camera random_camera(uint64_t *random, bool symmetric)
{
    camera c;
    double tangent[4], direction[3], ahead[3] = {0, 0, -1};
    for (double &t : tangent) t = std::tan(random_decade(random, 1, 87.5) * M_PI / 180);
    if (symmetric) tangent[1] = tangent[0], tangent[3] = tangent[2];
    c.lens = {tangent[0],
              tangent[1],
              tangent[2],
              tangent[3],
              (int)random_between(random, 1, 4096),
              (int)random_between(random, 1, 4096)};
    fv_pose pose;
    random_rotation(random, pose.rotation);
    fv_quat_normalise(pose.rotation);
    random_direction(random, direction);
    for (int i = 0; i < 3; i++) pose.position_m[i] = direction[i] * 10;
    fv_view_set(&c.view, &c.lens, &pose, ahead);
    c.world_to_eye = glm::mat4_cast(glm::conjugate(quat(pose.rotation))) *
                     glm::translate(glm::dmat4(1), -vec(pose.position_m));
    c.frustum = glm::frustum(-tangent[0], tangent[1], -tangent[3], tangent[2], 1.0, 1000.0);
    if (symmetric)
        c.frustum = glm::perspective(2 * std::atan(tangent[2]), tangent[0] / tangent[2], 1.0, 1000.0);
    c.viewport = glm::dvec4(0, 0, c.lens.width, c.lens.height);
    return c;
}

/* World to pixel in double; pixel to ray in float; both with GLM's frustum and with its perspective. */
void lenses(void **)
{
    uint64_t random = 5;
    worst pixels = {"project, double", 6, 0}, rays = {"ray of a pixel, float", 3, 0};
    for (int n = 0; n < inputs; n++) {
        camera c = random_camera(&random, n % 2);
        const fv_lens &l = c.lens;
        double x = random_between(&random, 0, l.width), y = random_between(&random, 0, l.height),
               depth = random_decade(&random, 1, 1000);
        if (n % 16 < 4) x = n % 2 ? l.width : 0, y = n % 4 / 2 ? l.height : 0;
        double eye[3] = {((l.tan_left + l.tan_right) * x / l.width - l.tan_left) * depth,
                         (l.tan_up - (l.tan_up + l.tan_down) * y / l.height) * depth, -depth},
               world[3], pixel[2];
        fv_quat_rotate(c.view.pose.rotation, eye, world);
        for (int i = 0; i < 3; i++) world[i] += c.view.pose.position_m[i];
        glm::dvec3 window = glm::project(vec(world), c.world_to_eye, c.frustum, c.viewport);
        double inverse[4], back[3], length = glm::length(vec(eye));
        fv_quat_conjugate(c.view.pose.rotation, inverse);
        for (int i = 0; i < 3; i++) back[i] = world[i] - c.view.pose.position_m[i];
        fv_quat_rotate(inverse, back, back);
        for (double &b : back) b /= length;
        assert_true(fv_lens_project(&l, back, pixel));
        /* What rounds is the world's coordinates, 10 m and the distance, as seen from the depth: in pixels
         * that is that error over the depth and over a pixel's size, and more where the ray is steep. */
        double steep = length / depth, world_error = (10 + length) / depth * steep;
        double unit_x = eps * world_error * l.width / (l.tan_left + l.tan_right),
               unit_y = eps * world_error * l.height / (l.tan_up + l.tan_down);
        pixels.take(std::fabs(pixel[0] - window.x) / (unit_x + eps * l.width));
        pixels.take(std::fabs(l.height - pixel[1] - window.y) / (unit_y + eps * l.height));
        if (n % 4) continue;
        glm::dvec3 near =
            glm::unProject(glm::dvec3(x, l.height - y, 0), c.world_to_eye, c.frustum, c.viewport) -
            vec(c.view.pose.position_m);
        for (int i = 0; i < 3; i++) { /* the sum of three terms, up to the tangents, in float */
            float ray = c.view.corner[i] + (float)x * c.view.dx[i] + (float)y * c.view.dy[i];
            rays.take(std::fabs((double)ray - near[i]) / (double)epsf /
                      (1 + l.tan_left + l.tan_right + l.tan_up + l.tan_down));
        }
    }
    pixels.print(), rays.print();
}

/* A point that one camera sees, found in another's picture: by the map, and by GLM through the world. */
void maps(void **)
{
    uint64_t random = 6;
    worst pixels = {"map, float", 2, 0}, depths = {"depth through the map", 2, 0};
    for (int n = 0; n < inputs / 4; n++) {
        camera now = random_camera(&random, false), before = random_camera(&random, false);
        fv_map map;
        double x = random_between(&random, 0, now.lens.width),
               y = random_between(&random, 0, now.lens.height), depth = random_decade(&random, 1, 1000);
        double z_window = 1000 * (depth - 1) / (999 * depth); /* of the frustum from 1 to 1000 */
        glm::dvec3 world = glm::unProject(glm::dvec3(x, now.lens.height - y, z_window), now.world_to_eye,
                                          now.frustum, now.viewport);
        glm::dvec4 eye = before.world_to_eye * glm::dvec4(world, 1);
        if (-eye.z < 1) continue;
        glm::dvec3 window = glm::project(world, before.world_to_eye, before.frustum, before.viewport);
        fv_map_set(&map, &now.view, &before.view);
        double to[3], w = 1 / depth;
        for (int r = 0; r < 3; r++) to[r] = map.m[r][0] * x + map.m[r][1] * y + map.m[r][2] + map.t[r] * w;
        /* The map's entries are floats of this size, and what they give is divided by Z. */
        const fv_lens &l = now.lens, &k = before.lens;
        double far = 1 + l.tan_left + l.tan_right + l.tan_up + l.tan_down + 20 * w, z = -eye.z / depth;
        double unit_x = (double)epsf * far / z *
                        ((1 + k.tan_left) * k.width / (k.tan_left + k.tan_right) + std::fabs(window.x));
        double unit_y =
            (double)epsf * far / z *
            ((1 + k.tan_up) * k.height / (k.tan_up + k.tan_down) + std::fabs(k.height - window.y));
        depths.take(std::fabs(to[2] - z) / ((double)epsf * far));
        pixels.take(std::fabs(to[0] / to[2] - window.x) / unit_x);
        pixels.take(std::fabs(to[1] / to[2] - (k.height - window.y)) / unit_y);
    }
    pixels.print(), depths.print();
}

glm::vec3 of(vec3s v)
{
    return glm::vec3(v.raw[0], v.raw[1], v.raw[2]);
}

float difference(vec3s v, glm::vec3 g)
{
    return std::fmax(std::fabs(v.raw[0] - g.x),
                     std::fmax(std::fabs(v.raw[1] - g.y), std::fabs(v.raw[2] - g.z)));
}

vec3s random_vector(uint64_t *random, double low, double high)
{
    double d[3], size = random_decade(random, low, high);
    random_direction(random, d);
    vec3s v = {{(float)(d[0] * size), (float)(d[1] * size), (float)(d[2] * size)}};
    return v;
}

/* Vectors from 1e-6 to 1e6 m, as scenes have them. Sums of a component or two are the same to the bit; those
 * of three products, roots and quotients are not. */
void cglm_vectors(void **)
{
    uint64_t random = 7;
    worst dot = {"cglm dot", 3, 0}, cross = {"cglm cross", 2, 0}, unit = {"cglm normalise", 4, 0},
          length = {"cglm norm, distance", 3, 0}, mix = {"cglm lerp", 2, 0}, ortho = {"cglm ortho", 2, 0};
    for (int n = 0; n < inputs; n++) {
        vec3s a = random_vector(&random, 1e-6, 1e6), b = random_vector(&random, 1e-6, 1e6);
        if (n % 8 == 0) b = glms_vec3_scale(a, (float)random_between(&random, -2, 2));
        if (n % 64 == 1) a.raw[n / 64 % 3] = 0;
        float s = (float)random_between(&random, 0, 1), la = glm::length(of(a)), lb = glm::length(of(b));
        assert_true(difference(glms_vec3_add(a, b), of(a) + of(b)) == 0 &&
                    difference(glms_vec3_sub(a, b), of(a) - of(b)) == 0);
        assert_true(difference(glms_vec3_scale(a, s), of(a) * s) == 0 &&
                    difference(glms_vec3_negate(a), -of(a)) == 0);
        dot.take((double)(std::fabs(glms_vec3_dot(a, b) - glm::dot(of(a), of(b))) / (epsf * la * lb)));
        cross.take((double)(difference(glms_vec3_cross(a, b), glm::cross(of(a), of(b))) / (epsf * la * lb)));
        unit.take((double)(difference(glms_vec3_normalize(a), glm::normalize(of(a))) / epsf));
        length.take((double)(std::fabs(glms_vec3_norm(a) - la) / (epsf * la)));
        length.take(
            (double)(std::fabs(glms_vec3_distance(a, b) - glm::distance(of(a), of(b))) / (epsf * (la + lb))));
        mix.take(
            (double)(difference(glms_vec3_lerp(a, b, s), glm::mix(of(a), of(b), s)) / (epsf * (la + lb))));
        /* Only of unit vectors does it stay clear of 0, and only of those are we asking it. */
        vec3s axis = glms_vec3_normalize(a);
        glm::vec3 across = of(glms_vec3_ortho(axis));
        if (!(glm::length(across) > 0.3f))
            fail_msg("ortho of %g %g %g", (double)axis.raw[0], (double)axis.raw[1], (double)axis.raw[2]);
        ortho.take((double)(std::fabs(glm::dot(across, of(axis))) / (epsf * glm::length(across))));
    }
    vec3s zero = {{0, 0, 0}};
    assert_true(difference(glms_vec3_normalize(zero), glm::vec3(0)) == 0); /* GLM's is NaN */
    dot.print(), cross.print(), unit.print(), length.print(), mix.print(), ortho.print();
}

float difference(const mat4 m, const glm::mat4 &g)
{
    float most = 0;
    for (int c = 0; c < 4; c++)
        for (int r = 0; r < 4; r++) most = std::fmax(most, std::fabs(m[c][r] - g[c][r]));
    return most;
}

/* Nodes of glTF files (quaternion, translation, product) and brushes (translation, turns). GLM makes matrices
 * of quaternions whose length is off by rounding four times as much so, cglm divides by it again. */
void cglm_matrices(void **)
{
    uint64_t random = 8;
    worst turned = {"cglm quat to matrix", 12, 0}, product = {"cglm matrix product", 12, 0},
          brush = {"cglm rotate", 4, 0}, point = {"cglm matrix, vector", 6, 0},
          normal = {"cglm mat3, vector", 4, 0};
    for (int n = 0; n < inputs / 2; n++) {
        double q[4], size = random_decade(&random, 1e-3, 1e3);
        versor v; /* x y z w */
        mat4 m, t, both;
        rotation(&random, n, q);
        for (int i = 0; i < 4; i++) v[i] = (float)(q[(i + 1) % 4] * size);
        glm::quat g = glm::normalize(glm::quat(v[3], v[0], v[1], v[2]));
        glm_quat_normalize(v);
        glm_quat_mat4(v, m);
        turned.take((double)(difference(m, glm::mat4_cast(g)) / epsf));
        vec3s way = random_vector(&random, 1e-3, 1e3);
        float length = glm::length(of(way)), angle = (float)random_between(&random, -7, 7);
        if (n % 5 == 0) angle = (float)angles[n / 5 % edges];
        mat4s place = glms_translate_make(way);
        assert_true(difference(place.raw, glm::translate(glm::mat4(1), of(way))) == 0);
        glm::mat4 gm = glm::mat4_cast(g), gp = glm::translate(glm::mat4(1), of(way));
        brush.take(
            (double)(difference(glms_rotate_y(place, angle).raw, glm::rotate(gp, angle, glm::vec3(0, 1, 0))) /
                     (epsf * (1 + length))));
        brush.take(
            (double)(difference(glms_rotate_x(place, angle).raw, glm::rotate(gp, angle, glm::vec3(1, 0, 0))) /
                     (epsf * (1 + length))));
        std::memcpy(t, place.raw, sizeof t);
        glm_mat4_mul(m, t, both);
        product.take((double)(difference(both, gm * gp) / (epsf * (1 + length))));
        mat4s world;
        std::memcpy(world.raw, both, sizeof both);
        vec3s at = random_vector(&random, 1e-3, 1e3);
        glm::mat4 gb = glm::make_mat4(&both[0][0]);
        point.take((double)(difference(glms_mat4_mulv3(world, at, 1), glm::vec3(gb * glm::vec4(of(at), 1))) /
                            (epsf * (length + glm::length(of(at))))));
        mat3 upper;
        vec3 out;
        for (int c = 0; c < 3; c++) std::memcpy(upper[c], both[c], sizeof upper[c]);
        glm_mat3_mulv(upper, at.raw, out);
        vec3s moved = {{out[0], out[1], out[2]}};
        normal.take((double)(difference(moved, glm::mat3(gb) * of(at)) / (epsf * glm::length(of(at)))));
    }
    turned.print(), product.print(), brush.print(), point.print(), normal.print();
}

} // namespace

int main()
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quaternions),  cmocka_unit_test(exponential_and_logarithm),
        cmocka_unit_test(slerp),        cmocka_unit_test(yaw_pitch_roll),
        cmocka_unit_test(lenses),       cmocka_unit_test(maps),
        cmocka_unit_test(cglm_vectors), cmocka_unit_test(cglm_matrices)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
