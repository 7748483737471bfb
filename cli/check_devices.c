/* check_devices: a table of what the settings may ask for outside the processor: a row each, looked at where it is asked
 * for. See check.h. A new device is one row here. */
#include "cli/check.h"

#include "platform/arena.h"
#include "sensors/eye/calibration.h"
#include "sensors/eye/camera_source.h"
#include "sensors/imu/devices.h"
#include "sensors/imu/usb_find.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum {
    CAMERA_NS = 700000000, /* frames of a camera are counted for so long ... */
    CAMERA_FIRST = 3       /* ... from this one on: the first may be older, or have a number that does not go on */
};

static bool cameras_asked(const struct fv_config *config)
{
    return strcmp(config->eye_source, "v4l2") == 0;
}

static bool right_camera_asked(const struct fv_config *config)
{
    return cameras_asked(config) && config->eye_device_right[0];
}

static bool imu_asked(const struct fv_config *config)
{
    return strcmp(config->imu_source, "usb") == 0;
}

/* Frames a second that come, over CAMERA_NS; 0 where too few do. */
static double measure_rate(struct fv_camera *camera)
{
    struct fv_camera_frame frame;
    int64_t first_ns = 0, newest_ns = 0, frames = 0, came = 0;
    int64_t until_ns = camera->io->now_ns(camera->io->context) + CAMERA_NS, now_ns;
    size_t bytes = fv_camera_grey_bytes(camera);
    fv_camera_lend(camera, fv_arena_take(fv_arena(), "check", bytes, 64), bytes);
    while (camera->fd >= 0 && (now_ns = camera->io->now_ns(camera->io->context)) < until_ns) {
        unsigned ready = 0;
        camera->io->wait(camera->io->context, &camera->fd, &ready, 1, until_ns - now_ns);
        if (fv_camera_step(camera, ready, &frame) != FV_CAMERA_FRAME) continue;
        frames = camera->counts.frames + camera->counts.skipped + camera->counts.gaps;
        newest_ns = frame.t_ns;
        if (++came <= CAMERA_FIRST) first_ns = newest_ns, camera->counts = (struct fv_camera_counts){0};
    }
    return came > CAMERA_FIRST && newest_ns > first_ns ? (double)frames * 1e9 / (double)(newest_ns - first_ns) : 0;
}

static void look_at_camera(struct fv_check *c, const struct fv_config *config, const char *what, const char *key,
                           const char *path)
{
    static struct fv_camera camera;
    struct fv_camera_settings settings;
    struct fv_error error;
    char rooted[FV_CAMERA_PATH_MAX];
    if (!path[0]) {
        fv_check_add(c, "device", what, FV_CHECK_FAULT, "set it to a path such as /dev/v4l/by-id/...", "%s is not set", key);
        return;
    }
    snprintf(rooted, sizeof rooted, "%s%.400s", c->root, path);
    fv_camera_settings_of(&settings, config, key, rooted);
    if (fv_camera_open(&camera, &settings, c->camera, &error)) {
        int why = access(rooted, R_OK | W_OK) ? errno : 0;
        fv_check_add(c, "device", what, FV_CHECK_FAULT,
                     why == EACCES ? "put who runs this into the group that owns it (video)"
                     : why == ENOENT ? "plug it in, or set the key to a path that is there"
                                     : "another camera, or other settings of the section eye",
                     "%s", error.text);
        return;
    }
    double hz = measure_rate(&camera);
    enum fv_check_state state = hz <= 0 ? FV_CHECK_FAULT : hz < 0.9 * config->eye_hz ? FV_CHECK_NOTE : FV_CHECK_OK;
    fv_check_add(c, "device", what, state,
                 hz <= 0               ? "it gives no frames: look at its cable, port and power"
                 : state != FV_CHECK_OK ? "eye.hz as it gives them; or a smaller size, a shorter exposure, a port of its own"
                                       : "",
                 "%.1f Hz measured; %.190s", hz, camera.text);
    fv_camera_close(&camera);
}

static void look_left(struct fv_check *c, const struct fv_config *config, const char *what)
{
    look_at_camera(c, config, what, "eye.device", config->eye_device);
}

