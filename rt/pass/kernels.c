/* kernels: collects what the instruction sets' copies of the *_kernel.c files export. */
#include "rt/pass/kernels.h"

#include <assert.h>

#define DECLARE(isa)                                                                                             \
    void fv_trace_samples_##isa(const struct fv_tracer *, const struct fv_view *, struct fv_samples *, uint32_t, \
                                int64_t *);                                                                      \
    void fv_pixel_encode_##isa(const float *, const float *, const float *, float, uint32_t *, int);             \
    void fv_reproject_##isa(struct fv_reproject_tile *);                                                         \
    void fv_pixel_present_##isa(const uint32_t *, uint8_t *, int);
#define ROW(isa) {fv_trace_samples_##isa, fv_pixel_encode_##isa, fv_reproject_##isa, fv_pixel_present_##isa}

DECLARE(base)
#ifdef __x86_64__
DECLARE(avx2)
DECLARE(avx512)
#endif

static const struct fv_kernels table[FV_ISA_COUNT] = {
    [FV_ISA_BASE] = ROW(base),
#ifdef __x86_64__
    [FV_ISA_AVX2] = ROW(avx2),
    [FV_ISA_AVX512] = ROW(avx512),
#endif
};

const struct fv_kernels *fv_kernels(enum fv_isa isa)
{
    assert(table[isa].trace);
    return &table[isa];
}
