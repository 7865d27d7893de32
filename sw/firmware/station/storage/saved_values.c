// SPDX-License-Identifier: Apache-2.0
// saved_values -- the list of the values that a node saves, and what each becomes again when it is
// restored: the parameters of its axes, then its settings.
#include "station/storage/saved_values.h"

#include "axis/axis.h"
#include "axis/parameters.h"
#include "made/bus_protocol.h"
#include "station/settings.h"

static unsigned axes;

void saved_values_start(unsigned served_axes) { axes = served_axes; }

uint32_t saved_values_build(void) { return BUS_VALUES_CRC + axes; }

// The settings come last: they make a sub-node listen to its main node, and by then its axes must
// have their parameters.
bool saved_values_next(unsigned* cursor, struct saved_value* value) {
    unsigned n = (*cursor)++, axis = n / BUS_PARAMETER_COUNT;
    if (axis < axes) {
        uint8_t id = (uint8_t)(n % BUS_PARAMETER_COUNT + 1u);
        *value = (struct saved_value){parameters_get(axis, id), axis, id};
        return value->value != parameters_default(id);
    }
    n -= axes * BUS_PARAMETER_COUNT;
    if (n >= BUS_SETTING_COUNT) {
        *value = (struct saved_value){.owner = SAVED_END};
        return true;
    }
    uint8_t id = (uint8_t)(n + 1u);
    *value = (struct saved_value){settings_get(id), SAVED_NODE, id};
    return value->value != settings_default(id);
}

bool saved_values_restore(const struct saved_value* value) {
    uint8_t id = (uint8_t)value->id;
    if (value->owner == SAVED_NODE) return settings_set(id, value->value) == BUS_CAUSE_OK;
    return value->owner < axes &&
           axis_set_parameter(value->owner, id, value->value) == BUS_CAUSE_OK;
}
