/* field_compile: from the nodes of a field file to parts: moves, turns and scalings are folded into the primitives
 * where they can be, unions on top are parted, and bounds are carried along. */
#include "rt/scene/field_primitive.h"
#include "rt/scene/field_parse.h"

#include "platform/arena.h"
#include "rt/scene/build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE (3.14159265358979323846 / 180)

/* Greatest slope of the noise, over its frequency and amplitude: a difference of 2 times that of the smooth step. */
#define NOISE_SLOPE 3.0

struct compiler {
    const struct fv_field_text *text;
    struct fv_field_code *code;
    int codes, parts;
    struct fv_field_part *part;
    float (*ball)[4];
    double scale;
    struct fv_error *error;
};

static int compile(struct compiler *c, int node, const struct fv_space *space, int to, struct fv_bound *bound);

static int refuse_size(const struct compiler *c, int line)
{
    return fv_field_refuse(c->text, line, c->error, "more than %d instructions in all: name no shape that often",
                           FV_FIELD_CODES_MAX);
}

static struct fv_field_code *emit(struct compiler *c, const struct fv_node *n, enum fv_field_op op, int to, int from, int point)
{
    if (c->codes >= FV_FIELD_CODES_MAX) {
        refuse_size(c, n->line);
        return NULL;
    }
    struct fv_field_code *code = &c->code[c->codes++];
    *code = (struct fv_field_code){(uint8_t)op, (uint8_t)to, (uint8_t)from, (uint8_t)point, {0}};
    return code;
}

static int registers(const struct compiler *c, const struct fv_node *n, int wanted, const char *of)
{
    if (wanted < FV_FIELD_REGISTERS) return 0;
    return fv_field_refuse(c->text, n->line, c->error, "%s: more than %d of %s in each other", fv_shape_rows[n->shape].name,
                           FV_FIELD_REGISTERS, of);
}

/* In a space of its own, whose axes are the register's. */
static int straighten(struct compiler *c, const struct fv_node *n, const struct fv_space *s, struct fv_space *own)
{
    *own = *s;
    if (!s->turned) return 0;
    if (registers(c, n, s->point + 1, "rotations and repetitions")) return -1;
    struct fv_field_code *code = emit(c, n, FV_FIELD_RIGID, s->point + 1, 0, s->point);
    if (!code) return -1;
    *own = (struct fv_space){.turn = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .scale = s->scale, .point = s->point + 1};
    for (int r = 0; r < 3; r++) {
        double moved = 0;
        for (int i = 0; i < 3; i++) {
            code->value[4 * r + i] = (float)s->turn[i][r];
            moved -= s->turn[i][r] * s->move[i];
        }
        code->value[4 * r + 3] = (float)moved;
    }
    return 0;
}

/* A bound from the space that straighten made to the one it came from. */
static void turn_back(const struct fv_space *s, struct fv_bound *bound)
{
    if (s->turned) *bound = fv_bound_turn(bound, s->turn, s->move);
}

static int primitive(struct compiler *c, const struct fv_node *n, const struct fv_space *s, int to, struct fv_bound *bound)
{
    bool any_way = n->shape == FV_SHAPE_SPHERE || n->shape == FV_SHAPE_PLANE || n->shape == FV_SHAPE_CAPSULE;
    struct fv_space own = *s;
    if (!any_way && straighten(c, n, s, &own)) return -1;
    struct fv_field_code *code = emit(c, n, fv_primitive_op(n), to, 0, own.point);
    if (!code) return -1;
    fv_primitive_put(n, &own, code->value, bound);
    if (!any_way) turn_back(s, bound);
    return 0;
}

static int combination(struct compiler *c, const struct fv_node *n, const struct fv_space *s, int to, struct fv_bound *bound)
{
    struct fv_space own;
    struct fv_bound other;
    const int *child = c->text->child + n->first;
    if (straighten(c, n, s, &own) || compile(c, child[0], &own, to, bound)) return -1;
    for (int i = 1; i < n->count; i++) {
        if (registers(c, n, to + 1, "unions, intersections and differences") || compile(c, child[i], &own, to + 1, &other)) return -1;
        enum fv_field_op op = n->shape == FV_SHAPE_UNION ? FV_FIELD_UNION
                              : n->shape == FV_SHAPE_INTERSECTION ? FV_FIELD_INTERSECT
                              : n->shape == FV_SHAPE_DIFFERENCE ? FV_FIELD_SUBTRACT
                                                                : FV_FIELD_SMOOTH;
        struct fv_field_code *code = emit(c, n, op, to, to + 1, own.point);
        if (!code) return -1;
        double lipschitz = fmax(bound->lipschitz, other.lipschitz);
        if (op == FV_FIELD_UNION || op == FV_FIELD_SMOOTH) *bound = fv_bound_join(bound, &other);
        /* Of an intersection one of the two is a bound. */
        if (op == FV_FIELD_INTERSECT && (other.radius < bound->radius || isinf(bound->radius))) *bound = other;
        bound->lipschitz = lipschitz;
        if (op != FV_FIELD_SMOOTH) continue;
        double width = n->number[0] * own.scale;
        code->value[0] = (float)width;
        code->value[1] = (float)(1 / width);
        fv_bound_grow(bound, width / 4);
    }
    turn_back(s, bound);
    return 0;
}

