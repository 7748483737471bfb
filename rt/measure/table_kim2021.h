/* table_kim2021: the sections that the table kim2021 is made of, a file each. */
#ifndef FV_MEASURE_TABLE_KIM2021_H
#define FV_MEASURE_TABLE_KIM2021_H

#include "rt/measure/table.h"
#include "rt/measure/vantage.h"

/* Adds the cells of its part, as struct fv_table's. */
typedef int fv_kim2021_section(const char *scene, const struct fv_table_bench *bench, struct fv_sheet *sheet);
fv_kim2021_section fv_kim2021_speed;     /* Table 2: table_kim2021_speed.c */
fv_kim2021_section fv_kim2021_smoothing; /* Table 3: table_kim2021_history.c */
fv_kim2021_section fv_kim2021_reuse;     /* Figure 6 */
fv_kim2021_section fv_kim2021_tolerance; /* Figure 7: table_kim2021_samples.c */
fv_kim2021_section fv_kim2021_density;   /* Figure 8 */

/* Cells psnr_fovea, psnr_para, ... of a row: the medians over `places` of psnr[place][zone], and the paper's,
 * as many of them as `known`, from the fovea on. */
void fv_kim2021_add_psnr(struct fv_sheet *sheet, const char *row, const double *paper, int known,
                         double (*psnr)[FV_ZONES], int places);

#endif
