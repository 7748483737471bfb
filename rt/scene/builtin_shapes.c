/* builtin_shapes: boxes, sheets, lathes and mouldings; see builtin_shapes.h. */
#include "rt/scene/builtin_shapes.h"

#include <assert.h>
#include <math.h>

enum { OUTLINE_MAX = 128, STATIONS_MAX = 129 };
#define CHORD_ERROR_M 0.0015f /* how far a chord may lie from its arc */

/* A profile made of short straight pieces, with normals; corners that stay sharp occur twice. */
struct outline {
    int count;
    struct {
        float x, y, nx, ny;
        float length; /* from the start */
        bool sharp;   /* the second of a pair: no face between it and the one before */
    } point[OUTLINE_MAX];
};

/* A cross-section of a sweep: where the profile's origin and axes are, and u in metres. */
struct station {
    vec3s origin, x, y;
    float u;
};

struct fv_brush fv_brush_at(const struct fv_brush *brush, float x, float y, float z, float yaw)
{
    struct fv_brush moved = *brush;
    moved.place = glms_mat4_mul(brush->place, glms_rotate_y(glms_translate_make(fv_vec(x, y, z)), yaw));
    return moved;
}

struct fv_brush fv_brush_of(const struct fv_brush *brush, int material, float repeats)
{
    struct fv_brush other = *brush;
    other.material = material;
    other.repeats = repeats;
    return other;
}

static vec3s along(vec3s p, vec3s direction, float t)
{
    return glms_vec3_add(p, glms_vec3_scale(direction, t));
}

static uint32_t put(const struct fv_brush *brush, vec3s position, vec3s normal, float u, float v)
{
    vec3s p = glms_mat4_mulv3(brush->place, position, 1);
    vec3s n = glms_mat4_mulv3(brush->place, normal, 0);
    return fv_build_vertex(
        brush->build,
        &(struct fv_vertex){.position = {p.x, p.y, p.z}, .normal = {n.x, n.y, n.z}, .uv = {u, v}});
}

/* The two triangles of a cell, corners counter-clockwise. */
static void cell(const struct fv_brush *brush, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    fv_build_triangle(brush->build, a, b, c, brush->material);
    fv_build_triangle(brush->build, a, c, d, brush->material);
}

/* A vertex of a flat face, its texture coordinates measured in world space along the face's u and v. */
static uint32_t put_flat(const struct fv_brush *brush, vec3s position, vec3s normal, vec3s u, vec3s v)
{
    vec3s p = glms_mat4_mulv3(brush->place, position, 1);
    vec3s world_u = glms_mat4_mulv3(brush->place, u, 0), world_v = glms_mat4_mulv3(brush->place, v, 0);
    return put(brush, position, normal, brush->repeats * glms_vec3_dot(p, world_u),
               -brush->repeats * glms_vec3_dot(p, world_v));
}

void fv_shape_quad(const struct fv_brush *brush, vec3s corner, vec3s u, vec3s v)
{
    vec3s n = glms_vec3_normalize(glms_vec3_cross(u, v));
    vec3s u1 = glms_vec3_normalize(u), v1 = glms_vec3_normalize(v);
    vec3s far_corner = glms_vec3_add(glms_vec3_add(corner, u), v);
    cell(brush, put_flat(brush, corner, n, u1, v1), put_flat(brush, glms_vec3_add(corner, u), n, u1, v1),
         put_flat(brush, far_corner, n, u1, v1), put_flat(brush, glms_vec3_add(corner, v), n, u1, v1));
}

void fv_shape_card(const struct fv_brush *brush, vec3s corner, vec3s u, vec3s v)
{
    vec3s n = glms_vec3_normalize(glms_vec3_cross(u, v));
    vec3s far_corner = glms_vec3_add(glms_vec3_add(corner, u), v);
    cell(brush, put(brush, corner, n, 0, 1), put(brush, glms_vec3_add(corner, u), n, 1, 1),
         put(brush, far_corner, n, 1, 0), put(brush, glms_vec3_add(corner, v), n, 0, 0));
}

