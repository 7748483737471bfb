/* optics: Fresnel and Snell, the Phong lobe, bent normals and texels against long double, from grazing to
 * normal incidence, at and beyond the critical angle, with indices from 1 up, exponents from 1 to 1e6,
 * coordinates to 1e6. Every instruction set that this machine has. */
#include "tests/numeric/probe/probe.h"

#include "rt/scene/build.h"
#include "rt/scene/texture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { ROWS = 8, MOST = 1 << 17 };

static float in[ROWS][MOST], out[ROWS][MOST];
static int rows; /* filled */

static void run(int isa, enum fv_probe probe, const struct fv_texture *texture)
{
    const float *from[ROWS];
    float *to[ROWS];
    for (int i = 0; i < ROWS; i++) from[i] = in[i], to[i] = out[i];
    memset(out, 0x7f, sizeof out);
    fv_probe_of(isa, probe)(texture, from, to, (rows + 15) & ~15);
}

static void push(const float *values, int n)
{
    assert_true(rows < MOST - 16);
    for (int i = 0; i < n; i++) in[i][rows] = values[i];
    rows++;
}

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

/* Reflectance of unpolarised light by the textbook's formulas (Born and Wolf, section 1.5.2). */
static long double reflectance(long double c, long double here, long double beyond)
{
    long double s = here / beyond * sqrtl((1 - c) * (1 + c));
    if (s >= 1) return 1;
    long double b = sqrtl((1 - s) * (1 + s));
    long double rs = (here * c - beyond * b) / (here * c + beyond * b);
    long double rp = (beyond * c - here * b) / (beyond * c + here * b);
    return 0.5L * (rs * rs + rp * rp);
}

static const float indices[] = {1,  1 + 1.1920929e-7f, 1.000001f, 1.0001f, 1.01f, 1.33f, 1.5f, 2.4f,
                                10, FV_IOR_MAX};
static const float cosines[] = {0,     1e-12f, 1e-7f, 1e-6f,   1e-5f,      1e-4f, 1e-3f,
                                0.01f, 0.03f,  0.1f,  0.3f,    0.5f,       0.6f,  0.70710678f,
                                0.8f,  0.9f,   0.99f, 0.9999f, 0.9999999f, 1};

/* Directions that come down to the plane y = 0 at each cosine, and around each critical angle. */
static void push_directions(void)
{
    rows = 0;
    for (unsigned n = 0; n < sizeof indices / sizeof *indices; n++)
        for (int outside = 0; outside < 2; outside++) {
            double critical = sqrt(1 - 1 / ((double)indices[n] * indices[n]));
            for (int i = 0; i < 60; i++) {
                int count = sizeof cosines / sizeof *cosines;
                double c = i < count ? (double)cosines[i]
                                     : critical * (1 + (i - 40) * pow(10, -1 - (i - count) % 7));
                if (!(c >= 0 && c <= 1)) continue;
                double s = sqrt((1 - c) * (1 + c));
                push((float[]){(float)(0.6 * s), (float)-c, (float)(0.8 * s), indices[n], (float)outside}, 5);
            }
        }
}

/* True when `value` lies between the references at cosines a few float steps away, give or take 2e-6
 * (more from within the densest media: b^2 is a difference of n1^2). */
static bool close_reflectance(float value, long double c, long double here, long double beyond)
{
    long double low = 1, high = 0;
    for (int i = -20; i <= 20; i++) {
        long double at = fminl(fmaxl(c + i * 0.05L * (3e-7L * c + 1e-7L), 0), 1),
                    r = reflectance(at, here, beyond);
        low = fminl(low, r);
        high = fmaxl(high, r);
    }
    long double rounding = 2e-6L + 2e-9L * here * here;
    return value >= low - rounding && value <= high + rounding;
}

