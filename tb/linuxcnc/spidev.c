// SPDX-License-Identifier: Apache-2.0
// spidev -- an SPI device of Linux for the tests of the driver, which is linked with --wrap=open
// and --wrap=ioctl: the path SPIDEV is the file of spidev_set, and each transfer is a call.
#include <errno.h>
#include <fcntl.h>
#include <linux/spi/spidev.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

static const char SPIDEV[] = "/dev/spidev0.0";

static char place[256];  // empty: there is no device
static bool (*make_transfer)(const void* sent, void* received, uint32_t length, uint32_t hz);
static int device = -1;

void spidev_set(const char* file, bool (*transfer)(const void*, void*, uint32_t, uint32_t));
int __real_open(const char* path, int flags, ...);
int __wrap_open(const char* path, int flags, ...);
int __real_ioctl(int file, unsigned long request, ...);
int __wrap_ioctl(int file, unsigned long request, ...);

void spidev_set(const char* file, bool (*transfer)(const void*, void*, uint32_t, uint32_t)) {
    strncpy(place, file, sizeof place - 1);
    make_transfer = transfer;
    device = -1;
}

int __wrap_open(const char* path, int flags, ...) {
    if (!*place || strcmp(path, SPIDEV) != 0) return __real_open(path, flags);
    return device = __real_open(place, flags);
}

int __wrap_ioctl(int file, unsigned long request, ...) {
    va_list list;
    va_start(list, request);
    void* argument = va_arg(list, void*);
    va_end(list);
    if (file != device) return __real_ioctl(file, request, argument);
    const struct spi_ioc_transfer* one = argument;
    switch (request) {
    case SPI_IOC_WR_MODE: return *(uint8_t*)argument == SPI_MODE_0 ? 0 : -1;
    case SPI_IOC_WR_BITS_PER_WORD: return *(uint8_t*)argument == 8 ? 0 : -1;
    case SPI_IOC_MESSAGE(1):
        if (one->cs_change || one->bits_per_word != 8) break;
        return make_transfer((const void*)(uintptr_t)one->tx_buf, (void*)(uintptr_t)one->rx_buf,
                             one->len, one->speed_hz)
                   ? (int)one->len
                   : -1;
    }
    errno = EINVAL;
    return -1;
}