void fv_shape_box(const struct fv_brush *brush, vec3s low, vec3s high)
{
    float w = high.x - low.x, h = high.y - low.y, d = high.z - low.z;
    fv_shape_quad(brush, fv_vec(low.x, low.y, high.z), fv_vec(w, 0, 0), fv_vec(0, h, 0));
    fv_shape_quad(brush, fv_vec(high.x, low.y, low.z), fv_vec(-w, 0, 0), fv_vec(0, h, 0));
    fv_shape_quad(brush, fv_vec(high.x, low.y, high.z), fv_vec(0, 0, -d), fv_vec(0, h, 0));
    fv_shape_quad(brush, low, fv_vec(0, 0, d), fv_vec(0, h, 0));
    fv_shape_quad(brush, fv_vec(low.x, high.y, high.z), fv_vec(w, 0, 0), fv_vec(0, 0, -d));
    fv_shape_quad(brush, low, fv_vec(w, 0, 0), fv_vec(0, 0, d));
}

void fv_shape_sheet(const struct fv_brush *brush, fv_surface *surface, const void *context, int columns,
                    int rows, float width, float height)
{
    const float step = 1e-3f;
    uint32_t first = fv_build_vertices(brush->build), stride = (uint32_t)columns + 1;
    for (int j = 0; j <= rows; j++) {
        for (int i = 0; i <= columns; i++) {
            float s = (float)i / (float)columns, t = (float)j / (float)rows;
            vec3s ds = glms_vec3_sub(surface(context, s + step, t), surface(context, s - step, t));
            vec3s dt = glms_vec3_sub(surface(context, s, t + step), surface(context, s, t - step));
            vec3s n = glms_vec3_normalize(glms_vec3_cross(ds, dt));
            put(brush, surface(context, s, t), n, s * width * brush->repeats,
                (1 - t) * height * brush->repeats);
        }
    }
    for (uint32_t j = 0; j < (uint32_t)rows; j++)
        for (uint32_t i = 0; i < (uint32_t)columns; i++) {
            uint32_t a = first + j * stride + i;
            cell(brush, a, a + 1, a + 1 + stride, a + stride);
        }
}

/* Appends a piece's end, with the normal of the piece that ends or starts there. */
static void outline_add(struct outline *o, float x, float y, float nx, float ny)
{
    assert(o->count < OUTLINE_MAX);
    int i = o->count++;
    bool sharp = i > 0 && o->point[i - 1].x == x && o->point[i - 1].y == y;
    float length = i > 0 ? o->point[i - 1].length + hypotf(x - o->point[i - 1].x, y - o->point[i - 1].y) : 0;
    if (sharp) {
        float px = o->point[i - 1].nx, py = o->point[i - 1].ny;
        if (px * nx + py * ny > 0.766f) { /* cos 40 degrees: one smooth corner */
            float scale = 1 / hypotf(px + nx, py + ny);
            o->point[i - 1].nx = (px + nx) * scale;
            o->point[i - 1].ny = (py + ny) * scale;
            o->count--;
            return;
        }
    }
    o->point[i].x = x;
    o->point[i].y = y;
    o->point[i].nx = nx;
    o->point[i].ny = ny;
    o->point[i].length = length;
    o->point[i].sharp = sharp;
}

/* The way from corner a to corner b. The arc's centre lies left of the chord's middle by
 * chord / 2 * (1 - bulge^2) / (2 bulge). */
static void outline_piece(struct outline *o, const struct fv_corner *a, const struct fv_corner *b)
{
    float dx = b->x - a->x, dy = b->y - a->y, chord = hypotf(dx, dy), k = a->bulge;
    if (chord < 1e-7f) return;
    if (fabsf(k) < 1e-3f) {
        outline_add(o, a->x, a->y, dy / chord, -dx / chord);
        outline_add(o, b->x, b->y, dy / chord, -dx / chord);
        return;
    }
    float to_centre = (1 - k * k) / (4 * k), angle = 4 * atanf(k), side = k > 0 ? 1.f : -1.f;
    float cx = (a->x + b->x) / 2 - dy * to_centre, cy = (a->y + b->y) / 2 + dx * to_centre;
    float radius = chord * (1 + k * k) / (4 * fabsf(k));
    float start = atan2f(a->y - cy, a->x - cx);
    float step = fminf(sqrtf(8 * CHORD_ERROR_M / radius), 0.9f);
    int steps = (int)ceilf(fabsf(angle) / step);
    for (int i = 0; i <= steps; i++) {
        float t = start + angle * (float)i / (float)steps, c = cosf(t), s = sinf(t);
        float x = i == 0 ? a->x : i == steps ? b->x : cx + radius * c;
        float y = i == 0 ? a->y : i == steps ? b->y : cy + radius * s;
        outline_add(o, x, y, side * c, side * s);
    }
}

