/* feed: a device's reports as they come in, and what is done when they do not: a state machine without input or output.
 *
 *   searching   the port is opened once every FV_IMU_SEARCH_NS until a device is there
 *   streaming   several transfers are in flight, each submitted again when it ends; reports become samples (devices.h),
 *               those the head's orientation (fusion.h), and that is put into a mailbox after every report
 *   ending      the device is gone, or fails: what is in flight is cancelled and waited for, the port is closed
 *
 * A device that is unplugged may tell so by a transfer's end, or by nothing but failures until a submission says it;
 * both end the stream. So do failures and stalls in a row without a report between them, and silence: opening it again
 * is all that can be tried, and an unplugged device that says nothing must not be waited for. A halted endpoint keeps
 * what is in flight for ever: it is cancelled, then the halt is cleared.
 *
 * Across an absence the orientation is kept, and turns no further; time goes on by the host's clock. Everything is
 * counted; that reports stay away, and that they come again, is logged once each. Nothing is allocated, and nothing is
 * shared but the mailbox. usb_port.h is the port to real devices. */
#ifndef FV_SENSORS_IMU_FEED_H
#define FV_SENSORS_IMU_FEED_H

#include "platform/clock.h"
#include "platform/mailbox.h"
#include "sensors/imu/devices.h"
#include "sensors/imu/fusion.h"
#include "sensors/imu/recorder.h"

/* Reports of 32 ms at 1 kHz: the thread may be held up for so long, as by a search for pupils before it, without a loss. */
enum { FV_IMU_TRANSFERS = 32, FV_IMU_FAILURES_MAX = 3 * FV_IMU_TRANSFERS };

#define FV_IMU_SEARCH_NS INT64_C(1000000000)
#define FV_IMU_SILENCE_NS INT64_C(2000000000)  /* no report for so long ends the stream */
#define FV_IMU_FAREWELL_NS INT64_C(1000000000) /* cancelled transfers are waited for at most so long */
#define FV_IMU_WAIT_NS INT64_C(100000000)      /* a step takes at most about that */

/* How a transfer ended. */
enum fv_imu_end {
    FV_IMU_CAME,      /* with these bytes; none: the empty packet after a report as long as packets may be */
    FV_IMU_FAILED,    /* the bus's error, or the first sign that the device is gone */
    FV_IMU_STALLED,   /* the endpoint has halted */
    FV_IMU_TOO_LONG,  /* more came than there was room for */
    FV_IMU_CANCELLED,
    FV_IMU_GONE       /* no device */
};

enum fv_imu_submitted { FV_IMU_SUBMITTED, FV_IMU_REFUSED, FV_IMU_NO_DEVICE };

/* Input and output as the feed sees it. */
struct fv_imu_port {
    /* Finds and opens the device; 0, its row and its calibration (NULL: none), 1 where none is there, -1 where it cannot
     * be opened, both with the error set. */
    int (*open)(void *context, const struct fv_imu_device **device, const struct fv_imu_calibration **calibration,
                struct fv_error *error);
    enum fv_imu_submitted (*submit)(void *context, int transfer);
    void (*cancel)(void *context, int transfer);
    int (*unstall)(void *context); /* 0, or -1: the endpoint stays halted */
    int (*tell)(void *context, const struct fv_imu_command *command); /* 0, or -1: the device did not take it */
    /* Waits until then at most, and tells what has ended by fv_imu_feed_end. */
    void (*wait)(void *context, int64_t until_ns);
    void (*close)(void *context);
    void *context;
};

struct fv_imu_feed_counts {
    int64_t connects;                       /* the port was opened; all but the first are reconnects */
    int64_t reports, samples;               /* as devices.h counts them; of all connections */
    int64_t repeated, lost, restarts;
    int64_t rejected;                       /* samples: mistimed, bad or stuck (fusion.h) ... */
    int64_t mistimed, bad, stuck, saturated; /* ... and these one by one; a saturated one is taken all the same */
    int64_t foreign;                        /* reports that are none of the device's, short ones too */
    int64_t empty, too_long, stalls, failures, refused, silences;
    int64_t untold;                         /* commands that the device did not take */
};

/* What the mailbox holds. */
struct fv_imu_state {
    int64_t connected;   /* 1: a device is open */
    int64_t t_ns;        /* of the newest good sample, the clock's; meaningless before the first */
    int64_t arrival_ns;  /* when it came */
    int64_t good;        /* good samples; 0: rotation is the identity */
    double rotation[4];  /* device to world */
    double rate[3];      /* rad/s, device axes */
    struct fv_imu_feed_counts counts;
};

enum fv_imu_feed_phase { FV_IMU_SEARCHING, FV_IMU_STREAMING, FV_IMU_ENDING };

/* The caller's: begun by fv_imu_feed_begin, then one thread's. */
struct fv_imu_feed {
    const struct fv_imu_port *port;
    const struct fv_clock *clock;
    enum fv_imu_feed_phase phase;
    const struct fv_imu_device *device; /* of the newest connection */
    struct fv_imu_stream stream;
    struct fv_fusion fusion;
    struct fv_imu_state state;
    struct fv_imu_counts past; /* of the streams before this one */
    bool flying[FV_IMU_TRANSFERS], idle[FV_IMU_TRANSFERS]; /* idle: to be submitted by the next step */
    bool halted, cancelled;     /* the endpoint has halted; what was in flight is cancelled for that */
    bool gone, missed;          /* the device is gone; that there are no reports was told */
    bool sampled;               /* sample_ns is of a sample */
    int failed;                 /* ends without a report, in a row */
    int64_t phase_ns, report_ns, sample_ns;
    int64_t tell_ns; /* when the device's command is due */
    struct fv_error error; /* why no device could be opened; "": it could */
    bool told;             /* that was logged */
    struct fv_imu_recorder *_Atomic recorder; /* NULL: samples are not recorded */
    struct fv_mailbox box;
};

/* Nothing is opened yet. */
void fv_imu_feed_begin(struct fv_imu_feed *feed, const struct fv_imu_port *port, const struct fv_clock *clock);

/* Opens the port and submits all transfers, at once; 0, or 1 or -1 with the error set, as port->open. For the first time,
 * where an error is to be told; the steps do it by themselves. */
int fv_imu_feed_search(struct fv_imu_feed *feed, struct fv_error *error);

/* Goes on, for about FV_IMU_WAIT_NS or until something ended. For a thread to call for ever. */
void fv_imu_feed_step(struct fv_imu_feed *feed);

/* For the port: a transfer that was submitted has ended, at arrival_ns. */
void fv_imu_feed_end(struct fv_imu_feed *feed, int transfer, enum fv_imu_end end, const uint8_t *bytes, size_t length,
                     int64_t arrival_ns);

/* Ends the stream, if there is one, and closes the port; steps may begin again. */
void fv_imu_feed_close(struct fv_imu_feed *feed);

#endif
