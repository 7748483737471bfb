/* schedule: see schedule.h. */
#include "rt/frame/schedule.h"

#include "platform/arena.h"

#include <math.h>
#include <string.h>

enum {
    QUAD = FV_TILE / 2, /* pixels, of what rings are counted by */
    BUCKETS = 256,      /* of an order, first ones first: */
    MUST = 0,
    WITHIN_R0 = 1,
    OTHERS = 94,
    NO_WORK = BUCKETS - 1,
    CLOSED = 1 << 30,
    BATCH = 16 /* tiles taken at once where none may be left out */
};

void fv_schedule_take(struct fv_schedule *s, struct fv_frame *f, struct fv_workers *workers,
                      const struct fv_clock *clock, struct fv_trace *trace)
{
    size_t tiles = (size_t)f->tiles;
    *s = (struct fv_schedule){.tiles = f->tiles, .clock = clock, .workers = workers, .trace = trace};
    s->eccentricity_deg = fv_arena_take(fv_arena(), "schedule", tiles * sizeof(float), 64);
    s->by_gaze = fv_arena_take(fv_arena(), "schedule", tiles * sizeof(uint32_t), 64);
    s->by_need = fv_arena_take(fv_arena(), "schedule", tiles * sizeof(uint32_t), 64);
    s->waited = fv_arena_take(fv_arena(), "schedule", tiles, 64);
    s->bucket = fv_arena_take(fv_arena(), "schedule", tiles, 64);
    f->failed_blocks = fv_arena_take(fv_arena(), "schedule", tiles, 64);
    s->ring = fv_arena_take(fv_arena(), "schedule", (size_t)workers->count * sizeof *s->ring, 64);
}

/* Degrees to a tenth of one; for vectors. acos by Abramowitz and Stegun 4.4.45. */
static inline float angle_deg(float cosine)
{
    float c = fabsf(cosine) < 1 ? fabsf(cosine) : 1;
    float a = sqrtf(1 - c) * (1.5707288f + c * (-0.2121144f + c * (0.0742610f - c * 0.0187293f))) * 57.29578f;
    return cosine < 0 ? 180 - a : a;
}

/* Eccentricities of n points of a row, `step` pixels apart from (x, y) on. */
static void row_eccentricities(const struct fv_view *v, float x, float y, float step, int n,
                               float *restrict out)
{
    const float *g = v->gaze;
    float c[3], d[3];
    for (int i = 0; v->bend.on && i < n; i++) out[i] = fv_eccentricity_deg(v, x + (float)i * step, y);
    if (v->bend.on) return;
    for (int k = 0; k < 3; k++) {
        c[k] = v->corner[k] + x * v->dx[k] + y * v->dy[k];
        d[k] = step * v->dx[k];
    }
    for (int i = 0; i < n; i++) {
        float t = (float)i, a = c[0] + t * d[0], b = c[1] + t * d[1], e = c[2] + t * d[2];
        out[i] = angle_deg((a * g[0] + b * g[1] + e * g[2]) / sqrtf(a * a + b * b + e * e));
    }
}

static int degree_of(float e)
{
    return e > 0 ? e < FV_DEGREES - 1 ? (int)e : FV_DEGREES - 1 : 0;
}

/* Stable, most important bucket first. */
static void sort(const uint8_t *bucket, int tiles, uint32_t *order)
{
    int start[BUCKETS + 1] = {0};
    for (int t = 0; t < tiles; t++) start[bucket[t] + 1]++;
    for (int b = 0; b < BUCKETS; b++) start[b + 1] += start[b];
    for (int t = 0; t < tiles; t++) order[start[bucket[t]]++] = (uint32_t)t;
}

static void count_row(struct fv_rings *rings, const float *e, int n, int width, int rows)
{
    for (int i = 0; i < n; i++) {
        int columns = width - i * QUAD < QUAD ? width - i * QUAD : QUAD;
        if (columns > 0 && !(e[i] < 0)) rings->pixels[degree_of(e[i])] += (float)(columns * rows);
    }
}

