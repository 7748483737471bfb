/* ssim: structural similarity of Wang, Bovik, Sheikh and Simoncelli, "Image Quality Assessment: From
 * Error Visibility to Structural Similarity", IEEE TIP 2004: window of 11 x 11, Gaussian of sigma 1.5,
 * K1 = 0.01, K2 = 0.03, full scale 255; in steps of one row, as flip.h. */
#ifndef FV_MEASURE_SSIM_H
#define FV_MEASURE_SSIM_H

#include <stdbool.h>
#include <stddef.h>

enum { FV_SSIM_RADIUS = 5, FV_SSIM_PLANES = 4 };

struct fv_ssim {
    float weight[2 * FV_SSIM_RADIUS + 1];
};

void fv_ssim_set(struct fv_ssim *ssim);

/* out = luma, 0 to 255, less 127.5, of r, g, b from 0 to 255. */
void fv_ssim_luma(const float *red, const float *green, const float *blue, float *out, int n);

/* plane[i * stride + x], from both pictures' luma and two scratch rows; all of these reach FV_SSIM_RADIUS
 * elements beyond both ends. */
void fv_ssim_across(const struct fv_ssim *ssim, const float *reference, const float *test, float *squares,
                    float *product, float *plane, ptrdiff_t stride, int n);

/* True where the window around element i of n lies inside, and for the middle one or two of a short row. */
bool fv_ssim_counts(int i, int n);

/* SSIM of a row. row[k] + offset: the planes of the row k below; scratch: FV_SSIM_PLANES rows of `stride`. */
void fv_ssim_down(const struct fv_ssim *ssim, const float *const *row, ptrdiff_t offset, float *scratch,
                  ptrdiff_t stride, float *out, int n);

#endif
