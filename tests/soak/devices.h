/* devices: the made-up camera, inertial sensor and display that the real program is given in place of the machine's, by
 * the same interfaces (struct fv_camera_io, struct fv_imu_port, struct fv_kms_io); what goes wrong with them is set here.
 * Each is the made-up device of the unit tests (tests/support), on the world's clock (world.h), and takes a real
 * descriptor for as long as it is open. */
#ifndef FV_SOAK_DEVICES_H
#define FV_SOAK_DEVICES_H

#include "sensors/imu/feed.h"

enum { EYE_HZ = 60, EYE_SIDE = 64, SCREEN_HZ = 20 };

/* What is wrong with the camera; all 0: nothing. Numbers: of frames, or calls, that it will still be so for. */
struct eye_faults {
    bool gone, silent, shut, larger;    /* unplugged; no frames; a lid hides the pupil; opened again, frames too large */
    int flagged, shorted, odd, untimed, dropped, failing; /* odd: with a buffer's number that cannot be */
};
extern struct eye_faults eye_faults;

/* And with the inertial sensor. */
struct imu_faults {
    bool gone, says_so, mute, fails, refuses, stuck; /* says_so: the end of its transfers tells that it is gone */
    bool forbidden, jammed;                          /* may not be opened again; a halt cannot be cleared */
    int halts, garbled, dropped, skips;              /* skips: its clock begins anew */
};
extern struct imu_faults imu_faults;
extern struct fv_imu_feed *imu_feed; /* of the program; NULL: not there yet */

/* Ways to lose a display, and to have it back. */
enum screen_loss { SCREEN_WELL, SCREEN_UNPLUGGED, SCREEN_CARD_GONE, SCREEN_TAKEN, SCREEN_SILENT, SCREEN_UNREADABLE, SCREEN_REFUSES };
void screen_lose(enum screen_loss how);
void screen_busy(int times);

/* All of them are as new. */
void devices_plug(void);

/* What of them is in the program's hands: devices that are open, buffers that are mapped and the like. */
struct devices_held {
    int eye_open, eye_mapped, imu_open, screen_open, screen_mapped, screen_blobs;
};
struct devices_held devices_held(void);

/* Faults of the soak itself, to see that it finds them. */
extern bool devices_leak; /* a camera that is closed keeps its descriptor */

int eye_device_opened(void), eye_device_mapped(void);
void eye_device_plug(void);
bool imu_device_open(void);
void imu_device_plug(void);
void screen_device_held(struct devices_held *held);
void screen_device_plug(void);

/* A descriptor for a device that is opened. */
int device_descriptor(void);

#endif
