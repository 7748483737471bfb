/* player: see player.h. The feed's port is made up: what it submits is what the tape holds next. */
#include "sensors/imu/player.h"

#include "sensors/motion.h"

#include <math.h>
#include <string.h>

static int64_t now_ns(void *context)
{
    return ((struct fv_imu_player *)context)->now_ns;
}

static void sleep_until_ns(void *context, int64_t t_ns)
{
    (void)context, (void)t_ns;
}

static int open_stream(void *context, const struct fv_imu_device **device, const struct fv_imu_calibration **calibration,
                       struct fv_error *error)
{
    struct fv_imu_player *p = context;
    (void)error;
    *device = &p->tape.device[p->tape.stream[p->stream].device];
    *calibration = &p->tape.stream[p->stream].calibration;
    return 0;
}

static enum fv_imu_submitted submit(void *context, int transfer)
{
    (void)context, (void)transfer;
    return FV_IMU_SUBMITTED;
}

static void cancel(void *context, int transfer)
{
    struct fv_imu_player *p = context;
    fv_imu_feed_end(&p->feed, transfer, FV_IMU_CANCELLED, NULL, 0, p->now_ns);
}

static int unstall(void *context)
{
    (void)context;
    return 0;
}

static int tell(void *context, const struct fv_imu_command *command)
{
    (void)context, (void)command;
    return 0;
}

static void wait_until(void *context, int64_t until_ns)
{
    (void)context, (void)until_ns;
}

static void close_stream(void *context)
{
    (void)context;
}

void fv_imu_player_begin(struct fv_imu_player *p, const struct fv_imu_tape *tape)
{
    if (&p->tape != tape) p->tape = *tape;
    p->port = (struct fv_imu_port){open_stream, submit, cancel, unstall, tell, wait_until, close_stream, p};
    p->clock = (struct fv_clock){now_ns, now_ns, sleep_until_ns, p};
    p->now_ns = p->round = p->next = p->again = 0;
    while (tape->row[p->again].arrival_ns < tape->session_ns) p->again++;
    while (p->again > 0 && tape->row[p->again].number > 0) p->again--;
    p->length_ns = tape->last_ns - tape->session_ns + (int64_t)fmin(fmax(1e9 / tape->device[0].hz, 1), 1e9);
    fv_imu_feed_begin(&p->feed, &p->port, &p->clock);
}

int fv_imu_player_open(struct fv_imu_player *p, const char *path, struct fv_error *error)
{
    int result = fv_imu_tape_read(&p->tape, path, error);
    if (result == 0) fv_imu_player_begin(p, &p->tape);
    return result;
}

/* The device of the next row is plugged in. */
static void connect(struct fv_imu_player *p)
{
    struct fv_error error;
    fv_imu_feed_close(&p->feed);
    p->stream = p->tape.row[p->next].stream;
    fv_imu_feed_search(&p->feed, &error); /* its stream was tried when the tape was read */
}

/* Takes the next report, where it came until then, session time. */
static bool take_report(struct fv_imu_player *p, int64_t until_ns)
{
    struct fv_imu_reading reading[FV_IMU_READINGS];
    const struct fv_imu_tape_row *row = &p->tape.row[p->next];
    int count = 0;
    if (p->next == p->tape.rows) return false;
    int64_t arrival_ns = p->round * p->length_ns + row->arrival_ns - p->tape.session_ns;
    if (arrival_ns > until_ns) return false;
    p->now_ns = arrival_ns;
    if (row->begins || p->feed.phase != FV_IMU_STREAMING) connect(p);
    do reading[count++] = p->tape.row[p->next++].reading;
    while (p->next < p->tape.rows && count < FV_IMU_READINGS && p->tape.row[p->next].number == count);
    fv_imu_feed_end(&p->feed, 0, FV_IMU_CAME, (const uint8_t *)reading, (size_t)count * sizeof reading[0], arrival_ns);
    return true;
}

static void take_until(struct fv_imu_player *p, int64_t round, int64_t t_ns)
{
    if (round > p->round) {
        while (round == p->round + 1 && take_report(p, INT64_MAX)) {
        }
        fv_imu_feed_close(&p->feed);
        p->round = round;
        p->next = p->again;
    }
    while (take_report(p, t_ns)) {
    }
}

bool fv_imu_player_head(struct fv_imu_player *p, const struct fv_neck *neck, bool predict, int64_t t_ns,
                        int64_t ahead_ns, struct fv_pose *head)
{
    struct fv_imu_state state = {0};
    int64_t into_ns, round = fv_motion_epoch(t_ns, p->length_ns, &into_ns);
    int64_t at_ns = round * p->length_ns + into_ns; /* t_ns, but for times that are out of range */
    take_until(p, round, at_ns);
    fv_mailbox_get(&p->feed.box, &state, sizeof state);
    return fv_imu_head(&state, neck, predict, at_ns, ahead_ns, head);
}