/* Quads that no eye sees through the lens have no pixels that count. */
static void leave_out_unseen(const struct fv_view *v, float y, int n, float *e)
{
    const struct fv_bend *b = &v->bend;
    for (int i = 0; b->masks && i < n; i++)
        if (fv_bend_square(b, (float)(i * QUAD + QUAD / 2), y) > b->most * b->most) e[i] = -1;
}

static void look_at_eye(struct fv_schedule *s, const struct fv_frame *f, int eye, uint8_t *bucket)
{
    const struct fv_view *v = &f->view[eye];
    float quad[2 * (8192 / FV_TILE)];
    for (int ty = 0; ty < f->tiles_y; ty++) {
        int first = (eye * f->tiles_y + ty) * f->tiles_x;
        float *e = s->eccentricity_deg + first, y = (float)(ty * FV_TILE);
        row_eccentricities(v, FV_TILE / 2, y + FV_TILE / 2, FV_TILE, f->tiles_x, e);
        for (int i = 0; i < f->tiles_x; i++) {
            bucket[first + i] = (uint8_t)degree_of(e[i]);
            s->rings.tiles[bucket[first + i]]++;
        }
        for (int half = 0; half < 2; half++) {
            int rows = f->height - ty * FV_TILE - half * QUAD;
            if (rows <= 0) continue;
            float middle = y + (float)(half * QUAD + QUAD / 2);
            row_eccentricities(v, QUAD / 2, middle, QUAD, 2 * f->tiles_x, quad);
            leave_out_unseen(v, middle, 2 * f->tiles_x, quad);
            count_row(&s->rings, quad, 2 * f->tiles_x, f->width, rows < QUAD ? rows : QUAD);
        }
    }
}

void fv_schedule_look(struct fv_schedule *s, const struct fv_frame *f)
{
    memset(&s->rings, 0, sizeof s->rings);
    for (int e = 0; e < f->eyes; e++) look_at_eye(s, f, e, s->bucket);
    sort(s->bucket, s->tiles, s->by_gaze);
    s->radius_deg = fv_radius_deg(&f->view[0], FV_TILE);
    s->must = 0;
    for (int d = 0; d <= degree_of(FV_FOVEA_DEG + s->radius_deg); d++) s->must += (int)s->rings.tiles[d];
}

void fv_schedule_least(const struct fv_schedule *s, const struct fv_pass *pass, const double expected[2],
                       double least[2])
{
    least[0] = expected[0];
    least[1] = expected[1];
    if (!pass->stand_in || pass->order != FV_ORDER_NEED) return;
    /* Of a pass that traces samples only what the fovea wants. */
    double must = (double)s->must * FV_TILE * FV_TILE, all = expected[0] + expected[1];
    least[0] = 0;
    least[1] = must < all ? must : all;
}

/* Higher for tiles whose samples do more for the picture, a ray; see schedule.h. Its upper bits count
 * eighths of octaves, which is fine enough to sort by. */
static uint8_t bucket_of_need(const struct fv_schedule *s, const struct fv_frame *f, int tile)
{
    const uint64_t *selected = f->buffer[FV_SELECTED][0];
    float e = s->eccentricity_deg[tile];
    if (degree_of(e) <= degree_of(FV_FOVEA_DEG + s->radius_deg)) return MUST;
    if (selected && !selected[tile]) return NO_WORK;
    bool within = e + s->radius_deg <= f->parameters.foveal.r0_deg;
    int blocks = selected && !within ? __builtin_popcountll(selected[tile]) : 1;
    int failed = selected && !within ? f->failed_blocks[tile] : 0;
    float need = 1 + 7 * (float)(failed < blocks ? failed : blocks) / (float)blocks;
    float weight = need * (float)(1 + s->waited[tile]) * 2.3f / (2.3f + e);
    uint32_t bits;
    memcpy(&bits, &weight, sizeof bits);
    /* Weights lie between 2^-6 and 2^11; within r0, where need is 1, below 2^8. */
    int first = within ? WITHIN_R0 : OTHERS, last = (within ? OTHERS : NO_WORK) - 1;
    int later = first + (within ? 134 << 3 : 138 << 3) - (int)(bits >> 20);
    return (uint8_t)(later < first ? first : later > last ? last : later);
}

