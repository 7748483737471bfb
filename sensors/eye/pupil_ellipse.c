/* pupil_ellipse: ellipses by direct least squares; see the header. */
#include "sensors/eye/pupil_ellipse.h"

#include <math.h>
#include <string.h>

/* Upper triangle of the scatter matrix of (x2, xy, y2, x, y, 1), in normalised coordinates. */
struct scatter {
    double quadratic[3][3], mixed[3][3], linear[3][3];
};

/* Mean and spread of the points; false where there are too few, or all at one place. */
static bool normalisation(const struct fv_outline_point *point, int n, double mean[2], double *spread)
{
    double sum = 0, square = 0;
    int used = 0;
    mean[0] = mean[1] = 0;
    for (int i = 0; i < n; i++) {
        sum += point[i].weight;
        mean[0] += point[i].weight * point[i].x;
        mean[1] += point[i].weight * point[i].y;
        used += point[i].weight > 0;
    }
    if (used < 6 || !(sum > 0)) return false;
    for (int i = 0; i < 2; i++) mean[i] /= sum;
    for (int i = 0; i < n; i++) {
        double x = point[i].x - mean[0], y = point[i].y - mean[1];
        square += point[i].weight * (x * x + y * y);
    }
    *spread = sqrt(square / sum);
    return *spread > 1e-9 && isfinite(*spread);
}

static void scatter_of(const struct fv_outline_point *point, int n, const double mean[2], double spread,
                       struct scatter *s)
{
    memset(s, 0, sizeof *s);
    for (int i = 0; i < n; i++) {
        double x = (point[i].x - mean[0]) / spread, y = (point[i].y - mean[1]) / spread, w = point[i].weight;
        double q[3] = {x * x, x * y, y * y}, l[3] = {x, y, 1};
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) {
                s->quadratic[j][k] += w * q[j] * q[k];
                s->mixed[j][k] += w * q[j] * l[k];
                s->linear[j][k] += w * l[j] * l[k];
            }
    }
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Inverse of a 3x3 matrix; false where it is singular to working precision. */
static bool inverse(const double m[3][3], double out[3][3])
{
    double columns[3][3], norm = 0;
    cross(m[1], m[2], columns[0]);
    cross(m[2], m[0], columns[1]);
    cross(m[0], m[1], columns[2]);
    double determinant = dot(m[0], columns[0]);
    for (int i = 0; i < 3; i++) norm = fmax(norm, dot(m[i], m[i]));
    if (!(fabs(determinant) > 1e-14 * norm * sqrt(norm))) return false;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out[i][j] = columns[j][i] / determinant;
    return true;
}

/* Roots of x3 - p x2 + q x - r that has three real ones (Viete's trigonometric form). */
static void roots_of_cubic(double p, double q, double r, double root[3])
{
    double third = p / 3, h = fmax(third * third - q / 3, 0), reach = sqrt(h);
    double k = third * third * third - 0.5 * third * q + 0.5 * r;
    double angle = reach > 0 ? acos(fmin(fmax(k / (h * reach), -1), 1)) / 3 : 0;
    for (int i = 0; i < 3; i++) root[i] = third + 2 * reach * cos(angle - 2 * M_PI / 3 * i);
}

/* The vector that m takes to 0, m of rank 2: the longest product of two of its rows. */
static bool null_vector(const double m[3][3], double out[3])
{
    double best = 0;
    for (int i = 0; i < 3; i++) {
        double v[3], length;
        cross(m[i], m[(i + 1) % 3], v);
        length = dot(v, v);
        if (length > best) {
            best = length;
            memcpy(out, v, sizeof v);
        }
    }
    return best > 0;
}

