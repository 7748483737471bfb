/* field_oracle: random solids as text, and what they are, in double: written anew from what README says of each
 * shape, by recursion over points, without bounds, folding or packets. For tests only. */
#ifndef FV_TESTS_FIELD_ORACLE_H
#define FV_TESTS_FIELD_ORACLE_H

#include "tests/support/random.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

enum oracle_shape {
    SPHERE, BOX, ROUND_BOX, CYLINDER, TORUS, CAPSULE, CONE, PLANE, ORACLE_PRIMITIVES,
    UNION = ORACLE_PRIMITIVES, INTERSECTION, DIFFERENCE, SMOOTH_UNION, TRANSLATE, ROTATE, SCALE, MIRROR, REPEAT, TWIST,
    DISPLACE, NOISE, ORACLE_SHAPES
};

struct oracle {
    enum oracle_shape shape;
    double n[7];
    double reach; /* the solid lies within this of its origin; infinite of planes */
    /* pure: the program computes what the oracle does, not a bound of it; nonexpansive: 1-Lipschitz. */
    bool pure, nonexpansive;
    int child[2];
};

static const char *const oracle_names[ORACLE_SHAPES] = {
    "sphere", "box", "round_box", "cylinder", "torus", "capsule", "cone", "plane", "union", "intersection", "difference",
    "smooth_union", "translate", "rotate", "scale", "mirror", "repeat", "twist", "displace", "noise"};
static const int oracle_numbers[ORACLE_SHAPES] = {1, 3, 4, 2, 2, 7, 3, 4, 0, 0, 0, 1, 3, 3, 1, 3, 6, 1, 2, 4};

struct oracle_tree {
    struct oracle node[256];
    int nodes;
};

static inline int oracle_primitive(struct oracle_tree *t, enum oracle_shape shape, uint64_t *r, double size)
{
    struct oracle *o = &t->node[t->nodes];
    double *n = o->n;
    *o = (struct oracle){.shape = shape, .pure = true, .nonexpansive = true};
    for (int i = 0; i < 7; i++) n[i] = size * random_between(r, 0.1, 1);
    o->reach = sqrt(3) * size;
    if (shape == ROUND_BOX) n[3] = random_between(r, 0.1, 0.49) * fmin(n[0], fmin(n[1], n[2]));
    if (shape == TORUS) n[1] = n[0] * random_between(r, 0.1, 0.9), o->reach = 2 * size;
    if (shape == CYLINDER) o->reach = 1.2 * size;
    if (shape == CONE && random_bits(r) % 3 == 0) n[random_bits(r) % 2] = 0;
    if (shape == CAPSULE) {
        for (int i = 0; i < 6; i++) n[i] = random_between(r, -size, size);
        o->reach = 3 * size;
    }
    if (shape == PLANE) {
        double up[3];
        random_direction(r, up);
        for (int i = 0; i < 3; i++) n[i] = up[i] * size;
        n[3] = random_between(r, -size, size);
        o->reach = INFINITY;
    }
    return t->nodes++;
}

/* A random solid of this depth, its root last; -1 where it could not be. */
static inline int oracle_make(struct oracle_tree *t, int depth, uint64_t *r, double size)
{
    if (depth == 0 || t->nodes > 200) return oracle_primitive(t, (enum oracle_shape)(random_bits(r) % PLANE), r, size);
    enum oracle_shape shape = (enum oracle_shape)(UNION + random_bits(r) % (ORACLE_SHAPES - UNION));
    int a = oracle_make(t, depth - 1, r, size), b = -1;
    /* What is blended or displaced by metres must be a distance that nothing has been divided out of. */
    if (!t->node[a].pure && (shape == SMOOTH_UNION || shape >= DISPLACE)) shape = TRANSLATE;
    if (shape <= SMOOTH_UNION)
        b = shape != SMOOTH_UNION && random_bits(r) % 6 == 0 ? oracle_primitive(t, PLANE, r, size) : oracle_make(t, depth - 1, r, size);
    if (b >= 0 && !t->node[b].pure && shape == SMOOTH_UNION) shape = UNION;
    struct oracle *o = &t->node[t->nodes], *below = &t->node[a];
    double *n = o->n, reach = below->reach;
    *o = (struct oracle){.shape = shape, .child = {a, b}, .reach = reach, .pure = below->pure && shape < REPEAT, .nonexpansive = below->nonexpansive};
    if (b >= 0) {
        o->nonexpansive &= t->node[b].nonexpansive;
        o->pure &= t->node[b].pure;
        if (shape == UNION || shape == SMOOTH_UNION) o->reach = fmax(reach, t->node[b].reach);
    }
    switch (shape) {
    case SMOOTH_UNION:
        n[0] = size * random_between(r, 0.05, 0.5);
        o->reach += 2 * n[0];
        break;
    case TRANSLATE:
        for (int i = 0; i < 3; i++) n[i] = random_between(r, -size, size);
        o->reach += sqrt(3) * size;
        break;
    case ROTATE:
        for (int i = 0; i < 3; i++) n[i] = random_between(r, -180, 180);
        break;
    case SCALE:
        n[0] = random_decade(r, 0.3, 3);
        o->reach *= n[0];
        break;
    case MIRROR:
        for (int i = 0; i < 3; i++) n[i] = (double)(random_bits(r) % 2);
        break;
    case REPEAT:
        for (int i = 0; i < 3; i++) {
            n[i] = random_bits(r) % 3 ? 4 * reach * random_between(r, 1, 1.5) : 0;
            n[3 + i] = n[i] > 0 ? (double)(random_bits(r) % 4) : 0;
        }
        if (n[0] + n[1] + n[2] == 0) n[0] = 4 * reach, n[3] = 2;
        o->nonexpansive = false;
        o->reach = INFINITY;
        break;
    case TWIST:
        n[0] = random_between(r, -90, 90) / size;
        o->nonexpansive = false;
        o->reach *= 1.5;
        break;
    case DISPLACE:
        n[0] = size * random_decade(r, 0.01, 0.1);
        n[1] = size * random_decade(r, 0.3, 3);
        o->reach += 4 * n[0];
        break;
    case NOISE:
        n[0] = size * random_decade(r, 0.01, 0.1);
        n[1] = size * random_decade(r, 0.3, 3);
        n[2] = random_between(r, 0.2, 0.7);
        n[3] = 1 + (double)(random_bits(r) % 4);
        o->reach += 8 * n[0];
        break;
    default: break;
    }
    return isfinite(reach) || (shape != REPEAT && shape != TWIST) ? t->nodes++ : a;
}

