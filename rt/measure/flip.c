/* flip: see flip.h. Section and symbol names are the paper's. Loops over a row are free of branches and
 * calls, so that the compiler makes vector code of them. */
#include "rt/measure/flip.h"

#include "rt/measure/filter.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* Section 4.1.1: a sqrt(pi / b) exp(-pi^2 d^2 / b), d in degrees. */
static const struct {
    double a, b;
} sensitivity[4] = {{1, 0.0047}, {1, 0.0053}, {34.1, 0.04}, {13.5, 0.025}};
static const double widest_b = 0.04;

/* Sections 4.1.3 and 4.3: exponents and the point where the scale of colour differences bends. */
static const double q_c = 0.7, p_c = 0.4, p_t = 0.95;

/* Section 4.2: width of the features that are looked for, degrees. */
static const double feature_deg = 0.082;

/* Linear RGB with sRGB's primaries to X / X_n, Y, Z / Z_n, white D65, and back from (Y, X - Y, Y - Z). */
static const float xyz_of_rgb[3][3] = {{0.433895389f, 0.376242373f, 0.189862239f},
                                       {0.212636822f, 0.715182982f, 0.072180196f},
                                       {0.017752423f, 0.109465629f, 0.872781948f}};
static const float rgb_of_opponent[3][3] = {
    {1, 3.080341988f, 0.542943019f}, {1, -0.921178396f, -0.045248412f}, {1, 0.052881293f, -1.151129913f}};

static void set_filter(struct fv_flip_filter *filter, int radius, const double *weight, double scale)
{
    filter->radius = radius;
    for (int k = 0; k <= 2 * radius; k++) {
        double w = weight[k] * scale;
        filter->weight[k] = fabs(w) < 1e-20 ? 0 : (float)w; /* no denormal products */
    }
}

static void set_sensitivity(struct fv_flip *flip, double ppd)
{
    double weight[4][2 * FV_FLIP_RADIUS_MAX + 1];
    double sum[4] = {0}, total[4];
    int radius = (int)ceil(3 * sqrt(widest_b / (2 * pi * pi)) * ppd);
    for (int i = 0; i < 4; i++) {
        for (int k = -radius; k <= radius; k++) {
            weight[i][k + radius] = exp(-pi * pi * (k / ppd) * (k / ppd) / sensitivity[i].b);
            sum[i] += weight[i][k + radius];
        }
        total[i] = sensitivity[i].a * sqrt(pi / sensitivity[i].b) * sum[i] * sum[i];
    }
    double both = total[2] + total[3], share[4] = {1, 1, total[2] / both, total[3] / both};
    for (int i = 0; i < 4; i++) {
        set_filter(&flip->sensitivity[i], radius, weight[i], 1 / sum[i]);
        set_filter(&flip->sensitivity_down[i], radius, weight[i], share[i] / sum[i]);
    }
}

/* Positive and negative weights sum to 1 and to -1, each of them. */
static void set_feature(struct fv_flip_filter *filter, int radius, double *weight)
{
    double positive = 0, negative = 0;
    for (int k = 0; k <= 2 * radius; k++) *(weight[k] > 0 ? &positive : &negative) += fabs(weight[k]);
    for (int k = 0; k <= 2 * radius; k++) weight[k] /= weight[k] > 0 ? positive : negative;
    set_filter(filter, radius, weight, 1);
}

static void set_features(struct fv_flip *flip, double ppd)
{
    double weight[3][2 * FV_FLIP_RADIUS_MAX + 1];
    double sigma = 0.5 * feature_deg * ppd;
    int radius = (int)ceil(3 * sigma);
    for (int k = -radius; k <= radius; k++) {
        double gaussian = exp(-k * k / (2 * sigma * sigma));
        weight[0][k + radius] = gaussian;
        weight[1][k + radius] = -k * gaussian;
        weight[2][k + radius] = (k * k / (sigma * sigma) - 1) * gaussian;
    }
    for (int i = 0; i < 3; i++) set_feature(&flip->feature[i], radius, weight[i]);
}

