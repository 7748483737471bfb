/* pyramid_repaint_kernel: pixels between those of a lower level that differ by checks only; see pyramid.h. */
#include "rt/pass/pyramid.h"
#include "rt/trace/field_surface.h"
#include "rt/trace/pixel.h"

#define repaint FV_ISA_NAME(fv_pyramid_repaint)

void repaint(const struct fv_repaint *r);

/* The four pixels around a cell, row by row. */
enum { AROUND = 4 };

/* As many cells as there are lanes, and what stands in them: of the pixels around, inverse depths, light that comes from
 * there and what they reflect, by channel. */
struct cells {
    _Alignas(64) float w[AROUND][FV_WIDTH], light[AROUND][3][FV_WIDTH], albedo[AROUND][3][FV_WIDTH], normal[3][FV_WIDTH];
    _Alignas(64) float x[FV_WIDTH], y[FV_WIDTH]; /* of the first pixel around */
    _Alignas(64) int32_t part[FV_WIDTH];
};

static inline void put3(float to[3][FV_WIDTH], vf3 v)
{
    vf_store(to[0], v.x);
    vf_store(to[1], v.y);
    vf_store(to[2], v.z);
}

static inline vf3 direction_of(const struct fv_view *view, vf x, vf y)
{
    vf3 across = vf3_scale(vf3_of(view->dx), x), along = vf3_scale(vf3_of(view->dy), y);
    return vf3_add(vf3_of(view->corner), vf3_add(across, along));
}

static inline vf3 point_of(const struct fv_view *view, vf3 direction, vf w)
{
    return vf3_add(vf3_of(view->origin), vf3_scale(direction, 1.0f / w));
}

/* What checks of these parts reflect in these lanes. */
static inline vf3 reflect(const struct fv_repaint *r, vi mask, vi parts, vf3 point, vf3 direction, vf3 normal, vf w)
{
    vf3 albedo = vf3_of((float[3]){0, 0, 0});
    for (unsigned pending = vi_bits(mask); pending;) {
        int id = parts[__builtin_ctz(pending)];
        vi lanes = mask & (parts == id);
        pending &= ~vi_bits(lanes);
        const struct fv_field_part *part = &r->scene->fields.part[id];
        vf3 diffuse = vf3_of(r->scene->material[part->material].diffuse);
        field_checks(part, lanes, point, direction, normal, r->view->pixel_size / w, &diffuse);
        albedo = vf3_select(lanes, diffuse, albedo);
    }
    return albedo;
}

static inline vf sum_of(vf3 a)
{
    return a.x + a.y + a.z;
}

/* The cells from i on: which show one part's checks, on a plane. */
static inline vi same_of(const struct fv_repaint *r, vi at, vi known, vf w[AROUND], vi *part)
{
    const float flat = 2.5e-4f; /* of the inverse depth: a quarter of a headset's pixel */
    vi same = known, first = vi_of(0);
    for (int k = 0; k < AROUND; k++) {
        vi seen = vi_gather(r->seen, at + (k & 1) + (k >> 1) * r->stride);
        if (k == 0) first = seen & FV_SEEN_PART;
        same &= (seen & FV_SEEN_PART) == first;
        w[k] = (vf)(seen & ~FV_SEEN_PART);
    }
    *part = first - 1;
    return same & (first != 0) & (vf_abs(w[0] + w[3] - w[1] - w[2]) <= flat * w[0]);
}

