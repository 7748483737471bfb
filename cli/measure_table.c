/* measure_table: see measure_table.h. */
#include "cli/measure_table.h"

#include "cli/measure_watch.h"
#include "platform/log.h"
#include "rt/measure/sweep_key.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

enum { PARTS_MAX = 64 };

struct run {
    const struct fv_arguments *arguments;
    const struct fv_table *table;
    const volatile int *stop;
    int frames;
    char folder[FV_PATH_MAX]; /* of parts */
    struct place {
        struct fv_table_part part;
        struct fv_part_heading heading; /* the key that it would have */
        bool there, left_out;           /* measured before; not asked for, or its scene is not at hand */
    } place[PARTS_MAX];
};

static struct run run;

/* ---- a part, in a process of its own ---- */

static void change_scene(void *context, struct fv_setup *setup)
{
    const int *n = context;
    if (run.table->relight) run.table->relight(*n, &setup->scene);
}

/* Two workers unless the user says otherwise; then what the user says; then what the table must have. */
static int request_of(const struct fv_table_part *part, struct fv_config_request *request, struct fv_error *error)
{
    const struct fv_config_request *given = &run.arguments->request;
    enum { SETS_MAX = sizeof request->set / sizeof request->set[0] };
    *request = *given;
    request->sets = 0;
    if (1 + given->sets + part->settings > SETS_MAX)
        return fv_error_set(error, "--set: at most %d of them with --table; put the rest into a settings file",
                            SETS_MAX - 1 - part->settings);
    request->set[request->sets++] = "threads.workers=2";
    for (int i = 0; i < given->sets; i++) request->set[request->sets++] = given->set[i];
    for (int i = 0; i < part->settings; i++) request->set[request->sets++] = part->setting[i];
    return 0;
}

static void walk_at(struct fv_config *c, const struct fv_table_part *part)
{
    if (part->path_frames > 0 && c->scene_path_seconds > 0)
        c->scene_path_seconds = part->path_frames / c->budget_hz;
}

static void describe(struct place *p, const struct fv_setup *s)
{
    const struct fv_config *c = &s->config;
    snprintf(p->heading.about, sizeof p->heading.about,
             "%.60s, %s, %d thread%s; %.32s, %d x %lld x %lld px; %d frames at %g Hz", fv_cpu_name(),
             fv_cpu_isa_name(s->tracer.isa), s->workers.count, s->workers.count == 1 ? "" : "s",
             c->display_headset, (int)c->display_eyes, (long long)c->display_width, (long long)c->display_height,
             run.frames, c->budget_hz);
}

static void part_path(const char *name, char path[FV_PATH_MAX + 64])
{
    snprintf(path, FV_PATH_MAX + 64, "%s/%s.part", run.folder, name);
}

/* A part's first row, where it has what the table is summed up by. */
static void tell(const char *name, const struct fv_sheet *sheet)
{
    const char *row = sheet->cells ? sheet->cell[0].row : "", *quantity = run.table->headline;
    double paper = fv_sheet_paper(sheet, row, quantity), ours = fv_sheet_ours(sheet, row, quantity);
    char of_paper[32] = "";
    if (!isnan(paper)) snprintf(of_paper, sizeof of_paper, " (paper %.2f)", paper);
    if (isnan(ours)) fv_log("%s: %d cells", name, sheet->cells);
    else fv_log("%s: %s is %.2f x as fast as %s%s, %d cells", name, row, ours, run.table->over, of_paper, sheet->cells);
}

/* Returns an exit code. */
static int measure_part(int n)
{
    static struct fv_setup setup;
    static struct fv_sheet sheet;
    struct fv_config_request request;
    struct fv_error error;
    struct place *p = &run.place[n];
    char path[FV_PATH_MAX + 64];
    setup.change = change_scene;
    setup.change_context = &n;
    if (request_of(&p->part, &request, &error) || fv_setup_open(&setup, &request, &error) ||
        fv_setup_start(&setup, false, &error)) {
        fv_log("%s", error.text);
        return FV_EXIT_UNUSABLE;
    }
    walk_at(&setup.config, &p->part);
    fv_setup_realtime(&setup, true);
    struct fv_measure_watch watch = {.setup = &setup};
    struct fv_sweep_io io = fv_measure_io(&watch);
    struct fv_table_bench bench = {&setup.config, &setup.tracer, &setup.workers, &io, run.frames, run.folder, &error};
    int state = run.table->measure(n, &bench, &sheet);
    describe(p, &setup);
    part_path(p->part.name, path);
    if (state == 0) state = fv_part_write(&p->heading, &sheet, path, &error);
    if (state < 0) fv_log("%s", error.text);
    if (state) return FV_EXIT_NOT_HELD;
    tell(p->part.name, &sheet);
    return FV_EXIT_DONE;
}