static inline size_t oracle_print(const struct oracle_tree *t, int node, char *out, size_t size)
{
    const struct oracle *o = &t->node[node];
    size_t at = (size_t)snprintf(out, size, "%s(", oracle_names[o->shape]);
    for (int i = 0; i < oracle_numbers[o->shape] && at < size; i++)
        at += (size_t)snprintf(out + at, size - at, "%s%.9g", i ? ", " : "", o->n[i]);
    for (int i = 0; i < 2 && o->shape >= UNION && at < size; i++) {
        if (i == 1 && o->shape > SMOOTH_UNION) break;
        if (i || oracle_numbers[o->shape]) at += (size_t)snprintf(out + at, size - at, ", ");
        if (at < size) at += oracle_print(t, o->child[i], out + at, size - at);
    }
    if (at < size) at += (size_t)snprintf(out + at, size - at, ")");
    return at;
}

static inline double oracle_lattice(int32_t x, int32_t y, int32_t z)
{
    uint32_t h = ((uint32_t)x * 0x8da6b343u) ^ ((uint32_t)y * 0xd8163841u) ^ ((uint32_t)z * 0xcb1b78b1u);
    h ^= h >> 15;
    h *= 0x2c1b3c6du;
    h ^= h >> 12;
    return (double)((int32_t)h >> 7) * 0x1p-24;
}

static inline double oracle_noise(const double p[3])
{
    double low[3], s[3], sum = 0;
    for (int i = 0; i < 3; i++) {
        low[i] = floor(p[i]);
        double f = p[i] - low[i];
        s[i] = f * f * (3 - 2 * f);
    }
    for (int k = 0; k < 8; k++) {
        double w = 1;
        for (int i = 0; i < 3; i++) w *= k >> i & 1 ? s[i] : 1 - s[i];
        sum += w * oracle_lattice((int32_t)low[0] + (k & 1), (int32_t)low[1] + (k >> 1 & 1), (int32_t)low[2] + (k >> 2 & 1));
    }
    return sum;
}

static inline void oracle_turn(double p[3], int axis, double degrees)
{
    double a = degrees * 3.14159265358979323846 / 180, s = sin(a), c = cos(a);
    int i = (axis + 1) % 3, j = (axis + 2) % 3;
    double u = p[i], v = p[j];
    p[i] = c * u - s * v;
    p[j] = s * u + c * v;
}

/* Distance of a point of the plane (across, along) to the segment between two. */
static inline double oracle_segment(double x, double y, double ax, double ay, double bx, double by)
{
    double d2 = (bx - ax) * (bx - ax) + (by - ay) * (by - ay);
    double t = fmin(fmax(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / d2, 0), 1);
    return hypot(x - ax - t * (bx - ax), y - ay - t * (by - ay));
}

static inline double oracle_box(const double p[3], const double h[3])
{
    double out[3], inside = -INFINITY;
    for (int i = 0; i < 3; i++) {
        double d = fabs(p[i]) - h[i];
        inside = fmax(inside, d);
        out[i] = fmax(d, 0);
    }
    return inside > 0 ? sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]) : inside;
}

static inline double oracle_solid(const struct oracle_tree *t, int node, const double at[3]);

