/* usb_find: the USB devices that are plugged in, as the kernel shows them under /sys/bus/usb/devices. Nothing is opened
 * and nothing allocated, so that a device can be searched for while the loop runs. */
#ifndef FV_SENSORS_IMU_USB_FIND_H
#define FV_SENSORS_IMU_USB_FIND_H

#include <stdbool.h>
#include <stdint.h>

enum { FV_USB_PLACES_MAX = 128, FV_USB_SERIAL_MAX = 128 };

struct fv_usb_place {
    uint16_t vendor, product;
    int bus, number;                /* its node: /dev/bus/usb/BUS/NUMBER, three digits each */
    char serial[FV_USB_SERIAL_MAX]; /* "": it has none */
};

/* Those that are there, by bus and number; a root folder is taken for / ("" but in tests). Devices whose files are not
 * whole, as they are while being plugged in or out, are left out. Returns their number, -1 where the kernel shows no
 * USB at all. */
int fv_usb_list(const char *root, struct fv_usb_place places[FV_USB_PLACES_MAX]);

/* Which one is wanted. */
struct fv_usb_wish {
    uint16_t vendor, product;       /* 0: any of the table */
    char serial[FV_USB_SERIAL_MAX]; /* "": any */
};

/* From the setting imu.device: "" any, VENDOR:PRODUCT in hexadecimal digits, the name of a row of the table, or else a
 * serial number. False where it is longer than any. */
bool fv_usb_wish_read(const char *text, struct fv_usb_wish *wish);

/* The first place that is wished for, in the order of the table of devices where any of it is; NULL: none is there. */
const struct fv_usb_place *fv_usb_choose(const struct fv_usb_wish *wish, const struct fv_usb_place *places, int count);

#endif