/* The tiles that have work, in order; returns their number. */
static int order_by_need(struct fv_schedule *s, const struct fv_frame *f)
{
    int working = 0;
    for (int t = 0; t < s->tiles; t++) {
        s->bucket[t] = bucket_of_need(s, f, t);
        working += s->bucket[t] != NO_WORK;
    }
    sort(s->bucket, s->tiles, s->by_need);
    return working;
}

/* A stage under way. What a worker counts is its own. */
struct stage {
    struct fv_schedule *schedule;
    struct fv_frame *frame;
    const struct fv_pass *pass;
    struct fv_stage_limit limit;
    const uint32_t *order; /* NULL: by their numbers */
    int tiles, must, foveal; /* of the order: all, the first that must be worked at, the first within r0 */
    int batch;               /* tiles taken at once */
    _Alignas(64) atomic_uint queue; /* the next place, and CLOSED */
    struct worker_count {
        _Alignas(64) int64_t start_ns, fovea_end_ns, end_ns, start_cpu_ns, cpu_ns, stand_in_ns;
        int64_t tile_ns[2], units[2], longest_ns; /* longest: of one tile */
        int done, cut;
    } worker[FV_WORKERS_MAX];
};

/* Of the tiles so far, CPU time over what was expected, at least what the stages before say; 20 at most. What
 * other programs took is lost, but makes nothing dearer. */
static double dearer_by(const struct stage *g, const struct worker_count *c, int64_t cpu_ns)
{
    double expected_ns = c->done * g->limit.tile_cpu_ns, dearer = fmax(g->limit.dearer, 1);
    /* As if a fifth of the stage had come as expected: the first tiles alone tell little. */
    double usual_ns = 0.2 * g->tiles * g->limit.tile_cpu_ns / g->schedule->workers->count;
    if (expected_ns > 0) dearer = fmax(dearer, ((double)cpu_ns + usual_ns) / (expected_ns + usual_ns));
    return fmin(dearer, 20);
}

/* True when what is left must not be begun, for one more tile may take as long as any: at `t_ns`, `place`
 * tiles having been taken. Where the frame has been dearer than expected so far, so will be what follows. */
static bool out_of_time(const struct stage *g, const struct worker_count *c, int place, int64_t t_ns)
{
    const struct fv_stage_limit *l = &g->limit;
    double stand_in_ns = l->stand_in_ns, left_ns = (double)(l->deadline_ns - t_ns - c->longest_ns);
    if (!(stand_in_ns > 0) && c->done > 0)
        stand_in_ns =
            (double)(c->tile_ns[0] + c->tile_ns[1]) / (16.0 * c->done * g->schedule->workers->count);
    double follow_ns = l->follow_ns + (g->tiles - place) * stand_in_ns;
    /* The thread's clock takes longer to read than a small tile: only where it decides. */
    if (left_ns > follow_ns * dearer_by(g, c, t_ns - c->start_ns)) return false;
    return left_ns <= follow_ns * dearer_by(g, c, fv_clock_cpu_ns(g->schedule->clock) - c->start_cpu_ns);
}

static struct fv_ring *ring_of(const struct fv_schedule *s, int worker, int tile)
{
    int ring = (int)(s->eccentricity_deg[tile] * (1 / (float)FV_RING_DEG));
    return &s->ring[worker][ring < FV_RINGS - 1 ? ring : FV_RINGS - 1];
}