/* Reflectance, and Snell's law for what goes through: the part along the surface is n1 / n2 of what came. */
static void fresnel_and_snell(void **state)
{
    (void)state;
    push_directions();
    FOR_EACH_ISA
    {
        run(isa, PROBE_REFRACT, NULL);
        for (int i = 0; i < rows; i++) {
            long double c = -(long double)in[1][i], ior = in[3][i];
            long double here = in[4][i] > 0 ? 1 : ior, beyond = in[4][i] > 0 ? ior : 1;
            float r = out[0][i], x = out[2][i], y = out[3][i], z = out[4][i];
            if (!(r >= 0 && r <= 1) || !close_reflectance(r, c, here, beyond))
                fail_msg("%s: cosine %.9Lg, index %.9Lg to %.9Lg: %.9g, not %.9Lg",
                         fv_cpu_isa_name((enum fv_isa)isa), c, here, beyond, (double)r,
                         reflectance(c, here, beyond));
            assert_true(r + (1 - r) == 1);
            if (out[1][i] == 0) {
                assert_true(r == 1); /* total */
                continue;
            }
            long double along = here / beyond * hypotl(in[0][i], in[2][i]);
            /* A cosine of incidence near 1 knows its sine^2 to 1e-7, and n1^2 magnifies that. */
            if (!(fabsl(hypotl(x, z) - fminl(along, 1)) < 2e-6L + 3e-7L * (here - 1) * here) ||
                !(fabsf(x * x + y * y + z * z - 1) < 4e-6f) || y > 1e-6f)
                fail_msg("%s: cosine %.9Lg, index %.9Lg to %.9Lg goes on to %g %g %g",
                         fv_cpu_isa_name((enum fv_isa)isa), c, here, beyond, (double)x, (double)y, (double)z);
            if (ior == 1 && c >= 1e-7L) /* as if it were not there */
                assert_true(r == 0 && fabsf(x - in[0][i]) < 2e-7f && fabsf(y - in[1][i]) < 2e-7f &&
                            fabsf(z - in[2][i]) < 2e-7f);
        }
    }
}

/* Hostile directions and indices: whatever comes in, the reflectance is a number in [0, 1]; nothing goes
 * through for a direction that is none, and what does for one of finite length is a unit direction. */
static void fresnel_of_anything(void **state)
{
    (void)state;
    static const float odd[] = {0, -0.0f, 1, -1, 1e-38f, 1e-45f, 1e20f, 3e38f, INFINITY, -INFINITY, NAN};
    const int n = sizeof odd / sizeof *odd;
    rows = 0;
    for (int y = 0; y < n; y++)
        for (int x = 0; x < n; x++)
            for (int outside = 0; outside < 2; outside++)
                for (int k = 0; k < 3; k++)
                    push((float[]){odd[x], odd[y], 0,
                                   k == 0   ? 1
                                   : k == 1 ? 1.5f
                                            : FV_IOR_MAX,
                                   (float)outside},
                         5);
    FOR_EACH_ISA
    {
        run(isa, PROBE_REFRACT, NULL);
        for (int i = 0; i < rows; i++) {
            assert_true(out[0][i] >= 0 && out[0][i] <= 1);
            bool none = isnan(in[0][i]) || isnan(in[1][i]);
            if (none) assert_true(out[1][i] == 0);
            float x = in[0][i], y = in[1][i], squared = x * x + y * y;
            float bx = out[2][i], by = out[3][i], bz = out[4][i];
            if (out[1][i] == 0 || !(squared > 1e-36f && squared < 1e36f)) continue;
            if (!(fabsf(bx * bx + by * by + bz * bz - 1) < 1e-5f))
                fail_msg("%s: %g %g, index %g, outside %g goes on to %g %g %g",
                         fv_cpu_isa_name((enum fv_isa)isa), (double)x, (double)y, (double)in[3][i],
                         (double)in[4][i], (double)bx, (double)by, (double)bz);
        }
    }
}