static void outline_make(struct outline *o, const struct fv_corner *profile, int corners)
{
    o->count = 0;
    for (int i = 0; i + 1 < corners; i++) outline_piece(o, &profile[i], &profile[i + 1]);
}

/* Stations must run along y x x for the outside to be where the profile's is. `poles`: profile
 * points with x = 0 are one point for all stations. */
static void sweep(const struct fv_brush *brush, const struct outline *o, const struct station *station,
                  int stations, bool poles)
{
    uint32_t first = fv_build_vertices(brush->build), n = (uint32_t)o->count;
    for (int i = 0; i < stations; i++) {
        const struct station *at = &station[i];
        for (int j = 0; j < o->count; j++) {
            vec3s p = along(along(at->origin, at->x, o->point[j].x), at->y, o->point[j].y);
            vec3s normal = along(glms_vec3_scale(at->x, o->point[j].nx), at->y, o->point[j].ny);
            put(brush, p, normal, at->u * brush->repeats, -o->point[j].length * brush->repeats);
        }
    }
    for (uint32_t i = 0; i + 1 < (uint32_t)stations; i++)
        for (uint32_t j = 0; j + 1 < n; j++) {
            uint32_t a = first + i * n + j;
            if (o->point[j + 1].sharp) continue;
            if (!poles || o->point[j].x > 0)
                fv_build_triangle(brush->build, a, a + n, a + n + 1, brush->material);
            if (!poles || o->point[j + 1].x > 0)
                fv_build_triangle(brush->build, a, a + n + 1, a + 1, brush->material);
        }
}

void fv_shape_lathe(const struct fv_brush *brush, const struct fv_corner *profile, int corners, int segments)
{
    struct outline outline;
    struct station station[STATIONS_MAX];
    float widest = 0;
    assert(segments < STATIONS_MAX);
    outline_make(&outline, profile, corners);
    for (int i = 0; i < outline.count; i++) widest = fmaxf(widest, outline.point[i].x);
    /* A whole number of repeats round the waist, so that the seam does not show. */
    float round_m = fmaxf(1, roundf(2 * GLM_PIf * widest * brush->repeats)) / brush->repeats;
    for (int i = 0; i <= segments; i++) {
        float s = (float)i / (float)segments, angle = i < segments ? 2 * GLM_PIf * s : 0;
        station[i] = (struct station){.x = fv_vec(cosf(angle), 0, -sinf(angle)), .y = fv_vec(0, 1, 0)};
        station[i].u = s * round_m;
    }
    sweep(brush, &outline, station, segments + 1, true);
}

void fv_shape_moulding(const struct fv_brush *brush, const struct fv_corner *profile, int corners, vec3s from,
                       vec3s to, vec3s x, vec3s y)
{
    struct outline outline;
    outline_make(&outline, profile, corners);
    bool turned = glms_vec3_dot(glms_vec3_sub(to, from), glms_vec3_cross(y, x)) < 0;
    struct station station[2] = {{turned ? to : from, x, y, 0}, {turned ? from : to, x, y, 0}};
    station[1].u = glms_vec3_distance(from, to);
    sweep(brush, &outline, station, 2, false);
}

void fv_shape_archivolt(const struct fv_brush *brush, const struct fv_corner *profile, int corners,
                        int segments)
{
    struct outline outline;
    struct station station[STATIONS_MAX];
    assert(segments < STATIONS_MAX);
    outline_make(&outline, profile, corners);
    for (int i = 0; i <= segments; i++) {
        float angle = GLM_PIf * (float)(segments - i) / (float)segments;
        station[i].origin = fv_vec(0, 0, 0);
        station[i].x = fv_vec(0, 0, 1);
        station[i].y = fv_vec(cosf(angle), sinf(angle), 0);
        station[i].u = angle * profile[0].y;
    }
    sweep(brush, &outline, station, segments + 1, false);
}

/* Where the ray from the origin leaves the rectangle |x| <= w, y <= h. */
static vec3s leave(float angle, float w, float h)
{
    float c = cosf(angle), s = sinf(angle);
    float t = fminf(w / fmaxf(fabsf(c), 1e-6f), h / fmaxf(s, 1e-6f));
    return fv_vec(t * c, t * s, 0);
}

