/* plan: what `foveola plan` keeps and leaves out, by scene, method and settings, and that the report of a
 * run says the same. */
#include "platform/files.h"
#include "tests/support/program.h"

static const char matt_obj[] = "mtllib test.mtl\nv 0 0 -2\nv 1 0 -2\nv 0 1 -2\nv 1 1 -2\n"
                               "usemtl matt\nf 1 2 3\nusemtl MATERIAL\nf 2 4 3\n";
static const char materials[] = "newmtl matt\nKd 0.5 0.5 0.5\nillum 1\n\n"
                                "newmtl mirror\nKd 0 0 0\nKs 0.9 0.9 0.9\nNs 1000\nillum 3\n";

#define LIBRARY FV_SOURCE_DIR "/../shared/data/scenes"
#define SCENES "--set scene.library=" LIBRARY " "
#define POINT "--set 'scene.point_lights=0 1 0 1 1 1' "
#define FILE_SCENE "--set scene.name=none " POINT "--set scene.file="

static const struct {
    const char *arguments, *file;        /* file: that must be there, or NULL */
    const char *kept[16], *left_out[16]; /* starts of rows */
} plans[] = {
    {"--set scene.name=cornell --set method.name=reproject",
     NULL,
     {"pass     select", "buffer   history colour", "feature  reflection", "feature  refraction",
      "feature  area lights", "feature  second eye", "memory   blue-noise mask", "kernel   tracing, all",
      "device   eye"},
     {"pass     sample_all", "feature  textures", "feature  alpha test", "feature  normal maps",
      "feature  sun", "kernel   tracing, plain", "feature  overlay", "feature  light kept apart"}},
    {"--set scene.name=columns --set method.name=full",
     NULL,
     {"feature  fields", "feature  point lights", "feature  Phong lobe", "memory   scene fields", "kernel   tracing, fields"},
     {"feature  meshes beside fields", "feature  sun", "feature  moving objects", "feature  carried levels", "kernel   tracing, plain", "kernel   tracing, everything"}},
    {"--set scene.name=temple --set method.refresh=4 --set method.contrast=1",
     NULL,
     {"feature  carried levels", "buffer   history starts", "buffer   coarse history colour", "buffer   coarsest history colour"},
     {"buffer   history colour", "buffer   history cache"}},
    {"--set scene.name=temple --set method.refresh=4",
     NULL,
     {"feature  carried levels", "buffer   history colour", "feature  repainted checks"},
     {"buffer   history cache"}},
    {"--set scene.name=none --set scene.fields=builtin:columns --set method.name=pyramid --set method.refresh=4 --set "
     "method.contrast=1",
     NULL,
     {"feature  carried levels"},
     {"buffer   history colour", "feature  repainted checks"}},
    {"--set scene.name=primitives",
     NULL,
     {"feature  repainted checks", "buffer   coarse seen checks", "buffer   coarsest seen checks"},
     {"feature  carried levels"}},
    {"--set scene.name=primitives --set method.contrast=1", NULL, {"pass     sharpen"}, {"feature  repainted checks", "buffer   coarse seen checks"}},
    {"--set scene.name=temple --set budget.adapt=on --set method.contrast=1", NULL, {"feature  carried levels", "buffer   history starts"}, {"buffer   history colour"}},
    {"--set scene.name=temple", NULL, {"buffer   starts"}, {"feature  carried levels", "buffer   history starts", "buffer   coarse history colour"}},
    {"--set scene.name=temple --set method.refresh=4 --set method.carry=off", NULL, {"buffer   starts"}, {"feature  carried levels", "buffer   history starts"}},
    {"--set scene.name=temple --set method.refresh=4 --set method.foveation=off", NULL, {"buffer   starts"}, {"feature  carried levels"}},
    {"--set scene.name=cornell --set scene.fields=builtin:primitives --set method.name=pyramid --set method.refresh=4",
     NULL,
     {"buffer   starts"},
     {"feature  carried levels", "buffer   history starts"}},
    {"--set scene.name=cornell --set scene.fields=builtin:primitives",
     NULL,
     {"feature  fields", "feature  meshes beside fields", "feature  area lights", "memory   scene fields", "kernel   tracing, everything"},
     {"feature  sun", "kernel   tracing, fields", "kernel   tracing, all"}},
    {"--set scene.name=cornell",
     NULL,
     {"memory   geometry"},
     {"feature  fields", "feature  meshes beside fields", "memory   scene fields", "kernel   tracing, fields"}},
    {"--set scene.name=cornell --set method.light=apart", NULL, {"feature  light kept apart"}, {"feature  sun"}},
    {"--set scene.name=cornell --set method.light=apart --set method.name=full", NULL, {NULL}, {"feature  light kept apart"}},
    {FILE_SCENE "matt.obj --set method.light=apart", NULL, {NULL}, {"feature  light kept apart"}},
    {"--set scene.name=cornell --set method.ao_spp=16",
     NULL,
     {"feature  ambient occlusion", "memory   blue-noise mask", "kernel   tracing, all"},
     {"feature  sun"}},
    {"--set scene.name=cornell --set method.ao_spp=16 --set 'scene.ambient=0 0 0'",
     NULL,
     {"feature  area lights"},
     {"feature  ambient occlusion"}},
    {"--set scene.name=cornell --set method.name=full --set display.eyes=1",
     NULL,
     {"pass     sample_all", "memory   blue-noise mask", "device   eye", "memory   tape"},
     {"pass     select", "pass     support", "buffer   cache", "buffer   history cache",
      "buffer   support colour", "buffer   selected blocks", "feature  second eye"}},
    {"--set scene.name=atrium --set method.name=full --set output.tape=off --set display.sink=none",
     NULL,
     {"feature  textures", "feature  alpha test", "memory   blue-noise mask", "kernel   tracing, all"},
     {"pass     present", "buffer   picture", "device   eye", "device   display", "memory   tape",
      "memory   png encoder"}},
    {"--set scene.name=cornell --set method.name=full --set output.tape=off --set output.overlay=on",
     NULL,
     {"device   eye", "feature  overlay", "buffer   picture"},
     {"memory   tape"}},
    {"--set scene.name=cornell --set eye.source=none --set imu.source=none",
     NULL,
     {"pass     select"},
     {"device   eye", "device   imu"}},
    {FILE_SCENE "matt.obj --set method.name=full",
     NULL,
     {"feature  point lights", "kernel   tracing, plain", "memory   geometry",
      "memory   acceleration structure"},
     {"feature  textures", "feature  Phong lobe", "feature  reflection", "feature  area lights",
      "feature  ambient occlusion", "memory   blue-noise mask", "kernel   tracing, textured", "kernel   tracing, mirrored",
      "kernel   tracing, all"}},
    {FILE_SCENE "mirror.obj --set method.name=full",
     NULL,
     {"feature  reflection", "feature  point lights", "kernel   tracing, mirrored"},
     {"feature  textures", "feature  refraction", "feature  area lights", "kernel   tracing, plain",
      "kernel   tracing, textured", "kernel   tracing, all"}},
    {SCENES FILE_SCENE "cornell/CornellBox-Mirror.obj",
     LIBRARY "/cornell/CornellBox-Mirror.obj",
     {"feature  reflection", "buffer   history cache", "kernel   tracing, mirrored"},
     {"feature  textures", "feature  normal maps", "feature  alpha test", "feature  refraction",
      "kernel   tracing, textured"}},
    {SCENES "--set scene.name=sponza",
     LIBRARY "/sponza/sponza.gltf",
     {"feature  textures", "feature  normal maps", "feature  alpha test", "feature  Phong lobe",
      "feature  point lights", "kernel   tracing, textured"},
     {"feature  reflection", "feature  refraction", "feature  emission", "feature  area lights",
      "kernel   tracing, all"}},
    {"--set scene.name=cornell --set method.name=selective --set selective.periphery=every --set selective.smooth=0",
     NULL,
     {"pass     gather", "pass     refine", "feature  secondary attributes", "buffer   second identity", "buffer   second facing", "buffer   base colour",
      "buffer   identity", "buffer   facing", "feature  samples without rays", "buffer   triangle", "buffer   lit"},
     {"pass     select", "pass     support", "pass     reproject", "pass     sample", "pass     sample_all", "buffer   history colour",
      "buffer   support colour", "buffer   selected blocks", "feature  light maps"}},
    {"--set scene.name=cornell --set method.name=selective --set selective.periphery=every --set selective.reuse=1",
     NULL,
     {"pass     reuse", "pass     smooth", "feature  earlier frames", "buffer   history colour", "buffer   history identity",
      "buffer   earlier colour"},
     {"pass     reproject"}},
    {"--set scene.name=cornell --set method.name=selective --set selective.periphery=sparse --set method.light=apart",
     NULL,
     {"pass     select", "pass     support", "pass     reproject", "pass     sample", "pass     refine", "buffer   history colour", "buffer   base colour"},
     {"pass     gather", "feature  light kept apart"}},
    {"--set scene.name=cornell --set method.name=selective-uniform --set selective.periphery=every --set selective.texture=trace",
     NULL,
     {"pass     gather", "pass     refine", "buffer   identity"},
     {"pass     sample", "feature  samples without rays", "buffer   triangle", "buffer   lit"}},
    {"--set scene.name=cornell --set method.name=denoise",
     NULL,
     {"pass     distribute", "pass     paths", "pass     across_4", "pass     down_1", "pass     light_up", "buffer   layer", "buffer   light",
      "buffer   filtered light", "buffer   albedo", "buffer   depth", "buffer   facing", "memory   blue-noise mask", "device   eye"},
     {"pass     fill", "pass     settle", "pass     across_16", "pass     sample_all", "buffer   cache", "buffer   history colour", "buffer   identity"}},
    {"--set scene.name=cornell --set method.name=denoise --set denoise.history=8",
     NULL,
     {"pass     accumulate", "buffer   accumulated light", "buffer   track", "buffer   history accumulated light", "buffer   history track",
      "buffer   history facing", "buffer   variance", "buffer   filtered variance"},
     {"buffer   history colour", "buffer   history cache", "buffer   history identity", "pass     fill"}},
    {"--set scene.name=cornell --set method.name=denoise --set denoise.history=8 --set denoise.rate=2 --set denoise.deviations=0",
     NULL,
     {"pass     accumulate", "pass     fill", "pass     settle"},
     {"feature  variance of light", "buffer   variance", "buffer   filtered variance"}},
    {"--set scene.name=cornell --set method.name=denoise --set denoise.history=0",
     NULL,
     {"pass     paths", "buffer   light", "buffer   facing"},
     {"pass     accumulate", "buffer   accumulated light", "buffer   track", "buffer   history accumulated light", "buffer   history track",
      "buffer   history facing"}},
    {"--set scene.name=cornell --set method.name=denoise --set denoise.p=0.5 --set 'denoise.iterations=0 0 5'",
     NULL,
     {"pass     fill", "pass     settle", "pass     across_16", "feature  variance of light", "buffer   variance", "buffer   filtered variance"},
     {"pass     select"}},
    {"--set scene.name=cornell --set method.name=denoise --set denoise.deviations=0",
     NULL,
     {"buffer   filtered light"},
     {"feature  variance of light", "buffer   variance", "buffer   filtered variance"}},
    {FILE_SCENE "matt.obj --set method.name=selective",
     NULL,
     {"pass     refine", "buffer   identity", "feature  samples without rays", "buffer   triangle", "feature  light maps"},
     {"feature  secondary attributes", "buffer   second identity", "buffer   second facing"}},
    {FILE_SCENE "mirror.obj --set method.name=selective --set selective.map=0",
     NULL,
     {"feature  secondary attributes", "buffer   second identity", "buffer   second facing"},
     {"feature  light maps"}},
    {"--set scene.name=temple --set method.name=selective",
     NULL,
     {"pass     refine", "buffer   identity", "buffer   facing"},
     {"feature  samples without rays", "buffer   triangle", "buffer   lit", "feature  light maps"}},
    {FILE_SCENE "mirror.obj --set method.name=reproject",
     NULL,
     {"feature  reflection"},
     {"pass     gather", "pass     refine", "feature  secondary attributes", "feature  samples without rays", "feature  light maps", "buffer   base colour",
      "buffer   identity", "buffer   facing", "buffer   second identity", "buffer   triangle", "buffer   lit"}},
    {"--set scene.name=cornell --set display.width=32 --set display.height=32 --set threads.workers=7",
     NULL,
     {"thread   workers"},
     {"thread   further workers"}},
    {"--set scene.name=cornell --set display.headset=rift-dk2-lens",
     NULL,
     {"feature  lens", "pass     fringe", "buffer   green's picture"},
     {"feature  unseen pixels"}},
    {"--set scene.name=cornell --set display.headset=rift-dk2-lens --set display.sink=none --set display.eyes=1",
     NULL,
     {"feature  lens"},
     {"feature  unseen pixels", "pass     fringe", "buffer   green's picture"}},
    {"--set scene.name=primitives --set method.name=pyramid",
     NULL,
     {"feature  repainted checks"},
     {"feature  lens", "pass     fringe", "buffer   green's picture"}},
    {"--set scene.name=primitives --set method.name=pyramid --set display.headset=rift-dk1",
     NULL,
     {"feature  lens", "pass     fringe"},
     {"feature  repainted checks"}},
};

