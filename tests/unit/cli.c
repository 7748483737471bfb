/* cli: the program as its users meet it: what a run leaves, every bad input, the sealed heap. */
#include "tests/support/picture.h"

#define SMALL "--set scene.name=cornell --set display.headset=small --set threads.workers=2 "

static bool there(const char *name)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", program_folder(), name);
    return fv_file_exists(path);
}

static void a_run_leaves_all_its_files(void **state)
{
    (void)state;
    static const char *const files[] = {"report.json",        "report.html",       "trace.json",
                                        "frames.csv",         "tape/head.csv",     "tape/gaze.csv",
                                        "tape/decisions.csv", "tape/settings.ini", "left-00000.png",
                                        "right-00000.png",    "left-00003.png",    "right-00003.png"};
    char name[128], json[256];
    struct program_result r = program("run %s --frames 4 --out a/b --set threads.sealed_heap=fatal", SMALL);
    if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
    for (unsigned i = 0; i < sizeof files / sizeof files[0]; i++) {
        snprintf(name, sizeof name, "a/b/%s", files[i]);
        if (!there(name)) fail_msg("%s is missing", name);
    }
    assert_non_null(strstr(r.errors, "4 frames of cornell with reproject"));
    assert_string_equal(r.output, "");
    static char text[65536];
    snprintf(json, sizeof json, "%s/a/b/report.json", program_folder());
    program_slurp(json, text, sizeof text);
    assert_non_null(strstr(text, "\"heap_calls\""));
}

static void y4m_goes_to_standard_output(void **state)
{
    (void)state;
    struct program_result r = program("run %s --frames 2 --set display.sink=y4m --set output.every=1 --out y", SMALL);
    assert_int_equal(r.code, 0);
    assert_memory_equal(r.output, "YUV4MPEG2 W", 11);
    /* The reader goes away: the pictures end, the run and its report do not. */
    char command[512];
    snprintf(command, sizeof command, "cd %s && (%s run %s --frames 40 --set display.sink=y4m --out closed 2>err; echo $? >code) | head -c 200000 >part",
             program_folder(), FV_PROGRAM, SMALL);
    assert_int_equal(system(command), 0);
    for (int i = 0; i < 100 && !there("code"); i++) usleep(100000);
    assert_true(there("closed/report.json"));
}

/* The settings that make each run fail, and what the one line must hold. Nothing may be written. */
static const struct {
    const char *arguments, *message;
} bad[] = {
    {"walk", "'walk' is no verb"},
    {"run --frames 0", "--frames 0"},
    {"run --frames", "a value must follow"},
    {"run --speed 3", "no such option"},
    {"run elsewhere", "not expected here"},
    {"run --config /no/such.ini", "/no/such.ini: No such file"},
    {"run --set fovea.p_min=2", "out of range"},
    {"run --set method.name=magic", "--set: method.name: 'magic' is not known; there are: full reproject"},
    {"run --set scene.name=atlantis", "'atlantis' is not known"},
    {"run --set scene.name=none --set scene.file=missing.gltf", "missing.gltf"},
    {"run --set scene.name=none --set scene.file=cut.glb", "cut.glb"},
    {"run --set scene.name=none --set scene.file=range.obj", "range.obj"},
    {"run --set scene.name=none --set scene.file=nan.obj", "nan.obj"},
    {"run --set scene.name=none --set scene.file=empty.obj", "no triangles"},
    {"run --set scene.name=none --set scene.file=picture.png", "picture.png"},
    {"run --set budget.memory_mb=2 --set scene.name=cornell", "set budget.memory_mb="},
    {"run --set display.width=8192 --set display.height=8192 --set scene.name=cornell --set budget.memory_mb=200", "asked for"},
    {"run --set eye.source=tape --set scene.name=cornell", "eye.tape"},
    {"run --set imu.source=tape --set imu.tape=missing.csv --set scene.name=cornell", "missing.csv"},
    {"run --set scene.name=cornell --out /proc/foveola", "/proc/foveola"},
    {"run --set scene.name=cornell --out picture.png", "not a folder"},
    {"replay", "name the folder"},
    {"replay nowhere", "nowhere/tape/frames"},
    {"plan --set fovea.inner_deg=x", "not a number"},
    {"help nonsense", "'nonsense' is no verb, section or key"},
};

static void bad_input_ends_with_2_and_one_line(void **state)
{
    (void)state;
    program_write("cut.glb", "glTF\2\0\0\0\377\0\0\0", 12);
    program_write("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", 32);
    program_write("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", 34);
    program_write("empty.obj", "# nothing\n", 10);
    program_write("picture.png", "\211PNG\r\n\032\n", 8);
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct program_result r = program("%s", bad[i].arguments);
        /* What was loaded may be told before; the error is the last line, and one. */
        char *error = strstr(r.errors, "foveola: scene cornell:"), *end;
        error = error ? strchr(error, '\n') + 1 : r.errors;
        end = strchr(error, '\n');
        if (r.code != 2) fail_msg("%s: exit %d: %s", bad[i].arguments, r.code, r.errors);
        if (!strstr(r.errors, bad[i].message)) fail_msg("%s: '%s' does not hold '%s'", bad[i].arguments, r.errors, bad[i].message);
        if (!end || end[1]) fail_msg("%s: not one line: %s", bad[i].arguments, r.errors);
        if (there("out")) fail_msg("%s: wrote into out", bad[i].arguments);
    }
}

