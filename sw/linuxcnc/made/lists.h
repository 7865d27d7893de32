// SPDX-License-Identifier: GPL-2.0-or-later
// Made by tables/linuxcnc.py from linuxcnc.toml: do not edit.
#ifndef MOIRE_LINUXCNC_LISTS_H
#define MOIRE_LINUXCNC_LISTS_H

#include <stdint.h>

struct list_place {
    unsigned fixed, each, width;
};

static const struct list_place READ_NODE_TICK_COUNT = {.fixed = 0, .each = 0, .width = 1};
static const struct list_place READ_LINK_PLL_STATE = {.fixed = 1, .each = 0, .width = 1};
static const struct list_place READ_LINK_READ_TIME = {.fixed = 2, .each = 0, .width = 1};
static const struct list_place READ_AXIS_STATE = {.fixed = 3, .each = 0, .width = 1};
static const struct list_place READ_AXIS_FAULTS = {.fixed = 3, .each = 1, .width = 1};
static const struct list_place READ_AXIS_FIRST_FAULT = {.fixed = 3, .each = 2, .width = 1};
static const struct list_place READ_AXIS_POSITION = {.fixed = 3, .each = 3, .width = 2};
static const struct list_place READ_AXIS_TARGET = {.fixed = 3, .each = 5, .width = 2};
static const struct list_place READ_AXIS_VELOCITY = {.fixed = 3, .each = 7, .width = 1};
static const struct list_place READ_AXIS_FOLLOWING_ERROR = {.fixed = 3, .each = 8, .width = 1};
static const struct list_place READ_AXIS_STREAM_STATE = {.fixed = 3, .each = 9, .width = 1};
static const struct list_place READ_AXIS_STREAM_COUNTS = {.fixed = 3, .each = 10, .width = 1};
static const struct list_place READ_AXIS_SUPERVISION = {.fixed = 3, .each = 11, .width = 1};
static const struct list_place READ_FEEDBACK_CAPTURE_STATE = {.fixed = 3, .each = 12, .width = 1};
enum { READS_FIXED = 3, READS_EACH = 13 };

static const struct list_place WRITE_AXIS_SET_POINT_POSITION = {.fixed = 0, .each = 0, .width = 2};
static const struct list_place WRITE_AXIS_SET_POINT_VELOCITY = {.fixed = 0, .each = 2, .width = 1};
static const struct list_place WRITE_NODE_AXIS_REQUESTS = {.fixed = 0, .each = 3, .width = 1};
static const struct list_place WRITE_NODE_SET_POINT_TICK = {.fixed = 1, .each = 3, .width = 1};
static const struct list_place WRITE_NODE_SET_POINT_COMMIT = {.fixed = 2, .each = 3, .width = 1};
enum { WRITES_FIXED = 3, WRITES_EACH = 3 };

#endif
