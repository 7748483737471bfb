/* camera_eye DEVICE WIDTH HEIGHT HZ SECONDS [told] RIGHT,UP[,OPEN]...: an eye camera: grey frames of a simulated eye,
 * written to a v4l2loopback device at that rate; the eye looks each way in turn, its lids so far open (1: wide, 0: closed;
 * below 0: there is no eye, all is grey), for the same part of the time, or until it is told to go on by SIGUSR1. The
 * frames are drawn before; then it says so. A device waits for no processor: this is before all others in getting it. Runs in the virtual
 * machine of tests/vm. */
#define _GNU_SOURCE
#include "sensors/eye/image_sim.h"
#include "sensors/eye/tracker.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

enum { VARIANTS = 2, WAYS_MAX = 8 }; /* frames of a way differ by their noise */

static volatile sig_atomic_t way;

static void go_on(int number)
{
    (void)number;
    way = way + 1;
}

static uint8_t *draw(int width, int height, int ways, char **text)
{
    struct fv_eye_camera camera = fv_eye_camera_usual(width, height, 7);
    size_t bytes = (size_t)width * (size_t)height;
    uint8_t *frames = malloc((size_t)ways * VARIANTS * bytes);
    for (int i = 0; i < ways * VARIANTS; i++) {
        double at_deg[2] = {0, 0}, open = 1;
        if (sscanf(text[i / VARIANTS], "%lf,%lf,%lf", &at_deg[0], &at_deg[1], &open) < 2) exit(2);
        struct fv_eye_state state = {.t_ns = i, .pupil_mm = 4, .open = open};
        fv_gaze_vector(at_deg, state.direction);
        state.direction[0] = -state.direction[0]; /* the camera faces the eye */
        if (open < 0) memset(frames + (size_t)i * bytes, 90 + i % VARIANTS, bytes);
        else fv_eye_image(&camera, &state, frames + (size_t)i * bytes, width, NULL);
    }
    return frames;
}

static int open_device(const char *path, int width, int height, int hz)
{
    int fd = open(path, O_RDWR);
    struct v4l2_format f = {.type = V4L2_BUF_TYPE_VIDEO_OUTPUT};
    f.fmt.pix.width = (unsigned)width;
    f.fmt.pix.height = (unsigned)height;
    f.fmt.pix.pixelformat = V4L2_PIX_FMT_GREY;
    f.fmt.pix.field = V4L2_FIELD_NONE;
    struct v4l2_streamparm p = {.type = V4L2_BUF_TYPE_VIDEO_OUTPUT};
    p.parm.output.timeperframe = (struct v4l2_fract){1, (unsigned)hz};
    return fd < 0 || ioctl(fd, VIDIOC_S_FMT, &f) < 0 || ioctl(fd, VIDIOC_S_PARM, &p) < 0 ? -1 : fd;
}

int main(int count, char **text)
{
    if (count < 7) return 2;
    int told = strcmp(text[6], "told") == 0, ways = count - 6 - told;
    int width = atoi(text[2]), height = atoi(text[3]), hz = atoi(text[4]);
    if (ways < 1 || ways > WAYS_MAX) return 2;
    long frames = (long)(hz * atof(text[5]));
    size_t bytes = (size_t)width * (size_t)height;
    uint8_t *eye = draw(width, height, ways, text + 6 + told);
    int fd = open_device(text[1], width, height, hz);
    if (fd < 0) {
        printf("camera_eye: %s: %s\n", text[1], strerror(errno));
        return 1;
    }
    sched_setscheduler(0, SCHED_FIFO, &(struct sched_param){50});
    signal(SIGUSR1, go_on);
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    for (long n = 0; n < frames; n++) {
        long now = told ? (way < ways ? way : ways - 1) : n * ways / frames;
        const uint8_t *frame = eye + ((size_t)now * VARIANTS + (size_t)n % VARIANTS) * bytes;
        if (write(fd, frame, bytes) != (ssize_t)bytes) {
            printf("camera_eye: frame %ld: %s\n", n, strerror(errno));
            return 1;
        }
        if (n == 0) puts("camera_eye: frames come"), fflush(stdout);
        t.tv_nsec += 1000000000 / hz;
        if (t.tv_nsec >= 1000000000) t.tv_nsec -= 1000000000, t.tv_sec++;
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL) == EINTR) {}
    }
    return 0;
}
