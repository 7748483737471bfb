/* usb_find: see usb_find.h. Folders are read by the system call itself, since the C library's readdir allocates. */
#define _GNU_SOURCE
#include "sensors/imu/usb_find.h"

#include "sensors/imu/devices.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

/* A file's first line, without its end; false where there is none. */
static bool read_line(int folder, const char *device, const char *name, char *text, size_t size)
{
    char path[320];
    snprintf(path, sizeof path, "%s/%s", device, name);
    int fd = openat(folder, path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return false;
    ssize_t got = read(fd, text, size - 1);
    close(fd);
    text[got > 0 ? got : 0] = 0;
    text[strcspn(text, "\n")] = 0;
    return got > 0;
}

static bool read_number(int folder, const char *device, const char *name, int base, long most, long *number)
{
    char text[32], *end;
    if (!read_line(folder, device, name, text, sizeof text)) return false;
    *number = strtol(text, &end, base);
    return end != text && *end == 0 && *number >= 0 && *number <= most;
}

/* Interfaces have a colon in their names. */
static bool read_place(int folder, const char *device, struct fv_usb_place *place)
{
    long vendor, product, bus, number;
    if (device[0] == '.' || strchr(device, ':')) return false;
    if (!read_number(folder, device, "idVendor", 16, UINT16_MAX, &vendor) ||
        !read_number(folder, device, "idProduct", 16, UINT16_MAX, &product) ||
        !read_number(folder, device, "busnum", 10, 999, &bus) ||
        !read_number(folder, device, "devnum", 10, 999, &number))
        return false;
    *place = (struct fv_usb_place){(uint16_t)vendor, (uint16_t)product, (int)bus, (int)number, ""};
    read_line(folder, device, "serial", place->serial, sizeof place->serial);
    return true;
}

static void put_in_order(struct fv_usb_place *places, int count)
{
    for (int i = count - 1; i > 0; i--) {
        struct fv_usb_place *a = &places[i - 1], *b = &places[i], kept = *a;
        if (a->bus < b->bus || (a->bus == b->bus && a->number <= b->number)) return;
        *a = *b, *b = kept;
    }
}

int fv_usb_list(const char *root, struct fv_usb_place places[FV_USB_PLACES_MAX])
{
    char path[320];
    _Alignas(struct dirent64) char entries[4096];
    int count = 0;
    long got;
    snprintf(path, sizeof path, "%s/sys/bus/usb/devices", root);
    int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return -1;
    while ((got = syscall(SYS_getdents64, folder, entries, sizeof entries)) > 0)
        for (long at = 0; at < got && count < FV_USB_PLACES_MAX;) {
            const struct dirent64 *entry = (const struct dirent64 *)(entries + at);
            at += entry->d_reclen;
            if (read_place(folder, entry->d_name, &places[count])) put_in_order(places, ++count);
        }
    close(folder);
    return count;
}

static bool hexadecimal(const char *text, int length)
{
    for (int i = 0; i < length; i++)
        if (!strchr("0123456789abcdefABCDEF", text[i]) || !text[i]) return false;
    return true;
}

bool fv_usb_wish_read(const char *text, struct fv_usb_wish *wish)
{
    const struct fv_imu_device *row = text[0] ? fv_imu_device_named(text) : NULL;
    *wish = (struct fv_usb_wish){0};
    if (row && row->vendor) {
        wish->vendor = row->vendor, wish->product = row->product;
    } else if (strlen(text) == 9 && text[4] == ':' && hexadecimal(text, 4) && hexadecimal(text + 5, 4)) {
        wish->vendor = (uint16_t)strtol(text, NULL, 16), wish->product = (uint16_t)strtol(text + 5, NULL, 16);
    } else {
        if (strlen(text) >= sizeof wish->serial) return false;
        strcpy(wish->serial, text);
    }
    return true;
}

const struct fv_usb_place *fv_usb_choose(const struct fv_usb_wish *wish, const struct fv_usb_place *places, int count)
{
    const struct fv_usb_place *best = NULL;
    int best_row = FV_IMU_DEVICES;
    for (int i = 0; i < count; i++) {
        const struct fv_imu_device *row = fv_imu_device_find(places[i].vendor, places[i].product);
        int at = row ? (int)(row - fv_imu_devices) : FV_IMU_DEVICES - 1; /* others only when named: last */
        bool wished = wish->vendor ? places[i].vendor == wish->vendor && places[i].product == wish->product
                                   : row || wish->serial[0];
        if (wish->serial[0] && strcmp(wish->serial, places[i].serial) != 0) wished = false;
        if (wished && at < best_row) best = &places[i], best_row = at;
    }
    return best;
}
