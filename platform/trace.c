/* trace: span rings and their writer. */
#include "platform/trace.h"

#include "platform/arena.h"
#include "platform/files.h"
#include "platform/json.h"

#include <math.h>

struct ring {
    _Alignas(64) int64_t count; /* spans ever added */
    struct fv_span span[FV_TRACE_SPANS];
};

struct fv_trace {
    int workers;
    struct ring ring[];
};

struct fv_trace *fv_trace_create(int workers)
{
    struct fv_trace *t =
        fv_arena_take(fv_arena(), "trace", sizeof *t + (size_t)workers * sizeof(struct ring), 64);
    t->workers = workers;
    return t;
}

void fv_trace_add(struct fv_trace *trace, int worker, const char *name, int64_t frame, int64_t start_ns,
                  int64_t end_ns)
{
    if (!trace) return;
    struct ring *r = &trace->ring[worker];
    r->span[r->count++ % FV_TRACE_SPANS] = (struct fv_span){name, start_ns, end_ns, frame};
}

static struct fv_writer out;

/* Begins an event that is not the first; its own fields and the closing brace follow. */
static void open_event(const char *phase, int worker, const char *name)
{
    fv_writer_print(&out, ",\n{\"ph\":\"%s\",\"pid\":1,\"tid\":%d,\"name\":", phase, worker);
    fv_json_text(&out, name);
}

/* Microseconds to the nanosecond, however long the clock has run. */
static void write_time(const char *key, int64_t ns)
{
    long long us = (long long)(ns / 1000), rest = (long long)(ns % 1000);
    if (ns < 0) us = rest = 0;
    fv_writer_print(&out, ",\"%s\":%lld.%03lld", key, us, rest);
}

static void write_names(int workers)
{
    fv_writer_print(&out,
                    "{\"ph\":\"M\",\"pid\":1,\"name\":\"process_name\",\"args\":{\"name\":\"foveola\"}}");
    for (int w = 0; w < workers; w++) {
        open_event("M", w, "thread_name");
        fv_writer_print(&out, ",\"args\":{\"name\":\"worker %d\"}}", w);
        open_event("M", w, "thread_sort_index");
        fv_writer_print(&out, ",\"args\":{\"sort_index\":%d}}", w);
    }
}

static void write_counters(const struct fv_counters *counters, int64_t frame, int64_t t_ns)
{
    double value[FV_COUNTERS_MAX];
    if (!counters->read(counters->context, frame, value)) return;
    for (int i = 0; i < counters->count; i++) {
        if (!isfinite(value[i])) continue;
        open_event("C", 0, counters->name[i]);
        write_time("ts", t_ns);
        fv_writer_print(&out, ",\"args\":{\"value\":");
        fv_json_number(&out, value[i]);
        fv_writer_print(&out, "}}");
    }
}

static void write_span(const struct fv_span *s, int worker)
{
    open_event("X", worker, s->name);
    write_time("ts", s->start_ns);
    write_time("dur", s->end_ns - s->start_ns);
    fv_writer_print(&out, ",\"args\":{\"frame\":%lld}}", (long long)s->frame);
}

int fv_trace_write(const struct fv_trace *trace, const struct fv_counters *counters, const char *path,
                   struct fv_error *error)
{
    if (fv_writer_open(&out, path, error)) return -1;
    fv_writer_print(&out, "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n");
    write_names(trace->workers);
    for (int w = 0; w < trace->workers; w++) {
        const struct ring *r = &trace->ring[w];
        int64_t first = r->count > FV_TRACE_SPANS ? r->count - FV_TRACE_SPANS : 0;
        for (int64_t i = first; i < r->count; i++) {
            const struct fv_span *s = &r->span[i % FV_TRACE_SPANS];
            bool new_frame = i == first || s->frame != r->span[(i - 1) % FV_TRACE_SPANS].frame;
            if (w == 0 && counters && new_frame) write_counters(counters, s->frame, s->start_ns);
            write_span(s, w);
        }
    }
    fv_writer_print(&out, "\n]}\n");
    return fv_writer_close(&out, error);
}