static void look_right(struct fv_check *c, const struct fv_config *config, const char *what)
{
    look_at_camera(c, config, what, "eye.device_right", config->eye_device_right);
}

static void look_at_calibration(struct fv_check *c, const struct fv_config *config, const char *what)
{
    struct fv_calibration calibration = {0};
    struct fv_error error;
    if (!config->eye_calibration[0])
        fv_check_add(c, "device", what, FV_CHECK_NOTE, "calibrate, and name the file in eye.calibration",
                     "none: gaze by eye.model, degrees off");
    else if (fv_calibration_read(&calibration, config->eye_calibration, &error))
        fv_check_add(c, "device", what, FV_CHECK_FAULT, "calibrate again", "%s", error.text);
    else
        fv_check_add(c, "device", what, FV_CHECK_OK, "", "%.200s, of frames of %dx%d", config->eye_calibration,
                     calibration.width, calibration.height);
}

static void look_at_imu(struct fv_check *c, const struct fv_config *config, const char *what)
{
    static struct fv_usb_place places[FV_USB_PLACES_MAX];
    struct fv_usb_wish wish;
    char node[FV_PATH_MAX];
    int count = fv_usb_list(c->root, places);
    const struct fv_usb_place *place = NULL;
    if (count > 0 && fv_usb_wish_read(config->imu_device, &wish)) place = fv_usb_choose(&wish, places, count);
    if (!place) {
        static const char change[] = "plug it in; 'foveola help imu.device' tells which are known";
        if (count < 0) fv_check_add(c, "device", what, FV_CHECK_FAULT, change, "this kernel shows no USB (/sys/bus/usb/devices)");
        else
            fv_check_add(c, "device", what, FV_CHECK_FAULT, change, "%d devices on USB, none that imu.device asks for", count);
        return;
    }
    const struct fv_imu_device *known = fv_imu_device_find(place->vendor, place->product);
    snprintf(node, sizeof node, "%s/dev/bus/usb/%03d/%03d", c->root, place->bus, place->number);
    if (!known && !config->imu_layout[0])
        fv_check_add(c, "device", what, FV_CHECK_FAULT, "imu.layout must say how its reports are laid out",
                     "%04x:%04x is not known", place->vendor, place->product);
    else if (access(node, R_OK | W_OK) != 0)
        fv_check_add(c, "device", what, FV_CHECK_FAULT,
                     "copy config/udev/70-foveola-imu.rules to /etc/udev/rules.d, run 'udevadm control --reload', plug it in again",
                     "%04x:%04x (%s) is there, but %s: %s", place->vendor, place->product, known ? known->name : "imu.layout",
                     node, strerror(errno));
    else
        fv_check_add(c, "device", what, FV_CHECK_OK, "", "%04x:%04x (%s), may be opened: %s", place->vendor,
                     place->product, known ? known->name : "imu.layout", node);
}

/* look: adds at least one row. unasked: what the row says where it is not asked for. */
static const struct {
    const char *what;
    bool (*asked)(const struct fv_config *config);
    void (*look)(struct fv_check *check, const struct fv_config *config, const char *what);
    const char *unasked;
} devices[] = {
    {"eye camera", cameras_asked, look_left, "eye.source is not v4l2"},
    {"right eye camera", right_camera_asked, look_right, "eye.device_right is not set, or eye.source is not v4l2"},
    {"eye calibration", cameras_asked, look_at_calibration, "eye.source is not v4l2"},
    {"inertial sensor", imu_asked, look_at_imu, "imu.source is not usb"},
    {"display", fv_check_display_asked, fv_check_display, "display.sink is not kms: the refresh rate is budget.hz"},
    {"gpio", fv_check_lines_asked, fv_check_lines, "gpio.* names no line"},
};

void fv_check_devices(struct fv_check *c, const struct fv_config *config)
{
    for (size_t i = 0; i < sizeof devices / sizeof devices[0]; i++) {
        if (devices[i].asked(config)) devices[i].look(c, config, devices[i].what);
        else fv_check_add(c, "device", devices[i].what, FV_CHECK_UNASKED, "", "%s", devices[i].unasked);
    }
}
