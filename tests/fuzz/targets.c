/* Fuzzing of logs of targets: parsed; rows that are good grow, and read back as they are written. */
#include "sensors/eye/targets.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct fv_target_shown shown[FV_SHOWN_MAX], again[FV_SHOWN_MAX];
    static struct fv_writer out;
    struct fv_error error = {""};
    char *text = malloc(size + 1);
    if (!text) return 0;
    if (size) memcpy(text, data, size);
    text[size] = 0;
    int rows = fv_targets_parse(shown, "targets", text, size, &error);
    free(text);
    if (rows < 0) {
        if (!error.text[0]) abort();
        return 0;
    }
    if (rows < 1 || rows > FV_SHOWN_MAX) abort();
    /* Into the writer's own buffer, which holds all of it. */
    out.used = 0;
    out.failed = 0;
    fv_targets_begin(&out);
    for (int i = 0; i < rows; i++) {
        const struct fv_target_shown *s = &shown[i];
        if (s->from_ns < s->t_ns || s->until_ns <= s->from_ns || (i > 0 && s->t_ns < shown[i - 1].until_ns) ||
            !(hypot(s->at_deg[0], s->at_deg[1]) <= 80))
            abort();
        fv_targets_row(&out, s);
    }
    out.buffer[out.used] = 0;
    if (fv_targets_parse(again, "again", out.buffer, out.used, &error) != rows ||
        memcmp(shown, again, sizeof shown[0] * (size_t)rows) != 0)
        abort();
    return 0;
}
