/* setup: from settings to a loop that is ready to run; used by every verb that renders. */
#include "cli/cli.h"

#include "cli/record.h"
#include "platform/arena.h"
#include "platform/realtime.h"

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
    if (fv_config_load(&s->config, request, error)) return -1;
    fv_arena_limit(fv_arena(), (size_t)s->config.budget_memory_mb << 20);
    method = fv_setup_method(s->config.method_name, "method.name", error);
    if (!method) return -1;
    if (fv_scene_load(&s->scene, &s->config, error)) return -1;
    if (s->change) s->change(s->change_context, s);
    if (fv_tracer_open(&s->tracer, &s->scene, &s->config, error)) return -1;
    fv_frame_size(&s->loop.frame, &s->config);
    s->loop.config = &s->config; /* all that fv_loop_view wants */
    fv_plan_make(&s->plan, method, &s->scene, &s->config, &s->loop.frame);
    return 0;
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
    fv_setup_close();
    if (fv_sensors_open(&s->sensors, &needed, error)) return -1;
    opened = s->sensors;
    fv_workers_start(&s->workers, s->plan.workers);
    return 0;
}

void fv_setup_latch(struct fv_setup *s, int64_t now_ns, int64_t show_ns, struct fv_pose *relative,
                    struct fv_gaze *gaze, struct fv_pose *head)
{
    struct fv_pose stand;
    fv_sensors_latch(s->sensors, now_ns, show_ns, relative, gaze);
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

void fv_setup_realtime(struct fv_setup *s, bool apply)
{
    const struct fv_config *c = &s->config;
    struct fv_realtime_request request = {.pin = strcmp(c->threads_pin, "on") == 0,
                                          .fifo_priority = (int)c->threads_fifo,
                                          .lock_memory = strcmp(c->threads_lock_memory, "on") == 0,
                                          .cpu_latency_us = (int)c->threads_cpu_latency_us,
                                          .root = ""};
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