static void logarithm_and_power(void **state)
{
    (void)state;
    rows = 0;
    for (int i = -1260; i <= 1260; i++) push((float[]){exp2f((float)i * 0.1f)}, 1);
    for (int i = 0; i < 4000; i++) push((float[]){0.99f + (float)i * 5e-6f}, 1);
    FOR_EACH_ISA
    {
        run(isa, PROBE_LOG2, NULL);
        for (int i = 0; i < rows; i++) {
            long double exact = log2l(in[0][i]);
            if (!(fabsl(out[0][i] - exact) <= 1e-5L * fabsl(exact) + 1e-9L))
                fail_msg("log2 %.9g: %.9g, not %.9Lg", (double)in[0][i], (double)out[0][i], exact);
        }
    }
    rows = 0;
    for (int i = -12600; i <= 12600; i++) push((float[]){(float)i * 0.01f}, 1);
    push((float[]){-INFINITY}, 1);
    push((float[]){-1e30f}, 1);
    push((float[]){NAN}, 1);
    FOR_EACH_ISA
    {
        run(isa, PROBE_EXP2, NULL);
        for (int i = 0; i < rows - 3; i++) {
            long double exact = exp2l(in[0][i]);
            if (!(fabsl(out[0][i] / exact - 1) <= 2e-4L))
                fail_msg("2^%.9g: %.9g", (double)in[0][i], (double)out[0][i]);
        }
        for (int i = rows - 3; i < rows; i++) assert_true(out[0][i] >= 0 && out[0][i] < 1e-37f);
    }
}

/* Directions in the plane z = 0 at angles from the normal. */
static void push_lobe(double light, double viewer, float exponent)
{
    push((float[]){(float)sin(viewer), (float)cos(viewer), 0, (float)-sin(light), (float)cos(light), 0,
                   exponent},
         7);
}

/* (s + 2) / 2 pi cos^s a cos: as exact as the directions' rounding lets an exponent be. */
static void phong_lobe(void **state)
{
    (void)state;
    static const float exponents[] = {1, 2, 10, 100, 1000, FV_SHININESS_MAX, 1e5f, 1e6f};
    static const double off[] = {0, 1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.5, 1, 1.5, 2};
    static const double lights[] = {0, 0.3, 1.2, 1.5707, 1.5707963, -0.5};
    rows = 0;
    for (unsigned s = 0; s < sizeof exponents / sizeof *exponents; s++)
        for (unsigned l = 0; l < sizeof lights / sizeof *lights; l++)
            for (unsigned o = 0; o < sizeof off / sizeof *off; o++)
                push_lobe(lights[l], lights[l] - off[o], exponents[s]);
    FOR_EACH_ISA
    {
        run(isa, PROBE_PHONG, NULL);
        for (int i = 0; i < rows; i++) {
            long double vx = in[0][i], vy = in[1][i], lx = in[3][i], ly = in[4][i], s = in[6][i];
            long double along = 2 * ly * vy - (lx * vx + ly * vy),
                        factor = (s + 2) * fmaxl(ly, 0) / (2 * acosl(-1));
            long double low = along - 3e-7L > 0 ? powl(along - 3e-7L, s) * factor : 0;
            long double high = along + 3e-7L > 0 ? powl(fminl(along + 3e-7L, 1), s) * factor : 0;
            if (!(out[0][i] >= low * (1 - 4e-4L) - 1e-5L && out[0][i] <= high * (1 + 4e-4L) + 1e-5L))
                fail_msg("%s: exponent %Lg, cosine of the lobe %.9Lg: %.9g, not %.9Lg to %.9Lg",
                         fv_cpu_isa_name((enum fv_isa)isa), s, along, (double)out[0][i], low, high);
        }
    }
}

static void normalising(void **state)
{
    (void)state;
    rows = 0;
    for (int e = -45; e <= 38; e++)
        for (int k = 0; k < 4; k++) {
            float s = powf(10, (float)e);
            push((float[]){s, k > 0 ? -0.3f * s : 0, k > 1 ? 0.7f * s : 0}, 3);
        }
    int good = rows;
    static const float odd[] = {0, INFINITY, -INFINITY, NAN};
    for (int k = 0; k < 64; k++) push((float[]){odd[k % 4], odd[k / 4 % 4], odd[k / 16]}, 3);
    FOR_EACH_ISA
    {
        run(isa, PROBE_NORMALISE, NULL);
        for (int i = 0; i < rows; i++) {
            long double x = in[0][i], y = in[1][i], z = in[2][i], n = sqrtl(x * x + y * y + z * z);
            bool none = i >= good || n < 1e-18L || n > 1e18L;
            if ((n > 0.9e-18L && n < 1.1e-18L) || (n > 0.9e18L && n < 1.1e18L)) continue;
            long double w[3] = {none ? 0 : x / n, none ? 1 : y / n, none ? 0 : z / n};
            for (int c = 0; c < 3; c++)
                if (!(fabsl(out[c][i] - w[c]) < 2e-6L))
                    fail_msg("%Lg %Lg %Lg: %d: %g", x, y, z, c, (double)out[c][i]);
        }
    }
}

