/* builtin_pipes_steel: columns, beams, gratings, railings and ladders; see builtin_pipes.h. */
#include "rt/scene/builtin_pipes.h"

#include "rt/scene/builtin_random.h"

#include <math.h>

#define STOREY (FV_PIPES_STOREY * FV_PIPES_CELL)
#define LENGTH (FV_PIPES_NX * FV_PIPES_CELL / 2) /* half the structure's */
#define WIDTH (FV_PIPES_NZ * FV_PIPES_CELL / 2)
#define DECK 0.035f /* thickness of a grating */

static const int bridges[] = {19, 39}; /* the first of a bridge's two cells along x */
static const int ladders[] = {11, 31, 51};
enum {
    BRIDGES = sizeof bridges / sizeof bridges[0],
    LADDERS = sizeof ladders / sizeof ladders[0],
    LADDER_Z = FV_PIPES_AISLE - 1
};

void fv_pipes_reserve(struct fv_pipes *pipes)
{
    const int clear[3] = {FV_PIPES_NX, 2, 2}, across[3] = {2, 2, FV_PIPES_NZ},
              climb[3] = {1, 2 * FV_PIPES_STOREY + 2, 1};
    const int column[3] = {1, FV_PIPES_NY, 1}, beam_x[3] = {FV_PIPES_NX, 1, 1},
              beam_z[3] = {1, 1, FV_PIPES_NZ};
    for (int storey = 1; storey <= FV_PIPES_STOREYS; storey++) {
        int y = storey * FV_PIPES_STOREY - 1;
        for (int z = FV_PIPES_BAY_COLUMN; z < FV_PIPES_NZ; z += FV_PIPES_BAY)
            fv_pipes_claim(pipes, (const int[3]){0, y, z}, beam_x, FV_PIPES_STRUCTURE);
        for (int x = FV_PIPES_BAY_COLUMN; x < FV_PIPES_NX; x += FV_PIPES_BAY)
            fv_pipes_claim(pipes, (const int[3]){x, y, 0}, beam_z, FV_PIPES_STRUCTURE);
    }
    for (int x = FV_PIPES_BAY_COLUMN; x < FV_PIPES_NX; x += FV_PIPES_BAY)
        for (int z = FV_PIPES_BAY_COLUMN; z < FV_PIPES_NZ; z += FV_PIPES_BAY)
            fv_pipes_claim(pipes, (const int[3]){x, 0, z}, column, FV_PIPES_STRUCTURE);
    for (int storey = 0; storey < FV_PIPES_STOREYS; storey++)
        fv_pipes_claim(pipes, (const int[3]){0, storey * FV_PIPES_STOREY, FV_PIPES_AISLE}, clear,
                       FV_PIPES_WALKWAY);
    for (int i = 0; i < BRIDGES; i++)
        fv_pipes_claim(pipes, (const int[3]){bridges[i], FV_PIPES_STOREY, 0}, across, FV_PIPES_WALKWAY);
    for (int i = 0; i < LADDERS; i++)
        fv_pipes_claim(pipes, (const int[3]){ladders[i], 0, LADDER_Z}, climb, FV_PIPES_WALKWAY);
}

/* An I-section `length` along x from the brush's origin, its top at y = 0. */
static void beam(const struct fv_brush *brush, float length, float depth, float width)
{
    float w = width / 2, flange = 0.018f, web = 0.006f;
    fv_shape_box(brush, fv_vec(0, -flange, -w), fv_vec(length, 0, w));
    fv_shape_box(brush, fv_vec(0, -depth, -w), fv_vec(length, flange - depth, w));
    fv_shape_box(brush, fv_vec(0, flange - depth, -web), fv_vec(length, -flange, web));
}

/* The same upright, with a foot plate. */
static void column(const struct fv_brush *brush, float height)
{
    const float d = 0.15f, flange = 0.02f, web = 0.008f;
    fv_shape_box(brush, fv_vec(-0.25f, 0.05f, -0.25f), fv_vec(0.25f, 0.09f, 0.25f));
    for (int i = -1; i <= 1; i += 2) {
        float a = d * (float)i, b = (d - flange) * (float)i;
        fv_shape_box(brush, fv_vec(fminf(a, b), 0.09f, -d), fv_vec(fmaxf(a, b), height, d));
    }
    fv_shape_box(brush, fv_vec(flange - d, 0.09f, -web), fv_vec(d - flange, height, web));
}

