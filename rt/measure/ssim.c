/* ssim: see ssim.h. Luma is kept around 0, where squares lose fewer digits; variances do not notice. */
#include "rt/measure/ssim.h"

#include "rt/measure/filter.h"

#include <math.h>

static const float middle_grey = 127.5f;

void fv_ssim_set(struct fv_ssim *ssim)
{
    double sum = 0, sigma = 1.5;
    for (int k = -FV_SSIM_RADIUS; k <= FV_SSIM_RADIUS; k++) sum += exp(-k * k / (2 * sigma * sigma));
    for (int k = -FV_SSIM_RADIUS; k <= FV_SSIM_RADIUS; k++)
        ssim->weight[k + FV_SSIM_RADIUS] = (float)(exp(-k * k / (2 * sigma * sigma)) / sum);
}

/* ITU-R BT.601. */
void fv_ssim_luma(const float *red, const float *green, const float *blue, float *restrict out, int n)
{
    for (int i = 0; i < n; i++) out[i] = 0.299f * red[i] + 0.587f * green[i] + 0.114f * blue[i] - middle_grey;
}

void fv_ssim_across(const struct fv_ssim *ssim, const float *reference, const float *test,
                    float *restrict squares, float *restrict product, float *plane, ptrdiff_t stride, int n)
{
    for (int i = -FV_SSIM_RADIUS; i < n + FV_SSIM_RADIUS; i++) {
        squares[i] = reference[i] * reference[i] + test[i] * test[i];
        product[i] = reference[i] * test[i];
    }
    const float *in[FV_SSIM_PLANES] = {reference, test, squares, product};
    for (int i = 0; i < FV_SSIM_PLANES; i++)
        fv_filter_across(plane + i * stride, in[i], ssim->weight + FV_SSIM_RADIUS, FV_SSIM_RADIUS, n);
}

bool fv_ssim_counts(int i, int n)
{
    int margin = n > 2 * FV_SSIM_RADIUS ? FV_SSIM_RADIUS : (n - 1) / 2;
    return i >= margin && i < n - margin;
}

void fv_ssim_down(const struct fv_ssim *ssim, const float *const *row, ptrdiff_t offset, float *scratch,
                  ptrdiff_t stride, float *restrict out, int n)
{
    const float c1 = 0.01f * 255 * 0.01f * 255, c2 = 0.03f * 255 * 0.03f * 255;
    for (int i = 0; i < FV_SSIM_PLANES; i++)
        fv_filter_down(scratch + i * stride, row, offset + i * stride, ssim->weight + FV_SSIM_RADIUS,
                       FV_SSIM_RADIUS, n);
    const float *restrict a = scratch, *restrict b = a + stride;
    const float *restrict squares = b + stride, *restrict product = squares + stride;
    for (int i = 0; i < n; i++) {
        float variances = squares[i] - (a[i] * a[i] + b[i] * b[i]), covariance = product[i] - a[i] * b[i];
        float p = a[i] + middle_grey, q = b[i] + middle_grey;
        out[i] = (2 * p * q + c1) * (2 * covariance + c2) / ((p * p + q * q + c1) * (variances + c2));
    }
}
