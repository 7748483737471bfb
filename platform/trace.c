/* trace: span rings and their writer. */
#include "platform/trace.h"

#include "platform/arena.h"
#include "platform/files.h"

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
    struct fv_trace *t = fv_arena_take(fv_arena(), "trace",
                                       sizeof *t + (size_t)workers * sizeof(struct ring), 64);
    t->workers = workers;
    return t;
}

void fv_trace_add(struct fv_trace *trace, int worker, const char *name, int64_t frame,
                  int64_t start_ns, int64_t end_ns)
{
    if (!trace) return;
    struct ring *r = &trace->ring[worker];
    r->span[r->count++ % FV_TRACE_SPANS] = (struct fv_span){name, start_ns, end_ns, frame};
}

int fv_trace_write(const struct fv_trace *trace, const char *path, struct fv_error *error)
{
    static struct fv_writer out;
    if (fv_writer_open(&out, path, error)) return -1;
    fv_writer_print(&out, "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n");
    for (int w = 0; w < trace->workers; w++)
        fv_writer_print(&out, "{\"ph\":\"M\",\"pid\":1,\"tid\":%d,\"name\":\"thread_name\",\"args\":{\"name\":\"worker %d\"}}%s\n",
                        w, w, w + 1 < trace->workers || trace->ring[0].count ? "," : "");
    const char *separator = "";
    for (int w = 0; w < trace->workers; w++) {
        const struct ring *r = &trace->ring[w];
        int64_t first = r->count > FV_TRACE_SPANS ? r->count - FV_TRACE_SPANS : 0;
        for (int64_t i = first; i < r->count; i++) {
            const struct fv_span *s = &r->span[i % FV_TRACE_SPANS];
            fv_writer_print(&out,
                            "%s{\"ph\":\"X\",\"pid\":1,\"tid\":%d,\"name\":\"%s\",\"ts\":%.3f,\"dur\":%.3f,\"args\":{\"frame\":%lld}}",
                            separator, w, s->name, (double)s->start_ns * 1e-3,
                            (double)(s->end_ns - s->start_ns) * 1e-3, (long long)s->frame);
            separator = ",\n";
        }
    }
    fv_writer_print(&out, "\n]}\n");
    return fv_writer_close(&out, error);
}
