/* pcap: USB captures of Linux (pcap, link type 220), gzip'd or not, packet by packet. For tests only. */
#ifndef FV_TESTS_PCAP_H
#define FV_TESTS_PCAP_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <zlib.h>

struct pcap_packet {
    int64_t t_ns;
    int device, endpoint;
    bool came; /* the end of a transfer, not its beginning */
    uint8_t data[4096];
    size_t bytes;
};

static inline uint32_t pcap_word(const uint8_t *at)
{
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

/* NULL where there is none or it is no such capture. */
static inline gzFile pcap_open(const char *path)
{
    uint8_t head[24];
    gzFile f = gzopen(path, "rb");
    if (f && gzread(f, head, sizeof head) == sizeof head && pcap_word(head) == 0xa1b2c3d4 && pcap_word(head + 20) == 220)
        return f;
    if (f) gzclose(f);
    return NULL;
}

static inline bool pcap_next(gzFile f, struct pcap_packet *packet)
{
    enum { HEAD = 64 };
    uint8_t head[16], usb[HEAD];
    if (gzread(f, head, sizeof head) != sizeof head) return false;
    uint32_t bytes = pcap_word(head + 8);
    packet->t_ns = pcap_word(head) * INT64_C(1000000000) + pcap_word(head + 4) * INT64_C(1000);
    if (bytes < HEAD || bytes - HEAD > sizeof packet->data || gzread(f, usb, HEAD) != HEAD) return false;
    packet->bytes = bytes - HEAD;
    packet->came = usb[8] == 'C';
    packet->endpoint = usb[10];
    packet->device = usb[11];
    return gzread(f, packet->data, (unsigned)packet->bytes) == (int)packet->bytes;
}

#endif
