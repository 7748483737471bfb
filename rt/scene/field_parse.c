/* field_parse: see field_parse.h. By recursive descent, of bounded depth; a name stands for what it was given
 * before, so that nothing can contain itself. */
#include "rt/scene/field_parse.h"

#include "rt/scene/build.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const struct fv_shape_row fv_shape_rows[FV_SHAPES] = {
    [FV_SHAPE_SPHERE] = {"sphere", 1, 0, 0},
    [FV_SHAPE_BOX] = {"box", 3, 0, 0},
    [FV_SHAPE_ROUND_BOX] = {"round_box", 4, 0, 0},
    [FV_SHAPE_CYLINDER] = {"cylinder", 2, 0, 0},
    [FV_SHAPE_TORUS] = {"torus", 2, 0, 0},
    [FV_SHAPE_PLANE] = {"plane", 4, 0, 0},
    [FV_SHAPE_CAPSULE] = {"capsule", 7, 0, 0},
    [FV_SHAPE_CONE] = {"cone", 3, 0, 0},
    [FV_SHAPE_UNION] = {"union", 0, 1, FV_NODES_MAX},
    [FV_SHAPE_INTERSECTION] = {"intersection", 0, 2, FV_NODES_MAX},
    [FV_SHAPE_DIFFERENCE] = {"difference", 0, 2, FV_NODES_MAX},
    [FV_SHAPE_SMOOTH_UNION] = {"smooth_union", 1, 2, FV_NODES_MAX},
    [FV_SHAPE_TRANSLATE] = {"translate", 3, 1, 1},
    [FV_SHAPE_ROTATE] = {"rotate", 3, 1, 1},
    [FV_SHAPE_SCALE] = {"scale", 1, 1, 1},
    [FV_SHAPE_REPEAT] = {"repeat", 6, 1, 1},
    [FV_SHAPE_MIRROR] = {"mirror", 3, 1, 1},
    [FV_SHAPE_TWIST] = {"twist", 1, 1, 1},
    [FV_SHAPE_DISPLACE] = {"displace", 2, 1, 1},
    [FV_SHAPE_NOISE] = {"noise", 4, 1, 1},
};

struct parser {
    struct fv_field_text *out;
    const char *at, *end;
    int line, open; /* open: parentheses, in which lines do not end */
    char word[FV_WORD_MAX]; /* the last that was read */
    struct fv_error *error;
};

int fv_field_refuse(const struct fv_field_text *text, int line, struct fv_error *error, const char *format, ...)
{
    char what[300];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    return fv_error_set(error, "%.180s:%d: %s", text->source, line, what);
}

#define REFUSE(p, ...) fv_field_refuse((p)->out, (p)->line, (p)->error, __VA_ARGS__)

/* To the next that is no blank, comment or, within parentheses, line's end. Returns it, 0 at the end. */
static int peek(struct parser *p)
{
    for (; p->at < p->end; p->at++) {
        if (*p->at == '#')
            while (p->at + 1 < p->end && p->at[1] != '\n') p->at++;
        else if (*p->at == '\n' && p->open == 0) return '\n';
        else if (*p->at == '\n') p->line++;
        else if (*p->at != ' ' && *p->at != '\t' && *p->at != '\r') return *p->at > 0 ? *p->at : 1;
    }
    return 0;
}

static bool is_word(int c)
{
    return isalnum(c) || c == '_';
}

/* What stands next, for messages. */
static const char *next(struct parser *p, char out[24])
{
    int c = peek(p);
    if (c == 0 || c == '\n') return c ? "the line ends" : "the file ends";
    int length = 0;
    while (length < 16 && p->at + length < p->end && is_word((unsigned char)p->at[length])) length++;
    if (length == 0 && !isprint(c)) return "a byte that is no text stands there";
    snprintf(out, 24, "'%.*s' is there", length ? length : 1, p->at);
    return out;
}

/* A name or keyword into p->word. */
static int read_word(struct parser *p, const char *what)
{
    char there[24];
    size_t length = 0;
    int c = peek(p);
    if (!isalpha(c) && c != '_') return REFUSE(p, "%s is missing: %s", what, next(p, there));
    while (p->at < p->end && is_word((unsigned char)*p->at)) {
        if (length == FV_WORD_MAX - 1) return REFUSE(p, "%.20s...: a name has at most %d letters", p->word, FV_WORD_MAX - 1);
        p->word[length++] = *p->at++;
        p->word[length] = 0;
    }
    return 0;
}

static int expect(struct parser *p, int sign, const char *where)
{
    char there[24];
    if (peek(p) != sign) return REFUSE(p, "'%c' is missing %s: %s", sign, where, next(p, there));
    p->at++;
    return 0;
}

