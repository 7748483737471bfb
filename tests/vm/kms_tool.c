/* kms_tool COMMAND...: what another program sees of the first display card. Runs in the virtual machine of tests/vm.
 *
 *   state                           what the CRTC shows, and the console's mode
 *   hold SECONDS                    is the master for so long
 *   read FOLDER WIDTH HEIGHT        reads back what is shown: the middle of each half, as the png sink would write it
 *   flip PROCESS TIMES              flips 20 times a second in place of that process, by its own open card
 *   steal PROCESS                   takes the next event of the card that it has open: a flip that is never told of */
#define _GNU_SOURCE
#include "display/display.h"
#include "platform/log.h"

#include <dirent.h>
#include <drm.h>
#include <drm_mode.h>
#include <fcntl.h>
#include <linux/kd.h>
#include <poll.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

enum { SIDE = 256 };
static uint8_t pixels[2][SIDE * SIDE * 4];

static int fail(const char *what)
{
    perror(what);
    return 1;
}

/* The first CRTC that shows something. */
static struct drm_mode_crtc shown(int fd)
{
    uint32_t crtcs[8];
    struct drm_mode_card_res all = {.crtc_id_ptr = (uintptr_t)crtcs, .count_crtcs = 8};
    struct drm_mode_crtc crtc = {0};
    if (ioctl(fd, DRM_IOCTL_MODE_GETRESOURCES, &all)) return crtc;
    for (uint32_t i = 0; i < all.count_crtcs && !crtc.mode_valid; i++) {
        crtc = (struct drm_mode_crtc){.crtc_id = crtcs[i]};
        ioctl(fd, DRM_IOCTL_MODE_GETCRTC, &crtc);
    }
    return crtc;
}

static int state(int fd)
{
    struct drm_mode_crtc crtc = shown(fd);
    int tty = open("/dev/tty0", O_RDWR | O_NOCTTY), mode = -1;
    if (tty >= 0) ioctl(tty, KDGETMODE, &mode);
    printf("shows %s buffer %u, %dx%d, console %s\n", crtc.mode_valid ? "a mode," : "nothing,", crtc.fb_id, crtc.mode.hdisplay,
           crtc.mode.vdisplay, mode == KD_GRAPHICS ? "graphics" : mode == KD_TEXT ? "text" : "none");
    return 0;
}

static int hold(int fd, double seconds)
{
    if (ioctl(fd, DRM_IOCTL_SET_MASTER, NULL)) return fail("master");
    printf("held\n");
    fflush(stdout);
    usleep((useconds_t)(1e6 * seconds));
    return 0;
}

/* Memory of the driver: past the program's own heap. */
static const uint8_t *map(int fd, const struct drm_mode_fb_cmd *fb)
{
    struct drm_mode_map_dumb dumb = {.handle = fb->handle};
    if (ioctl(fd, DRM_IOCTL_MODE_MAP_DUMB, &dumb)) return NULL;
    long at = syscall(SYS_mmap, NULL, (size_t)fb->pitch * fb->height, PROT_READ, MAP_SHARED, fd, (off_t)dumb.offset);
    return at == -1 ? NULL : (const uint8_t *)at;
}

