/* Fuzzing of decisions.csv: whatever the bytes, both readings agree, and what comes out can be followed. */
#include "cli/decisions.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(int truth)
{
    if (!truth) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const stages[] = {"select", "support", "reproject", "sample"};
    struct fv_decisions_of of = {.stage = stages, .stages = 4, .levels = 9, .tiles = 1000};
    char *text = malloc(size + 1);
    memcpy(text, data, size);
    text[size] = 0;
    for (of.frames = 1; of.frames <= 4; of.frames++) {
        struct fv_error error = {""}, again = {""};
        struct fv_decision decision[4];
        int result = fv_decisions_parse("fuzz", text, size, &of, NULL, &error);
        check(fv_decisions_parse("fuzz", text, size, &of, decision, &again) == result);
        check(strcmp(error.text, again.text) == 0 && (result == 0) == (error.text[0] == 0));
        for (int64_t n = 0; result == 0 && n < of.frames; n++) {
            check(decision[n].t_ns >= 0 && (n == 0 || decision[n].t_ns > decision[n - 1].t_ns));
            check(decision[n].late_ns == 0 || decision[n].late_ns > decision[n].t_ns);
            check(n == 0 || decision[n].t_ns > decision[n - 1].late_ns);
            check(decision[n].level >= 0 && decision[n].level < of.levels);
            for (int k = 0; k < FV_STAGES_MAX; k++)
                check(decision[n].done[k] >= -1 && decision[n].done[k] <= of.tiles);
        }
    }
    free(text);
    return 0;
}
