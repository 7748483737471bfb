/* session: what a run leaves behind: one record a frame and the totals, in fixed memory.
 *
 * Filled by loop.c, written as report.json and report.html by cli/report.h, as frames.csv by
 * cli/frames_csv.h. */
#ifndef FV_FRAME_SESSION_H
#define FV_FRAME_SESSION_H

#include "rt/trace/rays.h"

#include <stdbool.h>
#include <stdint.h>

enum { FV_STAGES_MAX = 18, FV_PLAN_ROWS_MAX = 192, FV_RINGS = 36 };

/* Width of a ring of eccentricity; the last one holds all that lies farther out. */
#define FV_RING_DEG 2.5

/* What was decided for a frame while it ran, by the clock: together with what was latched it makes the same
 * picture again (replay). */
struct fv_decision {
    int64_t t_ns;                 /* session time that the frame was shown for */
    int32_t level;                /* quality level; 0: what the settings say */
    int32_t done[FV_STAGES_MAX];  /* tiles that each stage worked at before it was cut; -1: all */
    int64_t late_ns;              /* late: session time that its picture was turned for (pass/turn.h); 0: it was not */
};

struct fv_frame_record {
    int64_t frame, t_ns;          /* number and session time of display */
    float frame_ms;               /* wall time from the latch to the finished picture, all stages together */
    float cpu_ms;                 /* thread CPU time of all workers together */
    float stage_ms[FV_STAGES_MAX]; /* wall time of each stage */
    float control_ms;             /* wall time of choosing the level and putting tiles in order */
    float idle_ms;                /* of all workers together: waiting for each other within the stages */
    float predicted_ms, budget_ms; /* what the level was predicted to take, of what it was allowed; 0: unknown */
    float latch_ms;               /* from the latch to the deadline */
    int32_t level;                /* quality level; 0: what the settings say */
    int32_t periods;              /* display periods that the frame was given */
    int32_t cut_tiles;            /* tiles left to their stand-in, of all stages together */
    uint32_t late_stages;         /* bit s: stage s ended after the deadline */
    struct fv_decision decision;
    float r0_deg, r1_deg, p_min;
    int64_t rays[FV_RAY_KINDS];
    float sampled_fraction;       /* primary rays (support nodes too) over pixels x samples a pixel, at most 1 */
    float gaze_px[2][2];          /* gaze in each eye's picture, x y */
    float gaze_latency_ms;        /* from the gaze sample's time to the latch */
    bool missed, cut, turned;     /* turned: late, and its picture turned to the newest head */
};

struct fv_session {
    const char *scene, *method;   /* names */
    int64_t triangles, fields;
    const char *cpu, *isa;
    int threads;
    double period_ms;
    int stages;
    const char *stage[FV_STAGES_MAX];
    int64_t pixels;               /* of all eyes */
    /* The first `capacity` frames are kept; totals go on. */
    int64_t frames, capacity, missed, cut_frames;
    int64_t late_corrected;       /* of those missed, whose pictures were turned to the newest head */
    int64_t skipped;              /* display periods that no new frame was ready for */
    int levels;                   /* rows of the method's table, besides 0; 0: the level does not adapt */
    /* What samples cost by eccentricity, of all frames together: FV_RING_DEG each from the gaze outwards. */
    struct fv_ring {
        double cpu_ns;            /* of stages that trace samples by tile, by wall time of their tiles */
        int64_t units;            /* of their work (pass.h) */
        int64_t tiles, cut;       /* worked at; left to their stand-in */
    } ring[FV_RINGS];
    struct fv_frame_record *record;
    /* Sensors and memory, at the end. */
    int64_t gaze_samples, gaze_lost, imu_samples, imu_rejected;
    int64_t imu_readings, imu_lost, imu_reconnects; /* of a device; of its samples: */
    int64_t imu_repeated, imu_clock_restarts, imu_mistimed, imu_bad, imu_stuck, imu_saturated;
    double gaze_latency_ms_p50;
    int cameras; /* of the eyes; 0: no camera is the source of gaze, and all of them below are 0 */
    int64_t camera_frames, camera_skipped, camera_gaps, camera_rejected, camera_untimed, camera_errors;
    int64_t camera_lost, camera_restarts;
    int64_t eye_no_pupil, eye_unsure, eye_blinks; /* frames without a pupil, with a doubtful one; eyes lost to sight */
    double camera_ms_mean, camera_ms_most; /* from a frame in memory to its gaze */
    int64_t tape_rows, tape_dropped; /* recorded, and not: the disk was slow or failed */
    int tape_cut; /* recordings that are not whole: what was latched, what devices gave */
    int64_t pictures, pictures_failed; /* that the sink took; that it could not, and took no more */
    int64_t heap_calls, memory_syscalls;
    struct fv_session_display { /* a display of the machine; no mode: there is none, and all is 0 */
        char mode[128];
        double hz, measured_hz; /* measured_hz 0: not known */
        bool atomic, vblank;
        int64_t flips, skipped, dropped, busy, odd, lost, back, bytes;
        double copy_ms_mean, copy_ms_most;
    } display;
    struct fv_session_gpio { /* lines of a GPIO chip; no lines: all is 0 */
        int lines;
        int64_t vsyncs, odd, strobes, presses, errors;
        double vsync_hz;
    } gpio;
    /* Rows of the plan: what was kept or left out, with the reason and bytes. */
    int plan_rows;
    struct fv_plan_row {
        char what[32], kind[16], reason[128]; /* kind: pass, buffer, kernel, feature, memory, thread, device */
        bool kept;
        int64_t bytes; /* kept: taken; left out: what it would have taken, 0 where that is not known */
    } plan[FV_PLAN_ROWS_MAX];
};

#endif
