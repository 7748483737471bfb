/* check_display: a display of this machine (display.sink=kms) and lines of a GPIO chip, as a run would take them, but
 * nothing is shown and no line is driven. See check.h. */
#include "cli/check.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

bool fv_check_display_asked(const struct fv_config *config)
{
    return strcmp(config->display_sink, "kms") == 0;
}

/* Who holds a card (/dev/dri/cardN), by the kernel's list of who has it open, which only root can read; else "another
 * program". Columns: command, tgid, dev, master. */
static void name_holder(const struct fv_check *c, const char *card, char *name, size_t size)
{
    char path[FV_PATH_MAX], line[256], command[64], master;
    int number, pid;
    const char *last = strrchr(card, '/');
    snprintf(name, size, "another program");
    if (!last || sscanf(last, "/card%d", &number) != 1) return;
    snprintf(path, sizeof path, "%.200s/sys/kernel/debug/dri/%d/clients", c->root, number);
    FILE *f = fopen(path, "re");
    while (f && fgets(line, sizeof line, f))
        if (sscanf(line, "%63s %d %*d %c", command, &pid, &master) == 3 && master == 'y')
            snprintf(name, size, "%s (process %d)", command, pid);
    if (f) fclose(f);
}

static void add_refresh(struct fv_check *c, const struct fv_kms_looked *l)
{
    static const char what[] = "display refresh";
    bool as_said = fabs(l->measured_hz - l->mode_hz) <= 0.01 * l->mode_hz;
    if (!l->shows)
        fv_check_add(c, "device", what, FV_CHECK_NOTE, "", "not measured: it shows nothing now");
    else if (l->measured_hz <= 0)
        fv_check_add(c, "device", what, FV_CHECK_NOTE, "", "not measured: the driver tells of no vertical blank in %s", l->mode);
    else
        fv_check_add(c, "device", what, as_said ? FV_CHECK_OK : FV_CHECK_NOTE,
                     as_said ? "" : "another display.mode, or another driver", "%.2f Hz measured, in the mode that is on now: %s",
                     l->measured_hz, l->mode);
}

void fv_check_display(struct fv_check *c, const struct fv_config *config, const char *what)
{
    static struct fv_kms kms;
    struct fv_kms_settings settings;
    struct fv_kms_looked looked;
    struct fv_error error;
    char name[96];
    if (fv_kms_settings_of(&settings, config, &error) || fv_kms_look(&kms, &settings, c->display, &looked, &error)) {
        fv_check_add(c, "device", what, FV_CHECK_FAULT,
                     "plug a display in, or set display.device, display.connector and display.mode to what is there", "%s", error.text);
        return;
    }
    name_holder(c, kms.path, name, sizeof name);
    if (looked.held)
        fv_check_add(c, "device", what, FV_CHECK_FAULT,
                     "end who holds it, a display server most likely (systemctl stop display-manager), or name another card by "
                     "display.device",
                     "%.200s is held by %.90s", kms.path, name);
    else fv_check_add(c, "device", what, FV_CHECK_OK, "", "%.200s may be opened, and nobody holds it", kms.path);
    for (int s = 0; s < kms.screens; s++) {
        const struct fv_kms_screen *screen = &kms.screen[s];
        double hz = fv_kms_mode_hz(&screen->mode);
        bool paced = strcmp(config->budget_pace, "vsync") == 0;
        bool near = fabs(hz - config->budget_hz) <= 0.01 * config->budget_hz;
        fv_check_add(c, "device", s ? "right connector" : "connector", near ? FV_CHECK_OK : FV_CHECK_NOTE,
                     near    ? ""
                     : paced ? "budget.hz as the display has it, or another display.mode; a run is paced by the display"
                             : "budget.hz as the display has it, or another display.mode",
                     "%s is connected: %dx%d at %.2f Hz", screen->name, screen->mode.hdisplay, screen->mode.vdisplay, hz);
    }
    add_refresh(c, &looked);
}

static struct fv_gpio_settings lines_of(const struct fv_config *config)
{
    struct fv_gpio_settings settings;
    fv_setup_lines(&settings, config, llround(1e9 / config->budget_hz));
    return settings;
}

bool fv_check_lines_asked(const struct fv_config *config)
{
    const struct fv_gpio_settings w = lines_of(config);
    for (int i = 0; i < FV_GPIO_LINES; i++)
        if (w.line[i][0]) return true;
    return false;
}

/* The line before it in the settings that has its name; -1: there is none. */
static int same_line(const struct fv_gpio_settings *w, int line)
{
    for (int i = 0; i < line; i++)
        if (strcmp(w->line[i], w->line[line]) == 0) return i;
    return -1;
}

static void look_at_line(struct fv_check *c, const struct fv_gpio_settings *w, int line)
{
    const char *key = fv_gpio_key((enum fv_gpio_line)line), *name = w->line[line];
    char holder[FV_GPIO_NAME] = "";
    int offset = c->lines->find(c->lines->context, name), same = same_line(w, line);
    int held = offset < 0 ? 0 : c->lines->look(c->lines->context, offset, holder);
    if (offset < 0)
        fv_check_add(c, "device", key, FV_CHECK_FAULT, "a line that gpioinfo lists", "the chip has no line named '%s'", name);
    else if (same >= 0)
        fv_check_add(c, "device", key, FV_CHECK_FAULT, "a line of its own", "'%s' is %s already", name,
                     fv_gpio_key((enum fv_gpio_line)same));
    else if (held < 0)
        fv_check_add(c, "device", key, FV_CHECK_FAULT, "", "line %d, '%s': %s", offset, name, strerror(-held));
    else if (held > 0)
        fv_check_add(c, "device", key, FV_CHECK_FAULT, "end who holds it, or another line", "line %d, '%s', is held by %s", offset,
                     name, holder);
    else fv_check_add(c, "device", key, FV_CHECK_OK, "", "line %d, '%s', is free", offset, name);
}

void fv_check_lines(struct fv_check *c, const struct fv_config *config, const char *what)
{
    const struct fv_gpio_settings w = lines_of(config);
    struct fv_error error;
    if (!w.chip[0]) {
        fv_check_add(c, "device", what, FV_CHECK_FAULT, "set gpio.chip to the chip of the lines (gpiodetect lists them)",
                     "gpio.chip is not set");
        return;
    }
    if (c->lines->open(c->lines->context, w.chip, &error)) {
        fv_check_add(c, "device", what, FV_CHECK_FAULT,
                     "gpio.chip as gpiodetect lists it; who runs this into the group that owns /dev/gpiochip* (gpio)", "%s",
                     error.text);
        return;
    }
    fv_check_add(c, "device", what, FV_CHECK_OK, "", "the chip '%s' may be opened", w.chip);
    for (int i = 0; i < FV_GPIO_LINES; i++)
        if (w.line[i][0]) look_at_line(c, &w, i);
    c->lines->close(c->lines->context);
}