static void write_scenes(void)
{
    static const char *const names[] = {"matt", "mirror"};
    for (int i = 0; i < 2; i++) {
        char text[512], file[64];
        const char *at = strstr(matt_obj, "MATERIAL");
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - matt_obj), matt_obj, names[i],
                 at + strlen("MATERIAL"));
        snprintf(file, sizeof file, "%s.obj", names[i]);
        program_write(file, text, strlen(text));
    }
    program_write("test.mtl", materials, strlen(materials));
}

/* Exactly one row starts so, and it stands in the half that is asked for. */
static void expect_row(const char *output, const char *row, bool kept, const char *arguments)
{
    char line[128];
    snprintf(line, sizeof line, "\n%s ", row);
    const char *half = strstr(output, "\nleft out"), *found = strstr(output, line);
    assert_non_null(half);
    if (!found) fail_msg("%s: no row '%s' in:\n%s", arguments, row, output);
    if (strstr(found + 1, line)) fail_msg("%s: two rows '%s' in:\n%s", arguments, row, output);
    if ((found < half) != kept)
        fail_msg("%s: '%s' should be %s:\n%s", arguments, row, kept ? "kept" : "left out", output);
}

static void plans_name_what_is_kept_and_left_out(void **state)
{
    (void)state;
    write_scenes();
    for (unsigned i = 0; i < sizeof plans / sizeof plans[0]; i++) {
        const char *arguments = plans[i].arguments;
        if (plans[i].file && !fv_file_exists(plans[i].file)) {
            print_message("%s: not there, skipped\n", plans[i].file);
            continue;
        }
        struct program_result r = program("plan --set display.headset=small %s", arguments);
        if (r.code) fail_msg("%s: exit %d: %s", arguments, r.code, r.errors);
        for (int k = 0; plans[i].kept[k]; k++) expect_row(r.output, plans[i].kept[k], true, arguments);
        for (int k = 0; plans[i].left_out[k]; k++)
            expect_row(r.output, plans[i].left_out[k], false, arguments);
    }
}

