/* metrics: SSIM and FLIP against their definitions, worked out in double by direct two-dimensional sums. */
#include "tests/support/judged.h"

static double channel_at(const uint8_t *pixels, const struct judged *j, int x, int y, int k)
{
    return pixels[3 * (y * j->width + x) + k];
}

static int mirrored(int i, int n)
{
    while (i < 0 || i >= n) i = i < 0 ? -1 - i : 2 * n - 1 - i;
    return i;
}

static int clamped(int i, int n)
{
    return i < 0 ? 0 : i >= n ? n - 1 : i;
}

static double luma_at(const uint8_t *pixels, const struct judged *j, int x, int y)
{
    x = mirrored(x, j->width);
    y = mirrored(y, j->height);
    return 0.299 * channel_at(pixels, j, x, y, 0) + 0.587 * channel_at(pixels, j, x, y, 1) +
           0.114 * channel_at(pixels, j, x, y, 2);
}

static double ssim_at(const struct judged *j, int x, int y)
{
    double weights = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    for (int v = -5; v <= 5; v++)
        for (int u = -5; u <= 5; u++) {
            double w = exp(-(u * u + v * v) / (2 * 1.5 * 1.5));
            double p = luma_at(j->reference, j, x + u, y + v), q = luma_at(j->test, j, x + u, y + v);
            weights += w;
            a += w * p;
            b += w * q;
            aa += w * p * p;
            bb += w * q * q;
            ab += w * p * q;
        }
    a /= weights;
    b /= weights;
    double c1 = 0.01 * 255 * 0.01 * 255, c2 = 0.03 * 255 * 0.03 * 255;
    return (2 * a * b + c1) * (2 * (ab / weights - a * b) + c2) /
           ((a * a + b * b + c1) * (aa / weights - a * a + bb / weights - b * b + c2));
}

static double direct_ssim(const struct judged *j)
{
    int across = j->width >= 11 ? 5 : (j->width - 1) / 2, down = j->height >= 11 ? 5 : (j->height - 1) / 2;
    int n = 0;
    double sum = 0;
    for (int y = down; y < j->height - down; y++)
        for (int x = across; x < j->width - across; x++, n++) sum += ssim_at(j, x, y);
    return sum / n;
}

