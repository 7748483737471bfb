/* gpio: see gpio.h. */
#include "platform/gpio.h"

#include <stdio.h>
#include <string.h>

static const int64_t bounce_ns = 50000000;
static const char *const keys[FV_GPIO_LINES] = {"gpio.vsync", "gpio.button", "gpio.strobe", "gpio.missed", "gpio.heartbeat"};

const char *fv_gpio_key(enum fv_gpio_line line)
{
    return keys[line];
}

/* Offsets of the lines that are named, each once. */
static int find_lines(struct fv_gpio *g, const struct fv_gpio_settings *w, struct fv_error *error)
{
    for (int i = 0; i < FV_GPIO_LINES; i++) {
        if (!w->line[i][0]) continue;
        g->offset[i] = g->io->find(g->io->context, w->line[i]);
        if (g->offset[i] < 0)
            return fv_error_set(error, "%s: the chip %.60s has no line named '%.60s' (gpioinfo lists them)", keys[i],
                                w->chip, w->line[i]);
        for (int k = 0; k < i; k++)
            if (g->offset[k] == g->offset[i])
                return fv_error_set(error, "%s: the line '%.60s' is that of %s already", keys[i], w->line[i], keys[k]);
        g->lines++;
    }
    return 0;
}

int fv_gpio_open(struct fv_gpio *g, const struct fv_gpio_settings *w, const struct fv_gpio_io *io,
                 struct fv_error *error)
{
    int named = -1, taken[FV_GPIO_LINES], inputs = 0, outputs = 0;
    *g = (struct fv_gpio){.io = io, .pressed_ns = INT64_MIN / 2};
    for (int i = 0; i < FV_GPIO_LINES; i++) g->offset[i] = -1;
    for (int i = 0; i < FV_GPIO_LINES; i++)
        if (w->line[i][0]) named = i;
    fv_vsync_begin(&g->vsync, w->period_ns);
    if (named < 0) return 0;
    if (!w->chip[0]) return fv_error_set(error, "gpio.chip: is empty; must name the chip that %s is of", keys[named]);
    if (io->open(io->context, w->chip, error)) return -1;
    int failed = find_lines(g, w, error);
    for (int i = 0; i < FV_GPIO_INPUTS; i++)
        if (g->offset[i] >= 0) taken[inputs++] = g->offset[i];
    for (int i = FV_GPIO_INPUTS; i < FV_GPIO_LINES; i++)
        if (g->offset[i] >= 0) taken[inputs + outputs++] = g->offset[i];
    if (!failed) failed = io->take(io->context, taken, inputs, taken + inputs, outputs, error);
    if (!failed) return 0;
    io->close(io->context);
    g->lines = 0;
    for (int i = 0; i < FV_GPIO_LINES; i++) g->offset[i] = -1;
    return -1;
}

static void fail(struct fv_gpio *g, const char *what, int number)
{
    g->counts.errors++;
    snprintf(g->text, sizeof g->text, "%s: %s; the line is left alone from here on", what, strerror(-number));
}

static bool set(struct fv_gpio *g, enum fv_gpio_line line, bool high)
{
    if (g->offset[line] < 0 || high == g->high[line]) return g->offset[line] >= 0;
    int failed = g->io->set(g->io->context, g->offset[line], high);
    g->high[line] = high;
    if (failed >= 0) return true;
    fail(g, keys[line], failed);
    g->offset[line] = -1;
    return false;
}

void fv_gpio_strobe(struct fv_gpio *g)
{
    if (set(g, FV_GPIO_STROBE, !g->high[FV_GPIO_STROBE])) g->counts.strobes++;
}

void fv_gpio_frame(struct fv_gpio *g, bool missed)
{
    set(g, FV_GPIO_MISSED, missed);
    set(g, FV_GPIO_HEARTBEAT, !g->high[FV_GPIO_HEARTBEAT]);
}

static void take_edge(struct fv_gpio *g, const struct fv_gpio_edge *e)
{
    if (e->offset == g->offset[FV_GPIO_VSYNC]) {
        uint32_t steps = e->number - g->number;
        bool follows = g->numbered && steps > 0 && steps < 1u << 16;
        fv_vsync_saw(&g->vsync, e->t_ns, follows ? steps : 0);
        g->counts.vsyncs++;
        g->number = e->number;
        g->numbered = true;
    } else if (e->offset == g->offset[FV_GPIO_BUTTON]) {
        bool bounced = e->t_ns - g->pressed_ns < bounce_ns;
        g->pressed_ns = e->t_ns;
        if (bounced) return;
        g->counts.presses++;
        g->pressed = true;
    }
}

void fv_gpio_poll(struct fv_gpio *g)
{
    struct fv_gpio_edge edge[FV_GPIO_EDGES];
    bool listens = g->offset[FV_GPIO_VSYNC] >= 0 || g->offset[FV_GPIO_BUTTON] >= 0;
    if (!listens || g->deaf) return;
    int count = g->io->edges(g->io->context, edge, FV_GPIO_EDGES);
    for (int i = 0; i < count; i++) take_edge(g, &edge[i]);
    if (count >= 0) return;
    fail(g, g->offset[FV_GPIO_VSYNC] >= 0 ? keys[FV_GPIO_VSYNC] : keys[FV_GPIO_BUTTON], count);
    g->deaf = true;
    g->vsync.known = false;
}

bool fv_gpio_beat(const struct fv_gpio *g, int64_t now_ns, struct fv_beat *beat)
{
    return g->offset[FV_GPIO_VSYNC] >= 0 && !g->deaf && fv_vsync_beat(&g->vsync, now_ns, beat);
}

bool fv_gpio_pressed(struct fv_gpio *g)
{
    bool pressed = g->pressed;
    g->pressed = false;
    return pressed;
}

void fv_gpio_close(struct fv_gpio *g)
{
    if (g->lines == 0) return;
    for (int i = FV_GPIO_INPUTS; i < FV_GPIO_LINES; i++) set(g, (enum fv_gpio_line)i, false);
    g->io->close(g->io->context);
    g->lines = 0;
    for (int i = 0; i < FV_GPIO_LINES; i++) g->offset[i] = -1;
}
