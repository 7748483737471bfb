/* builtin_pipes_route: which cell is whose, and the ways of bundles; see builtin_pipes.h. */
#include "rt/scene/builtin_pipes.h"

#include "rt/scene/builtin_random.h"

static const int size[3] = {FV_PIPES_NX, FV_PIPES_NY, FV_PIPES_NZ};

vec3s fv_pipes_middle(const int cell[3])
{
    return fv_vec(FV_PIPES_CELL * ((float)cell[0] + 0.5f - FV_PIPES_NX / 2),
                  FV_PIPES_CELL * ((float)cell[1] + 0.5f),
                  FV_PIPES_CELL * ((float)cell[2] + 0.5f - FV_PIPES_NZ / 2));
}

int fv_pipes_at(const struct fv_pipes *pipes, int x, int y, int z)
{
    bool inside = x >= 0 && x < size[0] && y >= 0 && y < size[1] && z >= 0 && z < size[2];
    return inside ? pipes->cell[x][y][z] : FV_PIPES_STRUCTURE;
}

bool fv_pipes_all_free(const struct fv_pipes *pipes, const int low[3], const int cells[3])
{
    for (int x = 0; x < cells[0]; x++)
        for (int y = 0; y < cells[1]; y++)
            for (int z = 0; z < cells[2]; z++)
                if (fv_pipes_at(pipes, low[0] + x, low[1] + y, low[2] + z) != FV_PIPES_FREE) return false;
    return true;
}

void fv_pipes_claim(struct fv_pipes *pipes, const int low[3], const int cells[3], int what)
{
    for (int x = 0; x < cells[0]; x++)
        for (int y = 0; y < cells[1]; y++)
            for (int z = 0; z < cells[2]; z++)
                pipes->cell[low[0] + x][low[1] + y][low[2] + z] = (uint16_t)what;
}

/* How many of the next `wanted` cells from `from` are free, up to the first that is not. */
static int free_run(const struct fv_pipes *pipes, const int from[3], int axis, int sign, int wanted)
{
    int at[3] = {from[0], from[1], from[2]}, run = 0;
    while (run < wanted) {
        at[axis] += sign;
        if (fv_pipes_at(pipes, at[0], at[1], at[2]) != FV_PIPES_FREE) break;
        run++;
    }
    return run;
}

/* Goes on by one leg; false where no direction has room. Mostly along the structure. */
static bool add_leg(struct fv_pipes *pipes, int bundle, uint32_t *random, struct fv_pipes_route *route,
                    int *last_axis)
{
    static const int axis_of[10] = {0, 0, 0, 0, 0, 2, 2, 2, 1, 1};
    static const int least[3] = {4, 2, 3}, most[3] = {26, 5, 9};
    const int *from = route->corner[route->legs];
    for (int attempt = 0; attempt < 12; attempt++) {
        int axis = axis_of[fv_random_below(random, 10)], sign = fv_random_below(random, 2) * 2 - 1;
        int wanted = least[axis] + fv_random_below(random, most[axis] - least[axis] + 1);
        if (axis == *last_axis) continue;
        int run = free_run(pipes, from, axis, sign, wanted);
        if (run < least[axis]) continue;
        int *to = route->corner[++route->legs];
        for (int i = 0; i < 3; i++) to[i] = from[i];
        for (int n = 0; n < run; n++) {
            to[axis] += sign;
            pipes->cell[to[0]][to[1]][to[2]] = (uint16_t)bundle;
        }
        *last_axis = axis;
        return true;
    }
    return false;
}

bool fv_pipes_find_route(struct fv_pipes *pipes, int bundle, uint32_t *random, struct fv_pipes_route *route)
{
    int *start = route->corner[0], axis = -1, free = -1;
    route->legs = 0;
    for (int attempt = 0; attempt < 50 && free != FV_PIPES_FREE; attempt++) {
        for (int i = 0; i < 3; i++) start[i] = fv_random_below(random, size[i]);
        free = fv_pipes_at(pipes, start[0], start[1], start[2]);
    }
    if (free != FV_PIPES_FREE) return false;
    int legs = 5 + fv_random_below(random, FV_PIPES_LEGS_MAX - 4);
    pipes->cell[start[0]][start[1]][start[2]] = (uint16_t)bundle;
    while (route->legs < legs && add_leg(pipes, bundle, random, route, &axis)) continue;
    return route->legs > 0;
}
