/* Fuzzing of calibration files: parsed, and the maps that come of them asked at places inside and far outside. */
#include "sensors/eye/calibration.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fv_calibration c;
    struct fv_error error = {""};
    char *text = malloc(size + 1);
    if (!text) return 0;
    if (size) memcpy(text, data, size);
    text[size] = 0;
    if (fv_calibration_parse(&c, "calibration", text, size, &error)) {
        if (!error.text[0]) abort();
    } else
        for (int i = 0; i < 64; i++) {
            double at = (i % 8 - 3) * pow(10, i / 8), direction[2] = {0, 0}, error_deg = 0;
            struct fv_gaze_feature f = {{at, 100 - at}, {1, -1}, i % 2};
            for (int eye = 0; eye < 2; eye++)
                if (fv_gaze_map_at(&c.map[eye], &f, direction, &error_deg) &&
                    (isnan(direction[0]) || isnan(direction[1]) || isnan(error_deg)))
                    abort();
        }
    free(text);
    return 0;
}