/* The n tiles from `place` on; *t_ns: now. Those of one batch are alike. */
static void work_at(struct stage *g, struct worker_count *c, int worker, int place, int n, int64_t *t_ns)
{
    struct fv_schedule *s = g->schedule;
    int units = 0, index = 0;
    for (int i = 0; i < n; i++) {
        index = g->order ? (int)g->order[place + i] : place + i;
        struct fv_tile tile = fv_tile_at(g->frame, index, worker);
        units += g->pass->run(g->frame, &tile);
    }
    int64_t now_ns = fv_clock_now_ns(s->clock), took_ns = now_ns - *t_ns;
    int whole = g->pass->whole > 0 && units >= g->pass->whole;
    *t_ns = now_ns;
    c->tile_ns[whole] += took_ns;
    c->units[whole] += units;
    c->done += n;
    /* One that was interrupted says nothing about the next. */
    if (took_ns / n > c->longest_ns && (c->done < 8 || took_ns / n * c->done < 10 * (now_ns - c->start_ns)))
        c->longest_ns = took_ns / n;
    if (g->pass->order != FV_ORDER_NEED) return;
    struct fv_ring *r = ring_of(s, worker, index);
    r->cpu_ns += (double)took_ns;
    r->units += units;
    r->tiles++;
    s->waited[index] = 0;
}

static void leave_out(struct stage *g, struct worker_count *c, int worker, int place, int64_t *t_ns)
{
    struct fv_schedule *s = g->schedule;
    struct fv_tile tile = fv_tile_at(g->frame, (int)g->order[place], worker);
    g->pass->stand_in(g->frame, &tile);
    int64_t now_ns = fv_clock_now_ns(s->clock);
    c->stand_in_ns += now_ns - *t_ns;
    *t_ns = now_ns;
    c->cut++;
    if (g->pass->order != FV_ORDER_NEED) return;
    ring_of(s, worker, tile.index)->cut++;
    if (s->waited[tile.index] < UINT8_MAX) s->waited[tile.index]++;
}

/* Closes the queue once there is no time for more. */
static void look_at_clock(struct stage *g, const struct worker_count *c, int64_t t_ns)
{
    unsigned word = atomic_load_explicit(&g->queue, memory_order_relaxed);
    int place = (int)(word & (CLOSED - 1));
    if (!(word & CLOSED) && place >= g->must && place < g->tiles && out_of_time(g, c, place, t_ns))
        atomic_fetch_or_explicit(&g->queue, CLOSED, memory_order_relaxed);
}

static void work(void *context, int worker)
{
    struct stage *g = context;
    const struct fv_clock *clock = g->schedule->clock;
    struct worker_count *c = &g->worker[worker];
    int64_t start_cpu_ns = fv_clock_cpu_ns(clock), t_ns = fv_clock_now_ns(clock);
    *c = (struct worker_count){.start_ns = t_ns, .fovea_end_ns = t_ns, .start_cpu_ns = start_cpu_ns};
    for (;;) {
        if (g->limit.deadline_ns) look_at_clock(g, c, t_ns);
        unsigned word = atomic_fetch_add_explicit(&g->queue, (unsigned)g->batch, memory_order_relaxed);
        int place = (int)(word & (CLOSED - 1)), left = g->tiles - place;
        if (left <= 0) break;
        if (word & CLOSED || place >= g->limit.done) leave_out(g, c, worker, place, &t_ns);
        else work_at(g, c, worker, place, left < g->batch ? left : g->batch, &t_ns);
        if (place < g->foveal) c->fovea_end_ns = t_ns;
    }
    c->end_ns = fv_clock_now_ns(clock);
    c->cpu_ns = fv_clock_cpu_ns(clock) - start_cpu_ns;
    if (c->cpu_ns < 0 || c->cpu_ns > c->end_ns - c->start_ns) c->cpu_ns = c->end_ns - c->start_ns;
}

