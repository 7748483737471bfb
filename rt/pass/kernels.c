/* kernels: collects what the instruction sets' copies of the *_kernel.c files export. */
#include "rt/pass/kernels.h"

#include <assert.h>

#define TRACE(name, isa)                                                                                        \
    void name##_##isa(const struct fv_tracer *, const struct fv_view *, struct fv_samples *, uint32_t, int64_t *);
#define DECLARE(isa)                                                                                             \
    TRACE(fv_trace_plain, isa)                                                                                   \
    TRACE(fv_trace_textured, isa)                                                                                \
    TRACE(fv_trace_mirrored, isa)                                                                                \
    TRACE(fv_trace_all, isa)                                                                                     \
    TRACE(fv_trace_moving, isa)                                                                                  \
    TRACE(fv_trace_fields, isa)                                                                                  \
    TRACE(fv_trace_paths, isa)                                                                                   \
    TRACE(fv_trace_paths_textured, isa)                                                                          \
    void fv_field_starts_##isa(const struct fv_tracer *, const struct fv_view *, struct fv_samples *, float,     \
                               int64_t *);                                                                       \
    TRACE(fv_trace_samples, isa)                                                                                 \
    fv_map_row fv_map_row_##isa;                                                                                 \
    void fv_pixel_encode_##isa(const float *, const float *, const float *, float, uint32_t *, int);             \
    void fv_pixel_encode_light_##isa(const float *, const float *, const float *, float, uint32_t *, int);       \
    void fv_pixel_encode_albedo_##isa(const float *, const float *, const float *, uint32_t *, int);             \
    void fv_pixel_compose_##isa(const uint32_t *, const uint32_t *, const uint32_t *, uint32_t *, int);          \
    void fv_reproject_##isa(struct fv_reproject_tile *);                                                         \
    void fv_pyramid_carry_##isa(struct fv_carry *);                                                              \
    void fv_test_corners_##isa(struct fv_corners *);                                                             \
    void fv_resolve_##isa(const struct fv_resolve *);                                                            \
    void fv_smooth_##isa(const struct fv_smooth *);                                                              \
    void fv_reuse_##isa(struct fv_reuse *);                                                                      \
    void fv_atrous_##isa(const struct fv_atrous *);                                                              \
    void fv_accumulate_##isa(struct fv_accumulate *);                                                            \
    void fv_pack_light_##isa(const float *, const float *, const float *, float, uint32_t *, int);               \
    void fv_unpack_light_##isa(const uint32_t *, float *, float *, float *, int);                                \
    void fv_even_out_##isa(struct fv_variances *);                                                              \
    void fv_light_up_##isa(const uint32_t *, const uint32_t *, const float *, const float *, const float *,      \
                           uint32_t *, int);                                                                     \
    void fv_pixel_decode_##isa(const uint32_t *, float *, float *, float *, int);                                \
    void fv_pyramid_contrast_##isa(struct fv_contrast *);                                                        \
    void fv_pyramid_repaint_##isa(const struct fv_repaint *);                                                    \
    void fv_support_answer_##isa(struct fv_support_packet *);                                                    \
    void fv_merge_##isa(const struct fv_merge *);                                                                \
    void fv_bounds_##isa(const uint32_t *, int64_t, int, uint32_t, float *, float *);                            \
    void fv_halve_##isa(const uint32_t *, const uint32_t *, uint32_t *, int);                                    \
    void fv_double_row_##isa(const uint32_t *, const uint32_t *, uint32_t *, int);                              \
    void fv_fringe_##isa(const struct fv_fringe_row *);                                                          \
    void fv_turn_##isa(const struct fv_turn_square *);                                                           \
    void fv_pixel_present_##isa(const uint32_t *, uint8_t *, int);
/* Rows of the coarsest tiles are 8 pixels: `narrow` are kernels that take no more at a time. */
#define ROW(trace_, paths_, isa, narrow)                                                                         \
    {                                                                                                            \
        .trace = trace_##_##isa, .paths = paths_##_##isa, .starts = fv_field_starts_##isa,                                       \
        .map_row = fv_map_row_##isa, .encode = fv_pixel_encode_##isa,                                                                         \
        .encode_light = fv_pixel_encode_light_##isa,                                                             \
        .encode_albedo = fv_pixel_encode_albedo_##isa, .compose = fv_pixel_compose_##isa,                        \
        .reproject = {fv_reproject_##isa, fv_reproject_##isa, fv_reproject_##narrow}, .merge = fv_merge_##isa,   \
        .bounds = {fv_bounds_##isa, fv_bounds_##isa, fv_bounds_##narrow}, .answer = fv_support_answer_##isa,     \
        .test_corners = fv_test_corners_##isa, .resolve = fv_resolve_##isa, .decode = fv_pixel_decode_##isa,     \
        .carry = {fv_pyramid_carry_##isa, fv_pyramid_carry_##isa, fv_pyramid_carry_##narrow},                    \
        .contrast = fv_pyramid_contrast_##isa, .repaint = fv_pyramid_repaint_##isa,                              \
        .smooth = fv_smooth_##isa, .reuse = fv_reuse_##isa,                                                      \
        .atrous = fv_atrous_##isa, .pack_light = fv_pack_light_##isa, .unpack_light = fv_unpack_light_##isa,     \
        .even_out = fv_even_out_##isa, .light_up = fv_light_up_##isa, .accumulate = fv_accumulate_##isa,           \
        .halve = fv_halve_##isa, .double_row = fv_double_row_##isa, .present = fv_pixel_present_##isa,           \
        .fringe = fv_fringe_##isa, .turn = fv_turn_##isa                                                         \
    }
#define ROWS(isa, narrow)                                                                                        \
    {                                                                                                            \
        [FV_VARIANT_PLAIN] = ROW(fv_trace_plain, fv_trace_paths_textured, isa, narrow),                          \
        [FV_VARIANT_TEXTURED] = ROW(fv_trace_textured, fv_trace_paths_textured, isa, narrow),                    \
        [FV_VARIANT_MIRRORED] = ROW(fv_trace_mirrored, fv_trace_paths, isa, narrow),                             \
        [FV_VARIANT_ALL] = ROW(fv_trace_all, fv_trace_paths, isa, narrow),                                       \
        [FV_VARIANT_MOVING] = ROW(fv_trace_moving, fv_trace_paths, isa, narrow),                                 \
        [FV_VARIANT_FIELDS] = ROW(fv_trace_fields, fv_trace_paths, isa, narrow),                                 \
        [FV_VARIANT_EVERYTHING] = ROW(fv_trace_samples, fv_trace_paths, isa, narrow),                            \
    }

DECLARE(base)
#ifdef __x86_64__
DECLARE(avx2)
DECLARE(avx512)
#endif

static const struct fv_kernels table[FV_ISA_COUNT][FV_VARIANTS] = {
    [FV_ISA_BASE] = ROWS(base, base),
#ifdef __x86_64__
    [FV_ISA_AVX2] = ROWS(avx2, avx2),
    [FV_ISA_AVX512] = ROWS(avx512, avx2),
#endif
};

const struct fv_kernels *fv_kernels_for(enum fv_isa isa, enum fv_variant variant)
{
    assert(table[isa][variant].trace);
    return &table[isa][variant];
}

const struct fv_kernels *fv_kernels(enum fv_isa isa)
{
    return fv_kernels_for(isa, FV_VARIANT_EVERYTHING);
}
