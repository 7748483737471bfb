/* setup: from settings to a loop that is ready to run; used by every verb that renders. */
#include "cli/cli.h"

#include "cli/record.h"
#include "platform/arena.h"
#include "platform/log.h"
#include "platform/sandbox.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const struct fv_method *fv_setup_method(const char *name, const char *key, struct fv_error *error)
{
    char known[128] = "";
    const struct fv_method *method = fv_method_find(name);
    if (method) return method;
    for (int n = 0; fv_method_at(n); n++) {
        strncat(known, " ", sizeof known - strlen(known) - 1);
        strncat(known, fv_method_at(n)->name, sizeof known - strlen(known) - 1);
    }
    if (key[0] == '-') fv_error_set(error, "%s %.60s: not known; there are:%s", key, name, known);
    else fv_config_error(error, key, "'%.60s' is not known; there are:%s", name, known);
    return NULL;
}

int fv_setup_open(struct fv_setup *s, const struct fv_config_request *request, struct fv_error *error)
{
    const struct fv_method *method;
    s->recentre = s->centred = false;
    if (fv_config_load(&s->config, request, error)) return -1;
    struct fv_error why;
    if (s->config.threads_cores[0] && fv_threads_keep_to(s->config.threads_cores, &why))
        return fv_config_error(error, "threads.cores", "%s", why.text);
    fv_arena_limit(fv_arena(), (size_t)s->config.budget_memory_mb << 20);
    method = fv_setup_method(s->config.method_name, "method.name", error);
    if (!method) return -1;
    if (fv_scene_load(&s->scene, &s->config, error)) return -1;
    if (s->change) s->change(s->change_context, s);
    if (fv_tracer_open(&s->tracer, &s->scene, &s->config, error)) return -1;
    fv_frame_size(&s->loop.frame, &s->config);
    fv_loop_look(&s->loop, &s->config);
    fv_plan_make(&s->plan, method, &s->scene, &s->config, &s->loop.frame);
    return 0;
}

int fv_setup_pinhole(const struct fv_config *c, struct fv_error *error)
{
    if (strcmp(c->display_lens, "none") == 0) return 0;
    return fv_config_error(error, "display.lens", "%s: pictures are measured as a pinhole shows them; none would be right", c->display_lens);
}

static struct fv_sensors *opened;

void fv_setup_close(void)
{
    if (opened) fv_sensors_close(opened);
    opened = NULL;
}

int fv_setup_start(struct fv_setup *s, bool gaze, struct fv_error *error)
{
    static struct fv_config needed;
    needed = s->config;
    if (!gaze) strcpy(needed.eye_source, "none");
    fv_sandbox_ask(strcmp(s->config.threads_sandbox, "on") == 0);
    fv_sandbox_keep_console(strcmp(s->config.display_sink, "kms") == 0);
    fv_setup_close();
    if (fv_sensors_open(&s->sensors, &needed, error)) return -1;
    opened = s->sensors;
    fv_workers_start(&s->workers, s->plan.workers);
    return 0;
}

/* The head relative to where it was when recentring was last asked for: place and heading are forgotten, up stays up.
 * Who looks straight up or down then has no heading, and keeps the one he had. */
static void recentre(struct fv_setup *s, struct fv_pose *head)
{
    static const double ahead[3] = {0, 0, -1};
    struct fv_pose back, moved;
    if (s->recentre) {
        double looks[3];
        fv_quat_rotate(head->rotation, ahead, looks);
        memcpy(s->centre.position_m, head->position_m, sizeof s->centre.position_m);
        if (!s->centred || hypot(looks[0], looks[2]) > 1e-3)
            fv_quat_from_yaw_pitch_roll(atan2(-looks[0], -looks[2]), 0, 0, s->centre.rotation);
        s->centred = true;
        s->recentre = false;
    }
    if (!s->centred) return;
    fv_quat_conjugate(s->centre.rotation, back.rotation);
    fv_quat_rotate(back.rotation, s->centre.position_m, back.position_m);
    for (int i = 0; i < 3; i++) back.position_m[i] = -back.position_m[i];
    fv_pose_compose(&back, head, &moved);
    *head = moved;
}

void fv_setup_latch(struct fv_setup *s, int64_t now_ns, int64_t show_ns, struct fv_pose *relative,
                    struct fv_gaze *gaze, struct fv_pose *head)
{
    struct fv_pose stand;
    fv_sensors_latch(s->sensors, now_ns, show_ns, relative, gaze);
    recentre(s, relative);
    fv_path_pose(&s->config.scene_path, s->config.scene_path_seconds, show_ns, &stand);
    fv_pose_compose(&stand, relative, head);
}

