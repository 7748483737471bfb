/* zones: which zone of eccentricity each pixel of a picture is in; see metrics.h. */
#include "rt/measure/metrics.h"

#include <assert.h>
#include <math.h>

static const double degree = 3.14159265358979323846 / 180;

const struct fv_zone_row fv_zones[FV_ZONES] = {
    [FV_ZONE_FOVEA] = {"fovea", 3.3}, [FV_ZONE_PARA] = {"para", 5.5}, [FV_ZONE_PERI] = {"peri", 12.1},
    [FV_ZONE_NEAR] = {"near", 30},    [FV_ZONE_FAR] = {"far", 180},   [FV_ZONE_ALL] = {"all", 180},
};

/* Where each pixel's direction is: corner + x dx + y dy. */
struct plane {
    int width, height;
    double corner[3], dx[3], dy[3], gaze[3];
};

/* The number of limits that a pixel lies beyond; angles are compared by their cosines, which in double are good to
 * 1e-13 degrees here. */
static void set_zones(const struct plane *p, const double *limit_deg, int limits, uint8_t *zone)
{
    double limit[FV_ZONE_FAR], length = sqrt(p->gaze[0] * p->gaze[0] + p->gaze[1] * p->gaze[1] + p->gaze[2] * p->gaze[2]);
    assert(limits >= 0 && limits <= FV_ZONE_FAR);
    for (int z = 0; z < limits; z++) limit[z] = cos(limit_deg[z] * degree) * length;
    for (int y = 0; y < p->height; y++)
        for (int x = 0; x < p->width; x++) {
            double d[3], along = 0, square = 0;
            for (int i = 0; i < 3; i++) {
                d[i] = p->corner[i] + (x + 0.5) * p->dx[i] + (y + 0.5) * p->dy[i];
                along += d[i] * p->gaze[i];
                square += d[i] * d[i];
            }
            double far_away = sqrt(square);
            int beyond = 0;
            for (int z = 0; z < limits; z++) beyond += along < limit[z] * far_away;
            zone[(int64_t)y * p->width + x] = (uint8_t)beyond;
        }
}

static void set_own_zones(const struct plane *p, uint8_t *zone)
{
    double limit_deg[FV_ZONE_FAR];
    for (int z = 0; z < FV_ZONE_FAR; z++) limit_deg[z] = fv_zones[z].upper_deg;
    set_zones(p, limit_deg, FV_ZONE_FAR, zone);
}

static struct plane plane_of(const struct fv_view *view)
{
    struct plane p = {.width = view->width, .height = view->height};
    for (int i = 0; i < 3; i++) {
        p.corner[i] = (double)view->corner[i];
        p.dx[i] = (double)view->dx[i];
        p.dy[i] = (double)view->dy[i];
        p.gaze[i] = (double)view->gaze[i];
    }
    return p;
}

void fv_zones_of_view(const struct fv_view *view, uint8_t *zone)
{
    struct plane p = plane_of(view);
    set_own_zones(&p, zone);
}

void fv_zones_beyond(const struct fv_view *view, const double *limit_deg, int limits, uint8_t *zone)
{
    struct plane p = plane_of(view);
    set_zones(&p, limit_deg, limits, zone);
}

void fv_zones_of_picture(int width, int height, double gaze_x, double gaze_y, double focal_px, uint8_t *zone)
{
    struct plane p = {width,     height,    {-0.5 * width, -0.5 * height, focal_px},
                      {1, 0, 0}, {0, 1, 0}, {gaze_x - 0.5 * width, gaze_y - 0.5 * height, focal_px}};
    set_own_zones(&p, zone);
}
