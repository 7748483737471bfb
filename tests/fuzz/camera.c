/* Fuzzing of frames as a camera's driver gives them: format, size and stride from the first eight bytes, then the frame,
 * which may be short. What is decoded stays within the frame and the picture. */
#include "sensors/eye/v4l2_format.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 8) return 0;
    const struct fv_camera_layout layout = {.format = &fv_camera_formats[data[0] % FV_CAMERA_FORMATS],
                                            .width = (int8_t)data[1] + 256 * (data[2] % 4),
                                            .height = (int8_t)data[3] + 256 * (data[4] % 4),
                                            .stride = (size_t)data[5] + 256u * data[6]};
    size_t more = data[7], bytes = size - 8;
    if (layout.width > 0 && layout.height > 0) {
        uint8_t *frame = malloc(bytes ? bytes : 1), /* blocks of their own, so that the sanitizer sees their ends */
            *grey = malloc((size_t)layout.height * ((size_t)layout.width + more));
        if (bytes) memcpy(frame, data + 8, bytes);
        size_t whole = fv_camera_frame_bytes(&layout);
        bool decoded = fv_camera_decode(&layout, frame, bytes, grey, (size_t)layout.width + more);
        if (decoded != (whole > 0 && bytes >= whole)) abort();
        free(grey);
        free(frame);
    } else if (fv_camera_frame_bytes(&layout) != 0) abort();
    return 0;
}