/* Quadratic coefficients of the ellipse: M a = lambda C a with the constraint 4ac - b2 = a'Ca > 0. */
static bool quadratic_part(const double m[3][3], double out[3])
{
    /* C^-1 M, with C = (0 0 2, 0 -1 0, 2 0 0) */
    double e[3][3], root[3], best = 0;
    for (int j = 0; j < 3; j++) {
        e[0][j] = 0.5 * m[2][j];
        e[1][j] = -m[1][j];
        e[2][j] = 0.5 * m[0][j];
    }
    double trace = e[0][0] + e[1][1] + e[2][2];
    double minors = e[0][0] * e[1][1] - e[0][1] * e[1][0] + e[0][0] * e[2][2] - e[0][2] * e[2][0] +
                    e[1][1] * e[2][2] - e[1][2] * e[2][1];
    double column[3];
    cross(e[1], e[2], column);
    roots_of_cubic(trace, minors, dot(e[0], column), root);
    for (int i = 0; i < 3; i++) {
        double shifted[3][3], v[3] = {0};
        memcpy(shifted, e, sizeof shifted);
        for (int j = 0; j < 3; j++) shifted[j][j] -= root[i];
        if (!null_vector(shifted, v)) continue;
        double constraint = (4 * v[0] * v[2] - v[1] * v[1]) / dot(v, v);
        if (constraint > best) {
            best = constraint;
            memcpy(out, v, sizeof v);
        }
    }
    return best > 1e-9;
}

/* Centre and axes of q0 x2 + q1 xy + q2 y2 + l0 x + l1 y + l2 = 0. */
static bool axes_of(const double q[3], const double l[3], struct fv_ellipse *e)
{
    double discriminant = 4 * q[0] * q[2] - q[1] * q[1];
    if (!(discriminant > 0)) return false;
    e->x = (q[1] * l[1] - 2 * q[2] * l[0]) / discriminant;
    e->y = (q[1] * l[0] - 2 * q[0] * l[1]) / discriminant;
    double value = 0.5 * (l[0] * e->x + l[1] * e->y) + l[2]; /* at the centre */
    double half = 0.5 * (q[0] + q[2]), apart = 0.5 * hypot(q[0] - q[2], q[1]);
    /* Eigenvalues of one sign; the smaller one by the product, which does not cancel. */
    double large = half + copysign(apart, half), small = 0.25 * discriminant / large;
    double a2 = -value / small, b2 = -value / large;
    if (!(a2 > 0 && b2 > 0) || !isfinite(a2)) return false;
    double angle = apart > 1e-12 * fabs(half) ? 0.5 * atan2(q[1], q[0] - q[2]) : 0;
    if (half > 0) angle += M_PI / 2; /* that of the larger eigenvalue is the minor axis */
    e->a = sqrt(a2);
    e->b = sqrt(b2);
    e->c = cos(angle);
    e->s = sin(angle);
    return e->b > 1e-6 * e->a;
}

bool fv_ellipse_fit(const struct fv_outline_point *point, int n, struct fv_ellipse *ellipse)
{
    double mean[2], spread, to_linear[3][3], invert[3][3], m[3][3], q[3] = {0}, l[3];
    struct scatter s;
    if (!normalisation(point, n, mean, &spread)) return false;
    scatter_of(point, n, mean, spread, &s);
    if (!inverse(s.linear, invert)) return false;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) to_linear[i][j] = -dot(invert[i], s.mixed[j]);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            m[i][j] = s.quadratic[i][j];
            for (int k = 0; k < 3; k++) m[i][j] += s.mixed[i][k] * to_linear[k][j];
        }
    if (!quadratic_part(m, q)) return false;
    double length = sqrt(dot(q, q));
    for (int i = 0; i < 3; i++) q[i] /= length;
    for (int i = 0; i < 3; i++) l[i] = dot(to_linear[i], q);
    if (!axes_of(q, l, ellipse)) return false;
    ellipse->x = mean[0] + spread * ellipse->x;
    ellipse->y = mean[1] + spread * ellipse->y;
    ellipse->a *= spread;
    ellipse->b *= spread;
    return isfinite(ellipse->x + ellipse->y + ellipse->a);
}

