/* watch: looks at the program while it runs, and says what is not as it should be: descriptors, memory, threads and
 * frame time that drift; devices that do not come back. It sees each frame through fv_setup_latch and
 * fv_display_present, which the linker leads here. */
#ifndef FV_SOAK_WATCH_H
#define FV_SOAK_WATCH_H

#include "cli/cli.h"
#include "display/display.h"
#include "sensors/imu/feed.h"
#include "tests/soak/faults.h"

/* What the program has counted up to now. */
struct seen {
    struct fv_sensors_counts sensors;
    struct fv_imu_feed_counts imu;
    struct fv_display_counts display;
    int64_t frames, skipped;
};
void watch_look(struct seen *seen);

/* When a group last worked as it should: a gaze that is new, a pose that is new, a flip, a frame. 0: never. And when it
 * first did after a time. */
int64_t watch_fresh_ns(enum fault_group group);
void watch_expect(enum fault_group group);
int64_t watch_back_ns(enum fault_group group);

/* every_s: from one inspection to the next. */
void watch_begin(uint64_t seed, const char *session, double every_s);
void watch_report(void);

/* Says that something is wrong, by seed and time: it can be run again. */
void watch_fail(const char *format, ...) __attribute__((format(printf, 1, 2)));
int watch_failures(void);

/* Faults of the soak itself: memory that is kept at each inspection; work that grows. */
extern bool watch_hoard, watch_slow;

/* Called once a frame. */
extern void (*watch_each_frame)(void);

/* Descriptors of the soak's own that it has closed since the beginning. */
extern int watch_closed;

#endif
