/* fields: field files that are read, and those that are not, with what is said about them; and what folding and
 * parting leave of them. */
#include "rt/scene/build.h"
#include "tests/support/program.h"

#include <math.h>

static struct fv_fields fields;
static struct fv_error error;

static int read_with(const char *text, size_t size, double scale)
{
    struct fv_build *build = fv_build_create("test");
    error.text[0] = 0;
    int result = fv_fields_read(&fields, build, text, size, "test.field", scale, &error);
    fv_build_destroy(build);
    return result;
}

static int read_fields(const char *text)
{
    return read_with(text, strlen(text), 1);
}

#define M "material a diffuse 0.5 0.5 0.5\n"

static void good(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int parts, codes;
    } table[] = {
        {M "solid a: sphere(1)", 1, 1},
        {"\r\n" M "\n\n# nothing\nsolid a: sphere(1) # one\r\n", 1, 1},
        {M "solid a: union(sphere(1), box(1, 1, 1), plane(0, 1, 0, 0))", 3, 3},
        {M "solid a: translate(1, 2, 3, scale(2, union(sphere(1), union(torus(1, .25), cone(1, 0, 1)))))", 3, 3},
        {M "let b = box(1, 1,\n  # within\n  1)\nsolid a: difference(b, sphere(0.6))\nsolid a: b", 2, 4},
        {M "solid a: rotate(10, 0, 0, sphere(1))", 1, 1},
        {M "solid a: rotate(10, 0, 0, capsule(0, 0, 0, 1, 1, 1, 1e-1))", 1, 1},
        {M "solid a: rotate(10, 0, 0, box(1, 1, 1))", 1, 2},
        {M "solid a: rotate(0, 0, 0, box(1, 1, 1))", 1, 1},
        {M "solid a: rotate(10, 0, 0, intersection(box(1, 1, 1), cylinder(1, 1)))", 1, 4},
        {M "solid a: repeat(3, 0, 2, 0, 0, 5, cylinder(1, 4))", 1, 4},
        {M "solid a: mirror(1, 0, 1, sphere(1))", 1, 2},
        {M "solid a: twist(90, box(1, 1, 1))", 1, 3},
        {M "solid a: noise(0.1, 1, 0.5, 3, displace(0.1, 1, sphere(1)))", 1, 3},
        {M "solid a: smooth_union(0.1, sphere(1), sphere(1), sphere(1))", 1, 5},
        {M "solid a: displace(0.1, 1, plane(0, 1, 0, 0))", 1, 2},
        {"material a diffuse 1 0 0 specular 0.1 0.1 0.1 40 mirror 0 0 0 emission 5 5 5 checker 0 0 0 2\nsolid a: sphere(1)", 1, 1},
        {"material a\nsolid a: sphere(1)", 1, 1},
    };
    for (unsigned i = 0; i < sizeof table / sizeof table[0]; i++) {
        if (read_fields(table[i].text)) fail_msg("%s\n%s", error.text, table[i].text);
        if (fields.parts != table[i].parts || fields.codes != table[i].codes)
            fail_msg("%d parts, %d codes of %s", fields.parts, fields.codes, table[i].text);
    }
}

