/* peers: the same picture by others, in one run: Sibenik without its textures, one eye of 1182 x 1464,
 * primary rays only, two threads, at three places of the scene's path. Embree's own viewer (package
 * embree-tools), POV-Ray (povray) and Blender's Cycles (blender), interleaved with `full`; and `full` once
 * more with the textures, which the viewer does not read. A peer that is not there is left out with a
 * notice. `full` must reach 2.5 times the viewer's frame rate.
 *
 * Each one's fastest frame of a run counts, which others on the machine disturb least. The cameras were
 * compared once by laying the pictures' edges over each other. */
#include "platform/pose.h"
#include "rt/measure/rank.h"
#include "rt/scene/scene.h"
#include "tests/support/program.h"

#include <math.h>

enum { WIDTH = 1182, HEIGHT = 1464, ROUNDS = 3, OUTPUT = 1 << 20 };
#define HALF_DEG 53.0
static const double limit = 2.5, aim = 4;
static const char library[] = FV_SOURCE_DIR "/../shared/data/scenes";

/* x, y, z (m), yaw, pitch (degrees): way points of scene.path. */
static const double places[][5] = {{-17, -13.65, 0, -90, 0}, {-4, -13.65, -0.6, -98, 8}, {3.6, -12.95, 0, -90, 10}};
enum { PLACES = sizeof places / sizeof places[0] };

struct camera {
    const double *place;
    double right[3], up[3], ahead[3];
    double tan_side, tan_up;
};

static struct camera camera_at(const double place[5])
{
    static const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, -1};
    struct camera c = {.place = place, .tan_up = tan(HALF_DEG * M_PI / 180)};
    double q[4];
    fv_quat_from_yaw_pitch_roll(place[3] * M_PI / 180, place[4] * M_PI / 180, 0, q);
    fv_quat_rotate(q, x, c.right);
    fv_quat_rotate(q, y, c.up);
    fv_quat_rotate(q, z, c.ahead);
    c.tan_side = c.tan_up * WIDTH / HEIGHT;
    return c;
}

/* What a command prints, both streams; "" where it fails. */
static const char *output_of(const char *format, ...) __attribute__((format(printf, 1, 2)));
static const char *output_of(const char *format, ...)
{
    static char output[OUTPUT];
    char command[4096];
    va_list list;
    int length = snprintf(command, sizeof command, "cd %s && ", program_folder());
    va_start(list, format);
    vsnprintf(command + length, sizeof command - (size_t)length, format, list);
    va_end(list);
    FILE *pipe = popen(command, "r");
    size_t n = pipe ? fread(output, 1, sizeof output - 1, pipe) : 0;
    output[n] = 0;
    if (!pipe || pclose(pipe)) output[0] = 0;
    return output;
}

/* The number behind a word of the text; NaN where there is none. */
static double number_behind(const char *text, const char *word)
{
    const char *at = strstr(text, word);
    char *end;
    if (!at) return NAN;
    double value = strtod(at += strlen(word), &end);
    return end > at ? value : NAN;
}

/* Least of frames.csv's column frame_ms, and of no frame with another ray than primary ones. */
static double fastest_of(const char *csv)
{
    double fastest = NAN;
    for (const char *line = strchr(csv, '\n'); line && line[1]; line = strchr(line + 1, '\n')) {
        double v[12] = {0};
        char *at = (char *)(uintptr_t)line + 1;
        for (int i = 0; i < 12; i++, at += *at == ',') v[i] = strtod(at, &at);
        assert_true(v[9] == (double)WIDTH * HEIGHT || v[9] == (double)(WIDTH + 2) * HEIGHT); /* whole blocks */
        assert_true(v[10] == 0 && v[11] == 0);
        fastest = fmin(v[2], fastest);
    }
    return fastest;
}

/* `file`: the OBJ file. */
static double render_ms(const struct camera *c, const char *file)
{
    const double *p = c->place;
    double side_deg = atan(c->tan_side) * 180 / M_PI;
    return fastest_of(output_of(
        "%s run --set scene.name=sibenik --set scene.file=%s --set method.name=full --set scene.point_lights= "
        "--set method.depth=0 --set display.eyes=1 --set display.ipd_mm=0 --set display.width=%d --set display.height=%d "
        "--set display.fov_up_deg=%.17g --set display.fov_down_deg=%.17g --set display.fov_out_deg=%.17g "
        "--set display.fov_in_deg=%.17g --set scene.path='%g %g %g %g %g' --set scene.path_seconds=0 "
        "--set imu.source=none --set eye.source=none --set display.sink=none --set output.tape=off "
        "--set threads.workers=2 --frames 23 --out full >/dev/null 2>&1 && cat full/frames.csv",
        FV_PROGRAM, file, WIDTH, HEIGHT, HALF_DEG, HALF_DEG, side_deg, side_deg, p[0], p[1], p[2], p[3], p[4]));
}

