/* path: see path.h. */
#include "rt/frame/path.h"

#include <math.h>

enum { COLUMNS = 5 };

static double point(const struct fv_list *path, int row, int column)
{
    int rows = path->count / COLUMNS;
    row = row < 0 ? 0 : row >= rows ? rows - 1 : row;
    return path->value[row * COLUMNS + column];
}

/* Position on the path, 0 at the first point, 1 at the last: there in `seconds`, back in as many. */
static double phase(double seconds, int64_t t_ns)
{
    if (!(seconds > 0)) return 0;
    int64_t both_ns = (int64_t)(2e9 * seconds);
    if (both_ns < 1) return 0;
    int64_t into_ns = t_ns % both_ns;
    if (into_ns < 0) into_ns += both_ns;
    double s = (double)into_ns / (double)both_ns * 2;
    if (s > 1) s = 2 - s;
    return s - sin(6.28318530717958648 * s) * 0.9 / 6.28318530717958648;
}

void fv_path_pose(const struct fv_list *path, double seconds, int64_t t_ns, struct fv_pose *pose)
{
    double value[COLUMNS] = {0}, degree = 3.14159265358979323846 / 180;
    int rows = path->count / COLUMNS;
    if (rows > 0) {
        double s = phase(seconds, t_ns) * (rows - 1);
        int row = (int)floor(s);
        double t = s - row;
        for (int c = 0; c < COLUMNS; c++) {
            double a = point(path, row - 1, c), b = point(path, row, c), d = point(path, row + 1, c),
                   e = point(path, row + 2, c);
            value[c] = b + 0.5 * t * (d - a + t * (2 * a - 5 * b + 4 * d - e + t * (3 * (b - d) + e - a)));
        }
    }
    for (int i = 0; i < 3; i++) pose->position_m[i] = value[i];
    fv_quat_from_yaw_pitch_roll(value[3] * degree, value[4] * degree, 0, pose->rotation);
}
