/* factory: see factory.h. */
#include "sensors/imu/factory.h"

#include <jansson.h>
#include <math.h>
#include <string.h>
#include <zlib.h>

enum { TEXT_MAX = 256 << 10 };

int fv_factory_piece(struct fv_factory_pieces *pieces, const uint8_t *report, size_t bytes, struct fv_error *error)
{
    if (bytes < 2 || report[0] != FV_FACTORY_PIECE || report[1] > bytes - 2)
        return fv_error_set(error, "a piece of %zu bytes is none", bytes);
    if (report[1] > sizeof pieces->packed - pieces->bytes)
        return fv_error_set(error, "more than %d bytes", FV_FACTORY_PACKED_MAX);
    memcpy(pieces->packed + pieces->bytes, report + 2, report[1]);
    pieces->bytes += report[1];
    return report[1] > 0;
}

/* Three numbers; NaN where one is none. */
static void read_three(const json_t *of, const char *name, const double otherwise[3], double out[3])
{
    const json_t *three = json_object_get(of, name);
    for (size_t i = 0; i < 3; i++) {
        const json_t *one = json_array_get(three, i);
        out[i] = !three && otherwise ? otherwise[i] : json_is_number(one) ? json_number_value(one) : (double)NAN;
    }
}

int fv_factory_read(const uint8_t *packed, size_t bytes, struct fv_imu_calibration *calibration, struct fv_error *error)
{
    static char text[TEXT_MAX];
    static const double one[3] = {1, 1, 1};
    uLongf length = sizeof text;
    json_error_t why;
    if (uncompress((Bytef *)text, &length, packed, (uLong)bytes) != Z_OK)
        return fv_error_set(error, "%zu bytes cannot be unpacked", bytes);
    json_t *all = json_loadb(text, (size_t)length, 0, &why);
    if (!all) return fv_error_set(error, "no JSON: line %d: %.100s", why.line, why.text);
    const json_t *imu = json_object_get(all, "imu"), *of = json_is_object(imu) ? imu : all;
    struct fv_imu_calibration read;
    read_three(of, "acc_bias", NULL, read.acc_bias);
    read_three(of, "gyro_bias", NULL, read.rate_bias);
    read_three(of, "acc_scale", one, read.acc_scale);
    read_three(of, "gyro_scale", one, read.rate_scale);
    json_decref(all);
    if (fv_imu_calibration_check(&read, error)) return -1;
    *calibration = read;
    return 0;
}