/* Two angles of a bay, crossed in the plane of z = 0. */
static void bracing(const struct fv_brush *brush, float width, float height)
{
    for (int i = -1; i <= 1; i += 2) {
        float z = 0.03f * (float)i, x = 0.5f * width * (float)i;
        fv_shape_tube(brush, fv_vec(-x, 0.1f, z), fv_vec(x, height - 0.15f, z), 0.035f, 0.035f, 8);
    }
}

static float column_x(int i)
{
    return FV_PIPES_CELL * ((float)i + 0.5f) - LENGTH;
}

static float column_z(int k)
{
    return FV_PIPES_CELL * ((float)k + 0.5f) - WIDTH;
}

static void frame(const struct fv_pipes *pipes)
{
    const struct fv_brush *steel = &pipes->brush[FV_PIPES_STEEL];
    const float height = FV_PIPES_STOREYS * STOREY;
    for (int x = FV_PIPES_BAY_COLUMN; x < FV_PIPES_NX; x += FV_PIPES_BAY)
        for (int z = FV_PIPES_BAY_COLUMN; z < FV_PIPES_NZ; z += FV_PIPES_BAY) {
            struct fv_brush foot = fv_brush_at(steel, column_x(x), 0, column_z(z), 0);
            column(&foot, height - 0.3f);
            fv_shape_box(&pipes->brush[FV_PIPES_CONCRETE],
                         fv_vec(column_x(x) - 0.35f, -0.1f, column_z(z) - 0.35f),
                         fv_vec(column_x(x) + 0.35f, 0.05f, column_z(z) + 0.35f));
        }
    for (int storey = 1; storey <= FV_PIPES_STOREYS; storey++) {
        float y = (float)storey * STOREY - DECK - 0.005f;
        for (int z = FV_PIPES_BAY_COLUMN; z < FV_PIPES_NZ; z += FV_PIPES_BAY) {
            struct fv_brush end = fv_brush_at(steel, -LENGTH, y, column_z(z), 0);
            beam(&end, 2 * LENGTH, 0.32f, 0.18f);
        }
        for (int x = FV_PIPES_BAY_COLUMN; x < FV_PIPES_NX; x += FV_PIPES_BAY) {
            struct fv_brush end = fv_brush_at(steel, column_x(x), y - 0.005f, WIDTH, GLM_PI_2f);
            beam(&end, 2 * WIDTH, 0.26f, 0.14f);
        }
    }
    for (int storey = 0; storey < FV_PIPES_STOREYS; storey++)
        for (int side = -1; side <= 1; side += 2)
            for (int x = FV_PIPES_BAY_COLUMN; x + FV_PIPES_BAY < FV_PIPES_NX; x += 3 * FV_PIPES_BAY) {
                float z = column_z(side < 0 ? FV_PIPES_BAY_COLUMN : FV_PIPES_NZ - 1 - FV_PIPES_BAY_COLUMN);
                float bay = FV_PIPES_BAY * FV_PIPES_CELL;
                struct fv_brush middle = fv_brush_at(steel, column_x(x) + bay / 2, (float)storey * STOREY,
                                                     z + 0.2f * (float)side, 0);
                bracing(&middle, bay, STOREY);
            }
}

/* One cell of grating, its top at y = 0 and its corner at the brush's origin: bars along x, rods across them.
 * Detail below 1 leaves bars out. */
static void grating(const struct fv_brush *brush, float detail)
{
    const float edge = 0.005f, size = FV_PIPES_CELL - edge, thick = 0.0025f;
    int bars = (int)fmaxf(3, roundf(30 * fminf(detail, 1))),
        rods = (int)fmaxf(2, roundf(10 * fminf(detail, 1)));
    for (int i = 0; i <= bars; i++) {
        float z = edge + thick + (size - edge - 2 * thick) * (float)i / (float)bars;
        fv_shape_box(brush, fv_vec(edge, -DECK, z - thick), fv_vec(size, 0, z + thick));
    }
    for (int i = 0; i <= rods; i++) {
        float x = edge + 2 * thick + (size - edge - 4 * thick) * (float)i / (float)rods;
        fv_shape_box(brush, fv_vec(x - thick, -0.012f, edge + thick),
                     fv_vec(x + thick, -0.004f, size - thick));
    }
}

