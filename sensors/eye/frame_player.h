/* frame_player: recorded frames of one or two eyes, taken the whole way that those of cameras go, at the
 * times at which they were taken: from pixels to gaze. Past the end of the longer tape both start again. The
 * answer depends on the tapes and the frames that were due when asked alone. */
#ifndef FV_SENSORS_FRAME_PLAYER_H
#define FV_SENSORS_FRAME_PLAYER_H

#include "sensors/eye/binocular.h"
#include "sensors/eye/frame_tape.h"

enum { FV_FRAME_PLAYER_HISTORY = 8 };

struct fv_frame_player {
    int eyes;
    struct fv_frame_tape tape[2];
    struct fv_eye_tracker tracker[2];
    struct fv_binocular binocular;
    uint8_t *grey;
    struct {
        size_t at;            /* behind the next frame */
        const uint8_t *bytes; /* the next frame; NULL: the tape is over */
        int64_t t_ns;         /* its time on the tape */
    } next[2];
    int64_t first_ns, length_ns; /* of the tapes together */
    int64_t round;               /* how often they have started again */
    int samples;
    struct fv_gaze_sample sample[FV_FRAME_PLAYER_HISTORY]; /* newest last; session time */
};

/* Reads folder/left.frames, and folder/right.frames where it is. Memory from the arena ("sensors"). 0, or -1
 * with the error set. settings: of each eye. */
int fv_frame_player_open(struct fv_frame_player *player, const char *folder,
                         const struct fv_eye_settings settings[2], double settle_s, struct fv_error *error);

/* Takes the frames that were due up to t_ns, session time, of which 0 is the first frame's; where many were,
 * the newest ones. Returns the number of samples in the list. */
int fv_frame_player_until(struct fv_frame_player *player, int64_t t_ns);

#endif