static void add_spans(const struct stage *g, int worker)
{
    const struct worker_count *c = &g->worker[worker];
    struct fv_trace *trace = g->schedule->trace;
    int64_t n = g->frame->number;
    fv_trace_add(trace, worker, g->pass->name, n, c->start_ns, c->end_ns);
    if (g->pass->order != FV_ORDER_NEED) return;
    if (c->fovea_end_ns > c->start_ns) fv_trace_add(trace, worker, "fovea", n, c->start_ns, c->fovea_end_ns);
    if (c->end_ns > c->fovea_end_ns) fv_trace_add(trace, worker, "periphery", n, c->fovea_end_ns, c->end_ns);
}

/* Tile times are wall times; of each worker they are scaled to the CPU time that it used in this stage. */
static void collect(const struct stage *g, struct fv_stage_result *r)
{
    for (int w = 0; w < g->schedule->workers->count; w++) {
        const struct worker_count *c = &g->worker[w];
        int64_t busy_ns = c->tile_ns[0] + c->tile_ns[1] + c->stand_in_ns;
        double running = busy_ns > 0 ? (double)c->cpu_ns / (double)busy_ns : 1;
        for (int k = 0; k < 2; k++) {
            r->units[k] += (double)c->units[k];
            r->unit_cpu_ns[k] += (double)c->tile_ns[k] * (running < 1 ? running : 1);
        }
        r->cpu_ns += c->cpu_ns;
        r->idle_ns += r->end_ns - r->start_ns - (c->end_ns - c->start_ns);
        r->stand_in_ns += c->stand_in_ns;
        r->done += c->done;
        r->cut += c->cut;
        add_spans(g, w);
    }
}

void fv_schedule_run(struct fv_schedule *s, struct fv_frame *f, const struct fv_pass *pass,
                     const struct fv_stage_limit *limit, struct fv_stage_result *r)
{
    struct stage g = {.schedule = s,
                      .frame = f,
                      .pass = pass,
                      .limit = *limit,
                      .tiles = s->tiles,
                      .order = s->by_gaze,
                      .batch = 1};
    bool by_need = pass->order == FV_ORDER_NEED;
    bool cuttable = pass->stand_in && (f->has_history || !(pass->needs & FV_NEEDS_HISTORY));
    bool hurried = cuttable && (limit->deadline_ns || limit->done >= 0);
    int64_t begun_ns = fv_clock_now_ns(s->clock);
    if (by_need) {
        g.tiles = order_by_need(s, f);
        g.order = s->by_need;
        for (g.foveal = 0; g.foveal < g.tiles && s->bucket[s->by_need[g.foveal]] < OTHERS;) g.foveal++;
        g.must = s->must;
    }
    if (!cuttable) {
        g.limit.deadline_ns = 0;
        g.limit.done = -1;
    }
    /* What the tile before has brought into the caches serves the next: a tenth of reprojection's time. */
    if (!by_need && !hurried) g.order = NULL, g.batch = BATCH;
    if (g.limit.done < 0) g.limit.done = g.tiles;
    else g.limit.deadline_ns = 0;
    *r = (struct fv_stage_result){.start_ns = fv_clock_now_ns(s->clock)};
    r->order_ns = r->start_ns - begun_ns;
    fv_workers_each(s->workers, work, &g);
    r->end_ns = fv_clock_now_ns(s->clock);
    collect(&g, r);
}

void fv_schedule_rings(const struct fv_schedule *s, struct fv_ring sum[FV_RINGS])
{
    memset(sum, 0, FV_RINGS * sizeof *sum);
    for (int w = 0; w < s->workers->count; w++)
        for (int i = 0; i < FV_RINGS; i++) {
            const struct fv_ring *r = &s->ring[w][i];
            sum[i].cpu_ns += r->cpu_ns;
            sum[i].units += r->units;
            sum[i].tiles += r->tiles;
            sum[i].cut += r->cut;
        }
}