double fv_ellipse_distance(const struct fv_ellipse *e, double x, double y)
{
    double u = (e->c * (x - e->x) + e->s * (y - e->y)) / e->a;
    double v = (-e->s * (x - e->x) + e->c * (y - e->y)) / e->b;
    double slope = 2 * sqrt(u * u / (e->a * e->a) + v * v / (e->b * e->b));
    return slope > 1e-12 ? (u * u + v * v - 1) / slope : -e->b;
}

void fv_ellipse_outline(const struct fv_ellipse *e, double cosine, double sine, double at[2],
                        double normal[2])
{
    double u = e->a * cosine, v = e->b * sine;
    double nu = e->b * cosine, nv = e->a * sine, length = sqrt(nu * nu + nv * nv);
    at[0] = e->x + e->c * u - e->s * v;
    at[1] = e->y + e->s * u + e->c * v;
    normal[0] = (e->c * nu - e->s * nv) / length;
    normal[1] = (e->s * nu + e->c * nv) / length;
}

double fv_outline_rank(double *value, int n, int rank)
{
    int low = 0, high = n - 1;
    while (low < high) {
        double pivot = value[rank];
        int i = low, j = high;
        while (i <= j) {
            while (value[i] < pivot) i++;
            while (value[j] > pivot) j--;
            if (i > j) break;
            double v = value[i];
            value[i++] = value[j];
            value[j--] = v;
        }
        if (j < rank) low = i;
        if (i > rank) high = j;
    }
    return value[rank];
}

/* What 60 % of the points that weigh lie nearer than. */
static double usual_distance(const struct fv_outline_point *point, int n, const struct fv_ellipse *ellipse)
{
    double off[FV_OUTLINE_POINTS];
    int used = 0;
    for (int i = 0; i < n; i++)
        if (point[i].weight > 0) off[used++] = fabs(fv_ellipse_distance(ellipse, point[i].x, point[i].y));
    return used ? fv_outline_rank(off, used, 3 * used / 5) : 0;
}

bool fv_ellipse_fit_parts(const struct fv_outline_point *point, int n, double near,
                          struct fv_ellipse *ellipse)
{
    enum { PARTS = 12 };
    struct fv_outline_point part[FV_OUTLINE_POINTS];
    if (n > FV_OUTLINE_POINTS || !fv_ellipse_fit(point, n, ellipse)) return false;
    double least = usual_distance(point, n, ellipse);
    if (least <= near) return true;
    for (int i = 0; i < PARTS; i++) {
        struct fv_ellipse e;
        memcpy(part, point, (size_t)n * sizeof *part);
        for (int j = 0; j < n / 3; j++) part[(i * n / PARTS + j) % n].weight = 0;
        if (!fv_ellipse_fit(part, n, &e)) continue;
        double usual = usual_distance(point, n, &e);
        if (usual >= least) continue;
        least = usual;
        *ellipse = e;
    }
    return true;
}

bool fv_ellipse_fit_robust(struct fv_outline_point *point, int n, double near, struct fv_ellipse *ellipse)
{
    return fv_ellipse_fit(point, n, ellipse) && fv_ellipse_trim(point, n, near, ellipse);
}

bool fv_ellipse_trim(struct fv_outline_point *point, int n, double near, struct fv_ellipse *ellipse)
{
    double off[FV_OUTLINE_POINTS], sorted[FV_OUTLINE_POINTS];
    if (n > FV_OUTLINE_POINTS) return false;
    for (int round = 0; round < 2; round++) {
        int used = 0, dropped = 0;
        for (int i = 0; i < n; i++) {
            off[i] = fabs(fv_ellipse_distance(ellipse, point[i].x, point[i].y));
            if (point[i].weight > 0) sorted[used++] = off[i];
        }
        /* 1.48: from a median of distances to a standard deviation */
        double limit = fmax(2.5 * 1.48 * fv_outline_rank(sorted, used, used / 2), near);
        for (int i = 0; i < n; i++)
            if (point[i].weight > 0 && off[i] > limit) {
                point[i].weight = 0;
                dropped++;
            }
        if (dropped == 0) return true;
        if (!fv_ellipse_fit(point, n, ellipse)) return false;
    }
    return true;
}
