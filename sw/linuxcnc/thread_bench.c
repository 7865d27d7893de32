// SPDX-License-Identifier: GPL-2.0-or-later
// thread_bench.c -- the driver's read and write functions, called as the servo thread calls
// them, without LinuxCNC: how much processor time they take. A thread of its own answers as a node.
//
//     thread_bench PERIODS AXES
//
// It runs as the realtime threads of LinuxCNC do: SCHED_FIFO, memory locked, on the last processor.
// It prints, in us, the median and the largest time of read + write, and the largest time of a loop
// that does nothing for as long as the median, once after each period: what the machine itself
// takes from a thread by interrupts and, if it is virtual, by its host. Then the number of page
// faults of the thread in all periods.
#include "bench_hal.h"

#include <pthread.h>
#include <arpa/inet.h>
#include <errno.h>
#include <poll.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>
#include <zlib.h>

#include "moire.c"

enum { CLK_HZ = 60000000, TICK = 15000, STREAMING = 2, SERVO_NS = 1000000, WARM = 100 };
enum { PRIORITY = 90, STACK = 1 << 16 };

static uint32_t register_of(uint32_t address) {
    switch (address) {
    case NODE_BASE + NODE_MAP_CRC: return MAP_CRC;
    case NODE_BASE + NODE_BUILD: return (uint32_t)axes[0] << NODE_BUILD_AXES_SHIFT;
    case NODE_BASE + NODE_CLK_HZ: return CLK_HZ;
    case NODE_BASE + NODE_TICK_PERIOD: return TICK;
    default: return AXIS_BUILT_DRIVE_MASK | AXIS_BUILT_SET_POINTS_MASK;
    }
}

// Answers each request at once. It asks again and again instead of sleeping: the driver does not
// wake a node at the end of a wire, which would take as long as all the rest of it.
static void* answer(void* argument) {
    int file = *(int*)argument;
    uint32_t request[PACKET_LONGEST_WORDS], reply[PACKET_LONGEST_WORDS] = {0};
    size_t reads = READS_FIXED + (size_t)axes[0] * READS_EACH;
    size_t words = PACKET_REPLY_WORDS + reads + PACKET_REPLY_END_WORDS;
    for (uint32_t time = 0;; time += CLK_HZ / 1000) {
        struct sockaddr_in host;
        socklen_t size = sizeof host;
        ssize_t got;
        while ((got = recvfrom(file, request, sizeof request, MSG_DONTWAIT, (struct sockaddr*)&host,
                               &size)) < 0 &&
               errno == EAGAIN) {}
        if (got <= 0) return NULL;
        const uint32_t* end = request + got / 4 - PACKET_REQUEST_END_WORDS - 1;  // before its CRC
        reply[PACKET_REPLY_IDENTITY] =
            (request[PACKET_REQUEST_IDENTITY] & ~0xFFu) | PACKET_KIND_REPLY;
        reply[PACKET_REPLY_SEQUENCE] = request[PACKET_REQUEST_SEQUENCE];
        reply[PACKET_REPLY_TIME] = time;
        for (unsigned n = 0; n < (unsigned)axes[0]; n++)
            reply[PACKET_REPLY_WORDS + list_word(READ_AXIS_STREAM_STATE, (unsigned)axes[0], n)] =
                STREAMING;
        reply[words - 1] = register_of(end[PACKET_REQUEST_END_SPARE]);
        reply[words] = (uint32_t)crc32(0, (uint8_t*)reply, (unsigned)(4 * words));
        sendto(file, reply, 4 * words + 4, 0, (struct sockaddr*)&host, size);
    }
}

static double used_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec * 1e6 + (double)now.tv_nsec * 1e-3;
}

static int by_size(const void* a, const void* b) {
    double difference = *(const double*)a - *(const double*)b;
    return (difference > 0) - (difference < 0);
}

static void on_processor(pthread_t thread, long number) {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET((size_t)number, &one);
    pthread_setaffinity_np(thread, sizeof one, &one);
}

// As rtapi_app: a page that is not there yet would be a fault within the servo thread.
static bool as_realtime(void) {
    volatile char stack[STACK];
    for (size_t n = 0; n < sizeof stack; n++) stack[n] = 0;
    struct sched_param priority = {.sched_priority = PRIORITY};
    return mlockall(MCL_CURRENT | MCL_FUTURE) == 0 &&
           sched_setscheduler(0, SCHED_FIFO, &priority) == 0;
}

static double spun_us(double length_us) {
    double begin = used_us(), now = begin;
    while (now - begin < length_us) now = used_us();
    return now - begin;
}

static double median_of(double* times, size_t count) {
    qsort(times, count, sizeof *times, by_size);
    return times[count / 2];
}

int main(int count, char** words) {
    if (count != 3) return 2;
    size_t periods = (size_t)atol(words[1]);
    axes[0] = atoi(words[2]);
    session[0] = 4711;
    int file = socket(AF_INET, SOCK_DGRAM, 0);
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof here;
    if (bind(file, (struct sockaddr*)&here, size)) return 1;
    getsockname(file, (struct sockaddr*)&here, &size);
    char place[40];
    snprintf(place, sizeof place, "udp:127.0.0.1:%d", ntohs(here.sin_port));
    node[0] = place;
    pthread_t thread;
    pthread_create(&thread, NULL, answer, &file);
    if (rtapi_app_main()) return 1;
    for (int n = 0; n < axes[0]; n++) *links->axis[n].pins.scale = 250;
    long last = sysconf(_SC_NPROCESSORS_ONLN) - 1;
    on_processor(pthread_self(), last);
    on_processor(thread, last > 0 ? last - 1 : 0);
    double *times = calloc(periods + WARM, sizeof *times), empty = 0, length_us = 0;
    if (!as_realtime()) {
        fprintf(stderr, "a thread with SCHED_FIFO and locked memory needs root\n");
        return 1;
    }
    struct rusage before, after;
    for (size_t n = 0; n < periods + WARM; n++) {
        struct pollfd reply = {.fd = links->node.carrier.file, .events = POLLIN};
        if (n) poll(&reply, 1, 1000);
        if (n == WARM) {
            length_us = median_of(times, WARM);
            getrusage(RUSAGE_THREAD, &before);
        }
        double begin = used_us();
        functions[0](arguments[0], SERVO_NS);
        functions[1](arguments[1], SERVO_NS);
        times[n] = used_us() - begin;
        double spun = n < WARM ? 0 : spun_us(length_us);
        if (spun > empty) empty = spun;
        for (int one = 0; one < axes[0] && n == 1; one++) {
            *links->axis[one].pins.enable = 1;
            links->axis[one].phase = FOLLOWING;
        }
    }
    getrusage(RUSAGE_THREAD, &after);
    for (int n = 0; n < axes[0]; n++)
        if (links->axis[n].phase != FOLLOWING) return 1;
    double median = median_of(times + WARM, periods);
    printf("%.3f %.3f %.3f %ld\n", median, times[WARM + periods - 1], empty,
           after.ru_minflt - before.ru_minflt + after.ru_majflt - before.ru_majflt);
    return *links->pins.packet_error_total != 0;
}
