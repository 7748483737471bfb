/* tape_at: what a tape says at a session time; see tape.h. */
#include "sensors/tape.h"

#include <stddef.h>

_Static_assert(offsetof(struct fv_head_sample, t_ns) == 0 && offsetof(struct fv_gaze_sample, t_ns) == 0,
               "samples begin with their time");

/* Session time to the tape's: any time before its first row is just before; it starts again a mean
 * step after its last. */
static int64_t tape_time_ns(const struct fv_tape *tape, int64_t t_ns)
{
    int64_t span = tape->last_ns - tape->first_ns;
    if (t_ns < tape->first_ns) return tape->first_ns - 1;
    int64_t length = tape->rows > 1 ? span + span / (tape->rows - 1) : 1;
    return t_ns <= tape->last_ns ? t_ns : tape->first_ns + (t_ns - tape->first_ns) % length;
}

/* Index of the last of `count` > 0 samples of `size` bytes that is not after `at`, or of the first. */
static int64_t newest(const void *samples, size_t size, int64_t count, int64_t at)
{
    int64_t low = 0, high = count;
    while (high - low > 1) {
        int64_t middle = low + (high - low) / 2;
        if (*(const int64_t *)((const char *)samples + (size_t)middle * size) <= at) low = middle;
        else high = middle;
    }
    return low;
}

void fv_tape_head_at(const struct fv_tape *tape, int64_t t_ns, struct fv_pose *head)
{
    int64_t at = tape_time_ns(tape, t_ns), i = newest(tape->head, sizeof *tape->head, tape->heads, at);
    const struct fv_head_sample *a = &tape->head[i], *b = a + 1;
    *head = a->pose;
    if (at <= a->t_ns || i + 1 == tape->heads) return;
    double part = (double)(at - a->t_ns) / (double)(b->t_ns - a->t_ns);
    for (int k = 0; k < 3; k++) head->position_m[k] += (b->pose.position_m[k] - a->pose.position_m[k]) * part;
    fv_quat_slerp(a->pose.rotation, b->pose.rotation, part, head->rotation);
}

void fv_tape_gaze_at(const struct fv_tape *tape, int64_t t_ns, struct fv_gaze_sample *gaze)
{
    int64_t at = tape_time_ns(tape, t_ns);
    *gaze = tape->gaze[newest(tape->gaze, sizeof *tape->gaze, tape->gazes, at)];
    int64_t age = at - gaze->t_ns;
    if (age < 0 || age > FV_TAPE_STALE_NS) gaze->valid = false;
    gaze->t_ns = age < 0 ? t_ns : t_ns - age;
}

int fv_tape_head_history(const struct fv_tape *tape, int64_t t_ns, const struct fv_head_sample **history,
                         int64_t *at_ns)
{
    *at_ns = tape_time_ns(tape, t_ns);
    int64_t last = newest(tape->head, sizeof *tape->head, tape->heads, *at_ns);
    int64_t first = last < FV_TAPE_HISTORY ? 0 : last - FV_TAPE_HISTORY + 1;
    *history = &tape->head[first];
    return tape->head[last].t_ns <= *at_ns ? (int)(last - first) + 1 : 0;
}

int fv_tape_gaze_history(const struct fv_tape *tape, int64_t t_ns, const struct fv_gaze_sample **history,
                         int64_t *at_ns)
{
    *at_ns = tape_time_ns(tape, t_ns);
    int64_t last = newest(tape->gaze, sizeof *tape->gaze, tape->gazes, *at_ns);
    int64_t first = last < FV_TAPE_HISTORY ? 0 : last - FV_TAPE_HISTORY + 1;
    *history = &tape->gaze[first];
    return tape->gaze[last].t_ns <= *at_ns ? (int)(last - first) + 1 : 0;
}
