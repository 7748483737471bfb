/* config: what is read, and the message for everything that is not. */
#include "config/config.h"
#include "tests/support/program.h"

static struct fv_config config;
static struct fv_error error;

static int load_text(const char *ini, const char *set)
{
    static char path[128];
    snprintf(path, sizeof path, "%s/test.ini", program_folder());
    program_write("test.ini", ini, strlen(ini));
    struct fv_config_request r = {.files = 1, .file = {path}, .sets = set ? 1 : 0, .set = {set}};
    return fv_config_load(&config, &r, &error);
}

static void later_wins(void **state)
{
    (void)state;
    assert_int_equal(load_text("[fovea]\ninner_deg = 7 deg ; a comment\np_min=0.25\n[display]\nheadset=small\n", "fovea.p_min=0.5"), 0);
    assert_true(config.fovea_inner_deg == 7);
    assert_true(config.fovea_p_min == 0.5);
    assert_true(config.display_width < 400); /* the preset of the headset */
    assert_int_equal(load_text("[display]\nheadset=small\nwidth=99\n", NULL), 0);
    assert_int_equal(config.display_width, 99); /* files over presets */
}

static void lists_go_on_over_lines(void **state)
{
    (void)state;
    assert_int_equal(load_text("[scene]\npoint_lights = 1 2 3 4 5 6,\n  7 8 9 10 11 12\n  13 14\n  15 16 17 18,\n  0 0 0 0 0 0\n", NULL), 0);
    assert_int_equal(config.scene_point_lights.count, 24);
    assert_true(config.scene_point_lights.value[12] == 13);
    assert_int_equal(load_text("[scene]\npoint_lights =\n", NULL), 0);
    assert_int_equal(config.scene_point_lights.count, 0);
}

/* Settings of the method selective at the ends of what is possible. */
static void limits_of_lists(void **state)
{
    (void)state;
    assert_int_equal(load_text("[selective]\nfoveal_deg = 0\npara_deg = 0\nperi_deg = 180\nnear_deg = 180\nouter_deg = 180\n"
                               "shape = 0 0 0 1e6\nsamples = 1 64\n  64 1\nalpha = 0 1 0 1 0 1\n", NULL), 0);
    assert_int_equal(config.selective_samples.count, 4);
    assert_true(config.selective_samples.value[2] == 64);
    assert_true(config.selective_alpha.value[5] == 1);
}

/* Every key prints as text that reads back to the same value. */
static void text_reads_back(void **state)
{
    (void)state;
    static char text[FV_LIST_MAX * 32], again[FV_LIST_MAX * 32], set[FV_LIST_MAX * 32 + 64];
    assert_int_equal(load_text("[display]\nfov_in_deg = 43.123456789012345\n[scene]\nsky = 0.1 0.2 0.3\n", NULL), 0);
    static struct fv_config first;
    first = config;
    for (int i = 0; i < fv_keys_count; i++) {
        const struct fv_key *k = &fv_keys[i];
        fv_config_text(&first, k, text, sizeof text);
        snprintf(set, sizeof set, "%s.%s=%s", k->section, k->name, text);
        assert_int_equal(load_text("", set), 0);
        fv_config_text(&config, k, again, sizeof again);
        assert_string_equal(text, again);
        if (k->kind == FV_KEY_REAL)
            assert_memory_equal((char *)&first + k->offset, (char *)&config + k->offset, sizeof(double));
    }
}

