/* kms: a display of the kernel (DRM, kernel mode setting): pictures are copied into dumb buffers and flipped to at the
 * vertical blank, without libdrm.
 *
 *   kms_pick.c    which card, connector, CRTC, plane and mode
 *   kms_commit.c  setting the mode and flipping, atomic where the driver offers it, else legacy; the way back
 *   kms.c         buffers, pictures, events; losing the display and finding it again
 *   kms_copy.c    pixels
 *   kms_system.c  the system calls, behind struct fv_kms_io
 *   kms_look.c    what is there, for `foveola check`
 *   kms_sink.c    the sink that display.sink=kms names
 *
 * A state machine that is stepped by pictures: no thread, no clock of its own, no allocation, so that tests drive it by
 * a made-up device. One screen shows both eyes side by side, or each eye has one. A picture is shown pixel by pixel: in
 * the middle of its screen, or of its half of it; what does not fit is cut off, what is left over is black.
 *
 * A display that is unplugged, fails or does not flip is closed, and looked for again until it is back; the loop goes
 * on meanwhile. Drivers without a vertical blank (bochs, virtio-gpu) flip at once: nothing is waited for then. */
#ifndef FV_DISPLAY_KMS_H
#define FV_DISPLAY_KMS_H

#include "display/display.h"
#include "platform/error.h"
#include "platform/vsync.h"

#include <drm.h>
#include <drm_mode.h>

enum {
    FV_KMS_SCREENS = 2,
    FV_KMS_BUFFERS_MAX = 3,
    FV_KMS_OBJECTS = 64, /* connectors, CRTCs, encoders or planes of a card, at most */
    FV_KMS_MODES = 256,
    FV_KMS_CARDS = 16,
    FV_KMS_NAME = 32
};

/* What is asked of the system. Results below 0 are -errno. */
struct fv_kms_io {
    int (*open)(void *context, const char *path);
    void (*close)(void *context, int fd);
    int (*control)(void *context, int fd, unsigned long request, void *argument); /* ioctl */
    void *(*map)(void *context, int fd, size_t bytes, uint64_t offset);           /* NULL: refused */
    void (*unmap)(void *context, void *at, size_t bytes);
    int (*read)(void *context, int fd, void *bytes, size_t size); /* -EAGAIN: nothing is there */
    void (*wait)(void *context, int fd, int64_t timeout_ns);      /* until something can be read */
    void (*console)(void *context, bool graphics); /* the text console draws no more; false: it does */
    int64_t (*now_ns)(void *context);              /* CLOCK_MONOTONIC */
    void *context;
};
extern const struct fv_kms_io fv_kms_system;

struct fv_kms_settings {
    char device[FV_PATH_MAX];                       /* empty: the first card that has what is asked for */
    char connector[FV_KMS_SCREENS][FV_KMS_NAME];    /* "DP-1"; [0] empty: the first that is connected; [1] empty:
                                                       both eyes are on one */
    int mode_width, mode_height;                    /* 0: the size of the pictures where there is one, else the
                                                       display's own */
    double mode_hz;                                 /* 0: nearest to hz */
    int buffers;                                    /* 2 or 3 */
    int eyes, width, height;                        /* of the pictures */
    double hz;                                      /* of the frames */
};

struct fv_kms_buffer {
    uint32_t id, handle, pitch; /* id: of the frame buffer */
    size_t bytes;
    uint8_t *at;
};

/* What a screen was like before us. */
struct fv_kms_before {
    bool known;
    struct drm_mode_crtc crtc;
    uint32_t connector; /* 0: the CRTC showed nothing that we know of */
};

/* Properties of the atomic interface, by kms_commit.c's table. */
enum fv_kms_property {
    FV_KMS_CONNECTOR_CRTC,
    FV_KMS_CRTC_MODE, FV_KMS_CRTC_ACTIVE,
    FV_KMS_PLANE_FB, FV_KMS_PLANE_CRTC,
    FV_KMS_SRC_X, FV_KMS_SRC_Y, FV_KMS_SRC_W, FV_KMS_SRC_H,
    FV_KMS_CRTC_X, FV_KMS_CRTC_Y, FV_KMS_CRTC_W, FV_KMS_CRTC_H,
    FV_KMS_PROPERTIES
};

struct fv_kms_screen {
    char name[FV_KMS_NAME]; /* "HDMI-A-1" */
    uint32_t connector, crtc, plane;
    int crtc_index;
    struct drm_mode_modeinfo mode;
    uint32_t mode_blob, property[FV_KMS_PROPERTIES];
    struct fv_kms_buffer buffer[FV_KMS_BUFFERS_MAX];
    struct fv_kms_before before;
    bool pending, numbered; /* a flip is under way; `sequence` holds a number */
    uint32_t sequence;
};

struct fv_kms_counts {
    int64_t flips;   /* pictures shown */
    int64_t skipped; /* refreshes between two of them that showed the older one again, by the kernel's numbers */
    int64_t dropped; /* pictures never shown: the display was lost, or busy for too long */
    int64_t busy;    /* flips refused as the last one was not over (EBUSY), and tried again */
    int64_t odd;     /* events that nobody waited for, or that cannot be */
    int64_t lost;    /* times the display was lost ... */
    int64_t back;    /* ... and its mode set again */
    int64_t copies, bytes;         /* of pictures into buffers */
    int64_t copy_ns, copy_most_ns; /* time of that: all, the longest */
};

