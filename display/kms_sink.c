/* kms_sink: display.sink=kms: settings to kms.h, and what is said of changes. */
#define _GNU_SOURCE
#include "display/kms.h"

#include "display/sink.h"
#include "platform/arena.h"
#include "platform/faults.h"
#include "platform/log.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* What ends the program before close (a full arena, a sealed heap) must give the console back all the same. A thread
 * other than the one that shows pictures may be in the midst of it, and may call nothing else (platform/sandbox.h): the
 * kernel takes the screen back as the card is closed. */
static struct fv_kms *open_one;

static void close_at_death(void)
{
    if (!open_one) return;
    if (gettid() == getpid()) fv_kms_close(open_one);
    else open_one->io->console(open_one->io->context, false);
    open_one = NULL;
}

/* Of a program at fault nothing else can be relied on: the kernel closes the card with it. */
static void give_console_back(void)
{
    if (open_one) open_one->io->console(open_one->io->context, false);
}

int fv_kms_settings_of(struct fv_kms_settings *w, const struct fv_config *c, struct fv_error *error)
{
    *w = (struct fv_kms_settings){.buffers = (int)c->display_buffers,
                                  .eyes = (int)c->display_eyes,
                                  .width = (int)c->display_width,
                                  .height = (int)c->display_height,
                                  .hz = c->budget_hz};
    const struct {
        const char *key, *value;
    } connectors[FV_KMS_SCREENS] = {{"display.connector", c->display_connector},
                                    {"display.connector_right", c->display_connector_right}};
    snprintf(w->device, sizeof w->device, "%s", c->display_device);
    for (int s = 0; s < FV_KMS_SCREENS; s++) {
        size_t length = strlen(connectors[s].value);
        if (length >= FV_KMS_NAME)
            return fv_config_error(error, connectors[s].key, "'%.60s' is no connector; they are named as HDMI-A-1",
                                   connectors[s].value);
        memcpy(w->connector[s], connectors[s].value, length + 1);
    }
    if (w->connector[0][0] && strcmp(w->connector[0], w->connector[1]) == 0)
        return fv_config_error(error, "display.connector_right",
                               "is the left eye's too; leave it empty for both eyes side by side");
    if (c->display_mode[0] && !fv_kms_mode_read(c->display_mode, &w->mode_width, &w->mode_height, &w->mode_hz))
        return fv_config_error(error, "display.mode", "'%.60s': must be as 2160x1200 or 2160x1200@90",
                               c->display_mode);
    return 0;
}

static void *sink_open(const struct fv_config *config, const char *folder, struct fv_error *error)
{
    struct fv_kms_settings settings;
    (void)folder;
    if (fv_kms_settings_of(&settings, config, error)) return NULL;
    struct fv_kms *k = fv_arena_take(fv_arena(), "display", sizeof *k, 64);
    if (fv_kms_open(k, &settings, &fv_kms_system, error)) return NULL;
    open_one = k;
    fv_die_calls(close_at_death);
    fv_faults_call(give_console_back);
    fv_log("%s", k->text);
    return k;
}

static bool sink_wants(const void *state, int64_t frame, bool last)
{
    (void)state, (void)frame, (void)last;
    return true;
}

/* A display that is lost is no error of the run: it goes on, and the display may come back. */
static int sink_present(void *state, const struct fv_picture *picture, int64_t frame, struct fv_error *error)
{
    struct fv_kms *k = state;
    (void)frame, (void)error;
    if (fv_kms_present(k, picture) != FV_KMS_NOTHING) fv_log("%s", k->text);
    return 0;
}

static int sink_close(void *state, struct fv_error *error)
{
    (void)error;
    fv_kms_close(state);
    open_one = NULL;
    fv_faults_call(NULL);
    return 0;
}

static bool sink_beat(void *state, struct fv_beat *beat)
{
    return fv_kms_beat(state, beat);
}

static void sink_counts(const void *state, struct fv_display_counts *out)
{
    const struct fv_kms *k = state;
    const struct fv_kms_counts *c = &k->counts;
    const struct fv_kms_screen *screen = &k->screen[0];
    *out = (struct fv_display_counts){.hz = fv_kms_mode_hz(&screen->mode),
                                      .atomic = k->atomic,
                                      .vblank = k->vblank,
                                      .flips = c->flips,
                                      .skipped = c->skipped,
                                      .dropped = c->dropped,
                                      .busy = c->busy,
                                      .odd = c->odd,
                                      .lost = c->lost,
                                      .back = c->back,
                                      .bytes = c->bytes,
                                      .copy_ms_mean = c->copies > 0 ? (double)c->copy_ns * 1e-6 / (double)c->copies : 0,
                                      .copy_ms_most = (double)c->copy_most_ns * 1e-6,
                                      .measured_hz = k->vblank && k->vsync.count > 0 ? 1e9 / k->vsync.period_ns : 0};
    snprintf(out->mode, sizeof out->mode, "%s %dx%d, %.2f Hz", screen->name, screen->mode.hdisplay, screen->mode.vdisplay,
             out->hz);
}

const struct fv_sink fv_sink_kms = {"kms", sink_open, sink_wants, sink_present, sink_close, sink_beat, sink_counts};