static const struct {
    const char *ini, *set, *message;
} bad[] = {
    {"[fovea]\np_min = 1.5\n", NULL, "test.ini:2: fovea.p_min = 1.5 is out of range: from 0 to 1"},
    {"[fovea]\n\np_min = nan\n", NULL, "test.ini:3: fovea.p_min = nan is out of range"},
    {"[fovea]\np_min = inf\n", NULL, "out of range"},
    {"[fovea]\np_min = abc\n", NULL, "test.ini:2: fovea.p_min = 'abc': not a number"},
    {"[fovea]\np_min =\n", NULL, "not a number"},
    {"[fovea]\ninner_deg = 5 px\n", NULL, "test.ini:2: fovea.inner_deg = '5 px': unit 'px' is not understood, values are in deg"},
    {"[fovea]\nradius = 5\n", NULL, "test.ini:2: unknown key 'fovea.radius'"},
    {"[foveal]\nr0 = 5\n", NULL, "test.ini:2: unknown section [foveal]"},
    {"p_min = 0.1\n", NULL, "test.ini:1: 'p_min' stands before any [section]"},
    {"[fovea]\nwhat is this\n", NULL, "test.ini:2: neither [section] nor key = value"},
    {"[display]\nsink = jpeg\n", NULL, "test.ini:2: display.sink = 'jpeg': must be one of png|y4m|kms|none"},
    {"[display]\nsink =\n", NULL, "must be one of"},
    {"[display]\nwidth = 12.5\n", NULL, "test.ini:2: display.width = 12.5"},
    {"[display]\nwidth = 100.5\n", NULL, "must be a whole number"},
    {"[display]\nwidth = 1e30\n", NULL, "out of range"},
    {"[scene]\nsky = 1 2\n", NULL, "test.ini:2: scene.sky: a row of 2 numbers, needs 3 (r g b)"},
    {"[scene]\nsky = 1 2 x\n", NULL, "'x' is not a finite number"},
    {"[scene]\nsky = 1 2 nan\n", NULL, "is not a finite number"},
    {"[scene]\npath = 0 2e9 0 0 0\n", NULL,
     "test.ini:2: scene.path: 2000000000 is out of range: from -500000000 to 500000000"},
    {"[fovea]\ninner_deg = 20\nouter_deg = 10\n", NULL, "test.ini:3: fovea.outer_deg: 10 is less than fovea.inner_deg = 20"},
    {"[display]\nheadset = vision\n", NULL, "test.ini:2: display.headset: 'vision' is not known; there are:"},
    {"[scene]\nname = paris\n", NULL, "test.ini:2: scene.name: 'paris' is not known; there are:"},
    {"[fovea]\np_min = 0.1\np_min = 0.2\n", NULL, "test.ini:3: fovea.p_min is set twice"},
    {"[scene]\nfile = hall\n  .glb\n", NULL, "test.ini:3: scene.file is set twice"},
    {"[scene]\nsky = 1 2\nexposure = 1\n", NULL, "scene.sky: a row of 2 numbers, needs 3"},
    {"[scene]\npoint_lights = 1 2 3 4, 5 6\n", NULL, "scene.point_lights: a row of 4 numbers, needs 6"},
    {"[threads]\npin = off|on\n", NULL, "must be one of off|on"},
    {"[radio]\nline = 1\n", NULL, "test.ini:2: unknown section [radio]"},
    {"[method]\nsupport = 5\n", NULL, "test.ini:2: method.support: 5: must be 4, 8 or 16"},
    {"[method]\ncluster = 3\n", NULL, "test.ini:2: method.cluster: 3: must be 1, 2 or 4"},
    {"[selective]\npara_deg = 3\n", NULL, "test.ini:2: selective.para_deg: 3 is less than selective.foveal_deg = 3.3"},
    {"[selective]\nperi_deg = 5\n", NULL, "selective.peri_deg: 5 is less than selective.para_deg = 5.5"},
    {"[selective]\nnear_deg = 12\n", NULL, "selective.near_deg: 12 is less than selective.peri_deg = 12.1"},
    {"[selective]\nnear_deg = 50\n", NULL, "selective.outer_deg: 45 is less than selective.near_deg = 50"},
    {"[selective]\nfoveal_deg = nan\n", NULL, "out of range"},
    {"[selective]\nshape = 1 2 12\n", NULL, "test.ini:2: selective.shape: a row of 3 numbers, needs 4 (tau_0 tau_f tau'_f tau_np)"},
    {"[selective]\nshape = 1 2 3 4, 1 2 3 4\n", NULL, "selective.shape: 2 rows, must be one of 4 numbers (tau_0 tau_f tau'_f tau_np)"},
    {"[selective]\nshape =\n", NULL, "test.ini:2: selective.shape: 0 rows, must be one of 4 numbers"},
    {"", "selective.shape=1 2 -0.5 12", "--set: selective.shape: -0.5: must be numbers from 0 to 1e+06"},
    {"", "selective.samples=9 4 2.5 1", "--set: selective.samples: 2.5: must be whole numbers from 1 to 64"},
    {"", "selective.samples=9 4 2 0", "selective.samples: 0: must be whole numbers from 1 to 64"},
    {"", "selective.samples=65 4 2 1", "selective.samples: 65: must be whole numbers from 1 to 64"},
    {"", "selective.alpha=1 1 1 1 0 -0.1", "selective.alpha: -0.1: must be numbers from 0 to 1"},
    {"", "selective.alpha=1 1 1 1", "selective.alpha: a row of 4 numbers, needs 6"},
    {"", "fovea.p_min", "--set: 'fovea.p_min': must be section.key=value"},
    {"", "p_min=0.1", "--set: unknown key 'p_min'"},
    {"", "fovea.nothing=1", "--set: unknown key 'fovea.nothing'"},
    {"", "fovea.p_min=-0.1", "--set: fovea.p_min = -0.1 is out of range"},
    {"", "threads.workers=65", "out of range"},
};

static void bad_input_says_where(void **state)
{
    (void)state;
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        if (load_text(bad[i].ini, bad[i].set) == 0) fail_msg("accepted: %s%s", bad[i].ini, bad[i].set ? bad[i].set : "");
        if (!strstr(error.text, bad[i].message)) fail_msg("'%s' does not hold '%s'", error.text, bad[i].message);
        if (strchr(error.text, '\n')) fail_msg("more than one line: %s", error.text);
    }
}

static void odd_files(void **state)
{
    (void)state;
    static char longest[400];
    memset(longest, '1', sizeof longest - 1);
    memcpy(longest, "[scene]\nsky =", 13);
    assert_int_equal(load_text(longest, NULL), -1);
    assert_non_null(strstr(error.text, "test.ini:2: line of"));
    program_write("zero.ini", "[fovea]\0p", 9);
    char path[128];
    snprintf(path, sizeof path, "%s/zero.ini", program_folder());
    struct fv_config_request r = {.files = 1, .file = {path}};
    assert_int_equal(fv_config_load(&config, &r, &error), -1);
    assert_non_null(strstr(error.text, "not a text file"));
    r.file[0] = "/no/such.ini";
    assert_int_equal(fv_config_load(&config, &r, &error), -1);
    assert_non_null(strstr(error.text, "/no/such.ini: No such file"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(later_wins),           cmocka_unit_test(lists_go_on_over_lines),
        cmocka_unit_test(text_reads_back),      cmocka_unit_test(bad_input_says_where),
        cmocka_unit_test(odd_files),
        cmocka_unit_test(limits_of_lists),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