/* Runs measure_part in a process of its own, which ends with this one. Returns its exit code. */
static int run_part(int n)
{
    int status = 0;
    pid_t parent = getpid(), child = fork();
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGTERM);
        if (getppid() != parent) _exit(FV_EXIT_NOT_HELD);
        _exit(measure_part(n));
    }
    if (child < 0) {
        fv_log("%s: no process could be started: %s", run.place[n].part.name, strerror(errno));
        return FV_EXIT_NOT_HELD;
    }
    while (waitpid(child, &status, 0) < 0 && errno == EINTR)
        if (*run.stop) kill(child, SIGTERM);
    if (WIFEXITED(status)) return WEXITSTATUS(status);
    fv_log("%s: ended by signal %d", run.place[n].part.name, WTERMSIG(status));
    return FV_EXIT_NOT_HELD;
}

/* ---- the whole ---- */

/* Whether it is among those asked for. */
static bool wanted(const struct fv_table_part *part)
{
    const char *start = run.arguments->measure.part;
    return !start || strncmp(part->name, start, strlen(start)) == 0;
}

/* Settings of the part, or why its scene is not at hand. Returns 0; 1: it is not; -1 with the error set. */
static int settings_of(const struct fv_table_part *part, struct fv_config *config, struct fv_error *error)
{
    struct fv_config_request request;
    if (!fv_preset_text("scenes", part->scene)) {
        fv_error_set(error, "this program has no such scene");
        return 1;
    }
    if (request_of(part, &request, error) || fv_config_load(config, &request, error) || fv_setup_pinhole(config, error)) return -1;
    walk_at(config, part);
    return 0;
}

/* What the part would be, and whether it is there. Returns 0, or -1 with the error set. */
static int look_at(int n, const char *last_left_out, struct fv_error *error)
{
    static struct fv_config config;
    static struct fv_sheet sheet;
    struct place *p = &run.place[n];
    struct fv_part_heading heading;
    char path[FV_PATH_MAX + 64];
    run.table->part(n, run.frames, &p->part);
    int missing = settings_of(&p->part, &config, error);
    if (missing < 0) return -1;
    if (!missing) fv_settings_fingerprint(p->heading.key, sizeof p->heading.key, &config, run.frames);
    part_path(p->part.name, path);
    p->there = !missing && fv_file_exists(path);
    if (!missing && !p->there) missing = fv_scene_find(&config, error) != 0;
    p->left_out = missing || !wanted(&p->part);
    if (missing && wanted(&p->part) && strcmp(last_left_out, p->part.scene) != 0)
        fv_log("rows of %s are left out: %s", p->part.scene, error->text);
    if (!p->there) return 0;
    sheet.cells = 0;
    if (fv_part_read(&heading, &sheet, path, error)) return -1;
    if (strcmp(heading.key, p->heading.key) == 0) return 0;
    return fv_error_set(error, "%s: of another version or other settings; remove it or give another --out", path);
}

/* No part begins so. */
static int refuse_part(const char *given, struct fv_error *error)
{
    char known[256] = "";
    for (int n = 0; n < run.table->parts; n++) {
        size_t used = strlen(known);
        snprintf(known + used, sizeof known - used, " %s", run.place[n].part.name);
    }
    return fv_error_set(error, "--part %.60s: no part's name begins so; there are:%s", given, known);
}