static int read_number(struct parser *p, const char *of, double *out)
{
    char text[40], there[24], *end;
    size_t length = 0;
    int c = peek(p);
    if (!isdigit(c) && c != '-' && c != '+' && c != '.') return REFUSE(p, "%s: a number is missing: %s", of, next(p, there));
    while (p->at < p->end && length < sizeof text - 1 && (isalnum((unsigned char)*p->at) || strchr("+-.", *p->at)) && *p->at)
        text[length++] = *p->at++;
    text[length] = 0;
    *out = strtod(text, &end);
    if (*end || end == text) return REFUSE(p, "%s: %.30s is not a number", of, text);
    if (!(fabs(*out) <= FV_FIELD_LARGEST)) return REFUSE(p, "%s: %.30s: must be from -1e7 to 1e7", of, text);
    return 0;
}

static int find_name(const struct fv_field_text *out, const char *word)
{
    for (int i = 0; i < out->names; i++)
        if (strcmp(out->named[i].name, word) == 0) return out->named[i].node;
    return -1;
}

static int find_shape(const char *word)
{
    for (int s = 0; s < FV_SHAPES; s++)
        if (strcmp(fv_shape_rows[s].name, word) == 0) return s;
    return -1;
}

static int read_shape(struct parser *p, int *node);

/* What is in the parentheses behind a shape's name. */
static int read_arguments(struct parser *p, struct fv_node *n)
{
    const struct fv_shape_row *row = &fv_shape_rows[n->shape];
    int own[64], count = 0;
    if (expect(p, '(', "behind the shape's name")) return -1;
    if (++p->open > FV_DEPTH_MAX) return REFUSE(p, "more than %d parentheses in each other: name parts by let", FV_DEPTH_MAX);
    for (int i = 0; i < row->numbers; i++)
        if ((i > 0 && expect(p, ',', "between numbers")) || read_number(p, row->name, &n->number[i])) return -1;
    for (; peek(p) != ')'; count++) {
        if (count == row->most || count == 64)
            return REFUSE(p, "%s: ')' is missing, it takes %d numbers and at most %d shapes", row->name, row->numbers, row->most < 64 ? row->most : 64);
        if ((count + row->numbers > 0 && expect(p, ',', "before the next shape")) || read_shape(p, &own[count])) return -1;
        const struct fv_node *below = &p->out->node[own[count]];
        if (below->depth + 1 > n->depth) n->depth = below->depth + 1;
    }
    p->at++;
    p->open--;
    if (count < row->least) return REFUSE(p, "%s: needs %d shapes, has %d", row->name, row->least, count);
    if (n->depth > FV_DEPTH_MAX) return REFUSE(p, "%s: more than %d shapes in each other", row->name, FV_DEPTH_MAX);
    if (p->out->children + count > FV_NODES_MAX) return REFUSE(p, "more than %d shapes in the file", FV_NODES_MAX);
    n->first = p->out->children;
    n->count = count;
    memcpy(p->out->child + n->first, own, (size_t)count * sizeof *own);
    p->out->children += count;
    return 0;
}

static int read_shape(struct parser *p, int *node)
{
    if (read_word(p, "a shape")) return -1;
    *node = find_name(p->out, p->word);
    if (*node >= 0) return 0;
    int shape = find_shape(p->word);
    if (shape < 0)
        return REFUSE(p, "%.47s: neither a shape nor a name that a let before it gives", p->word);
    struct fv_node n = {.shape = (enum fv_shape)shape, .line = p->line, .depth = 1};
    if (read_arguments(p, &n) || fv_field_check(p->out, &n, p->error)) return -1;
    if (p->out->nodes == FV_NODES_MAX) return REFUSE(p, "more than %d shapes in the file", FV_NODES_MAX);
    *node = p->out->nodes++;
    p->out->node[*node] = n;
    return 0;
}

static int read_let(struct parser *p)
{
    struct fv_field_text *out = p->out;
    char name[FV_WORD_MAX];
    int node;
    if (read_word(p, "a name behind let")) return -1;
    if (find_shape(p->word) >= 0 || find_name(out, p->word) >= 0)
        return REFUSE(p, "let %.47s: is %s already", p->word, find_shape(p->word) >= 0 ? "a shape" : "given");
    if (out->names == FV_NAMED_MAX) return REFUSE(p, "more than %d names", FV_NAMED_MAX);
    memcpy(name, p->word, sizeof name);
    if (expect(p, '=', "behind the name") || read_shape(p, &node)) return -1;
    memcpy(out->named[out->names].name, name, sizeof name);
    out->named[out->names++].node = node;
    return 0;
}

