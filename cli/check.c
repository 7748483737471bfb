/* check: the verb; see check.h. Devices are looked at first, then opened no more: frames run on simulated sensors, so
 * that what the cores hold is told also where a device is missing. */
#include "cli/check.h"

#include "platform/json.h"
#include "platform/log.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { RECORDS = 20000 };

static const struct {
    const char *name, *shown;
} states[] = {[FV_CHECK_OK] = {"ok", "ok"},
              [FV_CHECK_NOTE] = {"note", "note"},
              [FV_CHECK_FAULT] = {"fault", "FAULT"},
              [FV_CHECK_UNASKED] = {"unasked", "-"}};

void fv_check_add(struct fv_check *c, const char *group, const char *what, enum fv_check_state state,
                  const char *change, const char *found, ...)
{
    va_list arguments;
    if (c->rows == FV_CHECK_ROWS_MAX) {
        c->left_out++;
        return;
    }
    struct fv_check_row *row = &c->row[c->rows++];
    row->group = group;
    row->state = state;
    snprintf(row->what, sizeof row->what, "%s", what);
    snprintf(row->change, sizeof row->change, "%s", change);
    va_start(arguments, found);
    vsnprintf(row->found, sizeof row->found, found, arguments);
    va_end(arguments);
}

int fv_check_faults(const struct fv_check *c)
{
    int faults = 0;
    for (int i = 0; i < c->rows; i++) faults += c->row[i].state == FV_CHECK_FAULT;
    return faults;
}

void fv_check_print(const struct fv_check *c, struct fv_writer *out)
{
    int faults = fv_check_faults(c), changes = 0;
    fv_writer_print(out, "%-8s %-24s %-6s %s\n", "group", "what", "state", "found");
    for (int i = 0; i < c->rows; i++) {
        const struct fv_check_row *r = &c->row[i];
        bool first = i == 0 || strcmp(r->group, c->row[i - 1].group) != 0;
        fv_writer_print(out, "%-8s %-24s %-6s %s\n", first ? r->group : "", r->what, states[r->state].shown, r->found);
        changes += r->change[0] != 0;
    }
    if (c->left_out) fv_writer_print(out, "%d more rows are left out\n", c->left_out);
    if (changes) fv_writer_print(out, "\nwhat %s change\n", faults ? "has to (FAULT), or could (note)," : "could");
    for (int i = 0; i < c->rows; i++)
        if (c->row[i].change[0])
            fv_writer_print(out, "%-6s %s: %s\n", states[c->row[i].state].shown, c->row[i].what, c->row[i].change);
    if (faults) fv_writer_print(out, "\nnot ready: %d of %d\n", faults, c->rows);
    else fv_writer_print(out, "\nready\n");
}

static void print_numbers(const struct fv_check *c, struct fv_writer *out)
{
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"copy_bytes_per_s", c->copy_bytes_per_s}, {"primary_rays_per_s", c->primary_per_s},
                   {"rays_per_s", c->rays_per_s},             {"wake_us_p50", c->wake_us_p50},
                   {"wake_us_p99", c->wake_us_p99},           {"frame_ms_p50", c->frame_ms_p50},
                   {"frame_ms_p99", c->frame_ms_p99},         {"level", c->level},
                   {"periods", c->periods},                   {"missed", c->missed}};
    fv_writer_print(out, "\"measured\":{");
    for (unsigned i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        fv_writer_print(out, "%s\"%s\":", i ? "," : "", numbers[i].name);
        fv_json_number(out, numbers[i].value);
    }
    fv_writer_print(out, "}");
}

void fv_check_json(const struct fv_check *c, struct fv_writer *out)
{
    fv_writer_print(out, "{\"version\":\"%s\",\"ready\":%s,\"faults\":%d,", FV_VERSION,
                    fv_check_faults(c) ? "false" : "true", fv_check_faults(c));
    print_numbers(c, out);
    fv_writer_print(out, ",\"rows\":[");
    for (int i = 0; i < c->rows; i++) {
        const struct fv_check_row *r = &c->row[i];
        fv_writer_print(out, "%s\n{\"group\":\"%s\",\"what\":", i ? "," : "", r->group);
        fv_json_text(out, r->what);
        fv_writer_print(out, ",\"state\":\"%s\",\"found\":", states[r->state].name);
        fv_json_text(out, r->found);
        fv_writer_print(out, ",\"change\":");
        fv_json_text(out, r->change);
        fv_writer_print(out, "}");
    }
    fv_writer_print(out, "]}\n");
}

/* The board's extras: asked of the machine as a run does. */
static void check_realtime(struct fv_check *c, const struct fv_setup *s, const struct fv_config *config)
{
    struct fv_realtime_request request = fv_setup_realtime_request(config);
    struct fv_realtime_row row[FV_REALTIME_EXTRAS];
    char change[FV_TEXT_MAX];
    fv_realtime_apply(&request, &s->workers, row);
    for (int i = 0; i < FV_REALTIME_EXTRAS; i++) {
        bool refused = row[i].asked && !row[i].granted;
        snprintf(change, sizeof change, "give the right to it, or set %s so that it is not asked for", row[i].key);
        fv_check_add(c, "extras", row[i].what, refused ? FV_CHECK_FAULT : row[i].asked ? FV_CHECK_OK : FV_CHECK_UNASKED,
                     refused ? change : "", "%s%s", refused ? "refused: " : "", row[i].reason);
    }
}

/* Simulated in place of devices, adapting where the method can. */
static int prepare(struct fv_setup *s, struct fv_error *error)
{
    struct fv_config *c = &s->config;
    if (strcmp(c->eye_source, "v4l2") == 0) strcpy(c->eye_source, "sim");
    if (strcmp(c->imu_source, "usb") == 0) strcpy(c->imu_source, "sim");
    strcpy(c->budget_adapt, "on");
    fv_plan_make(&s->plan, s->plan.method, &s->scene, c, &s->loop.frame);
    return fv_setup_take(s, RECORDS, error);
}

int fv_verb_check(const struct fv_arguments *a)
{
    static struct fv_setup setup;
    static struct fv_writer out;
    static struct fv_config config;
    static struct fv_check check = {.root = "", .camera = &fv_camera_system, .display = &fv_kms_system, .lines = &fv_gpio_system};
    struct fv_error error;
    if (a->root) check.root = a->root;
    if (fv_setup_open(&setup, &a->request, &error)) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    config = setup.config;
    fv_check_machine(&check);
    fv_check_devices(&check, &config);
    if (prepare(&setup, &error)) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    fv_check_memory(&check, &config);
    check_realtime(&check, &setup, &config);
    fv_check_speed(&check, &setup, &config, a->measure.seconds > 0 ? a->measure.seconds : 2);
    fv_sensors_close(setup.sensors);
    if (fv_writer_open(&out, "-", &error)) return FV_EXIT_NOT_HELD;
    if (a->json) fv_check_json(&check, &out);
    else fv_check_print(&check, &out);
    if (fv_writer_close(&out, &error)) return FV_EXIT_NOT_HELD;
    return fv_check_faults(&check) ? FV_EXIT_NOT_HELD : FV_EXIT_DONE;
}