/* Bytes in the row of the plan, or under the name in the table of memory behind it. */
static long long bytes_in(const char *output, const char *start)
{
    char line[128];
    snprintf(line, sizeof line, "\n%s ", start);
    const char *found = strstr(output, line);
    if (!found) fail_msg("no line '%s' in:\n%s", start, output);
    return strtoll(found + strlen(line), NULL, 10);
}

/* What the plan says of memory is what the arena gave, but for alignment. */
static void bytes_are_those_taken(void **state)
{
    (void)state;
    static const struct {
        const char *row, *taken;
    } pairs[] = {{"buffer   colour", "  colour"},
                 {"buffer   cache", "  cache"},
                 {"buffer   coarse cache", "  coarse cache"},
                 {"buffer   picture", "  picture"},
                 {"buffer   support colour", "  support colour"},
                 {"thread   workers", "  worker scratch"},
                 {"memory   frame records", "  frame records"},
                 {"memory   trace", "  trace"},
                 {"memory   png encoder", "  png"}};
    struct program_result r =
        program("plan --set scene.name=cornell --set display.headset=small --frames 50");
    for (unsigned i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        long long said = bytes_in(r.output, pairs[i].row), taken = bytes_in(r.output, pairs[i].taken);
        if (said <= 0 || llabs(said - taken) > 4096)
            fail_msg("%s: %lld bytes, taken %lld", pairs[i].row, said, taken);
    }
}

