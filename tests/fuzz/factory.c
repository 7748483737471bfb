/* Fuzzing of what the factory left in a headset. The first byte even: the rest is what was packed; odd: pieces as the
 * device sends them, each after its size. What is taken can begin a stream, or is refused by it with a reason. */
#include "sensors/imu/factory.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void read_packed(const uint8_t *packed, size_t size)
{
    static struct fv_imu_stream stream;
    struct fv_imu_calibration calibration;
    struct fv_error error = {""};
    uint8_t *exact = malloc(size ? size : 1); /* its own block, so that the sanitizer sees its end */
    if (size) memcpy(exact, packed, size);
    if (fv_factory_read(exact, size, &calibration, &error)) {
        if (!error.text[0]) abort();
    } else if (fv_imu_stream_begin(&stream, &fv_imu_devices[FV_IMU_VIVE], &calibration, &error)) abort();
    free(exact);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct fv_factory_pieces pieces;
    struct fv_error error;
    if (size < 1) return 0;
    if (data[0] % 2 == 0) {
        read_packed(data + 1, size - 1);
        return 0;
    }
    pieces.bytes = 0;
    int more = 1;
    for (size_t at = 1; at < size && more == 1;) {
        size_t bytes = data[at++] % (FV_FACTORY_PIECE_MAX + 1);
        if (bytes > size - at) bytes = size - at;
        uint8_t *exact = malloc(bytes ? bytes : 1);
        memcpy(exact, data + at, bytes);
        more = fv_factory_piece(&pieces, exact, bytes, &error);
        free(exact);
        at += bytes;
        if (pieces.bytes > FV_FACTORY_PACKED_MAX) abort();
    }
    if (more == 0) read_packed(pieces.packed, pieces.bytes);
    return 0;
}
