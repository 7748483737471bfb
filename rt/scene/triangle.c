/* triangle: see triangle.h. */
#include "rt/scene/triangle.h"

#include <math.h>
#include <string.h>

void fv_cross(const double a[3], const double b[3], double out[3])
{
    double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    memcpy(out, c, sizeof c);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

bool fv_normalise(double v[3])
{
    double length = sqrt(dot(v, v));
    if (!(length > 0) || !isfinite(length)) return false;
    for (int i = 0; i < 3; i++) v[i] /= length;
    return true;
}

/* The edges from the first corner, and the triangle's normal, not of unit length. In double: no float
 * position can make these overflow. */
static void edges_of(const struct fv_vertex *v, const uint32_t corner[3], double e1[3], double e2[3],
                     double n[3])
{
    for (int i = 0; i < 3; i++) {
        e1[i] = (double)v[corner[1]].position[i] - v[corner[0]].position[i];
        e2[i] = (double)v[corner[2]].position[i] - v[corner[0]].position[i];
    }
    fv_cross(e1, e2, n);
}

/* The sine of the angle at a triangle's first corner. */
static double sine_at(const double e1[3], const double e2[3], double area)
{
    return area / sqrt(dot(e1, e1) * dot(e2, e2));
}

/* Embree's plane goes through the first corner and has the product of the edges there as its normal, which loses
 * the angle's sine in precision. Corners are turned so that the first has the widest angle, but only where much is
 * lost: triangles that begin at the same corner share an edge to the bit, others may leave a gap along it. */
static void turn_corners(const struct fv_vertex *v, uint32_t corner[3])
{
    const uint32_t c[3] = {corner[0], corner[1], corner[2]};
    double best = 0;
    for (int first = 0; first < 3 && best < 1 / 16.0; first++) {
        const uint32_t turned[3] = {c[first], c[(first + 1) % 3], c[(first + 2) % 3]};
        double e1[3], e2[3], n[3];
        edges_of(v, turned, e1, e2, n);
        double sine = sine_at(e1, e2, sqrt(dot(n, n)));
        if (sine > best) {
            best = sine;
            memcpy(corner, turned, sizeof turned);
        }
    }
}

/* How far off its plane a hit may lie: 4 float roundings, the most seen (tests/numeric/slivers.c), over the sine,
 * times the way from the first corner. */
static float slack_of(const double e1[3], const double e2[3], double area)
{
    double length = sqrt(fmax(dot(e1, e1), dot(e2, e2)));
    return (float)fmin(4 * 0x1p-24 * length / sine_at(e1, e2, area), 0.1 * length);
}

static void quantise(const double n[3], int16_t out[3])
{
    for (int i = 0; i < 3; i++) out[i] = (int16_t)lrint(n[i] * 32767);
}

/* A unit vector at right angles to the unit vector n. */
static void perpendicular(const double n[3], double out[3])
{
    double axis[3] = {0};
    axis[fabs(n[0]) < 0.5 ? 0 : fabs(n[1]) < 0.5 ? 1 : 2] = 1;
    fv_cross(n, axis, out);
    fv_normalise(out);
}

/* The tangent by solving e = du T + dv B on two edges (Lengyel, "Foundations of Game Engine
 * Development" 2, section 7.5). Normal maps have y up in the picture, where v shrinks: a picture
 * that is not mirrored on its triangle has a negative determinant here, and the sign 1. A file that
 * gives the sign knows better: its normal maps may have y down. */
static void fill_uv(struct fv_triangle *t, const struct fv_vertex *v, const uint32_t corner[3],
                    const double e1[3], const double e2[3], const double normal[3], double area)
{
    const float *uv0 = v[corner[0]].uv, *uv1 = v[corner[1]].uv, *uv2 = v[corner[2]].uv;
    double u1 = (double)uv1[0] - uv0[0], u2 = (double)uv2[0] - uv0[0];
    double v1 = (double)uv1[1] - uv0[1], v2 = (double)uv2[1] - uv0[1];
    double determinant = u1 * v2 - u2 * v1, tangent[3];
    double sign = determinant > 0 ? 1 : -1;
    for (int i = 0; i < 3; i++) {
        memcpy(t->uv[i], v[corner[i]].uv, sizeof t->uv[i]);
        tangent[i] = sign * (v2 * e1[i] - v1 * e2[i]);
    }
    bool degenerate = determinant == 0 || !fv_normalise(tangent);
    if (degenerate) perpendicular(normal, tangent);
    quantise(tangent, t->tangent);
    float given = v[corner[0]].bitangent_sign;
    t->bitangent_sign = given != 0 ? (given > 0 ? 1 : -1) : determinant > 0 ? -1 : 1;
    t->uv_per_metre = degenerate ? 0 : (float)fmin(sqrt(fabs(determinant) / area), 1e30);
}

bool fv_triangle_has_area(const struct fv_vertex *v, const uint32_t corner[3])
{
    double e1[3], e2[3], n[3];
    edges_of(v, corner, e1, e2, n);
    return fv_normalise(n);
}

void fv_triangle_fill(struct fv_triangle *t, const struct fv_vertex *v, uint32_t corner[3], uint16_t material)
{
    double e1[3], e2[3], normal[3];
    turn_corners(v, corner);
    edges_of(v, corner, e1, e2, normal);
    double area = sqrt(dot(normal, normal)); /* twice the triangle's, as the determinant is in uv */
    t->slack = slack_of(e1, e2, area);
    fv_normalise(normal);
    for (int k = 0; k < 3; k++) {
        const float *given = v[corner[k]].normal;
        double n[3] = {given[0], given[1], given[2]};
        quantise(fv_normalise(n) ? n : normal, t->normal[k]);
    }
    t->material = material;
    fill_uv(t, v, corner, e1, e2, normal, area);
}