/* Of the cells from i on, those that can be painted, and what they are painted by. */
static inline vi find(const struct fv_repaint *r, int i, struct cells *c)
{
    const float alike = 0.15f, least = 1e-3f;
    vi known = vi_lanes() < r->count - i, column = vi_load(r->column + i) & known, row = vi_load(r->row + i) & known;
    vi at = row * r->stride + column, part;
    vf w[AROUND], darkest = vf_of(1e30f), brightest = vf_of(0);
    vf x = r->x0 + vf_from(column) * r->size, y = r->y0 + vf_from(row) * r->size;
    vi same = same_of(r, at, known, w, &part);
    vf3 direction[AROUND], point[AROUND];
    if (!vi_any(same)) return same;
    for (int k = 0; k < AROUND; k++) {
        w[k] = vf_select(same, w[k], vf_of(1));
        direction[k] = direction_of(r->view, x + (float)(k & 1) * r->size, y + (float)(k >> 1) * r->size);
        point[k] = point_of(r->view, direction[k], w[k]);
    }
    vf3 normal = vf3_normalise(vf3_cross(vf3_sub(point[1], point[0]), vf3_sub(point[2], point[0])),
                               (vf3){vf_of(0), vf_of(1), vf_of(0)});
    for (int k = 0; k < AROUND; k++) {
        vf3 albedo = reflect(r, same, part, point[k], direction[k], normal, w[k]);
        vf3 light = pixel_decode(pixel_unpack(vi_gather(r->pixel, at + (k & 1) + (k >> 1) * r->stride)));
        vf lit = sum_of(light) / vf_max(sum_of(albedo), vf_of(least));
        darkest = vf_min(darkest, lit), brightest = vf_max(brightest, lit);
        vf_store(c->w[k], w[k]);
        put3(c->light[k], light);
        put3(c->albedo[k], albedo);
    }
    put3(c->normal, normal);
    vf_store(c->x, x);
    vf_store(c->y, y);
    vi_store(c->part, part);
    return same & (brightest - darkest <= alike * brightest);
}

/* Which cell each lane's pixel is of; all of them of the same one where a cell has as many pixels. */
struct lanes {
    bool one;
    int cell;
    vi cells;
};

static inline vf of_cell(const float value[FV_WIDTH], const struct lanes *l)
{
    return l->one ? vf_of(value[l->cell]) : vf_gather(value, l->cells);
}

static inline vf3 of_cell3(float value[3][FV_WIDTH], const struct lanes *l)
{
    return (vf3){of_cell(value[0], l), of_cell(value[1], l), of_cell(value[2], l)};
}

/* As many of the cells' pixels as there are lanes, the first of them number `first`; a cell has 1 << (2 shift). */
static inline vi paint(const struct fv_repaint *r, struct cells *c, int first, int shift)
{
    vi number = first + vi_lanes(), side = vi_of((1 << shift) - 1);
    struct lanes l = {.one = FV_WIDTH <= 1 << 2 * shift, .cell = first >> 2 * shift, .cells = number >> 2 * shift};
    vf in_x = vf_from(number & side) + 0.5f, in_y = vf_from((number >> shift) & side) + 0.5f;
    vf fx = in_x / r->size, fy = in_y / r->size, w = vf_of(0);
    vf3 light = vf3_of((float[3]){0, 0, 0}), mean = light;
    for (int k = 0; k < AROUND; k++) {
        vf weight = (k & 1 ? fx : 1.0f - fx) * (k >> 1 ? fy : 1.0f - fy);
        w += of_cell(c->w[k], &l) * weight;
        light = vf3_add(light, vf3_scale(of_cell3(c->light[k], &l), weight));
        mean = vf3_add(mean, vf3_scale(of_cell3(c->albedo[k], &l), weight));
    }
    vf low = vf_of(1e-3f);
    vi part = l.one ? vi_of(c->part[l.cell]) : vi_gather(c->part, l.cells);
    vf3 direction = direction_of(r->view, of_cell(c->x, &l) + in_x, of_cell(c->y, &l) + in_y);
    vf3 own = reflect(r, part >= 0, part, point_of(r->view, direction, w), direction, of_cell3(c->normal, &l), w);
    vf3 linear = {light.x * own.x / vf_max(mean.x, low), light.y * own.y / vf_max(mean.y, low),
                  light.z * own.z / vf_max(mean.z, low)};
    return pixel_encode(linear, 1);
}

void repaint(const struct fv_repaint *r)
{
    int shift = r->size > 3 ? 2 : 1, pixels = 1 << 2 * shift;
    for (int i = 0; i < r->count; i += FV_WIDTH) {
        struct cells cells;
        vi painted = find(r, i, &cells);
        vi_store(r->painted + i, painted);
        unsigned wanted = vi_bits(painted), together = FV_WIDTH > pixels ? (1u << FV_WIDTH / pixels) - 1 : 1;
        for (int first = 0; wanted && first < FV_WIDTH * pixels; first += FV_WIDTH)
            if (wanted >> (first >> 2 * shift) & together)
                vi_store(r->colour + i * pixels + first, paint(r, &cells, first, shift));
    }
}
