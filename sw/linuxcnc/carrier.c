// SPDX-License-Identifier: GPL-2.0-or-later
#include "carrier.h"

#include <asm/termbits.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/spi/spidev.h>
#include <netdb.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { NS_PER_S = 1000000000, GROUP = 254 };  // COBS: most bytes after one count

int64_t carrier_now(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * (int64_t)NS_PER_S + now.tv_nsec;
}

static const char* open_udp(struct carrier* carrier, const char* host, const char* port) {
    struct addrinfo hints = {.ai_socktype = SOCK_DGRAM, .ai_family = AF_INET};
    struct addrinfo* found;
    if (getaddrinfo(host, port, &hints, &found) != 0) return "the address of the node is unknown";
    carrier->file = socket(found->ai_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    int failed = carrier->file < 0 || connect(carrier->file, found->ai_addr, found->ai_addrlen);
    freeaddrinfo(found);
    return failed ? "there is no network route to the node" : NULL;
}

static const char* open_serial(struct carrier* carrier, const char* device, unsigned baud) {
    carrier->file = open(device, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (carrier->file < 0)
        return errno == EBUSY ? "another program uses the serial port"
                              : "the serial port cannot be opened";
    struct termios2 settings;
    if (ioctl(carrier->file, TCGETS2, &settings)) return "the device is no serial port";
    if (flock(carrier->file, LOCK_EX | LOCK_NB) || ioctl(carrier->file, TIOCEXCL))
        return "another program uses the serial port";
    settings.c_iflag = settings.c_oflag = settings.c_lflag = 0;
    settings.c_cflag = CS8 | CREAD | CLOCAL | BOTHER | BOTHER << IBSHIFT;
    settings.c_ispeed = settings.c_ospeed = baud;
    if (ioctl(carrier->file, TCSETS2, &settings)) return "the serial port refuses this baud rate";
    return NULL;
}

static const char* open_spi(struct carrier* carrier, const char* device, unsigned long hz) {
    static const uint8_t mode = SPI_MODE_0, bits = 8;
    if (hz < SPI_LEAST_HZ || hz > SPI_MOST_HZ)
        return "the clock of the SPI must be 1000 to 50000000 Hz";
    carrier->hz = (unsigned)hz;
    carrier->file = open(device, O_RDWR | O_CLOEXEC);
    if (carrier->file < 0)
        return errno == ENOENT ? "there is no such SPI device: switch the SPI of this computer on"
                               : "the SPI device cannot be opened";
    if (ioctl(carrier->file, SPI_IOC_WR_MODE, &mode) ||
        ioctl(carrier->file, SPI_IOC_WR_BITS_PER_WORD, &bits))
        return "the device is no SPI device, or it has no mode 0";
    if (flock(carrier->file, LOCK_EX | LOCK_NB)) return "another program uses the SPI device";
    return NULL;
}

const char* carrier_open(struct carrier* carrier, const char* where) {
    static const char* const forms =
        "write udp:HOST:PORT, serial:DEVICE:BAUD or spi:DEVICE:HZ, with a number at the end";
    char text[128], *last;
    *carrier = (struct carrier){.file = -1};
    if (strlen(where) >= sizeof text) return "the place of the node is too long";
    strcpy(text, where);
    char* first = strchr(text, ':');
    last = strrchr(text, ':');
    if (!first || first == last) return forms;
    *first = *last = 0;
    char* end;
    unsigned long number = strtoul(last + 1, &end, 10);
    if (end == last + 1 || *end) return forms;
    const char* why = forms;
    if (strcmp(text, "serial") == 0 && number) {
        carrier->kind = CARRIER_SERIAL;
        why = open_serial(carrier, first + 1, (unsigned)number);
    } else if (strcmp(text, "spi") == 0) {
        carrier->kind = CARRIER_SPI;
        why = open_spi(carrier, first + 1, number);
    } else if (strcmp(text, "udp") == 0) {
        why = open_udp(carrier, first + 1, last + 1);
    }
    if (why) carrier_close(carrier);
    return why;
}

void carrier_close(struct carrier* carrier) {
    if (carrier->file >= 0) close(carrier->file);
    carrier->file = -1;
}

// Consistent overhead byte stuffing: the packet has no zero, and a zero ends it. The zero in front
// ends whatever noise came before.
static size_t stuffed(const uint8_t* packet, size_t length, uint8_t* out) {
    size_t count_at = 1, end = 2;
    out[0] = 0;
    for (size_t n = 0; n < length; n++) {
        if (packet[n]) out[end++] = packet[n];
        if (!packet[n] || end - count_at == GROUP + 1) {
            out[count_at] = (uint8_t)(end - count_at);
            count_at = end++;
        }
    }
    out[count_at] = (uint8_t)(end - count_at);
    out[end++] = 0;
    return end;
}

// The packet in `length` stuffed bytes without the final zero; 0 if they are none.
static size_t unstuffed(const uint8_t* in, size_t length, uint8_t* packet) {
    size_t out = 0;
    for (size_t n = 0; n < length;) {
        size_t count = in[n++];
        if (count == 0 || n + count - 1 > length || out + count - 1 > PACKET_LONGEST) return 0;
        memcpy(packet + out, in + n, count - 1);
        n += count - 1;
        out += count - 1;
        if (count > GROUP || n == length) continue;  // no zero follows
        if (out == PACKET_LONGEST) return 0;
        packet[out++] = 0;
    }
    return out;
}

// One transfer: the request, zeros while the node plays it, and zeros while the reply comes. What
// comes takes the place of what is sent.
static bool transfer(struct carrier* carrier, const uint8_t* packet, size_t length) {
    size_t whole = length + SPI_TURNROUND(length + carrier->reply, carrier->hz) + carrier->reply;
    memcpy(carrier->transferred, packet, length);
    memset(carrier->transferred + length, 0, whole - length);
    struct spi_ioc_transfer message = {
        .tx_buf = (uintptr_t)carrier->transferred,
        .rx_buf = (uintptr_t)carrier->transferred,
        .len = (uint32_t)whole,
        .speed_hz = carrier->hz,
        .bits_per_word = 8,
    };
    bool good = ioctl(carrier->file, SPI_IOC_MESSAGE(1), &message) == (int)whole;
    carrier->received = good ? whole : 0;
    return good;
}

// The reply in the last transfer begins with its first byte that is not 0. It is taken once.
static size_t take_transferred(struct carrier* carrier, uint8_t* packet) {
    size_t at = 0, length = carrier->received;
    carrier->received = 0;
    while (at < length && carrier->transferred[at] == 0) at++;
    length -= at;
    if (length > carrier->reply) length = carrier->reply;
    memcpy(packet, carrier->transferred + at, length);
    return length;
}

bool carrier_send(struct carrier* carrier, const uint8_t* packet, size_t length) {
    if (carrier->kind == CARRIER_SPI) return transfer(carrier, packet, length);
    if (carrier->kind == CARRIER_UDP)
        return send(carrier->file, packet, length, 0) == (ssize_t)length;
    uint8_t bytes[sizeof carrier->stuffed];
    size_t count = stuffed(packet, length, bytes);
    return write(carrier->file, bytes, count) == (ssize_t)count;
}

static bool readable(const struct carrier* carrier, int64_t deadline) {
    int64_t left = deadline - carrier_now();
    if (left < 0) left = 0;
    struct timespec wait = {.tv_sec = left / NS_PER_S, .tv_nsec = left % NS_PER_S};
    struct pollfd poll = {.fd = carrier->file, .events = POLLIN};
    return ppoll(&poll, 1, &wait, NULL) > 0 && poll.revents & POLLIN;
}

// The next whole packet among the received bytes of the serial port; 0: there is none yet. What is
// no packet is dropped.
static size_t take_stuffed(struct carrier* carrier, uint8_t* packet) {
    uint8_t* end;
    while ((end = memchr(carrier->stuffed, 0, carrier->received))) {
        size_t length = (size_t)(end - carrier->stuffed);
        size_t found = unstuffed(carrier->stuffed, length, packet);
        carrier->received -= length + 1;
        memmove(carrier->stuffed, end + 1, carrier->received);
        if (found) return found;
    }
    if (carrier->received == sizeof carrier->stuffed) carrier->received = 0;
    return 0;
}

// What has come without a wait; 0: no whole packet.
static size_t take(struct carrier* carrier, uint8_t* packet) {
    if (carrier->kind == CARRIER_UDP) {
        ssize_t count = recv(carrier->file, packet, PACKET_LONGEST, 0);
        return count > 0 ? (size_t)count : 0;
    }
    for (;;) {
        size_t found = take_stuffed(carrier, packet);
        uint8_t* free = carrier->stuffed + carrier->received;
        ssize_t count = 0;
        if (!found) count = read(carrier->file, free, sizeof carrier->stuffed - carrier->received);
        if (count <= 0) return found;
        carrier->received += (size_t)count;
    }
}

size_t carrier_receive(struct carrier* carrier, uint8_t* packet, int64_t deadline) {
    if (carrier->kind == CARRIER_SPI) return take_transferred(carrier, packet);
    for (;;) {
        size_t length = take(carrier, packet);
        if (length || !readable(carrier, deadline)) return length;
    }
}
