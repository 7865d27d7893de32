// SPDX-License-Identifier: Apache-2.0
// keep -- the parameters of the axes and the settings, kept over a power cut: which of them, and what they become again. store keeps them.
#include "keep.h"

#include "axis.h"
#include "line.h"
#include "line_protocol.h"
#include "parameters.h"
#include "settings.h"
#include "store.h"

static unsigned axes;

void keep_start(unsigned served_axes)
{
    axes = served_axes;
}

uint32_t keep_build(void)
{
    return LINE_VALUES_CRC + axes;
}

// The settings last: by them a sub-node begins to listen to its main node, and then the axes must be as they were.
bool keep_next(unsigned *at, struct keep_value *value)
{
    unsigned n = (*at)++, axis = n / LINE_PARAMETER_COUNT;
    if (axis < axes) {
        uint8_t id = (uint8_t)(n % LINE_PARAMETER_COUNT + 1u);
        *value = (struct keep_value){parameters_get(axis, id), axis, id};
        return value->value != parameters_default(id);
    }
    n -= axes * LINE_PARAMETER_COUNT;
    if (n >= LINE_SETTING_COUNT) {
        *value = (struct keep_value){.of = KEEP_END};
        return true;
    }
    uint8_t id = (uint8_t)(n + 1u);
    *value = (struct keep_value){settings_get(id), KEEP_NODE, id};
    return value->value != settings_default(id);
}

bool keep_take(const struct keep_value *value)
{
    uint8_t id = (uint8_t)value->id;
    if (value->of == KEEP_NODE) return settings_set(id, value->value) == LINE_CAUSE_OK;
    return value->of < axes && axis_set_parameter(value->of, id, value->value) == LINE_CAUSE_OK;
}

static uint8_t keep(void)
{
    uint8_t action = (uint8_t)line_field(LINE_KEEP_REQUEST_ACTION, 1);
    return action > LINE_KEEP_ACTION_FORGET ? LINE_CAUSE_OUT_OF_RANGE : store_keep(action == LINE_KEEP_ACTION_FORGET);
}

uint8_t keep_operation(uint8_t operation)
{
    if (operation == LINE_OPERATION_KEEP) return keep();
    if (operation != LINE_OPERATION_KEPT) return LINE_CAUSE_NOT_BUILT;
    const struct store_kept *kept = store_kept();
    line_answer(LINE_KEPT_REPLY_WRITING, store_state() == STORE_WRITING || store_state() == STORE_LOADING, 1);
    line_answer(LINE_KEPT_REPLY_CAUSE, kept->cause, 1);
    line_answer(LINE_KEPT_REPLY_TORN, kept->torn, 1);
    line_answer(LINE_KEPT_REPLY_GENERATION, kept->generation, 4);
    line_answer(LINE_KEPT_REPLY_VALUES, kept->values, 2);
    return LINE_CAUSE_OK;
}
