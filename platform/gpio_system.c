/* gpio_system: libgpiod 2 behind struct fv_gpio_io. */
#define _GNU_SOURCE
#include "platform/gpio.h"

#include <errno.h>
#include <gpiod.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

enum { CHIPS_MAX = 64 };

static struct {
    struct gpiod_chip *chip;
    struct gpiod_line_request *inputs, *outputs;
    struct gpiod_edge_event_buffer *events;
} held;

/* Opens /dev/gpiochipN where it is the chip of that label or name; false: it is not. */
static bool is_chip(int n, const char *wanted, char *all, size_t size, int *refused)
{
    char path[32];
    struct stat status;
    snprintf(path, sizeof path, "/dev/gpiochip%d", n);
    if (stat(path, &status)) return false;
    held.chip = gpiod_chip_open(path);
    struct gpiod_chip_info *info = held.chip ? gpiod_chip_get_info(held.chip) : NULL;
    if (!info) *refused = errno;
    bool right = info && (strcmp(gpiod_chip_info_get_label(info), wanted) == 0 ||
                          strcmp(gpiod_chip_info_get_name(info), wanted) == 0);
    if (info && strlen(all) + 80 < size) {
        size_t used = strlen(all);
        snprintf(all + used, size - used, " %.40s (%.24s)", gpiod_chip_info_get_label(info), gpiod_chip_info_get_name(info));
    }
    if (info) gpiod_chip_info_free(info);
    if (right) return true;
    if (held.chip) gpiod_chip_close(held.chip);
    held.chip = NULL;
    return false;
}

static int system_open(void *context, const char *chip, struct fv_error *error)
{
    char all[300] = "";
    int refused = 0;
    (void)context;
    for (int n = 0; n < CHIPS_MAX; n++)
        if (is_chip(n, chip, all, sizeof all, &refused)) return 0;
    if (refused)
        return fv_error_set(error, "gpio.chip: no '%.60s' among those that may be opened:%s; others: %s", chip,
                            all[0] ? all : " none", strerror(refused));
    return fv_error_set(error, "gpio.chip: there is no '%.60s'; there are:%s", chip, all[0] ? all : " none");
}

static int system_find(void *context, const char *name)
{
    (void)context;
    return gpiod_chip_get_line_offset_from_name(held.chip, name);
}

static int system_look(void *context, int offset, char holder[FV_GPIO_NAME])
{
    struct gpiod_line_info *info = gpiod_chip_get_line_info(held.chip, (unsigned)offset);
    (void)context;
    if (!info) return -errno;
    const char *name = gpiod_line_info_get_consumer(info);
    int used = gpiod_line_info_is_used(info);
    snprintf(holder, FV_GPIO_NAME, "%s", name ? name : "the kernel");
    gpiod_line_info_free(info);
    return used;
}

/* A request of lines that are set alike; NULL with errno set. */
static struct gpiod_line_request *request(struct gpiod_line_settings *settings, const int *offset, int lines)
{
    struct gpiod_line_config *lines_config = gpiod_line_config_new();
    struct gpiod_request_config *config = gpiod_request_config_new();
    struct gpiod_line_request *r = NULL;
    unsigned offsets[FV_GPIO_LINES];
    for (int i = 0; i < lines; i++) offsets[i] = (unsigned)offset[i];
    if (lines_config && config) {
        gpiod_request_config_set_consumer(config, "foveola");
        gpiod_request_config_set_event_buffer_size(config, FV_GPIO_EDGES);
        if (gpiod_line_config_add_line_settings(lines_config, offsets, (size_t)lines, settings) == 0)
            r = gpiod_chip_request_lines(held.chip, config, lines_config);
    }
    int number = errno;
    if (config) gpiod_request_config_free(config);
    if (lines_config) gpiod_line_config_free(lines_config);
    errno = number;
    return r;
}

static int system_take(void *context, const int *input, int inputs, const int *output, int outputs,
                       struct fv_error *error)
{
    struct gpiod_line_settings *s = gpiod_line_settings_new();
    (void)context;
    if (!s) return fv_error_set(error, "gpio: %s", strerror(errno));
    gpiod_line_settings_set_direction(s, GPIOD_LINE_DIRECTION_INPUT);
    gpiod_line_settings_set_edge_detection(s, GPIOD_LINE_EDGE_RISING);
    gpiod_line_settings_set_event_clock(s, GPIOD_LINE_CLOCK_MONOTONIC);
    if (inputs > 0) {
        held.inputs = request(s, input, inputs);
        held.events = gpiod_edge_event_buffer_new(FV_GPIO_EDGES);
    }
    bool failed = inputs > 0 && !(held.inputs && held.events);
    gpiod_line_settings_reset(s);
    gpiod_line_settings_set_direction(s, GPIOD_LINE_DIRECTION_OUTPUT);
    gpiod_line_settings_set_output_value(s, GPIOD_LINE_VALUE_INACTIVE);
    if (!failed && outputs > 0) held.outputs = request(s, output, outputs);
    failed = failed || (outputs > 0 && !held.outputs);
    int number = errno;
    gpiod_line_settings_free(s);
    if (!failed) return 0;
    return fv_error_set(error, "gpio: the lines for %s cannot be taken: %s%s",
                        inputs > 0 && !held.inputs ? "input (gpio.vsync, gpio.button)" : "output", strerror(number),
                        number == EBUSY ? "; another program or driver holds one (gpioinfo says which)" : "");
}

static int system_edges(void *context, struct fv_gpio_edge *edge, int most)
{
    (void)context;
    int ready = gpiod_line_request_wait_edge_events(held.inputs, 0);
    if (ready <= 0) return ready < 0 && errno != EINTR ? -errno : 0;
    int count = gpiod_line_request_read_edge_events(held.inputs, held.events, (size_t)most);
    if (count < 0) return errno == EINTR ? 0 : -errno;
    for (int i = 0; i < count; i++) {
        struct gpiod_edge_event *e = gpiod_edge_event_buffer_get_event(held.events, (unsigned long)i);
        edge[i] = (struct fv_gpio_edge){(int)gpiod_edge_event_get_line_offset(e),
                                        (int64_t)gpiod_edge_event_get_timestamp_ns(e),
                                        (uint32_t)gpiod_edge_event_get_line_seqno(e)};
    }
    return count;
}

static int system_set(void *context, int offset, bool high)
{
    (void)context;
    int failed = gpiod_line_request_set_value(held.outputs, (unsigned)offset,
                                              high ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE);
    return failed ? -errno : 0;
}

/* At the end of a run the heap is sealed, and what is freed would count as a call: the lines go back with the program.
 * A run that does not begin ends at once, too. */
static void system_close(void *context)
{
    (void)context;
}

const struct fv_gpio_io fv_gpio_system = {system_open,  system_find, system_look,  system_take,
                                          system_edges, system_set,  system_close, NULL};
