/* cli: the command line: `foveola VERB [options]`. The only part that sees all the others; a verb is
 * a row of the table in main.c. */
#ifndef FV_CLI_CLI_H
#define FV_CLI_CLI_H

#include "config/config.h"
#include "display/display.h"
#include "platform/files.h"
#include "platform/gpio.h"
#include "platform/realtime.h"
#include "rt/frame/loop.h"
#include "rt/scene/path.h"
#include "sensors/sensors.h"

/* Exit codes, fixed: scripts depend on them. */
enum { FV_EXIT_DONE = 0, FV_EXIT_NOT_HELD = 1, FV_EXIT_UNUSABLE = 2, FV_EXIT_DEVICE = 3 };

enum { FV_OPERANDS_MAX = 256 };

/* Options of measure. */
struct fv_measure_arguments {
    const char *method; /* --method, NULL: all */
    int level;          /* --level, -1: all */
    double seconds;     /* --seconds, 0 where it is not given */
    int shard, shards;  /* --shard I/N: I - 1 and N; 0 of 1 where it is not given */
    bool merge;         /* --merge: the operands are folders to join */
    const char *table;  /* --table, NULL: a sweep */
    const char *part;   /* --part, what names of its parts begin with; NULL: all */
};

struct fv_arguments {
    struct fv_config_request request;
    struct fv_measure_arguments measure;
    const char *out;         /* --out, "out" where it is not given */
    const char *decisions;   /* replay: file of what was decided (cli/decisions.h) ... */
    int64_t recorded;        /* ... for so many frames; 0: there is none */
    int64_t frames;          /* --frames, -1 where it is not given */
    int points;              /* --points, 9 where it is not given */
    const char *root;        /* --root: folder in whose place / is, NULL where it is not given */
    bool json;               /* --json */
    double ppd;              /* --ppd, pixels per degree, 67 where it is not given */
    double fov_deg;          /* --fov, across the picture, 0 where it is not given */
    double gaze_px[2];       /* --gaze, where has_gaze */
    bool has_gaze;
    const char *operand[FV_OPERANDS_MAX]; /* what stands behind the verb without an option */
    int operands;
};

/* A verb: what parses it and what help prints. */
struct fv_verb {
    const char *name;
    int (*run)(const struct fv_arguments *arguments); /* returns an exit code */
    const char *options; /* the options it takes, each followed by a space */
    int operands;        /* the most words that it takes without an option */
    const char *usage, *what;
};
extern const struct fv_verb fv_verbs[];
extern const int fv_verbs_count;

/* Reads what stands behind the verb; options are written "--name value" or "--name=value". Returns 0, or -1
 * with the reason logged. */
int fv_options_read(struct fv_arguments *arguments, const struct fv_verb *verb, int count, char **text);

int fv_verb_run(const struct fv_arguments *arguments);
int fv_verb_replay(const struct fv_arguments *arguments);
int fv_verb_compare(const struct fv_arguments *arguments);
int fv_verb_measure(const struct fv_arguments *arguments);
int fv_verb_calibrate(const struct fv_arguments *arguments);
int fv_verb_check(const struct fv_arguments *arguments);
int fv_verb_plan(const struct fv_arguments *arguments);
int fv_verb_help(const struct fv_arguments *arguments);
int fv_verb_version(const struct fv_arguments *arguments);

/* Everything that frames need, from settings to the first frame; takes all memory. */
struct fv_setup {
    /* Called when the scene is loaded, before the tracer is opened; NULL: nothing is changed. */
    void (*change)(void *context, struct fv_setup *setup);
    void *change_context;
    struct fv_config config;
    struct fv_scene scene;
    struct fv_tracer tracer;
    struct fv_workers workers;
    struct fv_plan plan;
    struct fv_session session;
    struct fv_loop loop;
    struct fv_sensors *sensors; /* given back by fv_setup_close, at the latest where the verb ends */
    bool recentre;         /* asked for: at the next latch the head's heading and place become straight ahead */
    bool centred;          /* `centre` holds what was set by it */
    struct fv_pose centre; /* relative to the sensors' */
    struct fv_png *png; /* for the report's pictures; NULL where no sink takes pictures */
};

/* Settings, scene, tracer and plan. Returns 0, or -1 with the error set. */
int fv_setup_open(struct fv_setup *setup, const struct fv_config_request *request, struct fv_error *error);

/* 0 where pictures are a pinhole's, as those must be that are compared by eccentricity and between frames; else -1 with
 * the error set. */
int fv_setup_pinhole(const struct fv_config *config, struct fv_error *error);

/* The method of that name; NULL with the error set, which says which `key` named it. */
const struct fv_method *fv_setup_method(const char *name, const char *key, struct fv_error *error);

/* Sensors and workers; `gaze`: whether anything uses where the eye looks, else its source stays shut.
 * Returns 0, or -1 with the error set. */
int fv_setup_start(struct fv_setup *setup, bool gaze, struct fv_error *error);

/* Gives the devices of the newest setup back to the system; nothing is latched any more. Nothing where that was done. */
void fv_setup_close(void);

/* What the sensors say for the session time show_ns, known at now_ns (fv_sensors_latch), and the head's pose
 * in the world that follows for a viewer on the scene's path. */
void fv_setup_latch(struct fv_setup *setup, int64_t now_ns, int64_t show_ns, struct fv_pose *relative,
                    struct fv_gaze *gaze, struct fv_pose *head);

/* Sensors, workers, buffers and records: all the memory that a run of `frames` frames (-1: no end)
 * takes, but for its sink's. Records are kept of the first FV_RECORDS_MAX frames. */
enum { FV_RECORDS_MAX = 100000 };
int fv_setup_take(struct fv_setup *setup, int64_t frames, struct fv_error *error);

/* What the settings ask for of the board's extras. */
struct fv_realtime_request fv_setup_realtime_request(const struct fv_config *config);

/* The board's extras (platform/realtime.h), last of all before frames: asked of the machine where `apply` is
 * set, else only named. Each becomes a row of the plan, which then is whole: it goes into the session's report. */
void fv_setup_realtime(struct fv_setup *setup, bool apply);

/* Gives up what frames do not need (platform/sandbox.h), at the very last: files are made in `out` only from here on.
 * A row of the plan, too. */
void fv_setup_seal(struct fv_setup *setup, const char *out);

/* gpio.* of the settings; period_ns: of the display. */
void fv_setup_lines(struct fv_gpio_settings *lines, const struct fv_config *config, int64_t period_ns);

#endif
