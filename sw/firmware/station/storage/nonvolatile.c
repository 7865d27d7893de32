// SPDX-License-Identifier: Apache-2.0
// keep -- the parameters of the axes and the settings, kept over a power cut: which of them, and
// what they become again. store keeps them.
#include "station/storage/nonvolatile.h"

#include "axis/axis.h"
#include "bus/bus.h"
#include "made/bus_protocol.h"
#include "axis/parameters.h"
#include "station/settings.h"
#include "station/storage/store.h"

static unsigned axes;

void nonvolatile_start(unsigned served_axes) { axes = served_axes; }

uint32_t saved_values_build(void) { return BUS_VALUES_CRC + axes; }

// The settings last: by them a sub-node begins to listen to its main node, and then the axes must
// be as they were.
bool saved_values_next(unsigned* at, struct saved_value* value) {
    unsigned n = (*at)++, axis = n / BUS_PARAMETER_COUNT;
    if (axis < axes) {
        uint8_t id = (uint8_t)(n % BUS_PARAMETER_COUNT + 1u);
        *value = (struct saved_value){parameters_get(axis, id), axis, id};
        return value->value != parameters_default(id);
    }
    n -= axes * BUS_PARAMETER_COUNT;
    if (n >= BUS_SETTING_COUNT) {
        *value = (struct saved_value){.of = SAVED_END};
        return true;
    }
    uint8_t id = (uint8_t)(n + 1u);
    *value = (struct saved_value){settings_get(id), SAVED_NODE, id};
    return value->value != settings_default(id);
}

bool saved_values_restore(const struct saved_value* value) {
    uint8_t id = (uint8_t)value->id;
    if (value->of == SAVED_NODE) return settings_set(id, value->value) == BUS_CAUSE_OK;
    return value->of < axes && axis_set_parameter(value->of, id, value->value) == BUS_CAUSE_OK;
}

static uint8_t save_settings(void) {
    uint8_t action = (uint8_t)bus_request_field(BUS_SAVE_SETTINGS_REQUEST_ACTION, 1);
    return action > BUS_SAVE_ACTION_CLEAR ? BUS_CAUSE_OUT_OF_RANGE
                                          : value_store_save(action == BUS_SAVE_ACTION_CLEAR);
}

uint8_t nonvolatile_operation(uint8_t operation) {
    if (operation == BUS_OPERATION_SAVE_SETTINGS) return save_settings();
    if (operation != BUS_OPERATION_SAVED_SETTINGS) return BUS_CAUSE_NOT_BUILT;
    const struct value_store_status* status = value_store_status();
    bus_reply_field(BUS_SAVED_SETTINGS_REPLY_WRITING,
                    store_state() == STORE_WRITING || store_state() == STORE_LOADING, 1);
    bus_reply_field(BUS_SAVED_SETTINGS_REPLY_CAUSE, status->cause, 1);
    bus_reply_field(BUS_SAVED_SETTINGS_REPLY_DAMAGED, status->damaged, 1);
    bus_reply_field(BUS_SAVED_SETTINGS_REPLY_GENERATION, status->generation, 4);
    bus_reply_field(BUS_SAVED_SETTINGS_REPLY_VALUES, status->values, 2);
    return BUS_CAUSE_OK;
}
