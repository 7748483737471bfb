/* Fuzzing of the tape parser: whatever the bytes, both passes agree and only sane samples come out,
 * and looking up any time gives one of them. */
#include "sensors/tape.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(int truth)
{
    if (!truth) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fv_tape counted, tape;
    struct fv_error error;
    char *text = malloc(size + 1);
    memcpy(text, data, size);
    text[size] = 0;
    int result = fv_tape_parse(&counted, "tape", text, size, NULL, NULL, &error);
    struct fv_head_sample *head = malloc((size_t)counted.heads * sizeof *head + 1);
    struct fv_gaze_sample *gaze = malloc((size_t)counted.gazes * sizeof *gaze + 1);
    check(fv_tape_parse(&tape, "tape", text, size, head, gaze, &error) == result);
    check(tape.heads == counted.heads && tape.gazes == counted.gazes && tape.rejected == counted.rejected);
    for (int64_t i = 0; i < tape.heads; i++) check(fv_head_pose_good(&head[i].pose));
    for (int64_t i = 0; i < tape.gazes; i++)
        check(!gaze[i].valid ||
              (fv_gaze_direction_good(gaze[i].direction[0]) && fv_gaze_direction_good(gaze[i].direction[1])));
    static const int64_t times[] = {INT64_MIN, 0, 1000000, INT64_MAX};
    for (int i = 0; result == 0 && i < 4; i++) {
        struct fv_pose pose;
        struct fv_gaze_sample sample;
        if (tape.heads) fv_tape_head_at(&tape, times[i], &pose), check(fv_head_pose_good(&pose));
        if (tape.gazes) fv_tape_gaze_at(&tape, times[i], &sample);
        const struct fv_head_sample *heads;
        const struct fv_gaze_sample *gazes;
        int64_t at_ns;
        int count = tape.heads ? fv_tape_head_history(&tape, times[i], &heads, &at_ns) : 0;
        check(count == 0 ||
              (heads >= head && heads + count <= head + tape.heads && heads[count - 1].t_ns <= at_ns));
        count = tape.gazes ? fv_tape_gaze_history(&tape, times[i], &gazes, &at_ns) : 0;
        check(count == 0 ||
              (gazes >= gaze && gazes + count <= gaze + tape.gazes && gazes[count - 1].t_ns <= at_ns));
    }
    free(gaze);
    free(head);
    free(text);
    return 0;
}
