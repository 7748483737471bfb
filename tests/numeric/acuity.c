/* acuity: tolerance, regions and smoothing by eccentricity: against bisection of the Bezier curves in long
 * double, ulp by ulp around the joints, and at shapes and limits where something vanishes or coincides. */
#include "rt/fovea/acuity.h"
#include "tests/support/program.h"
#include "tests/support/random.h"

#include <float.h>
#include <stdbool.h>

#define COUNT(table) (sizeof table / sizeof table[0])

/* x(t) = 2 m t (1 - t) + (m + n) t^2 grows with t: the t at which it is x. */
static long double bisected(long double m, long double n, long double x)
{
    long double low = 0, high = 1;
    for (int i = 0; i < 200 && low < high; i++) {
        long double t = (low + high) / 2;
        if (t == low || t == high) break;
        if (2 * m * t * (1 - t) + (m + n) * t * t < x) low = t;
        else high = t;
    }
    return (low + high) / 2;
}

/* y of the Bezier curve through (x0, y0), (x1, y0), (x2, y2), of which x1 is where tangents of slope 0 at the
 * first and `slope` at the last meet, where that lies between them, and x0 else. Searched for from the nearer
 * end, so that a vertical tangent there costs no digits. */
static long double curve(long double x0, long double y0, long double x2, long double y2, long double slope,
                         long double x)
{
    long double x1 = x2 - (y2 - y0) / slope;
    if (!(x1 >= fminl(x0, x2) && x1 <= fmaxl(x0, x2))) x1 = x0;
    long double m = fabsl(x1 - x0), n = fabsl(x2 - x1);
    bool far_end = fabsl(x - x2) < fabsl(x - x0);
    long double t = far_end ? 1 - bisected(n, m, fabsl(x - x2)) : bisected(m, n, fabsl(x - x0));
    return y0 * (1 - t) * (1 - t) + 2 * y0 * t * (1 - t) + y2 * t * t;
}

static long double expected(const struct fv_regions *r, const double shape[4], float e)
{
    float e_f = r->upper_deg[FV_REGION_FOVEA], e_np = r->upper_deg[FV_REGION_NEAR];
    if (!(e > 0)) return (long double)shape[0];
    if (e > e_f && e >= e_np) return (long double)shape[3];
    return e <= e_f ? curve(0, shape[0], e_f, shape[1], shape[2], e)
                    : curve(e_np, shape[3], e_f, shape[1], shape[2], e);
}

struct checked {
    struct fv_regions regions;
    struct fv_tolerance tolerance;
    const double *shape;
    double largest; /* of the tolerances */
    double worst;   /* error of all, in ulps */
    long tried;
};

static void set(struct checked *c, const double deg[FV_REGIONS], const double shape[4])
{
    fv_regions_set(&c->regions, deg);
    fv_tolerance_set(&c->tolerance, &c->regions, shape);
    c->shape = shape;
    c->largest = fmax(fabs(shape[0]), fmax(fabs(shape[1]), fabs(shape[3])));
}

/* Off by half an ulp, which a float cannot but be, and what doubles lose of the largest tolerance. */
static void check_value(struct checked *c, float e)
{
    float got = fv_tolerance_at(&c->tolerance, e);
    long double exact = expected(&c->regions, c->shape, e), off = fabsl((long double)got - exact);
    double size = fmax((double)fabsl(exact), (double)FLT_MIN), ulp = exp2(floor(log2(size))) * FLT_EPSILON;
    if (!(off <= 0.5L * (long double)ulp + 4e-15L * (long double)c->largest))
        fail_msg("shape %g %g %g %g, e_f %.9g, e_np %.9g: %.9g at %.9g, not %.12Lg", c->shape[0], c->shape[1],
                 c->shape[2], c->shape[3], (double)c->tolerance.joint_deg, (double)c->tolerance.end_deg,
                 (double)got, (double)e, exact);
    c->worst = fmax(c->worst, (double)off / ulp);
    c->tried++;
}

/* Every float within `ulps` of e; never below 0, and no less at the next one, but for rounding. */
static void check_around(struct checked *c, float e, int ulps)
{
    for (int i = 0; i < ulps; i++) e = nextafterf(e, -INFINITY);
    for (int i = 0; i < 2 * ulps; i++) {
        float next = nextafterf(e, INFINITY);
        check_value(c, e);
        float here = fv_tolerance_at(&c->tolerance, e), there = fv_tolerance_at(&c->tolerance, next);
        if (!((double)there >= (double)nextafterf(here, -INFINITY) - 4e-15 * c->largest && there >= 0))
            fail_msg("shape %g %g %g %g: %.9g at %.9g, then %.9g", c->shape[0], c->shape[1], c->shape[2],
                     c->shape[3], (double)here, (double)e, (double)there);
        e = next;
    }
}