static void odd_runs_end_as_they_should(void **state)
{
    (void)state;
    struct program_result r = program("run %s --frames 2 --set scene.path_seconds=1e-10 --out odd", SMALL);
    assert_int_equal(r.code, 0);
    r = program("replay odd --out odd");
    assert_int_equal(r.code, 2);
    assert_non_null(strstr(r.errors, "is the recording itself"));
    /* Long rows of lights come back through the recorded settings. */
    r = program("run %s --frames 2 --out rows --set 'scene.area_lights=0.123456789012345 1.123456789012345 0.123456789012345 "
                "0.323456789012345 0.023456789012345 0.023456789012345 0.023456789012345 0.023456789012345 0.323456789012345 "
                "1.123456789012345 1.123456789012345 1.123456789012345'", SMALL);
    assert_int_equal(r.code, 0);
    r = program("replay rows --out rows2");
    if (r.code) fail_msg("%s", r.errors);
    program_write("odd/tape/frames", "abc\n", 4);
    r = program("replay odd --out odd2");
    assert_int_equal(r.code, 2);
    char fifo[128];
    snprintf(fifo, sizeof fifo, "%s/fifo", program_folder());
    assert_int_equal(mkfifo(fifo, 0600), 0);
    r = program("plan --config fifo");
    assert_int_equal(r.code, 2);
}

static void plans_differ_by_scene(void **state)
{
    (void)state;
    struct program_result cornell = program("plan --set scene.name=cornell --set display.headset=small --set method.name=full");
    assert_int_equal(cornell.code, 0);
    const char *left_out = strstr(cornell.output, "left out");
    assert_non_null(left_out);
    assert_non_null(strstr(left_out, "history colour"));
    assert_non_null(strstr(left_out, "alpha test"));
    struct program_result atrium = program("plan --set scene.name=atrium --set display.headset=small");
    assert_int_equal(atrium.code, 0);
    left_out = strstr(atrium.output, "left out");
    const char *alpha = strstr(atrium.output, "alpha test");
    assert_true(alpha && alpha < left_out);
}

static void help_knows_every_key(void **state)
{
    (void)state;
    struct program_result all = program("help");
    assert_int_equal(all.code, 0);
    for (int i = 0; i < fv_keys_count; i++) {
        struct program_result r = program("help %s.%s", fv_keys[i].section, fv_keys[i].name);
        assert_int_equal(r.code, 0);
        assert_non_null(strstr(r.output, fv_keys[i].help));
        assert_non_null(strstr(all.output, fv_keys[i].section));
    }
}

/* The kernel's own word on it: no memory call between the first picture and the end. */
static void no_memory_call_after_the_seal(void **state)
{
    (void)state;
    char command[1024], path[128];
    static char calls[1 << 20];
#ifndef FV_HEAP
    skip(); /* the sanitizers bring a heap of their own */
#endif
    snprintf(command, sizeof command,
             "cd %s && strace -f -e trace=%%memory,openat -o calls %s run %s --frames 6 --out traced 2>/dev/null",
             program_folder(), FV_PROGRAM, SMALL);
    if (system("strace -o /dev/null true 2>/dev/null") != 0) {
        print_message("strace cannot trace here: skipped\n");
        skip();
    }
    assert_int_equal(system(command), 0);
    snprintf(path, sizeof path, "%s/calls", program_folder());
    program_slurp(path, calls, sizeof calls);
    char *after = strstr(calls, "left-00000.png");
    assert_non_null(after);
    assert_non_null(strstr(after, "left-00005.png"));
    static const char *const memory[] = {"mmap", "munmap", "brk", "madvise", "mprotect", "mremap", "mlock"};
    for (unsigned i = 0; i < sizeof memory / sizeof memory[0]; i++)
        if (strstr(after, memory[i])) fail_msg("%s after the seal", memory[i]);
}

/* README's table of settings is the program's. */
static void readme_lists_every_setting(void **state)
{
    (void)state;
    static char readme[1 << 20];
    char row[1024];
    program_slurp(FV_SOURCE_DIR "/README.md", readme, sizeof readme);
    for (int i = 0; i < fv_keys_count; i++) {
        const struct fv_key *k = &fv_keys[i];
        snprintf(row, sizeof row, "| `%s.%s` | %s%s%s |", k->section, k->name, k->initial[0] ? "`" : "", k->initial,
                 k->initial[0] ? "`" : "");
        if (!strstr(readme, row)) fail_msg("README.md lacks the row: %s", row);
        if (!strstr(readme, k->help)) fail_msg("README.md lacks: %s", k->help);
    }
}

/* A disk that fills up while a run writes: an error value, not a crash; the run ends by itself. */
static void full_disk_ends_pictures_not_the_run(void **state)
{
    (void)state;
    char command[512];
    snprintf(command, sizeof command,
             "cd %s && (ulimit -f 64; trap '' XFSZ; %s run %s --frames 6 --out disk 2>disk.txt; echo $? >disk.code)",
             program_folder(), FV_PROGRAM, "--set scene.name=cornell --set display.headset=small --set display.width=512 --set display.height=512");
    assert_int_equal(system(command), 0);
    char code[16], path[128];
    snprintf(path, sizeof path, "%s/disk.code", program_folder());
    program_slurp(path, code, sizeof code);
    assert_int_equal(atoi(code), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_input_ends_with_2_and_one_line),  cmocka_unit_test(a_run_leaves_all_its_files),
        cmocka_unit_test(y4m_goes_to_standard_output), cmocka_unit_test(plans_differ_by_scene),
        cmocka_unit_test(help_knows_every_key), cmocka_unit_test(odd_runs_end_as_they_should),        cmocka_unit_test(full_disk_ends_pictures_not_the_run),
        cmocka_unit_test(no_memory_call_after_the_seal), cmocka_unit_test(readme_lists_every_setting),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