static void bad(void **state)
{
    (void)state;
    static const struct {
        const char *text, *says;
    } table[] = {
        {"", "test.field:1: there is no solid"},
        {M "\n\n", "test.field:4: there is no solid"},
        {M "solid b: sphere(1)", "test.field:2: solid b: no material"},
        {M "solid a sphere(1)", "test.field:2: ':' is missing"},
        {M "solid a: ball(1)", "test.field:2: ball: neither a shape nor a name"},
        {M "solid a: sphere", "test.field:2: '(' is missing"},
        {M "solid a: sphere()", "test.field:2: sphere: a number is missing"},
        {M "solid a: sphere(1", "test.field:2: sphere: ')' is missing"},
        {M "solid a: sphere(1, 2)", "test.field:2: sphere: ')' is missing"},
        {M "solid a: sphere(1) sphere(1)", "test.field:2: the line should end here: 'sphere' is there"},
        {M "solid a: box(1, 1)", "test.field:2: ',' is missing between numbers"},
        {M "solid a: sphere(0)", "test.field:2: sphere: 0: must be 1e-05 or more"},
        {M "solid a: sphere(-1)", "sphere: -1: must be"},
        {M "solid a: sphere(nan)", "a number is missing: 'nan' is there"},
        {M "solid a: sphere(1e999)", "must be from -1e7 to 1e7"},
        {M "solid a: sphere(+inf)", "+inf: must be from"},
        {M "solid a: sphere(-nan)", "-nan: must be from"},
        {M "solid a: sphere(0x)", "0x is not a number"},
        {M "solid a: sphere(1..2)", "1..2 is not a number"},
        {M "solid a: round_box(1, 1, 1, 0.6)", "rounding is more than half an edge"},
        {M "solid a: torus(1, 2)", "tube's radius"},
        {M "solid a: plane(0, 0, 0, 1)", "normal has no length"},
        {M "solid a: capsule(1, 1, 1, 1, 1, 1, 1)", "take a sphere"},
        {M "solid a: cone(0, 0, 1)", "radii must be"},
        {M "solid a: cone(-1, 2, 1)", "radii must be"},
        {M "solid a: union()", "union: needs 1 shapes, has 0"},
        {M "solid a: difference(sphere(1))", "difference: needs 2 shapes, has 1"},
        {M "solid a: translate(1, 1, 1, sphere(1), sphere(1))", "translate: ')' is missing"},
        {M "solid a: translate(1, 1, 1)", "translate: needs 1 shapes, has 0"},
        {M "solid a: scale(0, sphere(1))", "scale: 0: must be"},
        {M "solid a: scale(1e6, scale(1e6, sphere(1)))", "scale: 1e+12 in all"},
        {M "solid a: translate(9e6, 0, 0, translate(9e6, 0, 0, sphere(1)))", "farther than 1e+07 m"},
        {M "solid a: repeat(1, 0, 0, 0, 0, 0, sphere(0.6))", "repeat: along x its content reaches 0.6 m from the middle, half a period is 0.5 m"},
        {M "solid a: repeat(0, 4, 0, 0, 0, 0, plane(0, 1, 0, 0))", "repeat: along y its content reaches inf m"},
        {M "solid a: repeat(0, 0, 0, 0, 0, 0, sphere(1))", "it has no period"},
        {M "solid a: repeat(4, 0, 0, 1.5, 0, 0, sphere(1))", "counts must be"},
        {M "solid a: repeat(-4, 0, 0, 1, 0, 0, sphere(1))", "periods must be"},
        {M "solid a: mirror(1, 2, 0, sphere(1))", "must be 1 (mirrored"},
        {M "solid a: twist(90, plane(0, 1, 0, 0))", "twist: what is twisted has no end"},
        {M "solid a: twist(1e6, box(1, 1, 1))", "twist: stretches space by"},
        {M "solid a: displace(100, 1, sphere(1))", "displace: its slope"},
        {M "solid a: displace(0, 1, sphere(1))", "displace: 0: must be"},
        {M "solid a: noise(0.1, 1, 2, 1, sphere(1))", "the gain must be"},
        {M "solid a: noise(0.1, 1, 0.5, 9, sphere(1))", "octaves must be"},
        {M "let b = b\nsolid a: b", "test.field:2: b: neither a shape nor a name that a let before it gives"},
        {M "let b = union(c, sphere(1))\nlet c = b\nsolid a: b", "test.field:2: c: neither"},
        {M "let b = sphere(1)\nlet b = sphere(2)\nsolid a: b", "test.field:3: let b: is given already"},
        {M "let box = sphere(1)\nsolid a: box", "let box: is a shape already"},
        {M "let = sphere(1)", "a name behind let is missing: '=' is there"},
        {M "let b sphere(1)", "'=' is missing behind the name: 'sphere' is there"},
        {M "cube(1)", "test.field:2: cube: a line begins with let, material or solid"},
        {M "\x01", "a byte that is no text stands there"},
        {M "\xff\xfe", "a byte that is no text stands there"},
        {M M "solid a: sphere(1)", "test.field:2: material a: is given already"},
        {"material a diffuse 2 0 0\n", "diffuse 2: must be from 0 to 1"},
        {"material a diffuse 1 0\n", "diffuse: a number is missing: the line ends"},
        {"material a shiny 1\n", "shiny: must be diffuse, specular"},
        {"material a checker 1 1 1 0\n", "checker: squares of 0 m"},
        {"material a emission -1 0 0\n", "emission -1: must be"},
        {"material averyveryverylongnamethatgoesonandonandonandonandon\n", "at most 47 letters"},
    };
    for (unsigned i = 0; i < sizeof table / sizeof table[0]; i++) {
        if (read_fields(table[i].text) == 0) fail_msg("was read: %s", table[i].text);
        if (!strstr(error.text, table[i].says)) fail_msg("%s\nmust say: %s", error.text, table[i].says);
        assert_true(strncmp(error.text, "test.field:", 11) == 0);
    }
}