/* The papers' two shapes, and those where the middle points come to lie on the ends or beyond them. */
static const double shapes[][4] = {
    {1, 2, 0.5, 12},
    {9, 10, 1.5, 20},
    {1, 2, 0.37, 12},      /* tangents meet near the middle of the second half */
    {1, 2, 1 / 3.3, 12},   /* near 0 */
    {0, 3.3, 1, 30},       /* at 0, and at e_np */
    {1, 2, 0, 12},         /* level: both straight */
    {1, 2, 1e-300, 12},
    {1, 2, 1e6, 12},       /* all but vertical */
    {1, 2, 1e300, 12},
    {1, 2, INFINITY, 12},
    {1, 2, NAN, 12},
    {1, 2, -0.5, 12},
    {2, 2, 0.5, 12},       /* tau_0 = tau_f */
    {2, 2, 0, 2},          /* constant, 0 / 0 */
    {2, 2, 1, 2},
    {0, 0, 0, 0},
    {0, 0, 1, 1e6},
    {0, 1e-3, INFINITY, 1e6}, /* vertical at e_f, where little is left of what was large */
    {0, 1e-3, 1e12, 1e6},
    {1, 2, 0.5, 4},           /* with limits of 4 and 12 degrees: both middle points in the middle */
    {1, 2, 0.5 + 1e-13, 4},
    {0, 1e6, 1e6, 1e6},
    {1e-30, 1e-20, 1e-21, 1e6},
};

static void against_bisection(void **state)
{
    (void)state;
    static const double limits[][FV_REGIONS] = {
        {3.3, 5.5, 12.1, 30, 45}, {2.5, 4.5, 8.5, 30, 45},    {3.3, 5.5, 12.1, 180, 180},
        {0, 5.5, 12.1, 30, 45},   {1e-30, 1, 2, 30, 45},      {10, 10, 10, 10.00001, 45},
        {4, 4, 4, 12, 45},        {30, 30, 30, 30, 45},       {0, 0, 0, 0, 0},
        {180, 180, 180, 180, 180},
    };
    struct checked c = {0};
    for (unsigned l = 0; l < COUNT(limits); l++)
        for (unsigned s = 0; s < COUNT(shapes); s++) {
            set(&c, limits[l], shapes[s]);
            int ulps = l == 0 && s < 5 ? 4000 : 100;
            check_around(&c, 0, ulps);
            check_around(&c, c.tolerance.joint_deg, ulps);
            check_around(&c, c.tolerance.end_deg, ulps);
            for (int i = 0; i < 400; i++) check_value(&c, (float)i * 31 / 400);
            for (int i = 0; i < 100; i++)
                check_value(&c, c.tolerance.joint_deg * (1 - exp2f(-0.25f * (float)i)));
        }
    print_message("%ld tolerances, off by at most %.6f ulps\n", c.tried, c.worst);
}

static void random_shapes(void **state)
{
    (void)state;
    uint64_t random = 5;
    struct checked c = {0};
    for (int n = 0; n < 100000; n++) {
        double e_f = random_decade(&random, 1e-6, 60), e_np = e_f + random_decade(&random, 1e-6, 120);
        double tau_f = random_decade(&random, 1e-3, 1e6), tau_np = tau_f + random_decade(&random, 1e-3, 1e6);
        double tau_0 = tau_f * random_between(&random, 0, 1), slope = random_decade(&random, 1e-6, 1e6);
        double e = n % 2 ? random_between(&random, 0, e_f) : random_between(&random, e_f, e_np);
        set(&c, (double[FV_REGIONS]){e_f, e_f, e_np, e_np, 180}, (double[4]){tau_0, tau_f, slope, tau_np});
        check_around(&c, (float)e, 1);
    }
    print_message("%ld tolerances, off by at most %.6f ulps\n", c.tried, c.worst);
}

