/* builtin_pipes_line: one pipe, swept along its way, and what is bolted to it; see builtin_pipes.h. */
#include "rt/scene/builtin_pipes.h"

#include "rt/scene/builtin_random.h"

#include <math.h>

#define COUNT(array) ((int)(sizeof(array) / sizeof(array)[0]))
enum { SIDES_MAX = 24, FITTING_CORNERS_MAX = 12 };

static vec3s along(vec3s p, vec3s direction, float t)
{
    return glms_vec3_add(p, glms_vec3_scale(direction, t));
}

/* The mantle of a pipe, ring by ring. Sides by size: a chord lies at most about 2 mm inside its arc. */
struct mantle {
    const struct fv_brush *brush;
    float radius;
    int sides;
    float cosine[SIDES_MAX], sine[SIDES_MAX];
    bool begun;
    uint32_t before; /* the last ring's first vertex */
};

static int sides_of(float radius)
{
    return radius < 0.025f ? 8 : radius < 0.06f ? 12 : radius < 0.15f ? 16 : SIDES_MAX;
}

static void mantle_begin(struct mantle *m, const struct fv_pipes_line *line)
{
    m->brush = line->paint;
    m->radius = line->radius;
    m->sides = sides_of(line->radius);
    m->begun = false;
    m->before = 0;
    for (int i = 0; i < m->sides; i++) {
        float angle = 2 * GLM_PIf * (float)i / (float)m->sides;
        m->cosine[i] = cosf(angle);
        m->sine[i] = sinf(angle);
    }
}

/* The next ring, joined to the one before. */
static void mantle_ring(struct mantle *m, vec3s centre, vec3s x, vec3s y)
{
    struct fv_build *build = m->brush->build;
    uint32_t first = fv_build_vertices(build), sides = (uint32_t)m->sides, before = m->before;
    for (int i = 0; i < m->sides; i++) {
        vec3s n = along(glms_vec3_scale(x, m->cosine[i]), y, m->sine[i]), p = along(centre, n, m->radius);
        fv_build_vertex(build, &(struct fv_vertex){.position = {p.x, p.y, p.z}, .normal = {n.x, n.y, n.z}});
    }
    for (uint32_t i = 0; i < sides && m->begun; i++) {
        uint32_t next = (i + 1) % sides;
        fv_build_triangle(build, before + i, before + next, first + next, m->brush->material);
        fv_build_triangle(build, before + i, first + next, first + i, m->brush->material);
    }
    m->begun = true;
    m->before = first;
}

static float bend_radius(const struct fv_pipes_line *line)
{
    return 3 * line->radius;
}

static vec3s direction_of(const struct fv_pipes_line *line, int leg)
{
    return glms_vec3_normalize(glms_vec3_sub(line->knot[leg + 1], line->knot[leg]));
}

/* v turned with the bend from d1 to d2, by the angle of this cosine and sine. */
static vec3s turned(vec3s v, vec3s d1, vec3s d2, float cosine, float sine)
{
    float a = glms_vec3_dot(v, d1), b = glms_vec3_dot(v, d2);
    vec3s rest = along(along(v, d1, -a), d2, -b);
    return along(along(rest, d1, a * cosine - b * sine), d2, a * sine + b * cosine);
}

static void bend(struct mantle *m, const struct fv_pipes_line *line, int leg)
{
    vec3s d1 = direction_of(line, leg), d2 = direction_of(line, leg + 1);
    float r = bend_radius(line);
    vec3s centre = along(along(line->knot[leg + 1], d1, -r), d2, r);
    int steps = line->radius < 0.06f ? 6 : 8;
    for (int i = 0; i <= steps; i++) {
        float angle = GLM_PI_2f * (float)i / (float)steps, c = cosf(angle), s = sinf(angle);
        mantle_ring(m, along(along(centre, d2, -r * c), d1, r * s), turned(line->x[leg], d1, d2, c, s),
                    turned(line->y[leg], d1, d2, c, s));
    }
}

/* A profile in units of the pipe's radius, turned about the pipe at `at`. */
static void fitting(const struct fv_pipes_line *line, const struct fv_brush *brush, vec3s at, vec3s axis,
                    const struct fv_corner *profile, int corners)
{
    struct fv_corner scaled[FITTING_CORNERS_MAX];
    struct fv_brush placed = fv_pipes_along(brush, at, axis);
    for (int i = 0; i < corners; i++) {
        scaled[i] = profile[i];
        scaled[i].x *= line->radius;
        scaled[i].y *= line->radius;
    }
    fv_shape_lathe(&placed, scaled, corners, sides_of(line->radius));
}

/* A pair of flanges, and the bolts through both where they are large enough to be seen. */
static void flange(const struct fv_pipes_line *line, vec3s at, vec3s axis)
{
    static const struct fv_corner profile[] = {{0.95f, -0.38f, 0}, {1.55f, -0.38f, 0}, {1.55f, -0.05f, 0},
                                               {1.25f, -0.05f, 0}, {1.25f, 0.05f, 0},  {1.55f, 0.05f, 0},
                                               {1.55f, 0.38f, 0},  {0.95f, 0.38f, 0}};
    static const struct fv_corner bolt[] = {
        {0, -0.55f, 0}, {0.07f, -0.55f, 0}, {0.07f, 0.55f, 0}, {0, 0.55f, 0}};
    fitting(line, line->paint, at, axis, profile, COUNT(profile));
    if (line->radius < 0.08f) return;
    struct fv_brush placed = fv_pipes_along(line->bolts, at, axis);
    float r = line->radius;
    struct fv_corner scaled[COUNT(bolt)];
    for (int i = 0; i < COUNT(bolt); i++) scaled[i] = (struct fv_corner){bolt[i].x * r, bolt[i].y * r, 0};
    for (int i = 0; i < 8; i++) {
        float angle = GLM_PIf / 4 * ((float)i + 0.5f);
        struct fv_brush hole = fv_brush_at(&placed, 1.4f * r * cosf(angle), 0, 1.4f * r * sinf(angle), 0);
        fv_shape_lathe(&hole, scaled, COUNT(bolt), 6);
    }
}