static int look_at_all(struct fv_error *error)
{
    const char *left_out = "", *given = run.arguments->measure.part;
    bool any = false;
    if (strlen(run.arguments->out) > FV_PATH_MAX - 200)
        return fv_error_set(error, "--out %.60s...: too long", run.arguments->out);
    snprintf(run.folder, sizeof run.folder, "%s/table-%s", run.arguments->out, run.table->name);
    for (int n = 0; n < run.table->parts; n++) {
        if (look_at(n, left_out, error)) return -1;
        any |= wanted(&run.place[n].part);
        if (run.place[n].left_out && wanted(&run.place[n].part)) left_out = run.place[n].part.scene;
    }
    return any ? fv_folder_make(run.folder, error) : refuse_part(given, error);
}

/* All parts that are there, as table and page. */
static int write_all(struct fv_table_report *report, struct fv_error *error)
{
    static struct fv_sheet sheet;
    struct fv_part_heading heading;
    char path[FV_PATH_MAX + 64];
    *report = (struct fv_table_report){.table = run.table, .sheet = &sheet, .folder = run.folder};
    sheet.cells = 0;
    for (int n = 0; n < run.table->parts; n++) {
        part_path(run.place[n].part.name, path);
        if (!fv_file_exists(path)) continue;
        if (fv_part_read(&heading, &sheet, path, error)) return -1;
        if (report->parts++ == 0) memcpy(report->about, heading.about, sizeof report->about);
    }
    snprintf(path, sizeof path, "%.900s/table-%s.csv", run.arguments->out, run.table->name);
    if (fv_sheet_csv(&sheet, path, error)) return -1;
    snprintf(path, sizeof path, "%.900s/report.html", run.arguments->out);
    return report->parts ? fv_table_page(report, path, error) : 0;
}

static int unusable(const char *what)
{
    fv_log("%s", what);
    return FV_EXIT_UNUSABLE;
}

/* The table that was asked for; NULL with the reason logged. */
static const struct fv_table *table_of(const struct fv_arguments *a)
{
    char known[128] = "";
    const struct fv_measure_arguments *m = &a->measure;
    const struct fv_table *table = fv_table_find(m->table);
    for (int n = 0; fv_table_at(n); n++) {
        size_t used = strlen(known);
        snprintf(known + used, sizeof known - used, " %s", fv_table_at(n)->name);
    }
    if (!table) fv_log("--table %.60s: not known; there are:%s", m->table, known);
    else if (m->method || m->level >= 0)
        fv_log("--table %s: takes no --method and no --level: it says itself what is measured", m->table);
    else if (m->seconds > 0)
        fv_log("--table %s: takes no --seconds; --frames says how much of it is measured", m->table);
    else if (m->shards > 1 || m->merge)
        fv_log("--table %s: is measured on one machine, so that its rows compare: no --shard, no --merge", m->table);
    else if (a->operands) fv_log("'%s': not expected here; see 'foveola help'", a->operand[0]);
    else if (a->frames > FV_TABLE_FRAMES_MAX)
        fv_log("--frames %lld: at most %d with --table", (long long)a->frames, FV_TABLE_FRAMES_MAX);
    else return table;
    return NULL;
}

int fv_measure_table(const struct fv_arguments *a)
{
    struct fv_table_report report;
    struct fv_error error;
    int code = FV_EXIT_DONE;
    run.arguments = a;
    run.table = table_of(a);
    if (!run.table) return FV_EXIT_UNUSABLE;
    run.frames = a->frames > 0 ? (int)a->frames : run.table->frames;
    if (look_at_all(&error)) return unusable(error.text);
    run.stop = fv_measure_heed_signals();
    for (int n = 0; n < run.table->parts && code == FV_EXIT_DONE && !*run.stop; n++)
        if (run.place[n].left_out) continue;
        else if (run.place[n].there) fv_log("%s is there already", run.place[n].part.name);
        else code = run_part(n);
    if (write_all(&report, &error)) {
        fv_log("%s", error.text);
        return FV_EXIT_NOT_HELD;
    }
    if (*run.stop) code = FV_EXIT_NOT_HELD;
    if (*run.stop) fv_log("stopped; the same command goes on with the rest");
    if (report.parts)
        fv_log("%d of %d parts in %s/table-%s.csv; report: %s/report.html", report.parts, run.table->parts, a->out,
               run.table->name, a->out);
    return code;
}