static int find_material(const struct fv_field_text *out, const char *word)
{
    for (int i = 0; i < out->materials; i++)
        if (strcmp(out->material[i].name, word) == 0) return i;
    return -1;
}

static int read_solid(struct parser *p)
{
    struct fv_field_text *out = p->out;
    int line = p->line, node;
    if (read_word(p, "a material behind solid")) return -1;
    int material = find_material(out, p->word);
    if (material < 0) return REFUSE(p, "solid %.47s: no material of this name is given before", p->word);
    if (expect(p, ':', "behind the material") || read_shape(p, &node)) return -1;
    if (out->solids == FV_SOLIDS_MAX) return REFUSE(p, "more than %d solids", FV_SOLIDS_MAX);
    out->solid[out->solids].node = node;
    out->solid[out->solids].material = material;
    out->solid[out->solids++].line = line;
    return 0;
}

/* A material's properties: a keyword and its numbers, each at most `most`. */
static const struct {
    const char *name;
    int numbers;
    double most;
} properties[] = {{"diffuse", 3, 1}, {"specular", 4, 1e4}, {"mirror", 3, 1}, {"emission", 3, 1e6}, {"checker", 4, 1e4}};
enum { DIFFUSE, SPECULAR, MIRROR, EMISSION, CHECKER, PROPERTIES };

static void set_property(struct fv_field_material *m, int property, const double v[4])
{
    float *colour[PROPERTIES] = {m->material.diffuse, m->material.specular, m->material.mirror, m->material.emission, NULL};
    for (int i = 0; i < 3; i++)
        if (colour[property]) colour[property][i] = (float)v[i];
        else m->checker[i] = v[i];
    if (property == SPECULAR) m->material.shininess = (float)v[3];
    if (property == CHECKER) m->checker_size = v[3];
}

static int read_material(struct parser *p)
{
    struct fv_field_text *out = p->out;
    if (read_word(p, "a name behind material")) return -1;
    if (find_material(out, p->word) >= 0) return REFUSE(p, "material %.47s: is given already", p->word);
    if (out->materials == FV_SOLIDS_MAX) return REFUSE(p, "more than %d materials", FV_SOLIDS_MAX);
    struct fv_field_material *m = &out->material[out->materials++];
    *m = (struct fv_field_material){.material = fv_material_default()};
    memcpy(m->name, p->word, sizeof m->name);
    while (peek(p) != '\n' && peek(p) != 0) {
        double v[4] = {0};
        int k = 0;
        if (read_word(p, "diffuse, specular, mirror, emission or checker")) return -1;
        while (k < PROPERTIES && strcmp(properties[k].name, p->word) != 0) k++;
        if (k == PROPERTIES)
            return REFUSE(p, "%.47s: must be diffuse, specular, mirror, emission or checker", p->word);
        for (int i = 0; i < properties[k].numbers; i++) {
            if (read_number(p, properties[k].name, &v[i])) return -1;
            double most = i == 3 || k == EMISSION ? properties[k].most : 1;
            if (!(v[i] >= 0 && v[i] <= most)) return REFUSE(p, "%s %g: must be from 0 to %g", properties[k].name, v[i], most);
        }
        if (k == CHECKER && v[3] < 1e-3) return REFUSE(p, "checker: squares of %g m: must be 0.001 or more", v[3]);
        set_property(m, k, v);
    }
    return 0;
}

static const struct {
    const char *name;
    int (*read)(struct parser *p);
} statements[] = {{"let", read_let}, {"material", read_material}, {"solid", read_solid}};

int fv_field_parse(struct fv_field_text *out, const char *text, size_t size, const char *source,
                   struct fv_error *error)
{
    struct parser parser = {.out = out, .at = text, .end = text + size, .line = 1, .error = error}, *p = &parser;
    char there[24];
    out->source = source;
    out->nodes = out->children = out->names = out->materials = out->solids = 0;
    for (;;) {
        int c = peek(p), s = 0;
        if (c == 0) break;
        if (c != '\n') {
            if (read_word(p, "let, material or solid")) return -1;
            while (s < 3 && strcmp(statements[s].name, p->word) != 0) s++;
            if (s == 3) return REFUSE(p, "%.47s: a line begins with let, material or solid", p->word);
            if (statements[s].read(p)) return -1;
            if (peek(p) != '\n' && peek(p) != 0) return REFUSE(p, "the line should end here: %s", next(p, there));
        }
        if (peek(p) == '\n') p->at++, p->line++;
    }
    return out->solids ? 0 : REFUSE(p, "there is no solid: at least one line 'solid MATERIAL: SHAPE' is needed");
}
