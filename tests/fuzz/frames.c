/* Fuzzing of recorded camera frames: parsed, every frame that is found decoded, and as many of them as were
 * counted. */
#include "sensors/eye/frame_tape.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fv_frame_tape t;
    struct fv_error error = {""};
    if (fv_frame_tape_parse(&t, "frames", data, size, &error)) {
        if (!error.text[0]) abort();
        return 0;
    }
    uint8_t *grey = malloc((size_t)t.layout.width * (size_t)t.layout.height), *frame;
    int64_t t_ns = INT64_MIN, frames = 0;
    size_t at = t.begin;
    while ((frame = (uint8_t *)fv_frame_tape_next(&t, &at, t_ns, &t_ns))) {
        frames++;
        if (grey && !fv_camera_decode(&t.layout, frame, fv_camera_frame_bytes(&t.layout), grey,
                                      (size_t)t.layout.width))
            abort();
    }
    if (frames != t.frames) abort();
    free(grey);
    return 0;
}
