/* view: cameras from poses, in double; see view.h. */
#include "rt/fovea/view.h"

#include <math.h>

static void scaled(const struct fv_pose *pose, double x, double y, double z, float out[3])
{
    double v[3] = {x, y, z};
    fv_quat_rotate(pose->rotation, v, v);
    for (int i = 0; i < 3; i++) out[i] = (float)v[i];
}

bool fv_lens_project(const struct fv_lens *lens, const double d[3], double pixel[2])
{
    if (!(d[2] < -1e-6)) return false;
    pixel[0] = (d[0] / -d[2] + lens->tan_left) * lens->width / (lens->tan_left + lens->tan_right);
    pixel[1] = (lens->tan_up - d[1] / -d[2]) * lens->height / (lens->tan_up + lens->tan_down);
    return true;
}

void fv_view_set(struct fv_view *view, const struct fv_lens *lens, const struct fv_pose *pose,
                 const double gaze[3])
{
    static const struct fv_bend none;
    fv_view_set_bent(view, lens, &none, pose, gaze);
}

void fv_view_set_bent(struct fv_view *view, const struct fv_lens *lens, const struct fv_bend *bend, const struct fv_pose *pose,
                      const double gaze[3])
{
    double step_x = (lens->tan_left + lens->tan_right) / lens->width;
    double step_y = (lens->tan_up + lens->tan_down) / lens->height;
    double g[3] = {gaze[0], gaze[1], gaze[2]}, pixel[2];
    double length = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    if (!(length > 1e-6 && length < 1e6) || !(g[2] < 0)) {
        g[0] = g[1] = 0;
        g[2] = -1;
        length = 1;
    }
    for (int i = 0; i < 3; i++) g[i] /= length;
    view->width = lens->width;
    view->height = lens->height;
    view->pose = *pose;
    view->lens = *lens;
    view->bend = *bend;
    view->pixel_size = (float)sqrt(step_x * step_y);
    view->pixel_deg = (float)(fmax(step_x, step_y) * 57.29577951308232);
    if (bend->on) view->pixel_deg *= bend->widest_angle;
    for (int i = 0; i < 3; i++) view->origin[i] = (float)pose->position_m[i];
    scaled(pose, -lens->tan_left, lens->tan_up, -1, view->corner);
    scaled(pose, step_x, 0, 0, view->dx);
    scaled(pose, 0, -step_y, 0, view->dy);
    scaled(pose, g[0], g[1], g[2], view->gaze);
    if (!fv_lens_project(lens, g, pixel)) pixel[0] = copysign(1e6, g[0]), pixel[1] = copysign(1e6, -g[1]);
    else if (bend->on) fv_bend_bent(bend, pixel, pixel);
    for (int i = 0; i < 2; i++) view->gaze_px[i] = (float)fmax(-1e6, fmin(1e6, pixel[i]));
}

/* Columns of the matrix that turns eye-space vectors of `before` into (X, Y, Z) above. */
static void to_pixels(const struct fv_lens *lens, const double v[3], double out[3])
{
    double across = lens->width / (lens->tan_left + lens->tan_right);
    double down = lens->height / (lens->tan_up + lens->tan_down);
    double ahead = -v[2];
    out[0] = (v[0] + lens->tan_left * ahead) * across;
    out[1] = (lens->tan_up * ahead - v[1]) * down;
    out[2] = ahead;
}

/* A point at p in the view's eye lies at o + D (x + R p - n) in the world of the frame before, where x and R are
 * the eye's place and turn now, n and o the object's places now and before, and D its turn in between. Places are
 * subtracted before anything is turned, so that what moves together far out does not cancel. */
void fv_map_set_moving(struct fv_map *map, const struct fv_view *now, const struct fv_view *before,
                       const struct fv_pose *object_now, const struct fv_pose *object_before)
{
    double turn[4], to_before[4], inverse[4], column[3], moved[3];
    const struct fv_lens *l = &now->lens;
    double step_x = (l->tan_left + l->tan_right) / l->width, step_y = (l->tan_up + l->tan_down) / l->height;
    double columns[3][3] = {{step_x, 0, 0}, {0, -step_y, 0}, {-l->tan_left, l->tan_up, -1}};
    fv_quat_conjugate(object_now->rotation, inverse);
    fv_quat_multiply(object_before->rotation, inverse, turn);
    fv_quat_normalise(turn);
    fv_quat_conjugate(before->pose.rotation, inverse);
    fv_quat_multiply(inverse, turn, to_before);
    fv_quat_multiply(to_before, now->pose.rotation, to_before);
    fv_quat_normalise(to_before);
    for (int c = 0; c < 3; c++) {
        fv_quat_rotate(to_before, columns[c], column);
        to_pixels(&before->lens, column, column);
        for (int r = 0; r < 3; r++) map->m[r][c] = (float)column[r];
    }
    for (int i = 0; i < 3; i++) moved[i] = now->pose.position_m[i] - object_now->position_m[i];
    fv_quat_rotate(turn, moved, moved);
    for (int i = 0; i < 3; i++) moved[i] -= before->pose.position_m[i] - object_before->position_m[i];
    fv_quat_rotate(inverse, moved, moved);
    to_pixels(&before->lens, moved, moved);
    for (int r = 0; r < 3; r++) map->t[r] = (float)moved[r];
}

