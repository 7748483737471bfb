/* field_probe: the fields of a scene at points, on each instruction set. For tests only. */
#ifndef FV_TESTS_FIELD_PROBE_H
#define FV_TESTS_FIELD_PROBE_H

#include "rt/scene/field.h"

/* The least field of the parts first to last at n points, a multiple of 16. */
typedef void fv_field_probe(const struct fv_fields *fields, int first, int last, int n, const float *const at[3], float *out);

fv_field_probe fv_field_probe_base;
#ifdef __x86_64__
fv_field_probe fv_field_probe_avx2, fv_field_probe_avx512;
#endif

#endif
