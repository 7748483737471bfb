/* ggx: the glossy lobe of rt/trace/ggx.h against its formulas in double: its values, what it reflects of even light, the density of
 * what is drawn, both ways of light, mirrors, alpha 1, grazing and degenerate directions. On every instruction set. */
#include "tests/numeric/probe/probe.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <math.h>
#include <stdbool.h>

enum { ROWS = 7, SIDE = 64, MOST = SIDE * SIDE };
static float in[ROWS][MOST], out[ROWS][MOST];
/* alpha 1, 0.58, 0.19, 0.09 and 0.007 */
static const double exponents[] = {0, 1, 13, 60, 10000};
static const double heights[] = {1, 0.9, 0.5, 0.1, 0.02};
enum { EXPONENTS = sizeof exponents / sizeof *exponents, HEIGHTS = sizeof heights / sizeof *heights };

#define FOR_EACH_ISA for (int isa = 0; isa <= (int)fv_cpu_isa(); isa++)

static void probe(int isa, enum fv_probe p)
{
    const float *from[ROWS];
    float *to[ROWS];
    for (int i = 0; i < ROWS; i++) from[i] = in[i], to[i] = out[i];
    fv_probe_of(isa, p)(NULL, from, to, MOST);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void unit(double a[3])
{
    double n = sqrt(dot(a, a));
    for (int c = 0; c < 3; c++) a[c] /= n;
}

static double alpha2(double exponent)
{
    return 1 / (2 * exponent + 1);
}

/* Smith's lambda of a direction at this cosine to the normal, +y. */
static double lambda(double a2, double y)
{
    return 0.5 * (sqrt(1 + a2 * (1 - y * y) / (y * y)) - 1);
}

static double facets(double a2, const double h[3])
{
    double sine2 = h[0] * h[0] + h[2] * h[2], d = sine2 + a2 * h[1] * h[1];
    return a2 / (M_PI * d * d);
}

/* Times the light's cosine. */
static double lobe(double a2, const double v[3], const double l[3])
{
    double h[3] = {v[0] + l[0], v[1] + l[1], v[2] + l[2]};
    if (l[1] <= 0) return 0;
    unit(h);
    return facets(a2, h) / (1 + lambda(a2, v[1]) + lambda(a2, l[1])) / (4 * v[1]);
}

static void view_at(double y, double v[3])
{
    double r = sqrt(1 - y * y);
    v[0] = 0.6 * r, v[1] = y, v[2] = -0.8 * r;
}

/* Half vectors spread as the facets' distribution times the cosine, more of them far off: number k of a grid; returns by how much
 * it counts, 1 in the mean. */
static double half_of(double a2, int k, double h[3])
{
    double rest = 1 - (k / SIDE + 0.5) / SIDE, u = 1 - rest * rest, turn = 2 * M_PI * (k % SIDE + 0.5) / SIDE;
    double tan2 = a2 * u / (1 - u), y = 1 / sqrt(1 + tan2), r = sqrt(tan2) * y;
    h[0] = r * cos(turn), h[1] = y, h[2] = r * sin(turn);
    return 2 * rest;
}

static void mirror(const double v[3], const double h[3], double l[3])
{
    double along = 2 * dot(v, h);
    for (int c = 0; c < 3; c++) l[c] = along * h[c] - v[c];
}

static void put3(int row, int k, const double v[3])
{
    for (int c = 0; c < 3; c++) in[row + c][k] = (float)v[c];
}

/* As the oracle has it, wherever the lobe is; the same with light and viewer exchanged; Fresnel's weight. */
static void values(void **state)
{
    (void)state;
    FOR_EACH_ISA for (int e = 0; e < EXPONENTS; e++) for (int y = 0; y < HEIGHTS; y++)
    {
        double v[3], h[3], l[3], a2 = alpha2(exponents[e]), worst = 0, other = 0;
        static float there[2][MOST];
        view_at(heights[y], v);
        for (int back = 0; back < 2; back++) {
            for (int k = 0; k < MOST; k++) {
                half_of(a2, k, h);
                mirror(v, h, l);
                put3(back ? 3 : 0, k, v);
                put3(back ? 0 : 3, k, l);
                in[6][k] = (float)exponents[e];
            }
            probe(isa, PROBE_GGX);
            memcpy(there[back], out[0], sizeof there[back]);
        }
        for (int k = 0; k < MOST; k++) {
            half_of(a2, k, h);
            mirror(v, h, l);
            double want = lobe(a2, v, l), along = dot(v, h);
            if (l[1] < 0.005 || along <= 0) continue;
            worst = fmax(worst, fabs((double)there[0][k] / want - 1));
            other = fmax(other, fabs((double)there[1][k] / v[1] * l[1] / want - 1));
            if (fabs((double)out[2][k] - pow(1 - along, 5)) > 1e-5) fail_msg("edge %g at %g", (double)out[2][k], along);
        }
        if (worst > 2e-3 || other > 2e-3) fail_msg("exponent %g from %g: %g and %g off", exponents[e], heights[y], worst, other);
    }
}

/* What a lobe reflects of even light: never more than all, as much as by quadrature over half vectors, and the mean of what is
 * drawn; each drawn direction counts for 1 at most; densities come to 1 over all directions. */
static void furnace(void **state)
{
    (void)state;
    FOR_EACH_ISA for (int e = 0; e < EXPONENTS; e++) for (int y = 0; y < HEIGHTS; y++)
    {
        double v[3], h[3], l[3], a2 = alpha2(exponents[e]), want = 0, got = 0, density = 0;
        view_at(heights[y], v);
        for (int k = 0; k < MOST; k++) {
            double counts = half_of(a2, k, h);
            mirror(v, h, l);
            put3(0, k, v);
            put3(3, k, l);
            in[6][k] = (float)exponents[e];
            if (dot(v, h) > 0 && l[1] > 0) want += counts * dot(v, h) / (v[1] * h[1]) / (1 + lambda(a2, v[1]) + lambda(a2, l[1])) / MOST;
        }
        probe(isa, PROBE_GGX);
        for (int k = 0; k < MOST; k++) {
            double counts = half_of(a2, k, h);
            if (dot(v, h) > 0) density += counts * (double)out[1][k] * 4 * dot(v, h) / (facets(a2, h) * h[1]) / MOST;
        }
        for (int k = 0; k < MOST; k++) {
            in[3][k] = (float)exponents[e];
            in[4][k] = ((float)(k / SIDE) + 0.5f) / SIDE, in[5][k] = ((float)(k % SIDE) + 0.5f) / SIDE;
        }
        probe(isa, PROBE_GGX_WAY);
        for (int k = 0; k < MOST; k++) {
            double n = 0;
            for (int c = 0; c < 3; c++) in[3 + c][k] = out[c][k], n += (double)out[c][k] * (double)out[c][k];
            if (fabs(n - 1) > 1e-5) fail_msg("a way of length %g", sqrt(n));
        }
        probe(isa, PROBE_GGX);
        for (int k = 0; k < MOST; k++) {
            if (in[4][k] <= 0) continue;
            double weight = (double)out[0][k] / (double)out[1][k];
            if (!(weight >= 0 && weight < 1.001)) fail_msg("exponent %g from %g: a weight of %g", exponents[e], heights[y], weight);
            got += weight / MOST;
        }
        print_message("exponent %5g from %4g: reflects %.4f, drawn %.4f; densities %.4f\n", exponents[e], heights[y], want, got, density);
        assert_true(want <= 1.001 && fabs(got - want) < 0.01); /* rows of the grid end at the horizon */
        assert_true(fabs(density - 1) < 0.02);
    }
}

/* The narrowest lobe mirrors; whatever comes in, nothing but numbers comes out. */
static void extremes(void **state)
{
    (void)state;
    static const double odd[][3] = {{0, 1, 0}, {1, 0, 0}, {0, -1, 0}, {0.6, -0.8, 0}, {0, 1e-30, -1}, {0.99999, 0.001, 0}, {0, 0, 0}, {0.6, 1e-4, 0.8}};
    enum { ODD = sizeof odd / sizeof *odd };
    uint64_t random = 5;
    FOR_EACH_ISA
    {
        for (int k = 0; k < MOST; k++) {
            double v[3];
            view_at(random_between(&random, 0.05, 1), v);
            put3(0, k, v);
            in[3][k] = 1e6f;
            in[4][k] = (float)random_between(&random, 0, 0.99), in[5][k] = (float)random_between(&random, 0, 1);
        }
        probe(isa, PROBE_GGX_WAY);
        for (int k = 0; k < MOST; k++) {
            double off = fabs((double)(out[0][k] + in[0][k])) + fabs((double)(out[1][k] - in[1][k])) + fabs((double)(out[2][k] + in[2][k]));
            if (!(off < 0.03)) fail_msg("not mirrored: %g off", off);
        }
        for (int k = 0; k < MOST; k++) {
            put3(0, k, odd[k % ODD]);
            put3(3, k, odd[k / ODD % ODD]);
            in[6][k] = (float)(k / (ODD * ODD) % 2 ? 1e9 : exponents[k / (2 * ODD * ODD) % EXPONENTS]);
        }
        probe(isa, PROBE_GGX);
        for (int k = 0; k < MOST; k++)
            for (int row = 0; row < 3; row++)
                if (!(out[row][k] >= 0 && out[row][k] < 1e12f)) fail_msg("%d: %g of view %d, light %d", row, (double)out[row][k], k % ODD, k / ODD % ODD);
        for (int k = 0; k < MOST; k++) in[3][k] = in[6][k], in[4][k] = k & 1 ? 0.99999994f : 0, in[5][k] = k & 2 ? 0.99999994f : 0;
        probe(isa, PROBE_GGX_WAY);
        for (int k = 0; k < MOST; k++)
            for (int row = 0; row < 3; row++)
                if (!(fabsf(out[row][k]) < 1.001f)) fail_msg("a way's part of %g", (double)out[row][k]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(values), cmocka_unit_test(furnace), cmocka_unit_test(extremes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
