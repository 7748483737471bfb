/* alpha: see alpha.h. Nearest texel of the nearest level: coverage is kept from level to level
 * when the texture is made, so that leaves do not thin out with distance. */
#include "rt/trace/alpha.h"

#include "rt/trace/tracer.h"

#include <math.h>

static int level_of(const struct fv_texture *t, float texels)
{
    if (!(texels > 1)) return 0;
    int level = (int)(ilogbf(texels * 1.4142f));
    return level < t->levels ? level : t->levels - 1;
}

/* Index of a coordinate in a row of `size` (a power of two) texels; 0 where the coordinate is not finite. */
static int wrap(float coordinate, int size)
{
    float f = coordinate - floorf(coordinate);
    if (!(f >= 0)) return 0;
    return (int)(f * (float)size) & (size - 1);
}

static bool covered(const struct fv_masked *masked, unsigned primitive, float u, float v, float footprint)
{
    const struct fv_scene *s = masked->scene;
    const struct fv_triangle *r = &s->triangle[masked->first + primitive];
    const struct fv_material *m = &s->material[r->material];
    if (m->alpha_texture < 0) return true;
    const struct fv_texture *t = &s->texture[m->alpha_texture];
    float w = 1 - u - v;
    float tu = w * r->uv[0][0] + u * r->uv[1][0] + v * r->uv[2][0];
    float tv = w * r->uv[0][1] + u * r->uv[1][1] + v * r->uv[2][1];
    int level = level_of(t, footprint * r->uv_per_metre * sqrtf((float)t->width * (float)t->height));
    int width = t->width >> level ? t->width >> level : 1, height = t->height >> level ? t->height >> level : 1;
    uint32_t texel = t->texel[t->offset[level] + (uint32_t)(wrap(tv, height) * (width + 1) + wrap(tu, width))];
    return (float)texel >= m->alpha_cutoff * 255.0f;
}

/* Rows of Embree's RTCRayN and RTCHitN, each N wide (its accessors exist in C++ only). */
enum { RAY_TFAR = 8, HIT_U = 3, HIT_V = 4, HIT_PRIMITIVE = 5 };

void fv_alpha_test(const struct RTCFilterFunctionNArguments *a)
{
    const struct fv_masked *masked = a->geometryUserPtr;
    const struct fv_ray_context *context = (const struct fv_ray_context *)a->context;
    const float *t = (const float *)a->ray + RAY_TFAR * a->N, *hit = (const float *)a->hit;
    const unsigned *primitive = (const unsigned *)a->hit + HIT_PRIMITIVE * a->N;
    for (unsigned i = 0; i < a->N; i++) {
        if (!a->valid[i]) continue;
        float footprint = context->base + t[i] * context->growth;
        if (!covered(masked, primitive[i], hit[HIT_U * a->N + i], hit[HIT_V * a->N + i], footprint)) a->valid[i] = 0;
    }
}