/* Whether something passes through the floor between a cell and the one below. */
static bool is_pierced(const struct fv_pipes *pipes, int x, int y, int z)
{
    int above = fv_pipes_at(pipes, x, y, z), below = fv_pipes_at(pipes, x, y - 1, z);
    return (above == below && above != FV_PIPES_FREE) ||
           (above == FV_PIPES_STRUCTURE && below == FV_PIPES_STRUCTURE);
}

static void floors(const struct fv_pipes *pipes)
{
    for (int storey = 1; storey < FV_PIPES_STOREYS; storey++)
        for (int x = 0; x < FV_PIPES_NX; x++)
            for (int z = 0; z < FV_PIPES_NZ; z++) {
                uint32_t bay = fv_random_stream(1000 * storey + 20 * (x / FV_PIPES_BAY) + z / FV_PIPES_BAY);
                int y = storey * FV_PIPES_STOREY;
                bool wanted =
                    fv_pipes_at(pipes, x, y, z) == FV_PIPES_WALKWAY || fv_random_below(&bay, 10) < 3;
                if (!wanted || is_pierced(pipes, x, y, z)) continue;
                struct fv_brush corner =
                    fv_brush_at(&pipes->brush[FV_PIPES_GRATING], FV_PIPES_CELL * (float)x - LENGTH,
                                (float)y * FV_PIPES_CELL, FV_PIPES_CELL * (float)z - WIDTH, 0);
                grating(&corner, pipes->detail);
            }
}

void fv_pipes_railing(const struct fv_brush *brush, vec3s from, vec3s to)
{
    const float r = 0.02f;
    float length = glms_vec3_distance(from, to);
    int posts = (int)ceilf(length / 1.5f);
    vec3s up = fv_vec(0, 1, 0), plate = glms_vec3_scale(glms_vec3_normalize(glms_vec3_sub(to, from)), 0.03f);
    for (int i = 0; i <= posts; i++) {
        vec3s foot = glms_vec3_lerp(from, to, (float)i / (float)posts);
        fv_shape_tube(brush, foot, glms_vec3_add(foot, glms_vec3_scale(up, 1.1f)), r, r, 8);
    }
    for (int i = 1; i <= 2; i++) {
        vec3s rise = glms_vec3_scale(up, 0.55f * (float)i);
        fv_shape_tube(brush, glms_vec3_sub(glms_vec3_add(from, rise), plate),
                      glms_vec3_add(glms_vec3_add(to, rise), plate), r, r, 8);
    }
    vec3s side = glms_vec3_scale(glms_vec3_normalize(glms_vec3_cross(plate, up)), 0.004f);
    for (int i = -1; i <= 1; i += 2) {
        vec3s face = glms_vec3_add(glms_vec3_add(i < 0 ? to : from, glms_vec3_scale(side, (float)i)),
                                   fv_vec(0, 0.01f, 0));
        fv_shape_quad(brush, face, glms_vec3_sub(i < 0 ? from : to, i < 0 ? to : from), fv_vec(0, 0.1f, 0));
    }
}

void fv_pipes_ladder(const struct fv_brush *brush, float height)
{
    const float half = 0.22f;
    for (int i = -1; i <= 1; i += 2) {
        float x = half * (float)i;
        fv_shape_tube(brush, fv_vec(x, 0, 0), fv_vec(x, height, 0), 0.018f, 0.018f, 8);
    }
    for (int i = 1; (float)i * 0.28f < height; i++)
        fv_shape_tube(brush, fv_vec(-half, 0.28f * (float)i, 0), fv_vec(half, 0.28f * (float)i, 0), 0.011f,
                      0.011f, 6);
    enum { HOOP = 12 };
    for (float y = 2.2f; y < height; y += 0.7f)
        for (int i = 0; i < HOOP; i++) {
            float a = GLM_PIf * (1.2f * (float)i / HOOP - 0.1f),
                  b = GLM_PIf * (1.2f * (float)(i + 1) / HOOP - 0.1f), r = 0.36f;
            fv_shape_tube(brush, fv_vec(r * cosf(a), y, 0.12f + r * sinf(a)),
                          fv_vec(r * cosf(b), y, 0.12f + r * sinf(b)), 0.01f, 0.01f, 5);
        }
    for (int i = 0; i < 5; i++) {
        float a = GLM_PIf * (0.1f + 0.2f * (float)i), r = 0.36f;
        vec3s foot = fv_vec(r * cosf(a), 2.2f, 0.12f + r * sinf(a));
        if (height > 2.2f) fv_shape_tube(brush, foot, fv_vec(foot.x, height, foot.z), 0.01f, 0.01f, 5);
    }
}

