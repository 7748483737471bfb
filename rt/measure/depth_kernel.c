/* depth_kernel: ways to interpolate depth between the nodes of a coarse grid; see depth.h. Plain loops,
 * their length known where they are compiled. */
#include "rt/measure/depth.h"
#include "rt/trace/simd.h"

#define methods FV_ISA_NAME(fv_depth_methods)
extern const struct fv_depth_method methods[FV_DEPTH_METHODS];

static inline float larger(float a, float b)
{
    return a > b ? a : b;
}

/* What stands for the depth of a node that hit nothing, m. */
static const float far_m = 1e6f;

static inline float metres(float w)
{
    return 1.0f / larger(w, 1.0f / far_m);
}

static inline __attribute__((always_inline)) void nearest(const struct fv_depth_span *s, int spacing)
{
    const float *restrict node = s->down < 0.5f ? s->upper : s->lower;
    float *restrict out = s->out;
    for (int r = 0; r < s->runs; r++, out += spacing) {
        float left = node[r], right = node[r + 1];
        for (int i = 0; i < spacing; i++) out[i] = i < spacing / 2 ? left : right;
    }
}

static inline __attribute__((always_inline)) void inverse(const struct fv_depth_span *s, int spacing)
{
    const float *restrict upper = s->upper, *restrict lower = s->lower;
    float *restrict out = s->out;
    for (int r = 0; r < s->runs; r++, out += spacing) {
        float left = upper[r] + (lower[r] - upper[r]) * s->down;
        float step = upper[r + 1] + (lower[r + 1] - upper[r + 1]) * s->down - left;
        for (int i = 0; i < spacing; i++) out[i] = left + step * (((float)i + 0.5f) / (float)spacing);
    }
}

static inline __attribute__((always_inline)) void linear(const struct fv_depth_span *s, int spacing)
{
    const float *restrict upper = s->upper, *restrict lower = s->lower;
    float *restrict out = s->out;
    for (int r = 0; r < s->runs; r++, out += spacing) {
        float a = metres(upper[r]), b = metres(upper[r + 1]);
        float left = a + (metres(lower[r]) - a) * s->down;
        float step = b + (metres(lower[r + 1]) - b) * s->down - left;
        for (int i = 0; i < spacing; i++)
            out[i] = 1.0f / (left + step * (((float)i + 0.5f) / (float)spacing));
    }
}

static inline __attribute__((always_inline)) void front(const struct fv_depth_span *s, int spacing)
{
    const float *restrict upper = s->upper, *restrict lower = s->lower;
    float *restrict out = s->out;
    for (int r = 0; r < s->runs; r++, out += spacing) {
        float w = larger(larger(upper[r], upper[r + 1]), larger(lower[r], lower[r + 1]));
        for (int i = 0; i < spacing; i++) out[i] = w;
    }
}

#define ROW(name)                                         \
    static void name##_row(const struct fv_depth_span *s) \
    {                                                     \
        if (s->spacing == 4) name(s, 4);                  \
        else if (s->spacing == 8) name(s, 8);             \
        else name(s, 16);                                 \
    }
ROW(nearest)
ROW(inverse)
ROW(linear)
ROW(front)

const struct fv_depth_method methods[FV_DEPTH_METHODS] = {
    [FV_DEPTH_NEAREST] = {"nearest node", nearest_row},
    [FV_DEPTH_INVERSE] = {"bilinear in inverse depth", inverse_row},
    [FV_DEPTH_LINEAR] = {"bilinear in depth", linear_row},
    [FV_DEPTH_FRONT] = {"nearest of four", front_row},
};
