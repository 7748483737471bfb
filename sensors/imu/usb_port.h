/* usb_port: the feed's port (feed.h) to a USB device, by libusb.
 *
 * libusb is kept from searching by itself, which would take memory and a thread of its own: usb_find.h looks for the
 * device, its node is opened here, and libusb is handed the file. What memory it takes comes from usb_memory.h. The
 * context, the transfers and their buffers are made at open and serve every device that comes and goes. */
#ifndef FV_SENSORS_IMU_USB_PORT_H
#define FV_SENSORS_IMU_USB_PORT_H

#include "sensors/imu/feed.h"
#include "sensors/imu/usb_find.h"

enum { FV_USB_REPORT_MAX = 1024 };

struct fv_usb_port; /* in the arena */

/* wish: what is to be opened; laid_out: the row that holds for it whatever its ids are, or NULL: that of the table.
 * Neither libusb nor a device is touched before port->open. Before the seal. Returns 0, or -1 with the error set. */
int fv_usb_port_make(struct fv_usb_port **port, const struct fv_usb_wish *wish, const struct fv_imu_device *laid_out,
                     struct fv_error *error);

/* As the feed wants it; ends are told to `feed`. */
const struct fv_imu_port *fv_usb_port_for(struct fv_usb_port *port, struct fv_imu_feed *feed);

#endif