void fv_map_set(struct fv_map *map, const struct fv_view *now, const struct fv_view *before)
{
    static const struct fv_pose still = {.rotation = {1, 0, 0, 0}};
    fv_map_set_moving(map, now, before, &still, &still);
}

void fv_view_at(const struct fv_view *view, float x, float y, struct fv_view *near)
{
    double a[2][3];
    fv_bend_tangent(&view->bend, (double)x, (double)y, a);
    *near = *view;
    for (int i = 0; i < 3; i++) {
        double dx = (double)view->dx[i], dy = (double)view->dy[i];
        near->corner[i] = (float)((double)view->corner[i] + a[0][2] * dx + a[1][2] * dy);
        near->dx[i] = (float)(a[0][0] * dx + a[1][0] * dy);
        near->dy[i] = (float)(a[0][1] * dx + a[1][1] * dy);
    }
    near->pixel_size *= (float)sqrt(fabs(a[0][0] * a[1][1] - a[0][1] * a[1][0]));
    near->bend.on = false;
}

void fv_map_bend(struct fv_map *map, const struct fv_bend *now, const struct fv_bend *before, float x, float y, float w)
{
    double a[2][3], b[2][3], from[2], to[3], m[3][4];
    fv_bend_tangent(now, (double)x, (double)y, a);
    for (int i = 0; i < 2; i++) from[i] = a[i][0] * (double)x + a[i][1] * (double)y + a[i][2];
    for (int i = 0; i < 3; i++) {
        double x0 = (double)map->m[i][0], y0 = (double)map->m[i][1];
        to[i] = x0 * from[0] + y0 * from[1] + (double)map->m[i][2] + (double)map->t[i] * (double)w;
        for (int k = 0; k < 3; k++) m[i][k] = x0 * a[0][k] + y0 * a[1][k] + (k == 2 ? (double)map->m[i][2] : 0);
        m[i][3] = (double)map->t[i];
    }
    if (!(to[2] > 1e-3)) return;
    double there[2] = {to[0] / to[2], to[1] / to[2]}, place[2];
    for (int i = 0; i < 2; i++) there[i] = fmax(-1e6, fmin(1e6, there[i]));
    fv_bend_bent(before, there, place);
    fv_bend_tangent(before, place[0], place[1], b);
    /* Its inverse: t grows wherever the lens bends. */
    double unit = 1 / (b[0][0] * b[1][1] - b[0][1] * b[1][0]);
    double back[2][2] = {{b[1][1] * unit, -b[0][1] * unit}, {-b[1][0] * unit, b[0][0] * unit}};
    for (int k = 0; k < 4; k++) {
        double u = m[0][k] - b[0][2] * m[2][k], v = m[1][k] - b[1][2] * m[2][k];
        double out[3] = {back[0][0] * u + back[0][1] * v, back[1][0] * u + back[1][1] * v, m[2][k]};
        for (int i = 0; i < 3; i++) *(k < 3 ? &map->m[i][k] : &map->t[i]) = (float)out[i];
    }
}

float fv_map_apart(const struct fv_map *map, float x, float y, float reach)
{
    float to[3];
    fv_map_point(map, x, y, 0, to);
    if (!(to[2] > 0)) return INFINITY;
    float across = map->t[0] - map->t[2] * to[0] / to[2], along = map->t[1] - map->t[2] * to[1] / to[2];
    return (hypotf(across, along) + 2 * reach * fabsf(map->t[2])) / to[2];
}

bool fv_map_still(const struct fv_map *map, const struct fv_view *now)
{
    const struct fv_bend *bend = &now->bend;
    float limit = bend->on ? bend->least / 64 : 1 / 64.0f;
    for (int corner = 0; corner < 8; corner++) {
        float at[2] = {corner & 1 ? (float)now->width : 0, corner & 2 ? (float)now->height : 0};
        float w = corner & 4 ? 2 : 0, to[3];
        if (bend->on) fv_bend_straight(bend, at[0], at[1], at);
        fv_map_point(map, at[0], at[1], w, to);
        if (!(to[2] > 0.5f && fabsf(to[0] / to[2] - at[0]) < limit && fabsf(to[1] / to[2] - at[1]) < limit))
            return false;
    }
    return true;
}
