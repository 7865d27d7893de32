// SPDX-License-Identifier: Apache-2.0
// nonvolatile -- the bus operations that save the values of the node and report what is saved.
#include "station/storage/nonvolatile.h"

#include "bus/bus.h"
#include "made/bus_protocol.h"
#include "station/storage/value_store.h"

static uint8_t save_settings(void) {
    uint8_t action = (uint8_t)bus_request_field(BUS_SAVE_SETTINGS_REQUEST_ACTION, 1);
    return action > BUS_SAVE_ACTION_CLEAR ? BUS_CAUSE_OUT_OF_RANGE
                                          : value_store_save(action == BUS_SAVE_ACTION_CLEAR);
}

static uint8_t saved_value(void) {
    struct saved_value saved;
    unsigned number = (unsigned)bus_request_field(BUS_SAVED_VALUE_REQUEST_NUMBER, 2);
    uint8_t refused = value_store_get(number, &saved);
    if (refused != BUS_CAUSE_OK) return refused;
    bus_reply_field(BUS_SAVED_VALUE_REPLY_OWNER, saved.owner, 1);
    bus_reply_field(BUS_SAVED_VALUE_REPLY_ID, saved.id, 1);
    bus_reply_field(BUS_SAVED_VALUE_REPLY_VALUE, (uint64_t)saved.value, 8);
    return BUS_CAUSE_OK;
}

uint8_t nonvolatile_operation(uint8_t operation) {
    if (operation == BUS_OPERATION_SAVED_VALUE) return saved_value();
    if (operation == BUS_OPERATION_SAVE_SETTINGS) return save_settings();
    if (operation != BUS_OPERATION_SAVED_SETTINGS) return BUS_CAUSE_NOT_BUILT;
    const struct value_store_status* status = value_store_status();
    bus_reply_field(BUS_SAVED_SETTINGS_REPLY_WRITING, store_busy(), 1);
    bus_reply_field(BUS_SAVED_SETTINGS_REPLY_CAUSE, status->cause, 1);
    bus_reply_field(BUS_SAVED_SETTINGS_REPLY_DAMAGED, status->damaged, 1);
    bus_reply_field(BUS_SAVED_SETTINGS_REPLY_GENERATION, status->generation, 4);
    bus_reply_field(BUS_SAVED_SETTINGS_REPLY_VALUES, status->values, 2);
    return BUS_CAUSE_OK;
}
