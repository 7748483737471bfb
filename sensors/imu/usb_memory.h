/* usb_memory: what libusb takes and frees, from a part of the arena that is its own.
 *
 * libusb takes memory for every transfer that is submitted, and for every device that is opened again, so it cannot do
 * without after the seal. Its calls of malloc and its kin are renamed in its archive (bootstrap) and end here: blocks of
 * powers of two from one piece of fixed size, each given back to the list of its size and never cut or joined. What it
 * takes is the same from one device to the next, so the piece is used no further once every size was at its most. Where
 * the piece is used up libusb is told that there is no memory, as it expects; the arena's other users are not touched.
 * No system call, constant time. The heap (platform/heap.h) and its seal stay as they are: they never see these calls. */
#ifndef FV_SENSORS_IMU_USB_MEMORY_H
#define FV_SENSORS_IMU_USB_MEMORY_H

#include <stddef.h>
#include <stdint.h>

enum { FV_USB_MEMORY_BYTES = 256 << 10, FV_USB_BLOCK_MAX = 64 << 10 };

struct fv_usb_memory_counts {
    int64_t taken, given;  /* calls */
    int64_t refused;       /* too large, or nothing was left */
    int64_t bytes;         /* of the piece that were ever used */
};

/* Takes the piece from the arena ("usb"), once; before it libusb gets no memory. Before the seal. */
void fv_usb_memory_open(void);
struct fv_usb_memory_counts fv_usb_memory_counts(void);

/* By libusb's archive; aligned to 16 bytes. */
void *fv_usb_malloc(size_t bytes);
void *fv_usb_calloc(size_t n, size_t bytes);
void *fv_usb_realloc(void *p, size_t bytes);
void fv_usb_free(void *p);
char *fv_usb_strdup(const char *text);
int fv_usb_asprintf(char **text, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
