/* Fuzzing of raw tapes of inertial sensors: whatever the bytes, both passes agree, and what is read can be played over and
 * over without a rotation that is none. */
#include "sensors/imu/player.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(int truth)
{
    if (!truth) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct fv_imu_tape counted, tape;
    static struct fv_imu_player player;
    struct fv_error error = {""}, again = {""};
    const struct fv_neck neck = {0.075, 0.0805};
    char *text = malloc(size + 1);
    if (size) memcpy(text, data, size);
    text[size] = 0;
    int result = fv_imu_tape_parse(&counted, "tape", text, size, NULL, &error);
    struct fv_imu_tape_row *row = malloc((size_t)(counted.rows + 1) * sizeof *row);
    check(fv_imu_tape_parse(&tape, "tape", text, size, row, &again) == result && strcmp(error.text, again.text) == 0);
    check(tape.rows == counted.rows && tape.rejected == counted.rejected && (result == 0) == (error.text[0] == 0));
    if (result == 0) {
        fv_imu_player_begin(&player, &tape);
        check(player.length_ns > 0);
        int64_t length_ns = player.length_ns;
        int64_t times[] = {INT64_MIN, 0, length_ns / 2, length_ns, 2 * length_ns + length_ns / 3, 1000 * length_ns, INT64_MAX};
        for (int i = 0; i < 7; i++) {
            struct fv_pose head;
            bool known = fv_imu_player_head(&player, &neck, true, times[i], 20000000, &head);
            check(!known || fv_pose_sound(&head));
        }
    }
    free(row);
    free(text);
    return 0;
}
