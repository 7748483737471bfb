/* clock_map: see clock_map.h. */
#include "sensors/imu/clock_map.h"

#include <math.h>

static const double slew = 2e-3, step_ns = 2e7, jump_ns = 1e9, second_ns = 1e9;
enum { LATE_REPORTS = 50, SECONDS_FOR_DRIFT = 4 };

void fv_clock_map_begin(struct fv_clock_map *map, double tick_ns, int bits, double drift_max)
{
    *map = (struct fv_clock_map){.tick_ns = tick_ns, .bits = bits, .drift_max = drift_max};
}

static uint64_t mask(int bits)
{
    return bits >= 64 ? UINT64_MAX : (UINT64_C(1) << bits) - 1;
}

/* Sums and differences that wrap, as times from outside may be any. */
static int64_t after(int64_t a, int64_t b)
{
    return (int64_t)((uint64_t)a + (uint64_t)b);
}

static int64_t between(int64_t a, int64_t b)
{
    return (int64_t)((uint64_t)b - (uint64_t)a);
}

int64_t fv_clock_map_unwrap(const struct fv_clock_map *map, uint64_t counter, int64_t arrival_ns)
{
    if (!map->begun) return 0;
    uint64_t on = (counter - map->newest) & mask(map->bits);
    if (map->bits >= 63) return after(map->ticks, (int64_t)on);
    double wrap = ldexp(1, map->bits), passed = (double)between(map->newest_ns, arrival_ns) / map->tick_ns;
    double wraps = rint((passed - (double)on) / wrap);
    /* More wraps than fit into the ticks: the host's time is the wrong one. */
    if (!(fabs(wraps) * wrap < 0x1p60)) wraps = 0;
    return after(map->ticks, (int64_t)on + (int64_t)(wraps * wrap));
}

/* A line by least squares through the least of each second that is over, pushed down onto the lowest of them. */
static void fit(struct fv_clock_map *map)
{
    double mean_x = 0, mean_y = 0, xy = 0, xx = 0;
    int n = map->seconds > 1 ? map->seconds - 1 : 1;
    for (int i = 0; i < n; i++) mean_x += map->least_at[i] / n, mean_y += map->least[i] / n;
    for (int i = 0; i < n; i++) {
        xy += (map->least_at[i] - mean_x) * (map->least[i] - mean_y);
        xx += (map->least_at[i] - mean_x) * (map->least_at[i] - mean_x);
    }
    map->drift = n >= SECONDS_FOR_DRIFT && xx > 0 ? fmin(fmax(xy / xx, -map->drift_max), map->drift_max) : 0;
    map->offset = INFINITY;
    for (int i = 0; i < n; i++) map->offset = fmin(map->offset, map->least[i] - map->drift * map->least_at[i]);
}

static void keep(struct fv_clock_map *map, double device, double over)
{
    int64_t second = (int64_t)floor(device / second_ns);
    if (map->seconds == 0 || second != map->second) {
        if (map->seconds == FV_CLOCK_MAP_SECONDS) {
            for (int i = 1; i < FV_CLOCK_MAP_SECONDS; i++)
                map->least[i - 1] = map->least[i], map->least_at[i - 1] = map->least_at[i];
            map->seconds--;
        }
        map->second = second;
        map->least[map->seconds] = over;
        map->least_at[map->seconds++] = device;
        fit(map);
    } else if (over < map->least[map->seconds - 1]) {
        map->least[map->seconds - 1] = over;
        map->least_at[map->seconds - 1] = device;
        map->offset = fmin(map->offset, over - map->drift * device);
    }
}

static void begin_at(struct fv_clock_map *map, uint64_t counter, int64_t arrival_ns)
{
    map->begun = true;
    map->newest = counter & mask(map->bits);
    map->ticks = 0;
    map->newest_ns = map->first_ns = arrival_ns;
    map->seconds = map->late = 0;
    map->applied = map->applied_at = 0;
    keep(map, 0, 0);
}

void fv_clock_map_arrive(struct fv_clock_map *map, uint64_t counter, int64_t arrival_ns)
{
    if (!map->begun) {
        begin_at(map, counter, arrival_ns);
        return;
    }
    int64_t ticks = fv_clock_map_unwrap(map, counter, arrival_ns);
    double device = (double)ticks * map->tick_ns;
    double over = (double)between(map->first_ns, arrival_ns) - device, line = map->offset + map->drift * device;
    /* It came before it was sent, is older than any that waits, or all are late for long: a clock has jumped. One that
     * is only late was held up. */
    map->late = over - line > jump_ns ? map->late + 1 : 0;
    bool back = device < (double)map->ticks * map->tick_ns - jump_ns;
    if (over - line < -step_ns || back || map->late >= LATE_REPORTS || !(fabs(device) < 0x1p62)) {
        map->restarts++;
        begin_at(map, counter, arrival_ns);
        return;
    }
    if (ticks <= map->ticks || arrival_ns < map->newest_ns) return;
    map->newest = counter & mask(map->bits);
    map->ticks = ticks;
    map->newest_ns = arrival_ns;
    if (map->late == 0) keep(map, device, over);
}

int64_t fv_clock_map_host_ns(struct fv_clock_map *map, int64_t ticks)
{
    double device = (double)ticks * map->tick_ns, target = map->offset + map->drift * device;
    double way = target - map->applied, most = slew * fmax(device - map->applied_at, 0);
    if (fabs(way) > step_ns || !map->given) most = INFINITY;
    map->applied += fmin(fmax(way, -most), most);
    map->applied_at = device;
    int64_t t_ns = after(map->first_ns, (int64_t)fmin(fmax(rint(device + map->applied), -0x1p62), 0x1p62));
    if (map->given && t_ns <= map->given_ns) t_ns = after(map->given_ns, 1);
    map->given = true;
    map->given_ns = t_ns;
    return t_ns;
}
