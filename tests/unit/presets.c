/* presets: every settings file under config/ loads alone, and by its name where a key takes one,
 * to the same settings; and what it says is within reason. */
#include "config/config.h"

#include <glob.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static struct fv_config by_file, by_name;

static const struct {
    const char *kind, *key; /* key: the setting that names a preset of this kind, NULL where none does */
} kinds[] = {{"headsets", "display.headset"}, {"scenes", "scene.name"}, {"boards", NULL}};
enum { KINDS = sizeof kinds / sizeof kinds[0] };

static void load(struct fv_config *config, const char *file, const char *set)
{
    struct fv_error error = {""};
    struct fv_config_request request = {
        .files = file != NULL, .sets = set != NULL, .file = {file}, .set = {set}};
    if (fv_config_load(config, &request, &error)) fail_msg("%s", error.text);
}

/* Calls check(kind, name, path) for every file of every kind; fails where a kind has too few. */
static void each_file(void (*check)(int kind, const char *name, const char *path))
{
    static const size_t least[KINDS] = {5, 4, 5};
    for (int kind = 0; kind < KINDS; kind++) {
        char pattern[512], name[64];
        glob_t found;
        snprintf(pattern, sizeof pattern, "%s/config/%s/*.ini", FV_SOURCE_DIR, kinds[kind].kind);
        assert_int_equal(glob(pattern, 0, NULL, &found), 0);
        assert_true(found.gl_pathc >= least[kind]);
        for (size_t i = 0; i < found.gl_pathc; i++) {
            const char *base = strrchr(found.gl_pathv[i], '/') + 1;
            snprintf(name, sizeof name, "%.*s", (int)(strlen(base) - strlen(".ini")), base);
            check(kind, name, found.gl_pathv[i]);
        }
        globfree(&found);
    }
}

/* Alone, by name, and compiled in: all the same. */
static void check_loads(int kind, const char *name, const char *path)
{
    char set[128], text_by_file[32768], text_by_name[32768];
    load(&by_file, path, NULL);
    assert_non_null(fv_preset_text(kinds[kind].kind, name));
    if (!kinds[kind].key) return;
    snprintf(set, sizeof set, "%s=%s", kinds[kind].key, name);
    load(&by_name, NULL, set);
    for (int i = 0; i < fv_keys_count; i++) {
        fv_config_text(&by_file, &fv_keys[i], text_by_file, sizeof text_by_file);
        fv_config_text(&by_name, &fv_keys[i], text_by_name, sizeof text_by_name);
        assert_string_equal(text_by_file, text_by_name);
    }
    assert_string_equal(kind == 0 ? by_name.display_headset : by_name.scene_name, name);
}

static void test_loads(void **state)
{
    (void)state;
    each_file(check_loads);
}

/* Lines that inih takes whole, and no second preset of the same name. */
static void check_lines(int kind, const char *name, const char *path)
{
    int same = 0;
    (void)path;
    for (const char *line = fv_preset_text(kinds[kind].kind, name); *line;) {
        size_t length = strcspn(line, "\n");
        assert_true(length < 190);
        line += length + (line[length] == '\n');
    }
    for (int n = 0; fv_preset_name(kinds[kind].kind, n); n++)
        same += strcmp(fv_preset_name(kinds[kind].kind, n), name) == 0;
    assert_int_equal(same, 1);
}

static void test_lines(void **state)
{
    (void)state;
    each_file(check_lines);
}

/* What a headset's file says of its edges is what the lens shows there, but beyond where it is known. */
static void check_edge(const struct fv_config *c, double px, double deg)
{
    const double *k = c->display_lens_k.value, r = px / c->display_lens_unit_px, q = r * r;
    double seen = atan(r * (1 + q * (k[0] + q * (k[1] + q * k[2])))) * 180 / 3.14159265358979;
    if (fabs(seen - deg) > 0.1) fail_msg("%s: %g degrees at %g pixels, not %g", c->display_headset, seen, px, deg);
}

static void check_lens(const struct fv_config *c)
{
    check_edge(c, c->display_lens_x_px, c->display_fov_out_deg);
    check_edge(c, (double)c->display_width - c->display_lens_x_px, c->display_fov_in_deg);
    check_edge(c, c->display_lens_y_px, c->display_fov_up_deg);
    check_edge(c, (double)c->display_height - c->display_lens_y_px, c->display_fov_down_deg);
}

/* Pixels of a headset are about square: both directions have much the same pixels a tangent. */
static void check_headset(int kind, const char *name, const char *path)
{
    const double rad = 3.14159265358979 / 180;
    if (kind != 0) return;
    load(&by_file, path, NULL);
    const struct fv_config *c = &by_file;
    double across = c->display_width / (tan(c->display_fov_out_deg * rad) + tan(c->display_fov_in_deg * rad));
    double down = c->display_height / (tan(c->display_fov_up_deg * rad) + tan(c->display_fov_down_deg * rad));
    assert_string_equal(c->display_headset, name);
    if (strcmp(c->display_lens, "none") != 0) check_lens(c);
    else assert_true(across / down > 0.8 && across / down < 1.25);
    assert_true(c->display_ipd_mm > 50 && c->display_ipd_mm < 75);
    assert_true(c->budget_hz >= 60 && c->budget_hz <= 144);
}

static void test_headsets(void **state)
{
    (void)state;
    each_file(check_headset);
}

/* A scene's viewer walks, at no more than a brisk pace, a path that turns less
 * than half round from point to point. */
static void check_scene(int kind, const char *name, const char *path)
{
    if (kind != 1) return;
    load(&by_file, path, NULL);
    const struct fv_list *way = &by_file.scene_path;
    double length_m = 0;
    assert_string_equal(by_file.scene_name, name);
    assert_true(way->count >= 10);
    for (int i = 5; i < way->count; i += 5) {
        const double *a = &way->value[i - 5], *b = &way->value[i];
        length_m += sqrt(pow(b[0] - a[0], 2) + pow(b[1] - a[1], 2) + pow(b[2] - a[2], 2));
        assert_true(fabs(b[3] - a[3]) < 180);
        assert_true(fabs(b[4]) <= 45);
    }
    assert_true(length_m / by_file.scene_path_seconds < 1.6);
}

static void test_scenes(void **state)
{
    (void)state;
    each_file(check_scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_loads), cmocka_unit_test(test_lines),
                                       cmocka_unit_test(test_headsets), cmocka_unit_test(test_scenes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
