/* tracer: rays through Embree and what they see: the scene's acceleration structure and the
 * kernels that trace and shade lists of samples in packets as wide as the instruction set. */
#ifndef FV_TRACE_TRACER_H
#define FV_TRACE_TRACER_H

#include "platform/cpu.h"
#include "rt/fovea/view.h"
#include "rt/trace/visibility.h"

#include <embree3/rtcore.h>

/* Samples of a list: at most a tile's pixels. What stands behind the last one does not matter. */
enum { FV_SAMPLES_MAX = 1024 };

/* What leaves the tracer: radiances in [0, FV_RADIANCE_MAX], so that means of many are finite, and inverse
 * depths in [0, FV_INVERSE_DEPTH_MAX]. A sample that came out otherwise (a scene whose numbers overflow) is
 * black and of the inverse depth FV_DEPTH_UNKNOWN. It is not blended with anything: where history was
 * reprojected, that stays; elsewhere the black pixel stands for one frame and is no history for the next,
 * but for a part in the bilinear colours of those beside it. */
#define FV_RADIANCE_MAX 1e30f
#define FV_INVERSE_DEPTH_MAX 1e6f
#define FV_DEPTH_UNKNOWN (-1.0f)

/* What a sample says of the surface that it saw first: the number of the moving object (0: what stands
 * still), and whether history says less of it than of others. */
enum fv_surface {
    FV_SURFACE_OBJECT = 31,
    FV_SURFACE_GRAZING = 32, /* seen at a grazing angle: cosine to the optical axis below method.epsilon_grazing */
    FV_SURFACE_VIEW = 64,    /* what it shows moves otherwise than it does itself: a bent mirror, glass */
    FV_SURFACE_OLD = 128     /* of a support node: not traced in this frame */
};

/* What tells one surface from another (attributes of Kim et al. 2021, table 1), in 32 bits of `identity`: bits 0-15
 * what it is of, a material or a part of the fields, 0 where nothing was hit; 16-20 the moving object; and those below.
 * Beside it `facing`, its normal before a map bends it, 10 bits a component, x the lowest: 511 (n + 1) rounded. */
enum { FV_IDENTITY_OBJECT = 0x1fffff, FV_IDENTITY_SHADOWS_SHIFT = 21, FV_IDENTITY_SHADOWS = 31 << 21 /* lights whose shadow it lies in */ };
#define FV_IDENTITY_TEXTURED (1 << 26) /* those above are the user's */

struct fv_samples {
    int count;
    _Alignas(64) float x[FV_SAMPLES_MAX], y[FV_SAMPLES_MAX]; /* in: pixel coordinates (view.h) */
    _Alignas(64) float red[FV_SAMPLES_MAX], green[FV_SAMPLES_MAX], blue[FV_SAMPLES_MAX]; /* out: radiance */
    /* Out: 1/m along the optical axis; 0: nothing hit. Of what a flat mirror shows, that of the image behind it:
     * of the whole way there, so that it is reprojected as if it stood there. A material counts as a mirror
     * here where it mirrors more than it scatters; one that scatters more has its own depth and
     * FV_SURFACE_VIEW. */
    _Alignas(64) float inverse_depth[FV_SAMPLES_MAX];
    _Alignas(64) int32_t surface[FV_SAMPLES_MAX]; /* out: enum fv_surface */
    /* In: keep sampled light (area lights and, where there is ambient occlusion, ambient light) of what primary
     * rays hit apart, so that red = red of a picture without it, and red + albedo_red * light_red is the whole.
     * Out, only where asked for in a scene with FV_SCENE_STOCHASTIC: diffuse reflectance, in [0, 1], and
     * irradiance / pi, in [0, FV_RADIANCE_MAX]. Highlights of area lights stay in red, green and blue. */
    bool split;
    /* In: where rays begin in fields, by the ray parameter; as `starts` of struct fv_kernels gives them. */
    bool started;
    _Alignas(64) float start[FV_SAMPLES_MAX];
    /* In: tell surfaces apart. Out, only then: of the first hits and, in scenes with mirrors or glass, of what these mirror
     * or let through (what a surface does both with: the latter), 0 where there is no such. */
    bool identified;
    /* Out, only then: the triangle's record, -1 where what was hit moves, is masked or of no triangle; and of the scene's
     * first 32 lights those that reach it, a bit each. In where `known` is set: samples show these triangles' planes, lit by
     * these lights; no ray is traced but to sampled light and from mirrors and glass. */
    bool known;
    _Alignas(64) int32_t triangle[FV_SAMPLES_MAX], lit[FV_SAMPLES_MAX];
    _Alignas(64) int32_t identity[FV_SAMPLES_MAX], facing[FV_SAMPLES_MAX];
    _Alignas(64) int32_t second_identity[FV_SAMPLES_MAX], second_facing[FV_SAMPLES_MAX];
    /* In: of points and suns that have maps (visibility.h), what primary rays hit is lit by these, without shadow rays. */
    bool mapped;
    _Alignas(64) int32_t part[FV_SAMPLES_MAX]; /* out, where started and there are fields: which was hit; -1: none */
    /* In: `number` is which of its pixel's samples this one is: light is sampled otherwise than for the others. */
    bool numbered;
    _Alignas(64) int32_t number[FV_SAMPLES_MAX];
    /* In, of kernels that follow paths (path.h): how many from what each sample hits, of so many bounces, by this mask
     * (fv_noise). Base, albedo and light are then always kept apart: light is the mean of the paths, 0 where there are none.
     * Out: `variance`, that of the mean's (red + 2 green + blue) / 4, as the paths' differences tell of it.
     * Where `identified`, `facing` is the normal as a map bends it. */
    _Alignas(64) int32_t paths[FV_SAMPLES_MAX];
    /* In: light of points and suns that a pixel's paths need not draw, as they are no fewer than the lights, is part of red, green
     * and blue, albedo and all, and not of light; -n paths: that alone, as where there are n. */
    bool apart;
    int bounces;
    const float *noise;
    int fewer; /* in: sampled light takes this part of the settings' rays, 4 at least; 0 is 1: all */
    _Alignas(64) float albedo_red[FV_SAMPLES_MAX], albedo_green[FV_SAMPLES_MAX], albedo_blue[FV_SAMPLES_MAX];
    _Alignas(64) float light_red[FV_SAMPLES_MAX], light_green[FV_SAMPLES_MAX], light_blue[FV_SAMPLES_MAX];
    _Alignas(64) float variance[FV_SAMPLES_MAX];
};

