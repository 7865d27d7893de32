// SPDX-License-Identifier: Apache-2.0
// settings -- the values that are set once in a station: tolerances, times, roles. Each is read
// where it is used, so a change is in force at once.
#include "station/settings.h"

#include "bus/bus.h"
#include "made/bus_protocol.h"

#define LIMITS(name, id, low, high, value) [id] = {low, high, value},

static const struct {
    int64_t low, high, value;
} table[BUS_SETTING_COUNT + 1] = {BUS_SETTINGS(LIMITS)};

static int64_t settings[BUS_SETTING_COUNT + 1];

void settings_start(unsigned axes) {
    (void)axes;
    for (uint8_t id = 1; id <= BUS_SETTING_COUNT; id++) settings[id] = table[id].value;
}

int64_t settings_default(uint8_t id) { return table[id].value; }

int64_t settings_get(uint8_t id) { return settings[id]; }

uint8_t settings_set(uint8_t id, int64_t value) {
    if (id < 1 || id > BUS_SETTING_COUNT) return BUS_CAUSE_UNKNOWN_PARAMETER;
    if (value < table[id].low || value > table[id].high) return BUS_CAUSE_OUT_OF_RANGE;
    settings[id] = value;
    return BUS_CAUSE_OK;
}

uint8_t settings_operation(uint8_t operation) {
    uint8_t id = (uint8_t)bus_request_field(BUS_REQUEST_HEAD, 1);  // the first field of both
    if (operation != BUS_OPERATION_GET_SETTING && operation != BUS_OPERATION_SET_SETTING)
        return BUS_CAUSE_NOT_BUILT;
    if (id < 1 || id > BUS_SETTING_COUNT) return BUS_CAUSE_UNKNOWN_PARAMETER;
    if (operation == BUS_OPERATION_SET_SETTING)
        return settings_set(id, (int64_t)bus_request_field(BUS_SET_SETTING_REQUEST_VALUE, 8));
    bus_reply_field(BUS_GET_SETTING_REPLY_VALUE, (uint64_t)settings_get(id), 8);
    return BUS_CAUSE_OK;
}
