// SPDX-License-Identifier: Apache-2.0
// settings -- what a station is told once: tolerances, times, roles. Each is looked up where it is used.
#include "settings.h"

#include "line.h"
#include "line_protocol.h"

#define LIMITS(name, id, low, high, value) [id] = {low, high, value},

static const struct { int64_t low, high, value; } table[LINE_SETTING_COUNT + 1] = {LINE_SETTINGS(LIMITS)};

static int64_t settings[LINE_SETTING_COUNT + 1];

void settings_start(unsigned axes)
{
    (void)axes;
    for (uint8_t id = 1; id <= LINE_SETTING_COUNT; id++) settings[id] = table[id].value;
}

int64_t settings_default(uint8_t id)
{
    return table[id].value;
}

int64_t settings_get(uint8_t id)
{
    return settings[id];
}

uint8_t settings_set(uint8_t id, int64_t value)
{
    if (id < 1 || id > LINE_SETTING_COUNT) return LINE_CAUSE_UNKNOWN_PARAMETER;
    if (value < table[id].low || value > table[id].high) return LINE_CAUSE_OUT_OF_RANGE;
    settings[id] = value;
    return LINE_CAUSE_OK;
}

uint8_t settings_operation(uint8_t operation)
{
    uint8_t id = (uint8_t)line_field(LINE_REQUEST_HEAD, 1);             // both begin with it
    if (operation != LINE_OPERATION_GET_SETTING && operation != LINE_OPERATION_SET_SETTING) return LINE_CAUSE_NOT_BUILT;
    if (id < 1 || id > LINE_SETTING_COUNT) return LINE_CAUSE_UNKNOWN_PARAMETER;
    if (operation == LINE_OPERATION_SET_SETTING) return settings_set(id, (int64_t)line_field(LINE_SET_SETTING_REQUEST_VALUE, 8));
    line_answer(LINE_GET_SETTING_REPLY_VALUE, (uint64_t)settings_get(id), 8);
    return LINE_CAUSE_OK;
}