/* Normal maps, also pointing backwards, all ways of degenerate tangents: a unit normal, and where the
 * numbers allow it, the one of the formula. */
static void bent_normals(void **state)
{
    (void)state;
    static const float texels[] = {0, 1, 300, 511, 511.5f, 512, 1023};
    static const float tangents[][3] = {{1, 0, 0}, {0, 0, -1}, {0.6f, 0, 0.8f}, {0, 0, 0},
                                        {0, 1, 0}, {0, -1, 0}, {1e-5f, 0, 0}};
    static const float scales[] = {0, 1e-6f, 1, -1, 1e6f, 1e30f};
    rows = 0;
    for (int t = 0; t < 7 * 7 * 7; t++)
        for (int g = 0; g < 7; g++)
            for (int s = 0; s < 6; s++)
                push((float[]){texels[t % 7], texels[t / 7 % 7], texels[t / 49], scales[s], tangents[g][0],
                               tangents[g][1], tangents[g][2], g % 2 ? 1 : -1},
                     8);
    FOR_EACH_ISA
    {
        run(isa, PROBE_BEND, NULL);
        for (int i = 0; i < rows; i++) {
            long double s = in[3][i], n[3] = {(in[0][i] - 511.5L) / 511.5L * s,
                                              (in[1][i] - 511.5L) / 511.5L * s, (in[2][i] - 511.5L) / 511.5L};
            long double t[3] = {in[4][i], in[5][i], in[6][i]}, b[3] = {t[2] * in[7][i], 0, -t[0] * in[7][i]},
                        w[3], l2 = 0;
            for (int c = 0; c < 3; c++) w[c] = t[c] * n[0] + b[c] * n[1] + (c == 1) * n[2], l2 += w[c] * w[c];
            float l = out[0][i] * out[0][i] + out[1][i] * out[1][i] + out[2][i] * out[2][i];
            if (!(fabsf(l - 1) < 1e-5f)) fail_msg("row %d: a normal of length^2 %g", i, (double)l);
            if (l2 < 1e-30L || l2 > 1e30L) continue;
            for (int c = 0; c < 3; c++)
                if (!(fabsl(out[c][i] - w[c] / sqrtl(l2)) < 1e-3L))
                    fail_msg("row %d: %d: %g, not %Lg", i, c, (double)out[c][i], w[c] / sqrtl(l2));
        }
    }
}

/* The square root of what texel (x, y) of level l stands for in test textures: a different value each. */
static unsigned texel_value(int x, int y, int l)
{
    return (unsigned)(x * 37 + y * 101 + l * 211) % 1024;
}

/* A texture laid out as scene.h says, every texel's red as texel_value says. */
static const uint32_t *make_texture(struct fv_texture *t, int width, int height)
{
    static uint32_t texel[200000];
    uint32_t n = 64; /* other textures' */
    *t = (struct fv_texture){.width = width, .height = height, .texel = texel};
    do {
        int l = t->levels, w = width >> l > 1 ? width >> l : 1, h = height >> l > 1 ? height >> l : 1;
        t->offset[t->levels++] = n;
        for (int y = 0; y < h; y++)
            for (int x = 0; x <= w; x++) texel[n++] = texel_value(x % w, y, l);
    } while ((width | height) >> t->levels);
    assert_true(n < sizeof texel / sizeof *texel - 64);
    for (uint32_t i = 0; i < 64; i++) texel[i] = texel[n + i] = 0xffffffff;
    return texel;
}