/* Linear RGB to XYZ as the sRGB standard's primaries give it, in the fractions of FLIP's authors. */
static const double xyz_of_rgb[3][3] = {
    {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
    {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
    {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382},
};
static const double rgb_of_xyz[3][3] = {
    {3.241003232976358, -1.537398969488785, -0.498615881996363},
    {-0.969224252202516, 1.875929983695176, 0.041554226340085},
    {0.055639419851975, -0.204011206123910, 1.057148977187533},
};

static void transform(const double m[3][3], const double in[3], double out[3])
{
    double v[3] = {in[0], in[1], in[2]};
    for (int i = 0; i < 3; i++) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

static void white(double out[3])
{
    transform(xyz_of_rgb, (double[3]){1, 1, 1}, out);
}

static void ycxcz_at(const uint8_t *pixels, const struct judged *j, int x, int y, double out[3])
{
    double rgb[3], xyz[3], w[3];
    for (int k = 0; k < 3; k++) {
        double s = channel_at(pixels, j, clamped(x, j->width), clamped(y, j->height), k) / 255;
        rgb[k] = s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
    }
    transform(xyz_of_rgb, rgb, xyz);
    white(w);
    out[0] = 116 * xyz[1] / w[1] - 16;
    out[1] = 500 * (xyz[0] / w[0] - xyz[1] / w[1]);
    out[2] = 200 * (xyz[1] / w[1] - xyz[2] / w[2]);
}

static void hunt_lab(const double rgb[3], double lab[3])
{
    double xyz[3], w[3], f[3];
    transform(xyz_of_rgb, rgb, xyz);
    white(w);
    for (int i = 0; i < 3; i++) {
        double t = xyz[i] / w[i], d = 6.0 / 29;
        f[i] = t > d * d * d ? cbrt(t) : t / (3 * d * d) + 4.0 / 29;
    }
    lab[0] = 116 * f[1] - 16;
    lab[1] = 0.01 * lab[0] * 500 * (f[0] - f[1]);
    lab[2] = 0.01 * lab[0] * 200 * (f[1] - f[2]);
}

/* The picture as the viewer's eye passes it on, at one pixel. */
static void seen_at(const uint8_t *pixels, const struct judged *j, int x, int y, double ppd, double lab[3])
{
    static const double a[3][2] = {{1, 0}, {1, 0}, {34.1, 13.5}};
    static const double b[3][2] = {{0.0047, 1e-5}, {0.0053, 1e-5}, {0.04, 0.025}};
    int radius = (int)ceil(3 * sqrt(0.04 / (2 * M_PI * M_PI)) * ppd);
    double sum[3] = {0}, weights[3] = {0}, c[3], w[3], rgb[3];
    for (int v = -radius; v <= radius; v++)
        for (int u = -radius; u <= radius; u++) {
            double d2 = (u * u + v * v) / (ppd * ppd);
            ycxcz_at(pixels, j, x + u, y + v, c);
            for (int k = 0; k < 3; k++) {
                double g = 0;
                for (int i = 0; i < 2; i++)
                    g += a[k][i] * sqrt(M_PI / b[k][i]) * exp(-M_PI * M_PI * d2 / b[k][i]);
                sum[k] += g * c[k];
                weights[k] += g;
            }
        }
    for (int k = 0; k < 3; k++) c[k] = sum[k] / weights[k];
    white(w);
    double luminance = (c[0] + 16) / 116;
    double xyz[3] = {w[0] * (c[1] / 500 + luminance), w[1] * luminance, w[2] * (luminance - c[2] / 200)};
    transform(rgb_of_xyz, xyz, rgb);
    for (int k = 0; k < 3; k++) rgb[k] = fmin(fmax(rgb[k], 0), 1);
    hunt_lab(rgb, lab);
}

/* Strength of edges (order 1) or points (order 2) at one pixel: the length over both directions. */
static double feature_at(const uint8_t *pixels, const struct judged *j, int x, int y, double ppd, int order)
{
    double sigma = 0.5 * 0.082 * ppd, length2 = 0;
    int radius = (int)ceil(3 * sigma);
    for (int direction = 0; direction < 2; direction++) {
        double part[2] = {0}, weights[2] = {0}, c[3];
        for (int v = -radius; v <= radius; v++)
            for (int u = -radius; u <= radius; u++) {
                double t = direction ? v : u, g = exp(-(u * u + v * v) / (2 * sigma * sigma));
                double w = order == 1 ? -t * g : (t * t / (sigma * sigma) - 1) * g;
                ycxcz_at(pixels, j, x + u, y + v, c);
                part[w < 0] += w * (c[0] + 16) / 116;
                weights[w < 0] += fabs(w);
            }
        double value = part[0] / weights[0] + part[1] / weights[1];
        length2 += value * value;
    }
    return sqrt(length2);
}

static double hyab(const double a[3], const double b[3])
{
    return fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]);
}

static double flip_at(const struct judged *j, int x, int y, double ppd)
{
    double green[3], blue[3], a[3], b[3];
    hunt_lab((double[3]){0, 1, 0}, green);
    hunt_lab((double[3]){0, 0, 1}, blue);
    seen_at(j->reference, j, x, y, ppd, a);
    seen_at(j->test, j, x, y, ppd, b);
    double most = pow(hyab(green, blue), 0.7), c = pow(hyab(a, b), 0.7), bend = 0.4 * most;
    c = c < bend ? 0.95 / bend * c : 0.95 + (c - bend) / (most - bend) * 0.05;
    double edge = fabs(feature_at(j->reference, j, x, y, ppd, 1) - feature_at(j->test, j, x, y, ppd, 1));
    double point = fabs(feature_at(j->reference, j, x, y, ppd, 2) - feature_at(j->test, j, x, y, ppd, 2));
    return pow(c, 1 - sqrt(fmax(edge, point) / sqrt(2)));
}

static const struct {
    int width, height;
    double ppd;
    int contrast, error;
} pictures[] = {
    {1, 1, 67, 50, 50},     {11, 1, 20, 50, 20}, {1, 13, 20, 90, 3},    {2, 2, 3, 10, 100},
    {10, 12, 12, 127, 255}, {11, 11, 8, 30, 30}, {17, 16, 33.3, 60, 5}, {33, 9, 1.7, 200, 60},
    {24, 20, 20, 4, 1},     {12, 12, 67, 0, 40}, {40, 3, 12, 255, 0},   {16, 15, 5, 1, 255},
};

static void judge_case(struct judged *j, unsigned i)
{
    judged_noise(j, pictures[i].width, pictures[i].height, i + 1, pictures[i].contrast, pictures[i].error);
    judge(j, pictures[i].ppd, NULL);
}

static void ssim_is_its_definition(void **state)
{
    static struct judged j;
    double worst = 0;
    (void)state;
    for (unsigned i = 0; i < sizeof pictures / sizeof pictures[0]; i++) {
        judge_case(&j, i);
        double expected = direct_ssim(&j);
        worst = fmax(worst, fabs(j.errors.ssim[FV_ZONE_ALL] - expected));
        check_near("ssim", j.errors.ssim[FV_ZONE_ALL], expected, 1e-4);
    }
    printf("largest difference of SSIM from its definition: %.2g\n", worst);
}

static void flip_is_its_definition(void **state)
{
    static struct judged j;
    double worst = 0;
    (void)state;
    for (unsigned i = 0; i < sizeof pictures / sizeof pictures[0]; i++) {
        judge_case(&j, i);
        for (int y = 0; y < j.height; y++)
            for (int x = 0; x < j.width; x++) {
                double expected = flip_at(&j, x, y, pictures[i].ppd), value = (double)j.flip[y * j.width + x];
                worst = fmax(worst, fabs(value - expected));
                if (!(fabs(value - expected) <= 1e-4))
                    fail_msg("%d x %d at %g: (%d, %d): %.7f, must be %.7f", j.width, j.height,
                             pictures[i].ppd, x, y, value, expected);
            }
    }
    printf("largest difference of FLIP from its definition: %.2g\n", worst);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ssim_is_its_definition),
        cmocka_unit_test(flip_is_its_definition),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
