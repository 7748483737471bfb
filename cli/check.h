/* check: whether this board is ready for its settings: a list of rows, each what was looked at, what was found
 * and, where that will not do, what would have to change.
 *
 *   check_machine.c   clock and timers, frequency, heat, memory
 *   check_devices.c   devices and permissions: a table, a row each; a new device adds one there
 *   check_display.c   a display of this machine, and lines of a GPIO chip
 *   check_speed.c     what the cores can do, with the scene and method of the settings
 *   check.c           the verb: table, JSON, exit code */
#ifndef FV_CLI_CHECK_H
#define FV_CLI_CHECK_H

#include "cli/cli.h"
#include "display/kms.h"
#include "sensors/eye/v4l2.h"

enum fv_check_state {
    FV_CHECK_OK,
    FV_CHECK_NOTE,   /* worth knowing, and does not keep it from being ready */
    FV_CHECK_FAULT,  /* not ready */
    FV_CHECK_UNASKED /* the settings do not ask for it */
};

enum { FV_CHECK_ROWS_MAX = 160 };

struct fv_check_row {
    const char *group; /* static string: clock, device, ... */
    char what[48];
    enum fv_check_state state;
    char found[256], change[448]; /* change: "" where nothing has to */
};

struct fv_check {
    const char *root;                  /* folder in whose place / is: "" but in tests */
    const struct fv_camera_io *camera; /* fv_camera_system but in tests */
    const struct fv_kms_io *display;   /* fv_kms_system but in tests */
    const struct fv_gpio_io *lines;    /* fv_gpio_system but in tests */
    int rows, left_out;                /* left_out: rows that found no room */
    struct fv_check_row row[FV_CHECK_ROWS_MAX];
    /* Measured; 0 where it was not. */
    double copy_bytes_per_s;             /* read and written, all workers together */
    double primary_per_s, rays_per_s;    /* primary rays through the tracer; with the shadow and secondary ones */
    double wake_us_p50, wake_us_p99;     /* how late a sleep ends */
    double frame_ms_p50, frame_ms_p99;   /* of settled frames that adapt, where the method can, ... */
    double level, periods;               /* ... their median level and display periods */
    double missed;                       /* part of them that missed */
};

/* Adds a row. change: "" where nothing has to change. */
void fv_check_add(struct fv_check *check, const char *group, const char *what, enum fv_check_state state,
                  const char *change, const char *found, ...) __attribute__((format(printf, 6, 7)));

/* Each a group of rows. */
void fv_check_machine(struct fv_check *check);
void fv_check_memory(struct fv_check *check, const struct fv_config *config);
void fv_check_devices(struct fv_check *check, const struct fv_config *config);

/* Rows of check_devices.c's table. */
bool fv_check_display_asked(const struct fv_config *config);
void fv_check_display(struct fv_check *check, const struct fv_config *config, const char *what);
bool fv_check_lines_asked(const struct fv_config *config);
void fv_check_lines(struct fv_check *check, const struct fv_config *config, const char *what);

/* Runs the scene for so many seconds. `setup`: memory is taken (fv_setup_take), its loop adapts where its method can;
 * config: as the user has it, who may not have asked that it adapts. */
void fv_check_speed(struct fv_check *check, struct fv_setup *setup, const struct fv_config *config, double seconds);

/* Rows that keep the board from being ready. */
int fv_check_faults(const struct fv_check *check);

void fv_check_print(const struct fv_check *check, struct fv_writer *out);
void fv_check_json(const struct fv_check *check, struct fv_writer *out);

#endif
