// SPDX-License-Identifier: GPL-2.0-or-later
// bench_hal.h -- the functions of HAL and RTAPI that moire.c calls, for programs that call its read
// and write functions without LinuxCNC: functions[0] reads, functions[1] writes. Included once,
// before moire.c.
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <rtapi.h>
#include <hal.h>

static void (*functions[2])(void*, long);
static void* arguments[2];
static int exported;

int hal_init(const char* name) { return name ? 1 : -1; }
int hal_ready(int id) { return id - 1; }
int hal_exit(int id) { return id - 1; }
void* hal_malloc(long size) { return calloc(1, (size_t)size); }
int hal_pin_new(const char* name, hal_type_t type, hal_pin_dir_t direction, void** pointer,
                int id) {
    *pointer = calloc(1, 8);
    return !(name && type && direction && id == 1);
}
int hal_export_funct(const char* name, void (*function)(void*, long), void* argument, int floats,
                     int reentrant, int id) {
    functions[exported] = function;
    arguments[exported++] = argument;
    return !(name && floats && !reentrant && id == 1);
}
void rtapi_print_msg(msg_level_t level, const char* format, ...) {
    va_list list;
    va_start(list, format);
    if (level <= RTAPI_MSG_ERR) vfprintf(stderr, format, list);
    va_end(list);
}
int rtapi_snprintf(char* text, unsigned long size, const char* format, ...) {
    va_list list;
    va_start(list, format);
    int length = vsnprintf(text, size, format, list);
    va_end(list);
    return length;
}