/* Slopes by secants of two lengths, whose first error cancels. */
static double slope_at(const struct fv_tolerance *t, float e, float h)
{
    double at = (double)fv_tolerance_at(t, e), one = (double)fv_tolerance_at(t, e + h);
    double two = (double)fv_tolerance_at(t, e + 2 * h);
    return (4 * one - 3 * at - two) / (2 * (double)h);
}

static void smooth_at_the_joint(void **state)
{
    (void)state;
    uint64_t random = 3;
    for (int n = 0; n < 20000; n++) {
        /* Where the tangents meet within both halves. */
        double e_f = random_between(&random, 1, 10), width = random_between(&random, 2, 30);
        double slope = random_between(&random, 0.2, 3), tau_0 = random_between(&random, 0, 5);
        double tau_f = tau_0 + slope * e_f * random_between(&random, 0.2, 0.8);
        double tau_np = tau_f + slope * width * random_between(&random, 0.2, 0.8);
        double shape[4] = {tau_0, tau_f, slope, tau_np};
        if (n == 0) e_f = 3.3, width = 26.7, memcpy(shape, shapes[0], sizeof shape);
        struct checked c;
        set(&c, (double[FV_REGIONS]){e_f, e_f, e_f, e_f + width, 180}, shape);
        float joint = c.tolerance.joint_deg, end = c.tolerance.end_deg, h = 0x1p-7f;
        double below = slope_at(&c.tolerance, joint, -h), above = slope_at(&c.tolerance, joint, h);
        if (!(fabs(below - shape[2]) < 0.01 * shape[2] && fabs(above - shape[2]) < 0.01 * shape[2]))
            fail_msg("row %d: slopes %g and %g at the joint, not %g", n, below, above, shape[2]);
        /* Level at both ends, unless the middle point is there. */
        double at_0 = slope_at(&c.tolerance, 0, h), at_end = slope_at(&c.tolerance, end, -h);
        if (!(fabs(at_0) < 0.05 * shape[2] && fabs(at_end) < 0.05 * shape[2]))
            fail_msg("row %d: slopes %g at 0, %g at e_np", n, at_0, at_end);
    }
}

static void tolerances_at_odd_places(void **state)
{
    (void)state;
    static const struct {
        double e_f, e_np, shape[4];
        float e, tau;
    } table[] = {
        /* The paper's: its middle points lie at 1.3 and 23.3 degrees; values by hand at t = 1/2. */
        {3.3, 30, {1, 2, 0.5, 12}, 0, 1},
        {3.3, 30, {1, 2, 0.5, 12}, (2 * 1.3f + 3.3f) / 4, 1.25f},
        {3.3, 30, {1, 2, 0.5, 12}, 3.3f, 2},
        {3.3, 30, {1, 2, 0.5, 12}, (3.3f + 2 * 23.3f + 30) / 4, 9.5f},
        {3.3, 30, {1, 2, 0.5, 12}, 30, 12},
        {3.3, 30, {1, 2, 0.5, 12}, 180, 12},
        {3.3, 30, {1, 2, 0.5, 12}, INFINITY, 12},
        {3.3, 30, {1, 2, 0.5, 12}, NAN, 1},
        {3.3, 30, {1, 2, 0.5, 12}, -0.0f, 1},
        {3.3, 30, {1, 2, 0.5, 12}, -1, 1},
        {3.3, 30, {1, 2, 0.5, 12}, -INFINITY, 1},
        {3.3, 30, {1, 2, 0.5, 12}, FLT_TRUE_MIN, 1},
        /* e_f = 0 */
        {0, 30, {1, 2, 0.5, 12}, 0, 1},
        {0, 30, {1, 2, 0.5, 12}, FLT_TRUE_MIN, 2},
        {0, 30, {1, 2, 0.5, 12}, 30, 12},
        {1e-45, 30, {1, 2, 0.5, 12}, FLT_TRUE_MIN, 2},
        /* e_f = e_np: a step beyond */
        {4, 4, {1, 2, 0.5, 12}, 4, 2},
        {4, 4, {1, 2, 0.5, 12}, 4.000001f, 12},
        {4, 4, {1, 2, 0.5, 12}, 180, 12},
        {0, 0, {1, 2, 0.5, 12}, 0, 1},
        {0, 0, {1, 2, 0.5, 12}, FLT_TRUE_MIN, 12},
        /* straight: no slope, the other way, too little of it */
        {4, 12, {1, 2, 0, 12}, 2, 1.5f},
        {4, 12, {1, 2, 0, 12}, 8, 7},
        {4, 12, {1, 2, -1, 12}, 2, 1.5f},
        {4, 12, {1, 2, 0.01, 12}, 8, 7},
        {4, 12, {1, 2, NAN, 12}, 8, 7},
        /* vertical: 1 - t = sqrt(1 - e / e_f) */
        {4, 12, {1, 2, INFINITY, 12}, 3, 1.25f},
        {4, 12, {1, 2, INFINITY, 12}, 4, 2},
        {4, 12, {1, 2, INFINITY, 12}, 6, 9.5f},
        /* constant, and falling */
        {4, 12, {2, 2, 0, 2}, 3, 2},
        {4, 12, {2, 2, 0.5, 12}, 3, 2},
        {4, 12, {2, 2, 0.5, 12}, 4, 2},
        {4, 12, {3, 2, 0, 1}, 2, 2.5f},
        {4, 12, {3, 2, -INFINITY, 1}, 3, 2.75f},
    };
    for (unsigned i = 0; i < COUNT(table); i++) {
        struct checked c;
        set(&c, (double[FV_REGIONS]){table[i].e_f, table[i].e_f, table[i].e_f, table[i].e_np, 180},
            table[i].shape);
        float tau = fv_tolerance_at(&c.tolerance, table[i].e);
        if (!(fabsf(tau - table[i].tau) <= 3e-7f * table[i].tau))
            fail_msg("row %u: %.9g, not %.9g", i, (double)tau, (double)table[i].tau);
    }
}