/* x^y for x >= 0, y in [0, 1], to 2e-6 of the value from x = 1e-6 up; 0^0 is 1. The logarithm's series in
 * (m - 1) / (m + 1) and the exponential's; both need no more terms over half an octave to each side. */
static inline float power(float x, float y)
{
    float above = x > 1e-37f ? x : 1e-37f, mantissa, scale;
    int32_t bits, exponent;
    memcpy(&bits, &above, 4);
    exponent = (bits - 0x3f3504f3) >> 23;
    bits -= exponent * (1 << 23);
    memcpy(&mantissa, &bits, 4);
    float t = (mantissa - 1) / (mantissa + 1), s = t * t;
    float logarithm = 0.577078016f + s * 0.412198583f;
    logarithm = (float)exponent + t * (2.88539008f + s * (0.961796694f + s * logarithm));
    float z = y * logarithm;
    int32_t whole = (int32_t)(z + 127.5f) - 127;
    float f = z - (float)whole;
    bits = (whole + 127) * (1 << 23);
    memcpy(&scale, &bits, 4);
    float value = 0.00961812911f + f * (0.00133335581f + f * 0.000154035304f);
    value = 1 + f * (0.693147181f + f * (0.240226507f + f * (0.0555041087f + f * value)));
    return x > 1e-37f ? value * scale : y > 0 ? 0 : 1;
}

