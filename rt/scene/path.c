/* path: see path.h. */
#include "rt/scene/path.h"

#include <math.h>

enum { COLUMNS = 5 };

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

void fv_path_at(const double *way, int rows, int columns, double seconds, int64_t t_ns, double *out)
{
    double s = phase(seconds, t_ns) * (rows - 1);
    int row = (int)floor(s);
    double t = s - row;
    const double *at[4]; /* the points around, those at the ends repeated */
    for (int i = 0; i < 4; i++) {
        int k = row + i - 1;
        at[i] = way + (k < 0 ? 0 : k >= rows ? rows - 1 : k) * columns;
    }
    for (int i = 0; i < columns; i++) {
        double a = at[0][i], b = at[1][i], d = at[2][i], e = at[3][i];
        out[i] = b + 0.5 * t * (d - a + t * (2 * a - 5 * b + 4 * d - e + t * (3 * (b - d) + e - a)));
    }
}

void fv_path_pose(const struct fv_list *path, double seconds, int64_t t_ns, struct fv_pose *pose)
{
    double value[COLUMNS] = {0}, degree = 3.14159265358979323846 / 180;
    int rows = path->count / COLUMNS;
    if (rows > 0) fv_path_at(path->value, rows, COLUMNS, seconds, t_ns, value);
    for (int i = 0; i < 3; i++) pose->position_m[i] = value[i];
    fv_quat_from_yaw_pitch_roll(value[3] * degree, value[4] * degree, 0, pose->rotation);
}