static void regions(void **state)
{
    (void)state;
    static const double not_finite = INFINITY;
    const struct {
        double deg[FV_REGIONS];
        float e;
        int region;
    } table[] = {
        {{3.3, 5.5, 12.1, 30, 45}, 0, FV_REGION_FOVEA},
        {{3.3, 5.5, 12.1, 30, 45}, 3.3f, FV_REGION_FOVEA},
        {{3.3, 5.5, 12.1, 30, 45}, nextafterf(3.3f, 4), FV_REGION_PARA},
        {{3.3, 5.5, 12.1, 30, 45}, 5.5f, FV_REGION_PARA},
        {{3.3, 5.5, 12.1, 30, 45}, 12.1f, FV_REGION_PERI},
        {{3.3, 5.5, 12.1, 30, 45}, 12.2f, FV_REGION_NEAR},
        {{3.3, 5.5, 12.1, 30, 45}, 30, FV_REGION_NEAR},
        {{3.3, 5.5, 12.1, 30, 45}, nextafterf(30, 31), FV_REGION_FAR},
        {{3.3, 5.5, 12.1, 30, 45}, 45, FV_REGION_FAR},
        {{3.3, 5.5, 12.1, 30, 45}, INFINITY, FV_REGION_FAR},
        {{3.3, 5.5, 12.1, 30, 45}, NAN, FV_REGION_FOVEA},
        {{3.3, 5.5, 12.1, 30, 45}, -1, FV_REGION_FOVEA},
        {{0, 0, 0, 0, 0}, 0, FV_REGION_FOVEA},
        {{0, 0, 0, 0, 0}, FLT_TRUE_MIN, FV_REGION_FAR},
        {{5, 5, 12, 12, 12}, 5, FV_REGION_FOVEA}, /* parafovea and near periphery are empty */
        {{5, 5, 12, 12, 12}, 5.000001f, FV_REGION_PERI},
        {{5, 5, 12, 12, 12}, 12.000001f, FV_REGION_FAR},
        {{5, 2, -3, 30, 20}, 4, FV_REGION_FOVEA}, /* raised to 5 5 5 30 30 */
        {{5, 2, -3, 30, 20}, 6, FV_REGION_NEAR},
        {{5, NAN, 12, 30, NAN}, 6, FV_REGION_PERI},
        {{NAN, 5, 12, 30, 45}, 0, FV_REGION_FOVEA},
        {{NAN, 5, 12, 30, 45}, 1, FV_REGION_PARA},
        {{not_finite, 5, 12, 30, 45}, 180, FV_REGION_FOVEA},
    };
    for (unsigned i = 0; i < COUNT(table); i++) {
        struct fv_regions r;
        fv_regions_set(&r, table[i].deg);
        for (int n = 0; n < FV_REGIONS; n++)
            assert_true(r.upper_deg[n] >= (n ? r.upper_deg[n - 1] : 0) && r.upper_deg[n] <= 180);
        if (fv_region_at(&r, table[i].e) != table[i].region)
            fail_msg("row %u: region %d, not %d", i, fv_region_at(&r, table[i].e), table[i].region);
    }
}