static double full_ms(const struct camera *c)
{
    return render_ms(c, "$PWD/sibenik.obj");
}

static double textured_ms(const struct camera *c)
{
    char file[600];
    snprintf(file, sizeof file, "%s/sibenik/sibenik.obj", library);
    return render_ms(c, file);
}

static double viewer_ms(const struct camera *c)
{
    const double *p = c->place, *a = c->ahead;
    return 1000 / number_behind(output_of("viewer -i sibenik.obj --vp %.9g %.9g %.9g --vi %.9g %.9g %.9g --vu 0 1 0 "
                                          "--fov %g --size %d %d --threads 2 --benchmark 3 20 2>&1",
                                          p[0], p[1], p[2], p[0] + a[0], p[1] + a[1], p[2] + a[2], 2 * HALF_DEG, WIDTH,
                                          HEIGHT),
                                "BENCHMARK_RENDER_MAX");
}

/* Quality 1: full ambient light, no shadows. */
static double povray_ms(const struct camera *c)
{
    char text[1024];
    const double *p = c->place, *a = c->ahead, *u = c->up, *r = c->right, h = 2 * c->tan_up, w = 2 * c->tan_side;
    snprintf(text, sizeof text,
             "#version 3.7;\nglobal_settings { assumed_gamma 1 }\n"
             "camera { location <%g,%g,%g> direction <%g,%g,%g> up <%g,%g,%g> right <%g,%g,%g> }\n#include \"mesh.inc\"\n",
             p[0], p[1], p[2], a[0], a[1], a[2], u[0] * h, u[1] * h, u[2] * h, r[0] * w, r[1] * w, r[2] * w);
    program_write("place.pov", text, strlen(text));
    const char *output = output_of("povray +Iplace.pov +Opov.png +FN +W%d +H%d -A -D +Q1 +WT2 2>&1", WIDTH, HEIGHT);
    const char *at = strstr(output, "Trace Time:");
    return at ? 1000 * number_behind(at, "(") : NAN;
}

/* The second picture of two, with the scene kept from the first. Blender's z is up. */
static double cycles_ms(const struct camera *c)
{
    static const char script[] =
        "import bpy, sys, time, math\n"
        "path, x, y, z, yaw, pitch, fov, w, h = sys.argv[sys.argv.index('--') + 1:]\n"
        "bpy.ops.wm.read_factory_settings(use_empty=True)\n"
        "(bpy.ops.wm.obj_import if hasattr(bpy.ops.wm, 'obj_import') else bpy.ops.import_scene.obj)(filepath=path)\n"
        "scene = bpy.context.scene\n"
        "data = bpy.data.cameras.new('eye')\n"
        "eye = bpy.data.objects.new('eye', data)\n"
        "scene.collection.objects.link(eye)\n"
        "data.sensor_fit, data.angle = 'VERTICAL', math.radians(float(fov))\n"
        "eye.location = (float(x), -float(z), float(y))\n"
        "eye.rotation_euler = (math.pi / 2 + math.radians(float(pitch)), 0, math.radians(float(yaw)))\n"
        "scene.camera = eye\n"
        "r, k = scene.render, scene.cycles\n"
        "r.engine, r.resolution_x, r.resolution_y, r.resolution_percentage = 'CYCLES', int(w), int(h), 100\n"
        "r.threads_mode, r.threads, r.use_persistent_data = 'FIXED', 2, True\n"
        "k.device, k.samples, k.max_bounces, k.use_denoising, k.use_adaptive_sampling = 'CPU', 1, 0, False, False\n"
        "for i in range(2):\n"
        "    start = time.time()\n"
        "    bpy.ops.render.render()\n"
        "print('CYCLES_SECONDS', time.time() - start)\n";
    const double *p = c->place;
    program_write("cycles.py", script, sizeof script - 1);
    return 1000 * number_behind(output_of("blender -b -P cycles.py -- sibenik.obj %g %g %g %g %g %g %d %d 2>&1",
                                          p[0], p[1], p[2], p[3], p[4], 2 * HALF_DEG, WIDTH, HEIGHT),
                                "CYCLES_SECONDS");
}

/* sibenik.obj and sibenik.mtl without textures, in the test's folder. */
static void write_plain_scene(void)
{
    output_of("ln -s %s/sibenik/sibenik.obj . && sed '/^[[:space:]]*\\(map_\\|bump\\|disp\\)/d' %s/sibenik/sibenik.mtl > sibenik.mtl",
              library, library);
}