static int placed(struct compiler *c, const struct fv_node *n, const struct fv_space *s, struct fv_space *below)
{
    const double *v = n->number;
    *below = *s;
    if (n->shape == FV_SHAPE_TRANSLATE) fv_space_place(s, v, below->move);
    if (n->shape == FV_SHAPE_SCALE) below->scale *= v[0];
    if (!(below->scale >= 1e-9 && below->scale <= 1e9))
        return fv_field_refuse(c->text, n->line, c->error, "scale: %g in all: must be from 1e-9 to 1e9", below->scale);
    for (int i = 0; i < 3; i++)
        if (!(fabs(below->move[i]) <= FV_FIELD_LARGEST))
            return fv_field_refuse(c->text, n->line, c->error, "translate: farther than %g m from the origin", FV_FIELD_LARGEST);
    if (n->shape != FV_SHAPE_ROTATE) return 0;
    /* About x first, then y, then z. */
    for (int axis = 2; axis >= 0; axis--) {
        double sine = sin(v[axis] * DEGREE), cosine = cos(v[axis] * DEGREE);
        int a = (axis + 1) % 3, b = (axis + 2) % 3;
        for (int r = 0; r < 3; r++) {
            double p = below->turn[r][a], q = below->turn[r][b];
            below->turn[r][a] = cosine * p + sine * q;
            below->turn[r][b] = cosine * q - sine * p;
        }
        below->turned |= v[axis] != 0;
    }
    return 0;
}