static void coupling(const struct fv_pipes_line *line, vec3s at, vec3s axis)
{
    static const struct fv_corner profile[] = {
        {0.95f, -0.9f, 0}, {1.3f, -0.8f, 0}, {1.3f, 0.8f, 0}, {0.95f, 0.9f, 0}};
    fitting(line, line->paint, at, axis, profile, COUNT(profile));
}

/* Where two sheets of cladding overlap. */
static void band(const struct fv_pipes_line *line, vec3s at, vec3s axis)
{
    float half = 0.025f / line->radius;
    const struct fv_corner profile[] = {
        {0.98f, -half, 0}, {1.03f, -half, 0}, {1.03f, half, 0}, {0.98f, half, 0}};
    fitting(line, line->paint, at, axis, profile, COUNT(profile));
}

/* Body between two flanges, bonnet and spindle towards `outwards`, and the wheel on it. */
static void valve(const struct fv_pipes_line *line, vec3s at, vec3s axis, vec3s outwards)
{
    static const struct fv_corner body[] = {{0.95f, -1.7f, 0},   {1.15f, -1.5f, 0.2f}, {1.45f, -0.6f, 0.25f},
                                            {1.45f, 0.6f, 0.2f}, {1.15f, 1.5f, 0},     {0.95f, 1.7f, 0}};
    static const struct fv_corner bonnet[] = {{0.8f, 1.2f, 0},  {0.8f, 2.0f, 0},  {1.15f, 2.0f, 0},
                                              {1.15f, 2.3f, 0}, {0.5f, 2.3f, 0},  {0.3f, 2.9f, 0},
                                              {0.13f, 2.9f, 0}, {0.13f, 4.1f, 0}, {0, 4.1f, 0}};
    static const struct fv_corner wheel[] = {{1.3f, 3.62f, 1}, {1.3f, 3.86f, 1}, {1.3f, 3.62f, 0}};
    fitting(line, line->paint, at, axis, body, COUNT(body));
    flange(line, along(at, axis, -2.05f * line->radius), axis);
    flange(line, along(at, axis, 2.05f * line->radius), axis);
    fitting(line, line->paint, at, outwards, bonnet, COUNT(bonnet));
    fitting(line, line->wheels, at, outwards, wheel, COUNT(wheel));
    struct fv_brush hub = fv_pipes_along(line->wheels, at, outwards);
    float reach = 1.3f * line->radius, y = 3.74f * line->radius, thick = 0.09f * line->radius;
    fv_shape_tube(&hub, fv_vec(-reach, y, 0), fv_vec(reach, y, 0), thick, thick, 6);
    fv_shape_tube(&hub, fv_vec(0, y, -reach), fv_vec(0, y, reach), thick, thick, 6);
}

/* What sits on the straight part of a leg, from `from` to `to` metres behind its first knot. */
static void fit_out(const struct fv_pipes_line *line, int leg, float from, float to, bool clad,
                    uint32_t *random)
{
    vec3s axis = direction_of(line, leg);
    bool wheels = glms_vec3_norm2(line->outwards[leg]) > 0 && line->radius >= 0.025f && line->radius <= 0.16f;
    float spacing = clad ? 1 : fminf(3 + 25 * line->radius, 6), room = 3.2f * line->radius;
    float t = from + room + fv_random_between(random, 0, spacing);
    while (t < to - room) {
        vec3s at = along(line->knot[leg], axis, t);
        int die = fv_random_below(random, 100);
        if (clad) band(line, at, axis);
        else if (wheels && die < 22) valve(line, at, axis, line->outwards[leg]);
        else if (line->radius >= 0.03f) flange(line, at, axis);
        else coupling(line, at, axis);
        t += spacing * fv_random_between(random, 0.8f, 1.2f) + 0.01f;
    }
}

/* A blind flange, its outside along `out`. */
static void cap(const struct fv_pipes_line *line, vec3s at, vec3s out)
{
    static const struct fv_corner profile[] = {
        {0.95f, -0.3f, 0}, {1.5f, -0.3f, 0}, {1.5f, 0.3f, 0}, {0, 0.3f, 0}};
    fitting(line, line->paint, at, out, profile, COUNT(profile));
}

void fv_pipes_lay_line(const struct fv_pipes_line *line, uint32_t *random)
{
    struct mantle m;
    int last = line->legs - 1;
    bool clad = line->radius > 0.1f && fv_random_below(random, 2) == 0;
    mantle_begin(&m, line);
    mantle_ring(&m, line->knot[0], line->x[0], line->y[0]);
    for (int i = 0; i <= last; i++) {
        float length = glms_vec3_distance(line->knot[i], line->knot[i + 1]), r = bend_radius(line);
        fit_out(line, i, i > 0 ? r : 0, i < last ? length - r : length, clad, random);
        if (i < last) bend(&m, line, i);
    }
    mantle_ring(&m, line->knot[line->legs], line->x[last], line->y[last]);
    cap(line, line->knot[0], glms_vec3_negate(direction_of(line, 0)));
    cap(line, line->knot[line->legs], direction_of(line, last));
}
