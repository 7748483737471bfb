/* recorder: see recorder.h. */
#include "sensors/imu/recorder.h"

#include "platform/arena.h"
#include "sensors/imu/imu_tape.h"

#include <string.h>

/* A connection, where device is not NULL, or a reading. */
struct row {
    const struct fv_imu_device *device; /* lasts as long as the program */
    int64_t arrival_ns;
    int number;
    union {
        struct fv_imu_calibration calibration;
        struct fv_imu_reading reading;
    } of;
};

struct fv_imu_recorder {
    struct fv_writer writer;
    struct fv_spool spool;
    int64_t connection; /* whose stream is told; 0: none */
    struct row ring[FV_IMU_RECORDER_ROWS];
};

static int write_row(void *context, const void *data)
{
    struct fv_imu_recorder *r = context;
    const struct row *row = data;
    if (row->device) fv_imu_tape_write_stream(&r->writer, row->device, &row->of.calibration);
    else fv_imu_tape_write_reading(&r->writer, row->arrival_ns, row->number, &row->of.reading);
    return r->writer.failed;
}

int fv_imu_recorder_open(struct fv_imu_recorder **recorder, const char *folder, struct fv_spooler *spooler,
                         struct fv_error *error)
{
    struct fv_imu_recorder *r = fv_arena_take(fv_arena(), "sensors", sizeof *r, 64);
    char path[FV_PATH_MAX];
    memset(r, 0, sizeof *r);
    if (fv_path_join(path, folder, "imu.csv")) return fv_error_set(error, "%.100s: path too long", folder);
    if (fv_writer_open(&r->writer, path, error)) return -1;
    fv_imu_tape_begin(&r->writer);
    fv_spool_begin(&r->spool, "tape/imu.csv", r->ring, FV_IMU_RECORDER_ROWS, sizeof r->ring[0], write_row, r, NULL);
    fv_spooler_add(spooler, &r->spool);
    *recorder = r;
    return 0;
}

void fv_imu_recorder_report(struct fv_imu_recorder *r, const struct fv_imu_stream *stream, int64_t connection,
                            int64_t arrival_ns)
{
    struct row row = {.device = stream->source, .of.calibration = stream->calibration};
    if (r->connection != connection) {
        if (!fv_spool_put(&r->spool, &row)) return; /* readings would be taken for another stream's */
        r->connection = connection;
    }
    row = (struct row){.arrival_ns = arrival_ns};
    for (int i = 0; i < stream->raws; i++) {
        row.number = i;
        row.of.reading = stream->raw[i];
        fv_spool_put(&r->spool, &row);
    }
}

int fv_imu_recorder_close(struct fv_imu_recorder *r, int64_t session_ns, struct fv_error *error)
{
    if (!r->writer.failed && session_ns != INT64_MIN) fv_imu_tape_write_session(&r->writer, session_ns);
    return fv_writer_close_cut(&r->writer, error);
}
