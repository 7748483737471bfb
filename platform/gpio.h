/* gpio: lines of a GPIO chip: a display's vertical sync or tearing-effect line as a clock, a strobe at each flip for a
 * photo diode's trigger, a line that is high while frames miss their flip, a heartbeat for a watchdog, a button.
 *
 *   gpio.c         what the lines do
 *   gpio_system.c  libgpiod, behind struct fv_gpio_io; it allocates when lines are taken, before the seal, and not after
 *
 * Each line is optional. Polled by the frame loop, without a thread: the kernel stamps edges (CLOCK_MONOTONIC) and keeps
 * them. A line that fails is said once and left alone from then on; the loop goes on. */
#ifndef FV_PLATFORM_GPIO_H
#define FV_PLATFORM_GPIO_H

#include "platform/error.h"
#include "platform/vsync.h"

enum fv_gpio_line {
    FV_GPIO_VSYNC,  /* in: rises at each refresh */
    FV_GPIO_BUTTON, /* in: rises when pressed */
    FV_GPIO_INPUTS,
    FV_GPIO_STROBE = FV_GPIO_INPUTS, /* out: changes with each flip that is handed over */
    FV_GPIO_MISSED,                  /* out: high from a frame that missed its flip to the next that did not */
    FV_GPIO_HEARTBEAT,               /* out: changes with each frame */
    FV_GPIO_LINES
};

enum { FV_GPIO_NAME = 64, FV_GPIO_EDGES = 64 };

struct fv_gpio_edge {
    int offset; /* of the line in its chip */
    int64_t t_ns;
    uint32_t number; /* of this line's edges, those that were dropped too */
};

/* What is asked of the system. One chip at a time. */
struct fv_gpio_io {
    /* The chip of that label or name (gpiochip0). 0, or -1 with the error set. */
    int (*open)(void *context, const char *chip, struct fv_error *error);
    int (*find)(void *context, const char *name); /* offset of a line by its name; -1: the chip has none */
    /* Whether a line is free: 0; 1: held, by whom; -errno. */
    int (*look)(void *context, int offset, char holder[FV_GPIO_NAME]);
    /* Takes lines: edges of the inputs are kept, outputs begin low. 0, or -1 with the error set. */
    int (*take)(void *context, const int *input, int inputs, const int *output, int outputs, struct fv_error *error);
    int (*edges)(void *context, struct fv_gpio_edge *edge, int most); /* those that wait, oldest first; -errno */
    int (*set)(void *context, int offset, bool high);                 /* 0 or -errno */
    void (*close)(void *context);
    void *context;
};
extern const struct fv_gpio_io fv_gpio_system;

struct fv_gpio_settings {
    char chip[FV_GPIO_NAME], line[FV_GPIO_LINES][FV_GPIO_NAME]; /* names; empty: none */
    int64_t period_ns;                                          /* of the display, nominal */
};

struct fv_gpio_counts {
    int64_t vsyncs;  /* edges of the vertical sync */
    int64_t strobes; /* changes of the strobe */
    int64_t presses; /* of the button; what follows within 50 ms is the same one */
    int64_t errors;  /* calls that failed */
};

struct fv_gpio {
    const struct fv_gpio_io *io;
    int lines; /* that are used; 0: nothing is open */
    int offset[FV_GPIO_LINES]; /* -1: not used, or failed */
    bool high[FV_GPIO_LINES];  /* outputs, as they were set */
    bool deaf;                 /* inputs have failed */
    struct fv_vsync vsync;
    bool numbered, pressed;
    uint32_t number; /* of the newest vertical sync */
    int64_t pressed_ns;
    struct fv_gpio_counts counts;
    char text[256]; /* what failed; empty: nothing, or it has been told */
};

/* The setting of a line, "gpio.vsync". */
const char *fv_gpio_key(enum fv_gpio_line line);

/* Takes the lines that are named: 0, or -1 with what is wrong. None is named: 0, and all calls do nothing. */
int fv_gpio_open(struct fv_gpio *gpio, const struct fv_gpio_settings *settings, const struct fv_gpio_io *io,
                 struct fv_error *error);

/* A picture was handed over: the strobe changes. */
void fv_gpio_strobe(struct fv_gpio *gpio);
/* A frame is over: the heartbeat changes; whether it missed its flip. */
void fv_gpio_frame(struct fv_gpio *gpio, bool missed);

/* Takes the edges that wait. */
void fv_gpio_poll(struct fv_gpio *gpio);

/* The beat of the vertical sync, of the edges that were taken; lead_ns is left alone. False: there is none. */
bool fv_gpio_beat(const struct fv_gpio *gpio, int64_t now_ns, struct fv_beat *beat);

/* True once after each press. */
bool fv_gpio_pressed(struct fv_gpio *gpio);

/* Outputs low, lines given back. */
void fv_gpio_close(struct fv_gpio *gpio);

#endif