enum fv_kms_event {
    FV_KMS_NOTHING,
    FV_KMS_LOST, /* why: `text` */
    FV_KMS_BACK  /* how: `text` */
};

struct fv_kms {
    struct fv_kms_settings settings;
    const struct fv_kms_io *io;
    struct fv_kms_counts counts;
    char text[512]; /* what was got, in one line; or why it was lost */
    char path[FV_PATH_MAX];
    int fd; /* < 0: there is none */
    int screens;
    struct fv_kms_screen screen[FV_KMS_SCREENS];
    bool master, atomic, vblank, monotonic, set; /* set: the mode is ours, to be given back */
    bool missing, graphics;
    bool looks, shares;         /* fv_kms_take: nothing is shown; a card that another program holds will do, too */
    int front, queued;          /* buffers: shown; flipped to, not yet shown; -1: none */
    struct fv_vsync vsync;      /* of screen 0 */
    bool asked;                 /* its newest time was asked for, and is of no flip: the next flip's number says no steps */
    int64_t nominal_ns;         /* period of the mode */
    int64_t blank_ns;           /* of it, the vertical blank before a scan-out begins */
    int64_t copy_held_ns;       /* time of a copy: a peak that falls by 1/128 a picture */
    int64_t looked_ns, retry_ns, pause_ns;
    int reached;                /* how far the newest attempt to open a card came, for the message */
    /* Answers of the kernel while a card is looked at. */
    struct drm_mode_card_res resources;
    uint32_t connectors[FV_KMS_OBJECTS], crtcs[FV_KMS_OBJECTS], ids[FV_KMS_OBJECTS], encoders[FV_KMS_OBJECTS];
    struct drm_mode_modeinfo modes[FV_KMS_MODES];
    struct drm_mode_get_connector found;
};

/* Opens the display and sets its mode: 0, or -1 with what is wrong and what would be right, and nothing changed. On 0
 * kms->text says what was got. `io` stays the caller's. */
int fv_kms_open(struct fv_kms *kms, const struct fv_kms_settings *settings, const struct fv_kms_io *io,
                struct fv_error *error);

/* Shows a picture at the next vertical blank: copies it, waits until the flip before it is over (at once where frames
 * are paced by the display) and flips. */
enum fv_kms_event fv_kms_present(struct fv_kms *kms, const struct fv_picture *picture);

/* The display's beat, as of now: takes the events that wait. False: it has none (lost, or without vertical blank). */
bool fv_kms_beat(struct fv_kms *kms, struct fv_beat *beat);

/* Waits for the flip that is under way, gives the screen back as it was, and closes. */
void fv_kms_close(struct fv_kms *kms);

/* kms_look.c: what fv_kms_open would take, without showing anything. */
struct fv_kms_looked {
    bool held;          /* another program holds the card: all that is here is known, but a mode cannot be set */
    bool shows;         /* the first screen is on, in the mode ... */
    char mode[32];      /* ... "1920x1080, 60.00 Hz" */
    double mode_hz, measured_hz; /* of that mode: as it says; by its vertical blanks, 0: the driver tells none */
};

/* Finds card, connectors and modes: 0, with kms->path and kms->screen as they would be taken; or -1 with what is wrong.
 * Takes 0.3 s. Nothing is changed, and all is closed again. */
int fv_kms_look(struct fv_kms *kms, const struct fv_kms_settings *settings, const struct fv_kms_io *io,
                struct fv_kms_looked *looked, struct fv_error *error);

/* kms.c: opens a card and picks from it; 0 or -1 as fv_kms_open. */
int fv_kms_take(struct fv_kms *kms, const struct fv_kms_settings *settings, const struct fv_kms_io *io, bool shares,
                struct fv_error *error);

/* kms_sink.c: display.* of the settings. */
int fv_kms_settings_of(struct fv_kms_settings *settings, const struct fv_config *config, struct fv_error *error);

/* kms_pick.c: fills fd's screens: connector, CRTC and mode of each, and sets nominal_ns and blank_ns. */
int fv_kms_pick(struct fv_kms *kms, struct fv_error *error);
/* Whether all screens are still connected, without asking the displays themselves: cheap. */
bool fv_kms_connected(struct fv_kms *kms);
/* "HDMI-A-1". */
void fv_kms_connector_name(uint32_t type, uint32_t number, char name[FV_KMS_NAME]);
/* "1920x1080", "1920x1080@90": false where it is none of these. */
bool fv_kms_mode_read(const char *text, int *width, int *height, double *hz);
double fv_kms_mode_hz(const struct drm_mode_modeinfo *mode);

/* kms_commit.c. What the driver has of the atomic interface; where it lacks any of it, atomic is set false. */
void fv_kms_find_properties(struct fv_kms *kms);
void fv_kms_remember(struct fv_kms *kms);                  /* what the screens show, for the way back */
int fv_kms_set_mode(struct fv_kms *kms, int buffer);       /* shows the buffer; 0 or -errno */
int fv_kms_flip(struct fv_kms *kms, int buffer);           /* all screens; 0 or -errno */
void fv_kms_restore(struct fv_kms *kms);

/* kms_copy.c: rows of r, g, b, unused into rows of XRGB8888 (b, g, r, unused), each row once and in order, as
 * write-combined memory wants it. Strides in bytes. */
void fv_kms_copy(uint8_t *out, size_t out_stride, const uint8_t *rgb, size_t stride, int width, int height);

#endif