static int read_back(int fd, const char *folder, int width, int height)
{
    static const char *const names[2] = {"left", "right"};
    struct drm_mode_crtc crtc = shown(fd);
    struct drm_mode_fb_cmd fb = {.fb_id = crtc.fb_id};
    if (width > SIDE || height > SIDE || ioctl(fd, DRM_IOCTL_MODE_GETFB, &fb)) return fail("frame buffer");
    const uint8_t *at = map(fd, &fb);
    if (!at) return fail("map");
    struct fv_picture picture = {2, width, height, 4 * SIDE, {pixels[0], pixels[1]}};
    struct fv_png *png = fv_png_open(width, height);
    struct fv_error error;
    int half = crtc.mode.hdisplay / 2, black = 0;
    for (int eye = 0; eye < 2; eye++) {
        int left = eye * half + (half - width) / 2, top = (crtc.mode.vdisplay - height) / 2;
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++) {
                const uint8_t *from = at + (size_t)(top + y) * fb.pitch + 4 * (size_t)(left + x);
                uint8_t *to = &pixels[eye][4 * (y * SIDE + x)];
                to[0] = from[2], to[1] = from[1], to[2] = from[0];
                black += !(to[0] | to[1] | to[2]);
            }
        char path[256];
        snprintf(path, sizeof path, "%s/%s.png", folder, names[eye]);
        if (fv_png_write(png, path, &picture, eye, 1, &error)) return fprintf(stderr, "%s\n", error.text), 1;
    }
    printf("read %dx%d twice, black %d\n", width, height, black);
    return 0;
}

/* The card that a process has open: the very same, so that it is the display's master here, too; -1: none. */
static int card_of(int process)
{
    char folder[64], to[64];
    snprintf(folder, sizeof folder, "/proc/%d/fd", process);
    int of = (int)syscall(SYS_pidfd_open, process, 0), found = -1;
    DIR *all = opendir(folder);
    for (struct dirent *d; all && found < 0 && (d = readdir(all));) {
        ssize_t length = readlinkat(dirfd(all), d->d_name, to, sizeof to - 1);
        to[length > 0 ? length : 0] = 0;
        if (strncmp(to, "/dev/dri/", 9) == 0) found = (int)syscall(SYS_pidfd_getfd, of, atoi(d->d_name), 0);
    }
    if (all) closedir(all);
    return found;
}

static int flip(int fd, int times)
{
    int flips = 0;
    struct drm_mode_crtc crtc = shown(fd);
    struct drm_mode_crtc_page_flip flip = {.crtc_id = crtc.crtc_id, .fb_id = crtc.fb_id};
    for (int i = 0; i < times; i++) {
        /* Between a vertical blank and the process's own. */
        union drm_wait_vblank blank = {.request = {.type = _DRM_VBLANK_RELATIVE, .sequence = 1}};
        int tries = 0;
        ioctl(fd, DRM_IOCTL_WAIT_VBLANK, &blank);
        while (ioctl(fd, DRM_IOCTL_MODE_PAGE_FLIP, &flip) && ++tries < 100) usleep(1000);
        flips += tries < 100;
        usleep(50000);
    }
    printf("flips of another %d\n", flips);
    return 0;
}

static int steal(int fd)
{
    char event[4096];
    struct pollfd ready = {.fd = fd, .events = POLLIN};
    ssize_t got = -1;
    while (got <= 0 && poll(&ready, 1, 5000) > 0) got = read(fd, event, sizeof event);
    printf("bytes of events taken %d\n", (int)got);
    return 0;
}

/* Of a process that has it open; before all others in getting the processor. */
static int meddle(int count, char **text)
{
    int fd = card_of(atoi(text[2]));
    if (fd < 0) return fail("the process's card");
    sched_setscheduler(0, SCHED_FIFO, &(struct sched_param){60});
    if (strcmp(text[1], "flip") == 0 && count > 3) return flip(fd, atoi(text[3]));
    return strcmp(text[1], "steal") == 0 ? steal(fd) : 1;
}

int main(int count, char **text)
{
    if (count > 2 && (strcmp(text[1], "flip") == 0 || strcmp(text[1], "steal") == 0)) return meddle(count, text);
    int fd = open("/dev/dri/card0", O_RDWR | O_CLOEXEC), result = 1;
    if (fd < 0 || count < 2) return fail("/dev/dri/card0");
    if (strcmp(text[1], "state") == 0) result = state(fd);
    if (strcmp(text[1], "hold") == 0 && count > 2) result = hold(fd, atof(text[2]));
    if (strcmp(text[1], "read") == 0 && count > 4) result = read_back(fd, text[2], atoi(text[3]), atoi(text[4]));
    return result;
}
