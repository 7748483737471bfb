/* camera_tool DEVICE VERB...: what a test does to a kernel's camera from outside, in place of v4l2-ctl, which is not
 * static.
 *
 *   input N                       the camera's input
 *   timings WIDTH HEIGHT HZ       what comes in at an HDMI input: CVT 1.2 with reduced blanking, version 2
 *   set CONTROL VALUE             a control by its name, in small letters, with _ for all that is neither letter nor digit
 *   first NAME                    waits for a thread of the kernel, for 5 s at most, that is an ordinary one; from then on
 *                                 it is before all others in getting the processor, as a device waits for none
 *
 * Runs in the virtual machine of tests/vm. Exit: 0, or 1 with what is wrong on standard output. */
#define _GNU_SOURCE
#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/v4l2-dv-timings.h>
#include <linux/videodev2.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

static int failed(const char *what)
{
    printf("camera_tool: %s: %s\n", what, strerror(errno));
    return 1;
}

static int set_input(int fd, char **text)
{
    int input = atoi(text[0]);
    return ioctl(fd, VIDIOC_S_INPUT, &input) < 0 ? failed("input") : 0;
}

/* VESA Coordinated Video Timings 1.2: 80 pixels between lines, at least 460 us between pictures. */
static int set_timings(int fd, char **text)
{
    unsigned width = (unsigned)atoi(text[0]), height = (unsigned)atoi(text[1]), hz = (unsigned)atoi(text[2]), blank = 15,
             line_hz;
    for (;; blank++) {
        line_hz = hz * (height + blank);
        if (blank > 460 * (unsigned long long)line_hz / 1000000) break;
    }
    struct v4l2_dv_timings t = {.type = V4L2_DV_BT_656_1120,
                                .bt = {.width = width,
                                       .height = height,
                                       .polarities = V4L2_DV_HSYNC_POS_POL,
                                       .pixelclock = (width + 80ull) * line_hz,
                                       .hfrontporch = 8,
                                       .hsync = 32,
                                       .hbackporch = 40,
                                       .vfrontporch = blank - 14,
                                       .vsync = 8,
                                       .vbackporch = 6,
                                       .standards = V4L2_DV_BT_STD_CVT,
                                       .flags = V4L2_DV_FL_REDUCED_BLANKING}};
    return ioctl(fd, VIDIOC_S_DV_TIMINGS, &t) < 0 ? failed("timings") : 0;
}

static void small(char *out, size_t size, const char *name)
{
    size_t n = 0;
    for (; *name && n + 1 < size; name++) {
        if (isalnum((unsigned char)*name)) out[n++] = (char)tolower((unsigned char)*name);
        else if (n > 0 && out[n - 1] != '_') out[n++] = '_';
    }
    out[n] = 0;
}

static int set_control(int fd, char **text)
{
    struct v4l2_queryctrl q = {.id = V4L2_CTRL_FLAG_NEXT_CTRL};
    for (; ioctl(fd, VIDIOC_QUERYCTRL, &q) == 0; q.id |= V4L2_CTRL_FLAG_NEXT_CTRL) {
        char name[64];
        small(name, sizeof name, (const char *)q.name);
        struct v4l2_control c = {.id = q.id, .value = atoi(text[1])};
        if (strcmp(name, text[0]) == 0) return ioctl(fd, VIDIOC_S_CTRL, &c) < 0 ? failed(name) : 0;
    }
    return failed(text[0]);
}

/* The thread whose name begins so, as long as it is an ordinary one; 0: there is none. */
static int ordinary_thread(const char *wanted)
{
    DIR *processes = opendir("/proc");
    int found = 0;
    for (struct dirent *d; processes && !found && (d = readdir(processes));) {
        char path[300], name[32] = "";
        snprintf(path, sizeof path, "/proc/%s/comm", d->d_name);
        FILE *f = atoi(d->d_name) > 0 ? fopen(path, "r") : NULL;
        if (!f) continue;
        if (fgets(name, sizeof name, f) && strncmp(name, wanted, strlen(wanted)) == 0 &&
            sched_getscheduler(atoi(d->d_name)) == SCHED_OTHER)
            found = atoi(d->d_name);
        fclose(f);
    }
    if (processes) closedir(processes);
    return found;
}

static int put_first(int fd, char **text)
{
    (void)fd;
    for (int i = 0; i < 500; i++) {
        int thread = ordinary_thread(text[0]);
        if (thread) return sched_setscheduler(thread, SCHED_FIFO, &(struct sched_param){50}) ? failed("first") : 0;
        usleep(10000);
    }
    errno = ETIMEDOUT;
    return failed("first");
}

static const struct {
    const char *name;
    int values, (*run)(int fd, char **text);
} verb[] = {{"input", 1, set_input},
            {"timings", 3, set_timings},
            {"set", 2, set_control},
            {"first", 1, put_first}};

int main(int count, char **text)
{
    int fd = count > 2 ? open(text[1], O_RDWR) : -1;
    if (fd < 0) return failed("no such camera");
    for (size_t i = 0; i < sizeof verb / sizeof verb[0]; i++)
        if (strcmp(text[2], verb[i].name) == 0 && count == 3 + verb[i].values) return verb[i].run(fd, text + 3);
    errno = EINVAL;
    return failed(text[2]);
}
