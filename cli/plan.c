/* plan: what this scene and method need, what is left out and why. No frame is run. */
#include "cli/cli.h"

#include "platform/arena.h"
#include "platform/log.h"

static void print_plan(const struct fv_setup *s, struct fv_writer *out)
{
    const struct fv_config *c = &s->config;
    fv_writer_print(out, "scene %s: %lld triangles, %d materials, %d textures, %d lights\n", s->scene.name,
                    (long long)s->scene.triangles, s->scene.materials, s->scene.textures, s->scene.lights);
    fv_writer_print(out, "method %s: %s\n", s->plan.method->name, s->plan.method->what);
    fv_writer_print(out, "display %s: %d x %lld x %lld pixels at %g Hz\n\n", c->display_headset, s->loop.frame.eyes,
                    (long long)c->display_width, (long long)c->display_height, c->budget_hz);
    for (int kept = 1; kept >= 0; kept--) {
        fv_writer_print(out, "%-8s %-22s %12s  %s\n", kept ? "kept" : "left out", "", "bytes", "why");
        for (int i = 0; i < s->plan.rows; i++) {
            const struct fv_plan_row *r = &s->plan.row[i];
            if (r->kept != kept) continue;
            fv_writer_print(out, "%-8s %-22s ", r->kind, r->what);
            if (r->bytes) fv_writer_print(out, "%12lld  %s\n", (long long)r->bytes, r->reason);
            else fv_writer_print(out, "%12s  %s\n", "", r->reason);
        }
        fv_writer_print(out, "\n");
    }
    const struct fv_arena *arena = fv_arena();
    fv_writer_print(out, "memory: %zu of %zu MB\n", arena->used >> 20, arena->capacity >> 20);
    for (int i = 0; i < arena->rows; i++)
        fv_writer_print(out, "  %-24s %12zu\n", arena->row[i].name, arena->row[i].bytes);
}

int fv_verb_plan(const struct fv_arguments *arguments)
{
    static struct fv_setup setup;
    static struct fv_writer out;
    struct fv_error error;
    if (fv_setup_open(&setup, &arguments->request, &error) || fv_setup_take(&setup, arguments->frames, &error)) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    fv_setup_realtime(&setup, false);
    if (fv_writer_open(&out, "-", &error)) return FV_EXIT_NOT_HELD;
    print_plan(&setup, &out);
    return fv_writer_close(&out, &error) ? FV_EXIT_NOT_HELD : FV_EXIT_DONE;
}
