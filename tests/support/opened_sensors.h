/* opened_sensors: sensors of given sources, whose tapes are gaze.csv and head.csv in the test's folder. For
 * tests only. */
#ifndef FV_TESTS_OPENED_SENSORS_H
#define FV_TESTS_OPENED_SENSORS_H

#include "sensors/sensors.h"
#include "tests/support/program.h"

static inline struct fv_config *sensor_settings(const char *eye, const char *imu, int eye_seed, int imu_seed)
{
    static struct fv_config config;
    memset(&config, 0, sizeof config);
    snprintf(config.eye_source, sizeof config.eye_source, "%s", eye);
    snprintf(config.imu_source, sizeof config.imu_source, "%s", imu);
    snprintf(config.eye_tape, sizeof config.eye_tape, "%s/gaze.csv", program_folder());
    snprintf(config.imu_tape, sizeof config.imu_tape, "%s/head.csv", program_folder());
    strcpy(config.imu_predict, "decay");
    config.eye_seed = eye_seed, config.imu_seed = imu_seed;
    config.eye_hold_ms = 1000, config.eye_noise_deg = 0.3;
    return &config;
}

static inline struct fv_sensors *opened(const struct fv_config *config)
{
    struct fv_sensors *sensors = NULL;
    struct fv_error why;
    if (fv_sensors_open(&sensors, config, &why)) fail_msg("%s", why.text);
    return sensors;
}

#endif