void fv_shape_arch(const struct fv_brush *brush, float width, float height, float thickness, float radius,
                   int segments)
{
    float w = width / 2, d = thickness / 2, corner = atan2f(height, w);
    vec3s across = fv_vec(0, 0, thickness), x = fv_vec(1, 0, 0), y = fv_vec(0, 1, 0), z = fv_vec(0, 0, 1);
    vec3s back = fv_vec(0, 0, -1), left = fv_vec(-1, 0, 0);
    float before = 0;
    for (int i = 1; i <= segments; i++) {
        /* The steps nearest the upper corners go to them exactly. */
        float step = GLM_PIf / (float)segments, now = i < segments ? step * (float)i : GLM_PIf;
        if (fabsf(now - corner) <= step / 2) now = corner;
        else if (fabsf(now - (GLM_PIf - corner)) <= step / 2) now = GLM_PIf - corner;
        vec3s ra = fv_vec(cosf(before), sinf(before), 0), rb = fv_vec(cosf(now), sinf(now), 0);
        vec3s a = glms_vec3_scale(ra, radius), b = glms_vec3_scale(rb, radius);
        vec3s c = leave(now, w, height), e = leave(before, w, height);
        a.z = b.z = c.z = e.z = d;
        cell(brush, put_flat(brush, a, z, x, y), put_flat(brush, e, z, x, y), put_flat(brush, c, z, x, y),
             put_flat(brush, b, z, x, y));
        vec3s a2 = glms_vec3_sub(a, across), b2 = glms_vec3_sub(b, across);
        vec3s c2 = glms_vec3_sub(c, across), e2 = glms_vec3_sub(e, across);
        cell(brush, put_flat(brush, a2, back, left, y), put_flat(brush, b2, back, left, y),
             put_flat(brush, c2, back, left, y), put_flat(brush, e2, back, left, y));
        float ua = before * radius * brush->repeats, ub = now * radius * brush->repeats;
        float v = thickness * brush->repeats;
        vec3s na = glms_vec3_negate(ra), nb = glms_vec3_negate(rb);
        cell(brush, put(brush, a2, na, ua, 0), put(brush, a, na, ua, v), put(brush, b, nb, ub, v),
             put(brush, b2, nb, ub, 0));
        before = now;
    }
    for (int side = -1; side <= 1; side += 2)
        fv_shape_quad(brush, fv_vec(side < 0 ? -w : radius, 0, -d), fv_vec(w - radius, 0, 0), across);
}

struct tube {
    vec3s a, b, x, y;
    float ra, rb;
};

static vec3s tube_surface(const void *context, float s, float t)
{
    const struct tube *tube = context;
    float angle = 2 * GLM_PIf * s, r = tube->ra + (tube->rb - tube->ra) * t;
    vec3s p = glms_vec3_lerp(tube->a, tube->b, t);
    return along(along(p, tube->x, r * cosf(angle)), tube->y, r * sinf(angle));
}

void fv_shape_tube(const struct fv_brush *brush, vec3s a, vec3s b, float ra, float rb, int segments)
{
    vec3s axis = glms_vec3_normalize(glms_vec3_sub(b, a));
    vec3s x = glms_vec3_normalize(glms_vec3_ortho(axis));
    struct tube tube = {a, b, x, glms_vec3_cross(axis, x), ra, rb};
    float round_m = 2 * GLM_PIf * fmaxf(ra, rb), repeats = fmaxf(1, roundf(round_m * brush->repeats));
    fv_shape_sheet(brush, tube_surface, &tube, segments, 1, repeats / brush->repeats,
                   glms_vec3_distance(a, b));
}

void fv_shape_sphere(const struct fv_brush *brush, vec3s centre, float radius, int segments)
{
    struct fv_corner profile[STATIONS_MAX];
    int rows = segments / 2;
    assert(rows < STATIONS_MAX);
    for (int i = 0; i <= rows; i++) {
        float angle = GLM_PIf * (float)i / (float)rows;
        profile[i].x = i == 0 || i == rows ? 0 : radius * sinf(angle);
        profile[i].y = -radius * cosf(angle);
        profile[i].bulge = 0;
    }
    struct fv_brush here = fv_brush_at(brush, centre.x, centre.y, centre.z, 0);
    fv_shape_lathe(&here, profile, rows + 1, segments);
}