static inline double oracle_of_primitive(const struct oracle *o, const double p[3])
{
    const double *n = o->n;
    double r = hypot(p[0], p[2]), half[3], d;
    switch (o->shape) {
    case SPHERE: return sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - n[0];
    case BOX:
    case ROUND_BOX:
        for (int i = 0; i < 3; i++) half[i] = n[i] / 2 - n[3] * (o->shape == ROUND_BOX);
        return oracle_box(p, half) - n[3] * (o->shape == ROUND_BOX);
    case CYLINDER: {
        double q[3] = {r, p[1], 0}, h[3] = {n[0], n[1] / 2, 1e30};
        return oracle_box(q, h);
    }
    case TORUS: return hypot(r - n[0], p[1]) - n[1];
    case PLANE: d = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]); return (p[0] * n[0] + p[1] * n[1] + p[2] * n[2]) / d - n[3];
    case CAPSULE: {
        double way[3], off[3], d2 = 0, along = 0, e2 = 0;
        for (int i = 0; i < 3; i++) way[i] = n[3 + i] - n[i], d2 += way[i] * way[i], along += way[i] * (p[i] - n[i]);
        along = fmin(fmax(along / d2, 0), 1);
        for (int i = 0; i < 3; i++) off[i] = p[i] - n[i] - along * way[i], e2 += off[i] * off[i];
        return sqrt(e2) - n[6];
    }
    default: {
        double h = n[2] / 2, wide = n[0] + (n[1] - n[0]) * (p[1] + h) / n[2];
        d = fmin(oracle_segment(r, p[1], n[0], -h, n[1], h),
                 fmin(oracle_segment(r, p[1], -1e-30, -h, n[0] + 1e-30, -h), oracle_segment(r, p[1], -1e-30, h, n[1] + 1e-30, h)));
        return fabs(p[1]) < h && r < wide ? -d : d;
    }
    }
}

/* The least over the cells around the point's, or those there are next to it. */
static inline double oracle_repeat(const struct oracle_tree *t, const struct oracle *o, const double p[3])
{
    double least = INFINITY;
    int from[3], to[3];
    for (int i = 0; i < 3; i++) {
        double period = o->n[i], count = o->n[3 + i], first = period > 0 && count > 0 ? -0.5 * (count - 1) * period : 0;
        int near = period > 0 ? (int)lround((p[i] - first) / period) : 0;
        from[i] = period > 0 ? near - 1 : 0;
        to[i] = period > 0 ? near + 1 : 0;
        if (period > 0 && count > 0) {
            int last = (int)count - 1;
            from[i] = from[i] < 0 ? 0 : from[i] > last ? last : from[i];
            to[i] = to[i] < 0 ? 0 : to[i] > last ? last : to[i];
        }
    }
    for (int x = from[0]; x <= to[0]; x++)
        for (int y = from[1]; y <= to[1]; y++)
            for (int z = from[2]; z <= to[2]; z++) {
                double q[3], cell[3] = {x, y, z};
                for (int i = 0; i < 3; i++) {
                    double first = o->n[i] > 0 && o->n[3 + i] > 0 ? -0.5 * (o->n[3 + i] - 1) * o->n[i] : 0;
                    q[i] = p[i] - first - cell[i] * o->n[i];
                }
                least = fmin(least, oracle_solid(t, o->child[0], q));
            }
    return least;
}

/* Negative inside; outside the distance of primitives. */
static inline double oracle_solid(const struct oracle_tree *t, int node, const double at[3])
{
    const struct oracle *o = &t->node[node];
    const double *n = o->n;
    if (o->shape < ORACLE_PRIMITIVES) return oracle_of_primitive(o, at);
    double p[3] = {at[0], at[1], at[2]}, a, b, d, sum;
    switch (o->shape) {
    case TRANSLATE:
        for (int i = 0; i < 3; i++) p[i] -= n[i];
        break;
    case ROTATE:
        for (int axis = 2; axis >= 0; axis--) oracle_turn(p, axis, -n[axis]);
        break;
    case SCALE:
        for (int i = 0; i < 3; i++) p[i] /= n[0];
        return n[0] * oracle_solid(t, o->child[0], p);
    case MIRROR:
        for (int i = 0; i < 3; i++) p[i] = n[i] > 0 ? fabs(p[i]) : p[i];
        break;
    case TWIST: oracle_turn(p, 1, -n[0] * p[1]); break;
    case REPEAT: return oracle_repeat(t, o, p);
    default: break;
    }
    a = oracle_solid(t, o->child[0], p);
    b = o->shape <= SMOOTH_UNION ? oracle_solid(t, o->child[1], p) : 0;
    switch (o->shape) {
    case UNION: return fmin(a, b);
    case INTERSECTION: return fmax(a, b);
    case DIFFERENCE: return fmax(a, -b);
    case SMOOTH_UNION: d = fmax(n[0] - fabs(a - b), 0) / n[0]; return fmin(a, b) - d * d * n[0] / 4;
    case DISPLACE:
        d = 2 * 3.14159265358979323846 / n[1];
        return a + n[0] * sin(d * p[0]) * sin(d * p[1]) * sin(d * p[2]);
    case NOISE:
        sum = 0;
        for (int i = 0; i < 3; i++) p[i] /= n[1];
        for (int i = 0; i < (int)n[3]; i++) {
            const double shift[3] = {17.3, 31.7, 7.1};
            sum += n[0] * pow(n[2], i) * oracle_noise(p);
            for (int k = 0; k < 3; k++) p[k] = p[k] * 2 + shift[k];
        }
        return a + sum;
    default: return a;
    }
}

#endif