/* The same as a mesh2 with a colour a material. */
static void write_mesh(void)
{
    static struct fv_config config;
    static struct fv_scene scene;
    struct fv_error error;
    char set[600], path[256];
    snprintf(set, sizeof set, "scene.file=%s/sibenik.obj", program_folder());
    struct fv_config_request request = {.sets = 2, .set = {"scene.name=sibenik", set}};
    if (fv_config_load(&config, &request, &error) || fv_scene_load(&scene, &config, &error)) fail_msg("%s", error.text);
    snprintf(path, sizeof path, "%s/mesh.inc", program_folder());
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    fprintf(out, "mesh2 {\nvertex_vectors { %lld", (long long)scene.vertices);
    for (int64_t i = 0; i < scene.vertices; i++) {
        const float *v = scene.position + 3 * i;
        fprintf(out, ",\n<%.9g,%.9g,%.9g>", (double)v[0], (double)v[1], (double)v[2]);
    }
    fprintf(out, "}\ntexture_list { %d", scene.materials);
    for (int i = 0; i < scene.materials; i++) {
        const float *d = scene.material[i].diffuse;
        fprintf(out, ",\ntexture { pigment { rgb <%g,%g,%g> } finish { ambient 1 } }", (double)d[0], (double)d[1], (double)d[2]);
    }
    fprintf(out, "}\nface_indices { %lld", (long long)scene.triangles);
    for (int64_t i = 0; i < scene.triangles; i++) {
        const uint32_t *v = scene.index + 3 * i;
        fprintf(out, ",\n<%u,%u,%u>,%d", v[0], v[1], v[2], scene.triangle[i].material);
    }
    fprintf(out, "}\n}\n");
    assert_int_equal(fclose(out), 0);
}

enum { FULL, TEXTURED, VIEWER, POVRAY, CYCLES, PEERS };
static const struct {
    const char *name, *command, *package;
    double (*frame_ms)(const struct camera *camera);
    int rounds; /* of each place */
} peers[PEERS] = {
    [FULL] = {"full", FV_PROGRAM, "", full_ms, ROUNDS},
    [TEXTURED] = {"full with textures", FV_PROGRAM, "", textured_ms, ROUNDS},
    [VIEWER] = {"Embree viewer", "viewer", "embree-tools", viewer_ms, ROUNDS},
    [POVRAY] = {"POV-Ray", "povray", "povray", povray_ms, 1},
    [CYCLES] = {"Cycles", "blender", "blender", cycles_ms, 1},
};

static double median(double *value, int count)
{
    fv_rank_sort(value, count);
    return value[count / 2];
}

static void full_against_peers(void **state)
{
    (void)state;
    static double ms[PEERS][PLACES * ROUNDS], ratio[PEERS][PLACES * ROUNDS];
    bool there[PEERS];
    if (access(library, R_OK)) {
        print_message("Sibenik is not in %s: skipped\n", library);
        skip();
    }
    for (int k = 0; k < PEERS; k++) {
        there[k] = *output_of("command -v %s", peers[k].command) != 0;
        if (!there[k]) print_message("%s is not there (package %s): left out\n", peers[k].name, peers[k].package);
    }
    write_plain_scene();
    write_mesh();
    for (int i = 0; i < PLACES * ROUNDS; i++) {
        struct camera c = camera_at(places[i % PLACES]);
        for (int k = 0; k < PEERS; k++) {
            if (!there[k] || i >= PLACES * peers[k].rounds) continue;
            ms[k][i] = peers[k].frame_ms(&c);
            ratio[k][i] = ms[k][i] / ms[FULL][i];
            if (isnan(ms[k][i])) {
                if (k <= VIEWER) fail_msg("%s gave no time", peers[k].name);
                print_message("%s gave no time: left out\n", peers[k].name);
                there[k] = false;
            }
        }
    }
    print_message("| Sibenik, %d x %d, primary rays only, 2 threads | ms a frame | times full's | from, to |\n"
                  "| --- | --- | --- | --- |\n", WIDTH, HEIGHT);
    double times[PEERS];
    for (int k = 0; k < PEERS; k++) {
        int count = PLACES * peers[k].rounds;
        if (!there[k]) continue;
        times[k] = median(ratio[k], count);
        print_message("| %s | %.1f | %.2f | %.2f, %.2f |\n", peers[k].name, median(ms[k], count), times[k], ratio[k][0],
                      ratio[k][count - 1]);
    }
    if (!there[VIEWER]) skip();
    print_message("full is %.2f times as fast as the viewer, %.2f times with textures; must be %.1f, aim %.1f\n",
                  times[VIEWER], times[VIEWER] / times[TEXTURED], limit, aim);
    assert_true(times[VIEWER] >= limit);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(full_against_peers)};
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