static float mask_of(bool kept)
{
    uint32_t bits = kept ? 0xffffffffu : 0x7fffffffu;
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

static int mirror(struct compiler *c, const struct fv_node *n, const struct fv_space *s, int to, struct fv_bound *bound)
{
    struct fv_space own, below;
    if (straighten(c, n, s, &own) || registers(c, n, own.point + 1, "rotations and repetitions")) return -1;
    struct fv_field_code *code = emit(c, n, FV_FIELD_MIRROR, own.point + 1, 0, own.point);
    if (!code) return -1;
    fv_field_put(code->value, own.move, 3);
    uint32_t all[3];
    for (int i = 0; i < 3; i++) {
        float mask = mask_of(n->number[i] == 0);
        memcpy(&all[i], &mask, sizeof mask);
    }
    memcpy(code->value + 3, all, sizeof all);
    below = (struct fv_space){.turn = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .scale = own.scale, .point = own.point + 1};
    if (compile(c, c->text->child[n->first], &below, to, bound)) return -1;
    double low[3], high[3], spread = bound->spread, lipschitz = bound->lipschitz;
    for (int i = 0; i < 3; i++) {
        bool mirrored = n->number[i] != 0;
        /* What lies beyond the mirror is cut away. */
        high[i] = own.move[i] + (mirrored ? fmax(bound->high[i], 0) : bound->high[i]);
        low[i] = own.move[i] + (mirrored ? -fmax(bound->high[i], 0) : bound->low[i]);
    }
    *bound = fv_bound_box(low, high);
    bound->spread = spread;
    bound->lipschitz = lipschitz;
    turn_back(s, bound);
    return 0;
}

/* Writes the cells' numbers, with periods in metres; the first of the two codes. */
static void put_cells(struct fv_field_code code[2], const struct fv_node *n, const struct fv_space *own, double first[3])
{
    for (int i = 0; i < 3; i++) {
        double period = n->number[i] * own->scale, count = n->number[3 + i];
        bool repeated = period > 0, endless = repeated && count == 0;
        first[i] = own->move[i] - (repeated && !endless ? 0.5 * (count - 1) * period : 0);
        code[0].value[i] = (float)first[i];
        code[0].value[3 + i] = (float)period;
        code[0].value[6 + i] = repeated ? (float)(1 / period) : 0;
        code[0].value[9 + i] = endless ? -INFINITY : 0;
        code[0].value[12 + i] = endless ? INFINITY : repeated ? (float)(count - 1) : 0;
    }
}

static int repeat(struct compiler *c, const struct fv_node *n, const struct fv_space *s, int to, struct fv_bound *bound)
{
    struct fv_space own;
    double first[3];
    if (straighten(c, n, s, &own) || registers(c, n, own.point + 1, "rotations and repetitions") ||
        registers(c, n, to + 1, "repetitions")) return -1;
    int at = c->codes;
    if (!emit(c, n, FV_FIELD_REPEAT, own.point + 1, to, own.point) || !emit(c, n, FV_FIELD_DATA, 0, 0, 0)) return -1;
    put_cells(c->code + at, n, &own, first);
    struct fv_space below = {.turn = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .scale = own.scale, .point = own.point + 1};
    if (compile(c, c->text->child[n->first], &below, to + 1, bound)) return -1;
    double low[3], high[3], lipschitz = bound->lipschitz;
    for (int i = 0; i < 3; i++) {
        double period = n->number[i] * own.scale, count = n->number[3 + i];
        double reach = fmax(-bound->low[i], bound->high[i]), gap = period / 2 - reach;
        bool repeated = period > 0;
        if (repeated && !(gap >= -1e-9 * period))
            return fv_field_refuse(c->text, n->line, c->error,
                                   "repeat: along %c its content reaches %g m from the middle, half a period is %g m: must fit",
                                   "xyz"[i], reach / own.scale, period / 2 / own.scale);
        c->code[at + 1].value[i] = repeated ? (float)(period / 2 + fmax(gap, 0)) : INFINITY;
        double end = repeated ? count == 0 ? INFINITY : (count - 1) * period : 0;
        low[i] = isinf(end) ? -INFINITY : first[i] + bound->low[i];
        high[i] = first[i] + bound->high[i] + end;
        if (isinf(end)) high[i] = INFINITY;
    }
    *bound = fv_bound_box(low, high);
    bound->spread = sqrt(3); /* the box's part of the field is the longest of three */
    bound->lipschitz = lipschitz;
    struct fv_field_code *code = emit(c, n, FV_FIELD_NEXT_CELL, to, to + 1, own.point);
    if (!code) return -1;
    fv_bound_halves(bound, code->value, code->value + 3);
    turn_back(s, bound);
    return 0;
}

static int twist(struct compiler *c, const struct fv_node *n, const struct fv_space *s, int to, struct fv_bound *bound)
{
    struct fv_space own;
    if (straighten(c, n, s, &own) || registers(c, n, own.point + 1, "rotations and repetitions")) return -1;
    struct fv_field_code *code = emit(c, n, FV_FIELD_TWIST, own.point + 1, 0, own.point);
    if (!code) return -1;
    double turns = n->number[0] / 360 / own.scale, radians = fabs(turns) * 360 * DEGREE;
    fv_field_put(code->value, own.move, 3);
    code->value[3] = (float)turns;
    struct fv_space below = {.turn = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .scale = own.scale, .point = own.point + 1};
    if (compile(c, c->text->child[n->first], &below, to, bound)) return -1;
    double side[2], low[3], high[3];
    for (int i = 0; i < 2; i++) side[i] = fmax(-bound->low[2 * i], bound->high[2 * i]);
    double radius = sqrt(side[0] * side[0] + side[1] * side[1]), shear = radians * radius;
    if (!isfinite(radius))
        return fv_field_refuse(c->text, n->line, c->error, "twist: what is twisted has no end in x or z: it must have one");
    double lipschitz = 0.5 * (shear + sqrt(shear * shear + 4));
    if (lipschitz > 100)
        return fv_field_refuse(c->text, n->line, c->error, "twist: stretches space by %g: at most 100 are possible", lipschitz);
    for (int i = 0; i < 3; i++) {
        low[i] = own.move[i] + (i == 1 ? bound->low[1] : -radius);
        high[i] = own.move[i] + (i == 1 ? bound->high[1] : radius);
    }
    lipschitz *= bound->lipschitz;
    *bound = fv_bound_box(low, high);
    bound->spread = sqrt(3);
    bound->lipschitz = lipschitz;
    code = emit(c, n, FV_FIELD_UNTWIST, to, 0, own.point);
    if (!code) return -1;
    fv_bound_halves(bound, code->value, code->value + 3);
    code->value[6] = (float)own.move[0];
    code->value[7] = (float)own.move[2];
    code->value[8] = (float)radians;
    code->value[9] = (float)radius;
    turn_back(s, bound);
    return 0;
}

/* displace: amplitude, metres a wave; noise: amplitude, metres a cell, gain, octaves. */
static int displacement(struct compiler *c, const struct fv_node *n, const struct fv_space *s, int to, struct fv_bound *bound)
{
    struct fv_space own;
    bool noise = n->shape == FV_SHAPE_NOISE;
    double amplitude = n->number[0] * s->scale, per_metre = 1 / (n->number[1] * s->scale), sum = amplitude;
    double slope = amplitude * per_metre * 2 * 180 * DEGREE;
    if (straighten(c, n, s, &own) || compile(c, c->text->child[n->first], &own, to, bound)) return -1;
    struct fv_field_code *code = emit(c, n, noise ? FV_FIELD_NOISE : FV_FIELD_DISPLACE, to, 0, own.point);
    if (!code) return -1;
    fv_field_put(code->value, own.move, 3);
    code->value[3] = (float)per_metre;
    code->value[4] = (float)amplitude;
    if (noise) {
        slope = sum = 0;
        double a = amplitude, f = per_metre;
        for (int i = 0; i < (int)n->number[3]; i++, a *= n->number[2], f *= 2) {
            sum += a;
            slope += a * f * NOISE_SLOPE;
        }
        code->value[8] = (float)n->number[2];
        code->value[9] = (float)n->number[3];
    }
    double lipschitz = 1 + slope;
    if (lipschitz > 100)
        return fv_field_refuse(c->text, n->line, c->error, "%s: its slope of %g is too steep: at most 99 are possible",
                               fv_shape_rows[n->shape].name, slope);
    code->value[5] = (float)sum;
    code->value[6] = (float)(1 / lipschitz);
    /* From here on d - sum is more than (d + anything) / lipschitz. */
    code->value[7] = (float)(sum * (lipschitz + 1) / (lipschitz - 1) * (1 + 1e-5));
    fv_bound_grow(bound, sum);
    bound->lipschitz *= lipschitz;
    turn_back(s, bound);
    return 0;
}

static int compile(struct compiler *c, int node, const struct fv_space *space, int to, struct fv_bound *bound)
{
    const struct fv_node *n = &c->text->node[node];
    struct fv_space below;
    switch (n->shape) {
    case FV_SHAPE_UNION:
    case FV_SHAPE_INTERSECTION:
    case FV_SHAPE_DIFFERENCE:
    case FV_SHAPE_SMOOTH_UNION: return combination(c, n, space, to, bound);
    case FV_SHAPE_TRANSLATE:
    case FV_SHAPE_ROTATE:
    case FV_SHAPE_SCALE:
        return placed(c, n, space, &below) || compile(c, c->text->child[n->first], &below, to, bound) ? -1 : 0;
    case FV_SHAPE_REPEAT: return repeat(c, n, space, to, bound);
    case FV_SHAPE_MIRROR: return mirror(c, n, space, to, bound);
    case FV_SHAPE_TWIST: return twist(c, n, space, to, bound);
    case FV_SHAPE_DISPLACE:
    case FV_SHAPE_NOISE: return displacement(c, n, space, to, bound);
    default: return primitive(c, n, space, to, bound);
    }
}

/* Of convex fields, placed anywhere, the greatest is convex. */
static bool convex(const struct fv_field_code *code, int count)
{
    static const bool is[FV_FIELD_OPS] = {
        [FV_FIELD_SPHERE] = true, [FV_FIELD_BOX] = true,  [FV_FIELD_CYLINDER] = true, [FV_FIELD_PLANE] = true,
        [FV_FIELD_CAPSULE] = true, [FV_FIELD_CONE] = true, [FV_FIELD_RIGID] = true,   [FV_FIELD_INTERSECT] = true};
    for (int i = 0; i < count; i++)
        if (!is[code[i].op]) return false;
    return true;
}

static int add_part(struct compiler *c, int node, const struct fv_space *space, const struct fv_field_part *like)
{
    struct fv_bound bound;
    const struct fv_node *n = &c->text->node[node];
    if (c->parts == FV_FIELD_PARTS_MAX)
        return fv_field_refuse(c->text, n->line, c->error, "more than %d parts: unions on top are parted", FV_FIELD_PARTS_MAX);
    struct fv_field_part *p = &c->part[c->parts];
    *p = *like;
    p->first = c->codes;
    if (compile(c, node, space, 0, &bound)) return -1;
    p->count = c->codes - p->first;
    p->lipschitz = (float)bound.lipschitz;
    p->convex = convex(c->code + p->first, p->count);
    float *ball = c->ball[c->parts++];
    for (int i = 0; i < 3; i++) {
        double outward = 1e-6 * (fabs(bound.low[i]) + fabs(bound.high[i]));
        p->low[i] = isinf(bound.low[i]) ? -INFINITY : (float)(bound.low[i] - (isinf(outward) ? 1e-6 * fabs(bound.low[i]) : outward));
        p->high[i] = isinf(bound.high[i]) ? INFINITY : (float)(bound.high[i] + (isinf(outward) ? 1e-6 * fabs(bound.high[i]) : outward));
        ball[i] = isinf(bound.radius) ? 0 : (float)bound.centre[i];
        bound.radius += isinf(bound.radius) ? 0 : 1e-6 * fabs(bound.centre[i]);
    }
    ball[3] = (float)(bound.radius * (1 + 1e-6));
    return 0;
}

/* A union's children, also where it is moved, turned or scaled as a whole, are parts each. */
static int add_parts(struct compiler *c, int node, const struct fv_space *space, const struct fv_field_part *like)
{
    const struct fv_node *n = &c->text->node[node];
    struct fv_space below;
    if (n->shape == FV_SHAPE_TRANSLATE || n->shape == FV_SHAPE_ROTATE || n->shape == FV_SHAPE_SCALE)
        return placed(c, n, space, &below) || add_parts(c, c->text->child[n->first], &below, like) ? -1 : 0;
    if (n->shape != FV_SHAPE_UNION) return add_part(c, node, space, like);
    for (int i = 0; i < n->count; i++)
        if (add_parts(c, c->text->child[n->first + i], space, like)) return -1;
    return 0;
}

static void lay_out(struct fv_fields *f, const struct compiler *c)
{
    size_t padded = ((size_t)c->parts + FV_FIELD_LANES - 1) / FV_FIELD_LANES * FV_FIELD_LANES;
    struct fv_field_part *part = fv_arena_take(fv_arena(), "scene fields", (size_t)c->parts * sizeof *part, 64);
    struct fv_field_code *code = fv_arena_take(fv_arena(), "scene fields", (size_t)c->codes * sizeof *code, 64);
    float *ball = fv_arena_take(fv_arena(), "scene fields", 4 * padded * sizeof *ball, 64);
    memcpy(part, c->part, (size_t)c->parts * sizeof *part);
    memcpy(code, c->code, (size_t)c->codes * sizeof *code);
    for (size_t i = 0; i < padded; i++)
        for (size_t k = 0; k < 4; k++)
            ball[k * padded + i] = i < (size_t)c->parts ? c->ball[i][k] : k < 3 ? 0 : -INFINITY;
    *f = (struct fv_fields){.parts = c->parts, .codes = c->codes, .part = part, .code = code,
                            .x = ball, .y = ball + padded, .z = ball + 2 * padded, .radius = ball + 3 * padded};
}

int64_t fv_fields_bytes(const struct fv_fields *f)
{
    int64_t padded = (f->parts + FV_FIELD_LANES - 1) / FV_FIELD_LANES * FV_FIELD_LANES;
    return f->parts * (int64_t)sizeof *f->part + f->codes * (int64_t)sizeof *f->code + 16 * padded;
}

static int compile_solids(struct compiler *c, struct fv_build *build)
{
    const struct fv_field_text *t = c->text;
    const struct fv_space world = {.turn = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .scale = c->scale};
    int material[FV_SOLIDS_MAX];
    for (int i = 0; i < t->materials; i++) material[i] = fv_build_material(build, &t->material[i].material);
    for (int i = 0; i < t->solids; i++) {
        const struct fv_field_material *m = &t->material[t->solid[i].material];
        struct fv_field_part like = {.material = material[t->solid[i].material],
                                     .checker_size = (float)(m->checker_size * c->scale)};
        fv_field_put(like.checker, m->checker, 3);
        if (add_parts(c, t->solid[i].node, &world, &like)) return -1;
    }
    return 0;
}

int fv_fields_read(struct fv_fields *fields, struct fv_build *build, const char *text, size_t size,
                   const char *source, double scale, struct fv_error *error)
{
    struct fv_field_text *nodes = calloc(1, sizeof *nodes);
    struct compiler c = {.text = nodes, .scale = scale, .error = error};
    c.code = calloc(FV_FIELD_CODES_MAX, sizeof *c.code);
    c.part = calloc(FV_FIELD_PARTS_MAX, sizeof *c.part);
    c.ball = calloc(FV_FIELD_PARTS_MAX, sizeof *c.ball);
    int result = -1;
    if (!nodes || !c.code || !c.part || !c.ball) fv_error_set(error, "memory: no room to read %.200s", source);
    else if (fv_field_parse(nodes, text, size, source, error) == 0) result = compile_solids(&c, build);
    if (result == 0) lay_out(fields, &c);
    free(nodes);
    free(c.code);
    free(c.part);
    free(c.ball);
    return result;
}