/* What Embree hands the alpha test of a geometry: its first triangle's record. */
struct fv_masked {
    const struct fv_scene *scene;
    int64_t first;
};

/* A moving object and where it is. */
struct fv_instance {
    RTCScene scene;
    struct fv_masked masked;
    int32_t first, opaque;   /* triangle record = first + primID, of masked ones + opaque */
    float turn[3][3], at[3]; /* world = turn * own + at */
    float ball[4];           /* around it: centre, in the world, and radius; -1: it has no triangles */
};

/* How rays step through fields (field_march.h). */
enum fv_stepping { FV_STEPPING_PLAIN, FV_STEPPING_RELAXED, FV_STEPPING_BALINT };

struct fv_tracer {
    RTCDevice device;
    RTCScene scene;                /* of what stands still */
    int instances;
    struct fv_instance *instance;  /* of objects 1 to `instances`; the only thing here that frames change */
    struct fv_masked masked;
    const struct fv_scene *data;
    const struct fv_light *light; /* the scene's; where some move, `moved`, which fv_tracer_move puts in place */
    struct fv_light *moved;
    struct fv_visibility *visibility; /* maps of lights, once made; NULL: no light can have one */
    const float *noise;  /* fv_noise(), NULL where the scene has no light that is sampled */
    int64_t bytes;       /* of the acceleration structure and what else Embree holds of the scene */
    int depth, area_spp, ao_spp; /* settings of the section method */
    float ao_radius, epsilon_grazing;
    bool phong;          /* paths' first surfaces have Phong's lobe, not that of ggx.h */
    enum fv_stepping stepping;
    int march_steps;   /* that a ray takes through fields at most */
    float march_far;   /* m: rays end there in fields */
    bool culling;      /* of fields' parts, by packet */
    enum fv_isa isa;
};

/* Builds the acceleration structure, single-threaded, on the sealed-to-be heap. `isa`: the widest
 * set to use. Returns 0, or -1 with the error set. */
int fv_tracer_open(struct fv_tracer *tracer, const struct fv_scene *scene, const struct fv_config *config,
                   struct fv_error *error);
void fv_tracer_close(struct fv_tracer *tracer);

/* Puts the moving objects where they are for the rays that follow: pose[0] is that of object 1. All are where
 * they are at time 0 before. Not while rays are traced. */
void fv_tracer_move(const struct fv_tracer *tracer, const struct fv_pose *pose);

/* What Embree hands to the alpha test: the context, extended by the ray cone, and what marching wants. The footprint of a
 * hit at parameter t is base + t * growth (m). */
struct fv_ray_context {
    struct RTCIntersectContext embree; /* first */
    float base, growth;
    const float *start; /* of each lane, in fields; NULL: 0 */
    float left;         /* of the way, up to where fields may shadow it; negative: nowhere */
    const int32_t *own; /* of each lane, a part of the fields that the ray does not meet, -1: none; NULL: of no lane */
    const struct field_few *few; /* what of the fields rays may meet, NULL: anything (field_cull.h) */
    int64_t *rays;      /* where steps through fields are counted, by enum fv_ray_kind */
};

#endif