/* The same rows in report.json; and pictures do not depend on whether the gaze's source was opened. */
static void the_report_has_the_plan(void **state)
{
    (void)state;
    static char text[1 << 17];
    char path[256];
    struct program_result r =
        program("run --set scene.name=cornell --set display.headset=small --set method.name=full "
                "--set output.tape=off --frames 2 --out run --set threads.sealed_heap=fatal");
    if (r.code) fail_msg("exit %d: %s", r.code, r.errors);
    snprintf(path, sizeof path, "%s/run/report.json", program_folder());
    program_slurp(path, text, sizeof text);
    static const char *const words[] = {"sample_all",
                                        "blue-noise mask",
                                        "tracing, textured",
                                        "the method needs no gaze",
                                        "acceleration structure",
                                        "one a core"};
    for (unsigned i = 0; i < sizeof words / sizeof words[0]; i++)
        if (!strstr(text, words[i])) fail_msg("report.json lacks '%s'", words[i]);
    r = program("run --set scene.name=cornell --set display.headset=small --set method.name=full --frames 2 "
                "--out taped");
    assert_int_equal(r.code, 0);
    snprintf(path, sizeof path, "cmp %s/run/left-00001.png %s/taped/left-00001.png", program_folder(),
             program_folder());
    assert_int_equal(system(path), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(plans_name_what_is_kept_and_left_out),
                                       cmocka_unit_test(bytes_are_those_taken),
                                       cmocka_unit_test(the_report_has_the_plan)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