/* Bilinear, wrapping, at a level. */
static long double sample_texture(const struct fv_texture *t, long double u, long double v, int l)
{
    int w = t->width >> l > 1 ? t->width >> l : 1, h = t->height >> l > 1 ? t->height >> l : 1;
    long double x = (u - floorl(u)) * w - 0.5L, y = (v - floorl(v)) * h - 0.5L, x0 = floorl(x),
                y0 = floorl(y), sum = 0;
    for (int k = 0; k < 4; k++) {
        int i = k % 2, j = k / 2;
        long double weight = (i ? x - x0 : 1 - x + x0) * (j ? y - y0 : 1 - y + y0);
        sum += weight * texel_value(((int)x0 + i + w) % w, ((int)y0 + j + h) % h, l);
    }
    return sum;
}

/* Coordinates up to 3e38, at 0 and 1 and beside them, in every level: bilinear as the formula has it, and
 * never a texel of another texture; footprints of any kind. */
static void texels_at_borders(void **state)
{
    (void)state;
    static const int sizes[][2] = {{1, 1}, {1, 64}, {64, 1}, {2, 2}, {256, 256}, {128, 32}};
    static const float places[] = {
        0,           1,          -1,         0.5f,       -0.5f,        1e-7f,          -1e-7f, -1e-10f,
        0.99999994f, 1.0000001f, 1e6f,       -1e6f,      999999.9375f, -1000000.0625f, 1e-40f, 1e9f,
        -1e30f,      3.4e38f,    0.0078125f, 0.9921875f, -0.00390625f, 0.33f};
    static const float odd[] = {INFINITY, -INFINITY, NAN};
    const int n = sizeof places / sizeof *places;
    for (int s = 0; s < 6; s++) {
        struct fv_texture t;
        make_texture(&t, sizes[s][0], sizes[s][1]);
        float unit = 1 / sqrtf((float)t.width * (float)t.height);
        rows = 0;
        for (int l = 0; l <= t.levels; l++)
            for (int i = 0; i < n * n; i++)
                push((float[]){places[i % n], places[i / n], exp2f((float)l) * unit}, 3);
        int good = rows;
        static const float footprints[] = {0, -1, 1e-40f, INFINITY, NAN, 1e38f};
        for (int f = 0; f < 6; f++)
            for (int i = 0; i < n; i++) push((float[]){places[i], 0.25f, footprints[f]}, 3);
        int finite = rows;
        for (int i = 0; i < 9; i++) push((float[]){odd[i % 3], odd[i / 3], unit}, 3);
        for (int i = 0; i < 6; i++)
            push((float[]){i < 3 ? odd[i] : 0.5f, i < 3 ? 0.5f : odd[i - 3], unit}, 3);
        uint32_t first = t.offset[0], last = t.offset[t.levels - 1];
        FOR_EACH_ISA
        {
            run(isa, PROBE_PLACE, &t);
            for (int i = 0; i < rows; i++) {
                const char *name = fv_cpu_isa_name((enum fv_isa)isa);
                double u = (double)in[0][i], v = (double)in[1][i];
                /* A pair of texels from a row's place on. */
                assert_true(out[1][i] >= (float)first && out[1][i] <= (float)(last + 1));
                assert_true(out[2][i] >= (float)first && out[2][i] <= (float)(last + 1));
                if (i < finite && !(out[0][i] >= -0.01f && out[0][i] <= 1023.01f))
                    fail_msg("%s: %d x %d at %g %g: %g", name, t.width, t.height, u, v, (double)out[0][i]);
                int level = i / (n * n);
                if (i >= good || level >= t.levels) continue;
                long double exact = sample_texture(&t, in[0][i], in[1][i], level);
                if (!(fabsl(out[0][i] - exact) <= 0.1L))
                    fail_msg("%s: %d x %d level %d at %.9g %.9g: %g, not %Lg", name, t.width, t.height, level,
                             u, v, (double)out[0][i], exact);
            }
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fresnel_and_snell),   cmocka_unit_test(fresnel_of_anything),
        cmocka_unit_test(logarithm_and_power), cmocka_unit_test(phong_lobe),
        cmocka_unit_test(normalising),         cmocka_unit_test(bent_normals),
        cmocka_unit_test(texels_at_borders)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