static void smoothing(void **state)
{
    (void)state;
#define PAPER {0.9, 0.8, 0.7, 0.5, 0.2, 0.1}
    static const struct {
        double deg[FV_REGIONS], alpha[FV_REGIONS + 1];
        float e, value;
    } table[] = {
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, 0, 0.9f},
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, 1.65f, 0.85f},
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, 3.3f, 0.8f},
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, 5.5f, 0.7f},
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, 12.1f, 0.5f},
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, 30, 0.2f},
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, 37.5f, 0.15f},
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, 45, 0.1f},
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, 180, 0.1f},
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, INFINITY, 0.1f},
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, NAN, 0.9f},
        {{3.3, 5.5, 12.1, 30, 45}, PAPER, -1, 0.9f},
        /* limits that coincide: a step beyond them */
        {{4, 4, 4, 8, 8}, PAPER, 4, 0.8f},
        {{4, 4, 4, 8, 8}, PAPER, 4.0000005f, 0.5f},
        {{4, 4, 4, 8, 8}, PAPER, 6, 0.35f},
        {{4, 4, 4, 8, 8}, PAPER, 8, 0.2f},
        {{4, 4, 4, 8, 8}, PAPER, 8.000001f, 0.1f},
        {{0, 0, 4, 8, 9}, PAPER, 0, 0.9f},
        {{0, 0, 4, 8, 9}, PAPER, FLT_TRUE_MIN, 0.7f},
        {{0, 0, 0, 0, 0}, PAPER, 0, 0.9f},
        {{0, 0, 0, 0, 0}, PAPER, FLT_TRUE_MIN, 0.1f},
        {{180, 180, 180, 180, 180}, PAPER, 180, 0.8f},
        /* 0 and 1 */
        {{3.3, 5.5, 12.1, 30, 45}, {0, 0, 0, 0, 0, 0}, 7, 0},
        {{3.3, 5.5, 12.1, 30, 45}, {1, 1, 1, 1, 1, 1}, 7, 1},
        {{4, 6, 12, 30, 45}, {0, 1, 0, 1, 0, 1}, 5, 0.5f},
        {{4, 6, 12, 30, 45}, {0, 1, 0, 1, 0, 1}, 4, 1},
        {{4, 6, 12, 30, 45}, {0, 1, 0, 1, 0, 1}, 6, 0},
    };
    struct fv_regions r;
    for (unsigned i = 0; i < COUNT(table); i++) {
        fv_regions_set(&r, table[i].deg);
        float value = fv_smoothing_at(&r, table[i].alpha, table[i].e);
        if (!(fabsf(value - table[i].value) <= 2.5e-7f * table[i].value))
            fail_msg("row %u: %.9g, not %.9g", i, (double)value, (double)table[i].value);
    }
    /* Within [0, 1] at whatever values there, and all of them 1 is 1. */
    uint64_t random = 7;
    double ones[FV_REGIONS + 1] = {1, 1, 1, 1, 1, 1};
    for (int n = 0; n < 200000; n++) {
        double deg[FV_REGIONS], alpha[FV_REGIONS + 1];
        for (int i = 0; i < FV_REGIONS; i++)
            deg[i] = (i ? deg[i - 1] : 0) + (n >> i & 1 ? random_decade(&random, 1e-40, 50) : 0);
        for (int i = 0; i <= FV_REGIONS; i++)
            alpha[i] = n >> i & 1 ? random_between(&random, 0, 1) : n >> (i + 1) & 1;
        fv_regions_set(&r, deg);
        float e = n % 3 ? (float)random_decade(&random, 1e-40, 180)
                        : nextafterf(r.upper_deg[n % FV_REGIONS], n % 2 ? 0 : 200);
        float value = fv_smoothing_at(&r, alpha, e);
        if (!(value >= 0 && value <= 1)) fail_msg("alpha %.9g at %.9g", (double)value, (double)e);
        assert_true(fv_smoothing_at(&r, ones, e) == 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(against_bisection),        cmocka_unit_test(random_shapes),
        cmocka_unit_test(smooth_at_the_joint),      cmocka_unit_test(tolerances_at_odd_places),
        cmocka_unit_test(regions),                  cmocka_unit_test(smoothing),
    };
    return cmocka_run_group_tests(tests, NULL, program_clean);
}