/* Along the aisle on both sides, with gaps where bridges and ladders lead away; then along the bridges. */
static void railings(const struct fv_pipes *pipes)
{
    const struct fv_brush *rail = &pipes->brush[FV_PIPES_RAILING];
    const float edge = FV_PIPES_CELL - 0.06f;
    for (int storey = 1; storey < FV_PIPES_STOREYS; storey++) {
        float y = STOREY * (float)storey;
        for (int side = -1; side <= 1; side += 2) {
            float z = edge * (float)side;
            int start = 0;
            for (int x = 0; x <= FV_PIPES_NX; x++) {
                bool gap = x == FV_PIPES_NX;
                for (int i = 0; i < BRIDGES; i++)
                    gap |= storey == 1 && (x == bridges[i] || x == bridges[i] + 1);
                for (int i = 0; i < LADDERS; i++) gap |= side < 0 && x == ladders[i];
                if (gap && x > start)
                    fv_pipes_railing(rail, fv_vec(FV_PIPES_CELL * (float)start - LENGTH, y, z),
                                     fv_vec(FV_PIPES_CELL * (float)x - LENGTH, y, z));
                if (gap) start = x + 1;
            }
        }
        for (int end = -1; end <= 1; end += 2) {
            float x = (LENGTH - 0.06f) * (float)end;
            fv_pipes_railing(rail, fv_vec(x, y, -edge), fv_vec(x, y, edge));
        }
    }
    for (int i = 0; i < BRIDGES; i++)
        for (int side = -1; side <= 1; side += 2)
            for (int far = -1; far <= 1; far += 2) {
                float x = FV_PIPES_CELL * (float)(bridges[i] + 1) - LENGTH + edge * (float)side;
                fv_pipes_railing(rail, fv_vec(x, STOREY, FV_PIPES_CELL * (float)far),
                                 fv_vec(x, STOREY, WIDTH * (float)far));
            }
}

/* Masts along the aisle of the first storey, in turn on either side. scene.point_lights stand for two of
 * them. */
static void lamps(const struct fv_pipes *pipes)
{
    for (int i = 0; i < 6; i++) {
        float side = i % 2 ? -1 : 1, x = 12 * (float)i - 27, z = (FV_PIPES_CELL - 0.1f) * side,
              y = STOREY + 2.2f;
        fv_shape_tube(&pipes->brush[FV_PIPES_RAILING], fv_vec(x, STOREY, z), fv_vec(x, y, z), 0.03f, 0.03f,
                      10);
        fv_shape_box(&pipes->brush[FV_PIPES_STEEL], fv_vec(x - 0.3f, y, z - 0.15f - 0.1f * side),
                     fv_vec(x + 0.3f, y + 0.05f, z + 0.15f - 0.1f * side));
        fv_shape_box(&pipes->brush[FV_PIPES_LAMP], fv_vec(x - 0.27f, y - 0.03f, z - 0.08f - 0.14f * side),
                     fv_vec(x + 0.27f, y - 0.002f, z + 0.08f - 0.14f * side));
    }
}

void fv_pipes_erect(const struct fv_pipes *pipes)
{
    frame(pipes);
    floors(pipes);
    railings(pipes);
    lamps(pipes);
    for (int i = 0; i < LADDERS; i++) {
        struct fv_brush foot =
            fv_brush_at(&pipes->brush[FV_PIPES_RAILING], column_x(ladders[i]), 0, column_z(LADDER_Z), 0);
        fv_pipes_ladder(&foot, 2 * STOREY + 1.1f);
    }
}
