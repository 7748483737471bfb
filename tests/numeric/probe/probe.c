/* probe: see probe.h; compiled once for each instruction set. */
#include "tests/numeric/probe/probe.h"

#include "rt/trace/ggx.h"
#include "rt/trace/light.h"
#include "rt/trace/refraction.h"

#define probes FV_ISA_NAME(fv_probes)
#define EACH for (int i = 0; i < n; i += FV_WIDTH)
#define IN(row) vf_load(in[row] + i)
#define IN3(row) ((vf3){IN(row), IN((row) + 1), IN((row) + 2)})
#define UP ((vf3){vf_of(0), vf_of(1), vf_of(0)})

static void store3(float *const *out, int row, int i, vf3 v)
{
    vf_store(out[row] + i, v.x);
    vf_store(out[row + 1] + i, v.y);
    vf_store(out[row + 2] + i, v.z);
}

static void probe_log2(const struct fv_texture *texture, const float *const *in, float *const *out, int n)
{
    (void)texture;
    EACH vf_store(out[0] + i, vf_log2(IN(0)));
}

static void probe_exp2(const struct fv_texture *texture, const float *const *in, float *const *out, int n)
{
    (void)texture;
    EACH vf_store(out[0] + i, vf_exp2(IN(0)));
}

static void probe_normalise(const struct fv_texture *texture, const float *const *in, float *const *out,
                            int n)
{
    (void)texture;
    EACH store3(out, 0, i, vf3_normalise(IN3(0), UP));
}

static void probe_refract(const struct fv_texture *texture, const float *const *in, float *const *out, int n)
{
    (void)texture;
    EACH
    {
        struct refraction r = refract(IN3(0), UP, IN(3), IN(4) > 0.5f);
        vf_store(out[0] + i, r.reflectance);
        vf_store(out[1] + i, vf_select(r.through, vf_of(1), vf_of(0)));
        store3(out, 2, i, r.beyond);
    }
}

static void probe_phong(const struct fv_texture *texture, const float *const *in, float *const *out, int n)
{
    (void)texture;
    EACH
    {
        struct surface s = {.normal = UP, .specular = {vf_of(1), vf_of(1), vf_of(1)}, .shininess = IN(6)};
        vf_store(out[0] + i, phong(&s, IN3(0), IN3(3), vf_max(IN(4), vf_of(0)), true).x);
    }
}

static void probe_place(const struct fv_texture *texture, const float *const *in, float *const *out, int n)
{
    EACH
    {
        struct texel_place p = place_texels(texture, IN(0), IN(1), IN(2));
        vf_store(out[0] + i, fetch(texture->texel, &p).x);
        vf_store(out[1] + i, vf_from(p.upper));
        vf_store(out[2] + i, vf_from(p.lower));
    }
}

static void probe_bend(const struct fv_texture *texture, const float *const *in, float *const *out, int n)
{
    (void)texture;
    EACH
    {
        struct surface s = {.normal = UP, .bump_scale = IN(3), .flags = vi_of(FV_MATERIAL_NORMAL_MAPPED)};
        s.in.tangent = IN3(4);
        s.in.bitangent_sign = IN(7);
        bend_normal(&s, IN3(0));
        store3(out, 0, i, s.normal);
    }
}

static void probe_sample(const struct fv_texture *texture, const float *const *in, float *const *out, int n)
{
    (void)texture;
    EACH
    {
        struct shading s = {.random1 = IN(0), .random2 = IN(1)};
        vf a, b;
        place_sample(&s, (int)in[2][i], (int)in[3][i], &a, &b);
        vf_store(out[0] + i, a);
        vf_store(out[1] + i, b);
    }
}

static void probe_turn(const struct fv_texture *texture, const float *const *in, float *const *out, int n)
{
    (void)texture;
    EACH
    {
        vf sine, cosine;
        vf_turn(IN(0), &sine, &cosine);
        vf_store(out[0] + i, sine);
        vf_store(out[1] + i, cosine);
    }
}

static void probe_basis(const struct fv_texture *texture, const float *const *in, float *const *out, int n)
{
    (void)texture;
    EACH
    {
        vf3 across, along;
        basis(IN3(0), &across, &along);
        store3(out, 0, i, across);
        store3(out, 3, i, along);
    }
}

static void probe_ggx(const struct fv_texture *texture, const float *const *in, float *const *out, int n)
{
    (void)texture;
    EACH
    {
        struct gloss g = ggx(ggx_square(IN(6)), UP, ggx_view(UP, IN3(0)), IN3(3));
        vf_store(out[0] + i, g.lobe);
        vf_store(out[1] + i, g.density);
        vf_store(out[2] + i, g.edge);
    }
}

static void probe_ggx_way(const struct fv_texture *texture, const float *const *in, float *const *out, int n)
{
    (void)texture;
    EACH store3(out, 0, i, ggx_way(ggx_square(IN(3)), UP, ggx_view(UP, IN3(0)), IN(4), IN(5)));
}

fv_probe_function *const probes[PROBES] = {
    [PROBE_LOG2] = probe_log2,       [PROBE_EXP2] = probe_exp2,   [PROBE_NORMALISE] = probe_normalise,
    [PROBE_REFRACT] = probe_refract, [PROBE_PHONG] = probe_phong, [PROBE_PLACE] = probe_place,
    [PROBE_BEND] = probe_bend,       [PROBE_SAMPLE] = probe_sample, [PROBE_TURN] = probe_turn,
    [PROBE_BASIS] = probe_basis,
    [PROBE_GGX] = probe_ggx,
    [PROBE_GGX_WAY] = probe_ggx_way};
