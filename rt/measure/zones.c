/* zones: which zone of eccentricity each pixel of a picture is in; see metrics.h. */
#include "rt/measure/metrics.h"

#include <math.h>

static const double degree = 3.14159265358979323846 / 180;

const struct fv_zone_row fv_zones[FV_ZONES] = {
    [FV_ZONE_FOVEA] = {"fovea", 3.3}, [FV_ZONE_PARA] = {"para", 5.5}, [FV_ZONE_PERI] = {"peri", 12.1},
    [FV_ZONE_NEAR] = {"near", 30},    [FV_ZONE_FAR] = {"far", 180},   [FV_ZONE_ALL] = {"all", 180},
};

/* Directions are corner + x dx + y dy. A pixel's zone is the number of limits that it lies beyond;
 * angles are compared by their cosines, which in double are good to 1e-13 degrees here. */
static void set_zones(int width, int height, const double corner[3], const double dx[3], const double dy[3],
                      const double gaze[3], uint8_t *zone)
{
    double limit[FV_ZONE_FAR], length = sqrt(gaze[0] * gaze[0] + gaze[1] * gaze[1] + gaze[2] * gaze[2]);
    for (int z = 0; z < FV_ZONE_FAR; z++) limit[z] = cos(fv_zones[z].upper_deg * degree) * length;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double d[3], along = 0, square = 0;
            for (int i = 0; i < 3; i++) {
                d[i] = corner[i] + (x + 0.5) * dx[i] + (y + 0.5) * dy[i];
                along += d[i] * gaze[i];
                square += d[i] * d[i];
            }
            double far_away = sqrt(square);
            int beyond = 0;
            for (int z = 0; z < FV_ZONE_FAR; z++) beyond += along < limit[z] * far_away;
            zone[(int64_t)y * width + x] = (uint8_t)beyond;
        }
}

void fv_zones_of_view(const struct fv_view *view, uint8_t *zone)
{
    double corner[3], dx[3], dy[3], gaze[3];
    for (int i = 0; i < 3; i++) {
        corner[i] = (double)view->corner[i];
        dx[i] = (double)view->dx[i];
        dy[i] = (double)view->dy[i];
        gaze[i] = (double)view->gaze[i];
    }
    set_zones(view->width, view->height, corner, dx, dy, gaze, zone);
}

void fv_zones_of_picture(int width, int height, double gaze_x, double gaze_y, double focal_px, uint8_t *zone)
{
    double corner[3] = {-0.5 * width, -0.5 * height, focal_px};
    double gaze[3] = {gaze_x - 0.5 * width, gaze_y - 0.5 * height, focal_px};
    set_zones(width, height, corner, (double[3]){1, 0, 0}, (double[3]){0, 1, 0}, gaze, zone);
}