static size_t wrapped(char *out, const char *before, const char *inner, const char *after, int times)
{
    size_t n = (size_t)sprintf(out, M "solid a: ");
    for (int i = 0; i < times; i++) n += (size_t)sprintf(out + n, "%s", before);
    n += (size_t)sprintf(out + n, "%s", inner);
    for (int i = 0; i < times; i++) n += (size_t)sprintf(out + n, "%s", after);
    return n;
}

/* Tables that are full, and depth without end. */
static void too_much(void **state)
{
    (void)state;
    static char text[1 << 20];
    wrapped(text, "union(", "sphere(1)", ")", 30);
    assert_int_equal(read_fields(text), 0);
    wrapped(text, "union(", "sphere(1)", ")", 100000);
    assert_int_equal(read_fields(text), -1);
    assert_non_null(strstr(error.text, "parentheses in each other"));
    wrapped(text, "twist(1, ", "sphere(1)", ")", 20);
    assert_int_equal(read_fields(text), -1);
    assert_non_null(strstr(error.text, "of rotations and repetitions in each other"));
    wrapped(text, "intersection(sphere(1), ", "sphere(1)", ")", 20);
    assert_int_equal(read_fields(text), -1);
    assert_non_null(strstr(error.text, "of unions, intersections and differences in each other"));
    /* Names that double what they stand for. */
    size_t n = (size_t)sprintf(text, M "let n0 = sphere(1)\n");
    for (int i = 1; i < 28; i++) n += (size_t)sprintf(text + n, "let n%d = union(n%d, n%d)\n", i, i - 1, i - 1);
    sprintf(text + n, "solid a: n27");
    assert_int_equal(read_fields(text), -1);
    assert_non_null(strstr(error.text, "more than 256 parts"));
    n = (size_t)sprintf(text, M "let n0 = sphere(1)\n");
    for (int i = 1; i < 5; i++) n += (size_t)sprintf(text + n, "let n%d = union(n%d, n%d, n%d, n%d, n%d, n%d, n%d, n%d)\n", i, i - 1, i - 1, i - 1, i - 1, i - 1, i - 1, i - 1, i - 1);
    sprintf(text + n, "solid a: displace(0.1, 1, n4)");
    assert_int_equal(read_fields(text), -1);
    assert_non_null(strstr(error.text, "more than 4096 instructions"));
    n = (size_t)sprintf(text, M "let n0 = sphere(1)\n");
    for (int i = 1; i < 60; i++) n += (size_t)sprintf(text + n, "let n%d = translate(1, 0, 0, n%d)\n", i, i - 1);
    assert_int_equal(read_fields(text), -1);
    assert_non_null(strstr(error.text, "shapes in each other"));
    n = (size_t)sprintf(text, M);
    for (int i = 0; i < 300; i++) n += (size_t)sprintf(text + n, "let n%d = sphere(1)\n", i);
    assert_int_equal(read_fields(text), -1);
    assert_non_null(strstr(error.text, "more than 256 names"));
    n = (size_t)sprintf(text, M);
    for (int i = 0; i < 300; i++) n += (size_t)sprintf(text + n, "solid a: sphere(1)\n");
    assert_int_equal(read_fields(text), -1);
    assert_non_null(strstr(error.text, "more than 256"));
    n = (size_t)sprintf(text, M);
    for (int i = 0; i < 200; i++) {
        n += (size_t)sprintf(text + n, "solid a: intersection(sphere(1)");
        for (int k = 0; k < 30; k++) n += (size_t)sprintf(text + n, ", sphere(1)");
        n += (size_t)sprintf(text + n, ")\n");
    }
    assert_int_equal(read_fields(text), -1);
    assert_non_null(strstr(error.text, "more than 4096 shapes"));
}