static inline float clamp_unit(float x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

/* The function inside CIELAB (CIE 15): a cube root, a line near 0. */
static inline float lab_curve(float t)
{
    float root = power(t, 1.0f / 3);
    return t > 216.0f / 24389 ? root : t * (841.0f / 108) + 4.0f / 29;
}

/* CIELAB with Hunt's effect: a and b fade with lightness (section 4.1.2). Linear r, g, b in [0, 1]. */
static inline void lab_of(float r, float g, float b, float lab[3])
{
    float curve[3];
    for (int i = 0; i < 3; i++)
        curve[i] = lab_curve(xyz_of_rgb[i][0] * r + xyz_of_rgb[i][1] * g + xyz_of_rgb[i][2] * b);
    lab[0] = 116 * curve[1] - 16;
    lab[1] = 0.01f * lab[0] * 500 * (curve[0] - curve[1]);
    lab[2] = 0.01f * lab[0] * 200 * (curve[1] - curve[2]);
}

/* HyAB, to the power of q_c (section 4.1.3). */
static inline float colour_difference(const float p[3], const float q[3])
{
    float a = p[1] - q[1], b = p[2] - q[2];
    return power(fabsf(p[0] - q[0]) + sqrtf(a * a + b * b), (float)q_c);
}

void fv_flip_set(struct fv_flip *flip, double ppd)
{
    float green[3], blue[3];
    ppd = fmin(fmax(ppd, 1), 1000);
    set_sensitivity(flip, ppd);
    set_features(flip, ppd);
    int r = flip->sensitivity[0].radius, s = flip->feature[0].radius;
    flip->radius = r > s ? r : s;
    lab_of(0, 1, 0, green);
    lab_of(0, 0, 1, blue);
    flip->colour_max = colour_difference(green, blue);
}

void fv_flip_opponent(const float *restrict red, const float *restrict green, const float *restrict blue,
                      float *const channel[3], int n)
{
    const float(*m)[3] = xyz_of_rgb;
    float *restrict y = channel[0], *restrict xy = channel[1], *restrict yz = channel[2];
    for (int i = 0; i < n; i++) {
        float r = red[i], g = green[i], b = blue[i];
        float up = m[0][0] * r + m[0][1] * g + m[0][2] * b;
        float middle = m[1][0] * r + m[1][1] * g + m[1][2] * b;
        float down = m[2][0] * r + m[2][1] * g + m[2][2] * b;
        y[i] = middle;
        xy[i] = up - middle;
        yz[i] = middle - down;
    }
}

static const float *middle(const struct fv_flip_filter *filter)
{
    return filter->weight + filter->radius;
}

void fv_flip_across(const struct fv_flip *flip, float *const channel[3], float *plane, ptrdiff_t stride,
                    int n)
{
    static const int channel_of[4] = {0, 1, 2, 2};
    for (int i = 0; i < 4; i++)
        fv_filter_across(plane + i * stride, channel[channel_of[i]], middle(&flip->sensitivity[i]),
                         flip->sensitivity[i].radius, n);
    for (int i = 0; i < 3; i++)
        fv_filter_across(plane + (4 + i) * stride, channel[0], middle(&flip->feature[i]),
                         flip->feature[i].radius, n);
}

/* Rows of filtered Y, X - Y and the two terms of Y - Z, to L, a, b in the first three. */
static void rows_to_lab(float *rows, ptrdiff_t stride, int n)
{
    float *restrict p = rows, *restrict q = rows + stride, *restrict r = rows + 2 * stride;
    const float *restrict s = rows + 3 * stride;
    for (int i = 0; i < n; i++) {
        float opponent[3] = {p[i], q[i], r[i] + s[i]}, rgb[3], lab[3];
        for (int k = 0; k < 3; k++)
            rgb[k] = clamp_unit(opponent[0] * rgb_of_opponent[k][0] + opponent[1] * rgb_of_opponent[k][1] +
                                opponent[2] * rgb_of_opponent[k][2]);
        lab_of(rgb[0], rgb[1], rgb[2], lab);
        p[i] = lab[0];
        q[i] = lab[1];
        r[i] = lab[2];
    }
}

/* out = |(p, q)|, which may be one of them. */
static void rows_to_length(const float *p, const float *q, float *out, int n)
{
    for (int i = 0; i < n; i++) out[i] = sqrtf(p[i] * p[i] + q[i] * q[i]);
}

void fv_flip_down(const struct fv_flip *flip, const float *const *row, ptrdiff_t offset, float *out,
                  ptrdiff_t stride, int n)
{
    /* Of a feature's two directions: the plane, and the filter that it still lacks. */
    static const struct {
        int plane, filter;
    } feature[4] = {{5, 0}, {4, 1}, {6, 0}, {4, 2}};
    const struct fv_flip_filter *filter = flip->sensitivity_down;
    for (int i = 0; i < 4; i++)
        fv_filter_down(out + i * stride, row, offset + i * stride, middle(&filter[i]), filter[i].radius, n);
    rows_to_lab(out, stride, n);
    filter = flip->feature;
    for (int i = 0; i < 4; i++) {
        const struct fv_flip_filter *f = &filter[feature[i].filter];
        fv_filter_down(out + (4 + i) * stride, row, offset + feature[i].plane * stride, middle(f), f->radius,
                       n);
    }
    rows_to_length(out + 4 * stride, out + 5 * stride, out + 3 * stride, n);
    rows_to_length(out + 6 * stride, out + 7 * stride, out + 4 * stride, n);
}

void fv_flip_judge(const struct fv_flip *flip, const float *reference, const float *test, ptrdiff_t stride,
                   float *restrict out, int n)
{
    const float *restrict p = reference, *restrict q = test;
    float most = flip->colour_max, bend = (float)p_c * most;
    float below = (float)p_t / bend, above = (1 - (float)p_t) / (most - bend);
    for (int i = 0; i < n; i++) {
        float a[5], b[5];
        for (int k = 0; k < 5; k++) {
            a[k] = p[k * stride + i];
            b[k] = q[k * stride + i];
        }
        float c = colour_difference(a, b);
        c = clamp_unit(c < bend ? c * below : (float)p_t + (c - bend) * above);
        float edge = fabsf(a[3] - b[3]), point = fabsf(a[4] - b[4]);
        float feature = clamp_unit(sqrtf((edge > point ? edge : point) * 0.707106781f)); /* q_f = 0.5 */
        out[i] = power(c, 1 - feature);
    }
}