/* What the arena and the program's own static memory hold besides what the plan decided. */
static void plan_the_rest(struct fv_setup *s)
{
    const struct fv_arena *arena = fv_arena();
    struct fv_plan *p = &s->plan;
    bool taped = strcmp(s->config.output_tape, "on") == 0;
    fv_plan_add(p, "memory", "acceleration structure", true, s->tracer.bytes, "Embree's, over the geometry");
    fv_plan_add(p, "memory", "sensors", true, (int64_t)fv_arena_bytes(arena, "sensors"),
                "the newest samples, and tapes where sources are tapes");
    fv_plan_add(p, "memory", "usb", strcmp(s->config.imu_source, "usb") == 0, (int64_t)fv_arena_bytes(arena, "usb"),
                "the inertial sensor's transfers, and what libusb takes");
    fv_plan_add(p, "memory", "device stacks", true,
                (int64_t)fv_arena_bytes(arena, "device stacks") + FV_DEVICE_STACK_BYTES,
                "a thread for each device, and one that writes what is recorded");
    fv_plan_add(p, "memory", "worker stacks", s->workers.count > 1,
                (int64_t)fv_arena_bytes(arena, "worker stacks"),
                "the first worker runs on the program's own");
    fv_plan_add(p, "memory", "frame records", true, (int64_t)fv_arena_bytes(arena, "frame records"),
                "%lld frames at most, for the report", (long long)s->session.capacity);
    fv_plan_add(p, "memory", "schedule", true, (int64_t)fv_arena_bytes(arena, "schedule"),
                "the order of tiles, and how long each has waited");
    fv_plan_add(p, "memory", "trace", true, (int64_t)fv_arena_bytes(arena, "trace"),
                "the newest spans of each worker, for trace.json");
    fv_plan_add(p, "memory", "png encoder", p->present, (int64_t)fv_arena_bytes(arena, "png"),
                p->present ? "the report shows the last picture" : "no pictures: the report shows none");
    fv_plan_add(p, "memory", "tape", taped, FV_RECORD_BYTES, "output.tape is %s: what was latched is %s",
                s->config.output_tape, taped ? "recorded for replay" : "not recorded");
}

int fv_setup_take(struct fv_setup *s, int64_t frames, struct fv_error *error)
{
    const struct fv_config *c = &s->config;
    if (fv_setup_start(s, s->plan.gaze, error)) return -1;
    int64_t records = frames > 0 && frames < FV_RECORDS_MAX ? frames : FV_RECORDS_MAX;
    fv_loop_open(&s->loop, c, &s->plan, &s->tracer, &s->workers, &s->session, records);
    if (s->plan.present) s->png = fv_png_open((int)c->display_width, (int)c->display_height);
    plan_the_rest(s);
    return 0;
}

struct fv_realtime_request fv_setup_realtime_request(const struct fv_config *c)
{
    return (struct fv_realtime_request){.pin = strcmp(c->threads_pin, "on") == 0,
                                        .fifo_priority = (int)c->threads_fifo,
                                        .lock_memory = strcmp(c->threads_lock_memory, "on") == 0,
                                        .cpu_latency_us = (int)c->threads_cpu_latency_us,
                                        .root = ""};
}

void fv_setup_realtime(struct fv_setup *s, bool apply)
{
    struct fv_realtime_request request = fv_setup_realtime_request(&s->config);
    struct fv_realtime_row row[FV_REALTIME_EXTRAS];
    if (apply) fv_realtime_apply(&request, &s->workers, row);
    else fv_realtime_ask(&request, row);
    for (int i = 0; i < FV_REALTIME_EXTRAS; i++) {
        bool refused = apply && row[i].asked && !row[i].granted;
        fv_plan_add(&s->plan, "thread", row[i].what, row[i].asked && !refused, 0, "%s%s", refused ? "refused: " : "",
                    row[i].reason);
    }
    fv_plan_report(&s->plan, &s->session);
}

void fv_setup_lines(struct fv_gpio_settings *lines, const struct fv_config *c, int64_t period_ns)
{
    const char *line[FV_GPIO_LINES] = {c->gpio_vsync, c->gpio_button, c->gpio_strobe, c->gpio_missed, c->gpio_heartbeat};
    *lines = (struct fv_gpio_settings){.period_ns = period_ns};
    snprintf(lines->chip, sizeof lines->chip, "%.63s", c->gpio_chip);
    for (int i = 0; i < FV_GPIO_LINES; i++) snprintf(lines->line[i], sizeof lines->line[i], "%.63s", line[i]);
}

void fv_setup_seal(struct fv_setup *s, const char *out)
{
    struct fv_error said;
    if (strcmp(s->config.threads_sandbox, "on") != 0) {
        fv_plan_add(&s->plan, "thread", "sandbox", false, 0, "threads.sandbox is off");
    } else if (fv_sandbox_seal(&s->workers, out, &said)) {
        fv_plan_add(&s->plan, "thread", "sandbox", false, 0, "refused: %s", said.text);
        fv_log("threads.sandbox: refused: %s; it goes on without", said.text);
    } else {
        fv_plan_add(&s->plan, "thread", "sandbox", true, 0, "%s", said.text);
    }
    fv_plan_report(&s->plan, &s->session);
}