static void bounds(void **state)
{
    (void)state;
    static const struct {
        const char *solid;
        float low[3], high[3], radius; /* 1e9: infinite */
    } table[] = {
        {"sphere(2)", {-2, -2, -2}, {2, 2, 2}, 2},
        {"translate(1, 2, 3, scale(2, sphere(2)))", {-3, -2, -1}, {5, 6, 7}, 4},
        {"plane(0, 1, 0, 3)", {-1e9f, -1e9f, -1e9f}, {1e9f, 3, 1e9f}, 1e9f},
        {"translate(0, 2, 0, plane(0, -2, 0, 3))", {-1e9f, -1, -1e9f}, {1e9f, 1e9f, 1e9f}, 1e9f},
        {"rotate(90, 0, 0, plane(0, 1, 0, 3))", {-1e9f, -1e9f, -1e9f}, {1e9f, 1e9f, 3}, 1e9f},
        {"rotate(90, 0, 0, cylinder(1, 6))", {-1, -1, -3}, {1, 1, 3}, 3.3166f},
        {"difference(box(2, 2, 2), sphere(9))", {-1, -1, -1}, {1, 1, 1}, 1.7321f},
        {"intersection(plane(0, 1, 0, 0), sphere(1))", {-1, -1, -1}, {1, 1, 1}, 1},
        {"smooth_union(0.4, sphere(1), sphere(1))", {-1.1f, -1.1f, -1.1f}, {1.1f, 1.1f, 1.1f}, 1.1f},
        {"repeat(4, 0, 0, 3, 0, 0, sphere(1))", {-5, -1, -1}, {5, 1, 1}, 5.1962f},
        {"repeat(4, 0, 0, 0, 0, 0, sphere(1))", {-1e9f, -1, -1}, {1e9f, 1, 1}, 1e9f},
        {"mirror(1, 0, 0, translate(3, 0, 0, sphere(1)))", {-4, -1, -1}, {4, 1, 1}, 4.2426f},
        {"displace(0.5, 9, sphere(1))", {-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}, 1.5f},
    };
    for (unsigned i = 0; i < sizeof table / sizeof table[0]; i++) {
        char text[256];
        snprintf(text, sizeof text, M "solid a: %s", table[i].solid);
        if (read_fields(text)) fail_msg("%s", error.text);
        const struct fv_field_part *p = &fields.part[0];
        for (int c = 0; c < 3; c++)
            if (fabsf(fmaxf(p->low[c], -1e9f) - table[i].low[c]) > 1e-3f || fabsf(fminf(p->high[c], 1e9f) - table[i].high[c]) > 1e-3f)
                fail_msg("%s: %g to %g along %c", table[i].solid, (double)p->low[c], (double)p->high[c], "xyz"[c]);
        if (fabsf(fminf(fields.radius[0], 1e9f) - table[i].radius) > 1e-3f)
            fail_msg("%s: radius %g", table[i].solid, (double)fields.radius[0]);
    }
}

/* Cut off anywhere, a file is refused with a reason, or is whole as it is. */
static void cut(void **state)
{
    (void)state;
    const char *text = fv_preset_text("fields", "temple");
    for (size_t n = 0; n < strlen(text); n++) {
        char *exact = malloc(n + 1);
        memcpy(exact, text, n);
        if (read_with(exact, n, 1)) assert_true(error.text[0] != 0);
        free(exact);
    }
}

/* As the program says it: exit 2, before the first frame. */
static void refused(void **state)
{
    (void)state;
    static const struct {
        const char *arguments, *says;
    } table[] = {{"--set scene.name=none --set scene.fields=bad.field", "bad.field:2: ball: neither a shape"},
                 {"--set scene.name=none --set scene.fields=none.field", "none.field is not there"},
                 {"--set scene.name=none --set scene.fields=builtin:none", "not known"},
                 {"--set scene.name=none --set scene.fields=bad.txt", "must end in .field"},
                 {"--set scene.name=none", "'none' is not known"}};
    program_write("bad.field", M "solid a: ball(1)", strlen(M "solid a: ball(1)"));
    for (unsigned i = 0; i < sizeof table / sizeof table[0]; i++) {
        struct program_result r = program("run %s --frames 1 --out out", table[i].arguments);
        if (r.code != 2 || !strstr(r.errors, table[i].says)) fail_msg("exit %d: %s", r.code, r.errors);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(good), cmocka_unit_test(bad), cmocka_unit_test(too_much),
                                       cmocka_unit_test(bounds), cmocka_unit_test(cut), cmocka_unit_test(refused)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
