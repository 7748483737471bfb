/* measure: the verb: error against run time, swept over methods and levels (rt/measure/sweep.h), and the
 * other numerics (numerics.h). What is done stays done: the same command goes on where it stopped. */
#include "cli/measure.h"
#include "cli/measure_table.h"
#include "cli/measure_watch.h"
#include "cli/numerics.h"

#include "platform/log.h"

#include <stdio.h>

struct measure {
    struct fv_setup setup;
    struct fv_measure_watch watch;
    struct fv_sweep *sweep;
};

static int open_sweep(struct measure *m, const struct fv_arguments *a, struct fv_error *error)
{
    const struct fv_measure_arguments *given = &a->measure;
    m->watch = (struct fv_measure_watch){.setup = &m->setup};
    struct fv_sweep_io io = fv_measure_io(&m->watch);
    struct fv_sweep_choice choice = {.method = given->method,
                                     .level = given->level,
                                     .shard = given->shard,
                                     .shards = given->shards,
                                     .seconds = given->seconds > 0 ? given->seconds : FV_SWEEP_SECONDS};
    if (fv_setup_open(&m->setup, &a->request, error) || fv_setup_pinhole(&m->setup.config, error)) return -1;
    if (given->method && fv_setup_method(given->method, "--method", error) == NULL) return -1;
    if (fv_setup_start(&m->setup, true, error)) return -1;
    if (fv_sweep_open(&m->sweep, &m->setup.config, &m->setup.tracer, &m->setup.workers, &io, &choice, a->out,
                      error))
        return -1;
    return fv_measure_check(a->out, fv_sweep_scene(m->sweep), fv_sweep_key(m->sweep), error);
}

static void tell_row(int n, int rows, const struct fv_measure_row *r, bool measured)
{
    if (measured)
        fv_log("row %d of %d: %s level %d (%s): %.1f ms, %.2f x full, %.1f dB in the fovea, %.1f dB in all",
               n + 1, rows, r->method, r->level, r->parameters, r->frame_ms.value, r->speedup.value,
               r->psnr[FV_ZONE_FOVEA].value, r->psnr[FV_ZONE_ALL].value);
    else fv_log("row %d of %d: %s level %d is there already", n + 1, rows, r->method, r->level);
}

/* Returns 0; 1: stopped; -1 with the error set. */
static int run_rows(struct measure *m, const char *out, struct fv_error *error)
{
    struct fv_measure_row row;
    bool measured;
    int rows = fv_sweep_rows(m->sweep), found, missing;
    int state = 0;
    m->watch.stage_ns = 0;
    for (int n = 0; n < rows && state == 0; n++) {
        state = fv_sweep_row(m->sweep, n, &row, &measured, error);
        if (state == 0) tell_row(n, rows, &row, measured);
        if (state == 0 && measured) state = fv_measure_write(out, &found, &missing, error);
    }
    return state;
}

static int run_numerics(struct measure *m, const char *out, const volatile int *stop, struct fv_error *error)
{
    static struct fv_numeric_row row[FV_NUMERICS_MAX];
    char path[FV_PATH_MAX + 32];
    snprintf(path, sizeof path, "%s/numerics.csv", out);
    if (fv_file_exists(path)) return 0;
    fv_log_progress("integrators, depth interpolation, prediction");
    int rows = fv_numerics_measure(&m->setup, row, stop);
    return *stop ? 1 : fv_numerics_write(row, rows, path, error);
}

static int finish(const char *out, int state, struct fv_error *error)
{
    int rows = 0, missing = 0;
    if (state < 0 || fv_measure_write(out, &rows, &missing, error)) {
        fv_log("%s", error->text);
        return FV_EXIT_NOT_HELD;
    }
    if (state > 0) fv_log("stopped; %d rows are in %s, the same command goes on with the rest", rows, out);
    else if (rows == 0) fv_log("this share has no rows; %s/measure.csv has its heading only", out);
    else if (missing)
        fv_log("%d rows in %s/measure.csv, %d of the whole sweep are not; report: %s/report.html", rows, out,
               missing, out);
    else fv_log("%d rows in %s/measure.csv; report: %s/report.html", rows, out, out);
    return state > 0 ? FV_EXIT_NOT_HELD : FV_EXIT_DONE;
}

static int merge(const struct fv_arguments *a)
{
    struct fv_error error;
    if (fv_measure_merge(a->operand, a->operands, a->out, &error)) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    return finish(a->out, 0, &error);
}

int fv_verb_measure(const struct fv_arguments *a)
{
    static struct measure m;
    struct fv_error error;
    if (a->measure.table) return fv_measure_table(a);
    if (a->frames >= 0) {
        fv_log("--frames %lld: goes with --table; what a sweep takes is said by --seconds", (long long)a->frames);
        return FV_EXIT_UNUSABLE;
    }
    if (a->measure.part) {
        fv_log("--part %.60s: goes with --table", a->measure.part);
        return FV_EXIT_UNUSABLE;
    }
    if (a->measure.merge) return merge(a);
    if (a->operands) {
        fv_log("'%s': not expected here; folders to join stand behind --merge", a->operand[0]);
        return FV_EXIT_UNUSABLE;
    }
    if (open_sweep(&m, a, &error) || fv_folder_make(a->out, &error)) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    for (int n = 0; fv_method_at(n) && !a->measure.method; n++)
        if (fv_method_at(n)->by_paths)
            fv_log("%s holds light that the other methods do not, and has a sweep of its own: --method %s, with another --out",
                   fv_method_at(n)->name, fv_method_at(n)->name);
    fv_setup_realtime(&m.setup, true);
    const volatile int *stop = fv_measure_heed_signals();
    int state = fv_sweep_rows(m.sweep) ? fv_sweep_prepare(m.sweep, &error) : 0;
    if (state < 0) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    int left_out = fv_sweep_left_out(m.sweep);
    if (left_out)
        fv_log(
            "%d rows would take too long and are left out; --seconds gives more time, --level measures one",
            left_out);
    if (state == 0) state = run_rows(&m, a->out, &error);
    if (state == 0 && a->measure.shard == 0) state = run_numerics(&m, a->out, stop, &error);
    return finish(a->out, state, &error);
}
