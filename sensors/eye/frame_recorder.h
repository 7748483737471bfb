/* frame_recorder: writes camera frames into frame tapes (frame_tape.h), by a thread of its own: whoever gives
 * it frames never waits. Where the disk does not keep up, frames are dropped and counted; where it fails,
 * that eye's recording ends and the failure is told at the close. Frames are kept as eight bits of grey,
 * which is all that the tracker sees. */
#ifndef FV_SENSORS_FRAME_RECORDER_H
#define FV_SENSORS_FRAME_RECORDER_H

#include "sensors/eye/frame_tape.h"
#include "sensors/eye/pupil.h"

#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>

enum { FV_RECORDER_SLOTS = 32 /* frames that may wait */ };

struct fv_frame_recorder {
    int eyes;
    struct fv_writer writer[2];
    size_t bytes[2], size[2]; /* of a frame; of the file so far */
    bool ended[2];            /* the disk or the file is full: it takes no more */
    struct {
        int eye;
        int64_t t_ns;
        uint8_t *bytes;
    } slot[FV_RECORDER_SLOTS];
    atomic_uint put, written; /* frames, so far; one thread each */
    atomic_llong dropped;
    atomic_bool stop, done;
    sem_t waiting;
    pthread_t thread;
    bool running;
};

/* Begins folder/left.frames and, of two eyes, folder/right.frames, of frames of these sizes. Memory from the
 * arena
 * ("sensors"), before the seal. 0, or -1 with the error set. */
int fv_frame_recorder_open(struct fv_frame_recorder **recorder, const char *folder, int eyes,
                           const int width[2], const int height[2], struct fv_error *error);

/* Takes a copy of a frame; from one thread only. Frames of another size than said are dropped. */
void fv_frame_recorder_put(struct fv_frame_recorder *recorder, int eye, int64_t t_ns,
                           const struct fv_eye_frame *frame);

/* Writes what still waits and closes the files. 0, or -1 with the first failure. */
int fv_frame_recorder_close(struct fv_frame_recorder *recorder, struct fv_error *error);

#endif
