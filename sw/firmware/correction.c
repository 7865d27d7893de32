// SPDX-License-Identifier: Apache-2.0
// correction -- the learners of all axes as a part of an image: their turns and what the line asks of them.
#include "correction.h"

#include "axis.h"
#include "grating.h"
#include "hardware.h"
#include "line.h"
#include "line_protocol.h"

static unsigned axes;
static unsigned turn;                           // axis that was served last

void correction_start(unsigned served_axes)
{
    axes = served_axes;
    turn = 0;
    for (unsigned n = 0; n < axes; n++) grating_start(n);
}

void correction_work(void)
{
    if (axes == 0) return;
    for (unsigned n = 0; n < axes; n++)
        if (axis_state(n) == LINE_STATE_HOMING) return;         // it has to see its switch in time
    turn = turn + 1 < axes ? turn + 1 : 0;
    grating_poll(turn);
}

static uint8_t learner(unsigned axis)
{
    const struct learner *learner = grating_learner(axis);
    uint8_t cause = grating_learn(axis, (uint8_t)line_field(LINE_LEARNER_REQUEST_ACTION, 1));
    line_answer(LINE_LEARNER_REPLY_REASON, grating_reason(axis), 1);
    line_answer(LINE_LEARNER_REPLY_SETTLED, learner->settled, 1);
    line_answer(LINE_LEARNER_REPLY_FROZEN, learner->frozen, 1);
    line_answer(LINE_LEARNER_REPLY_ACCEPTED, learner->accepted, 4);
    line_answer(LINE_LEARNER_REPLY_REFUSED, learner->refused, 4);
    line_answer(LINE_LEARNER_REPLY_SCATTER, learner->scatter, 4);
    return cause;
}

static uint8_t get_correction(unsigned axis)
{
    const struct learner_values *values = &grating_learner(axis)->values;
    line_answer(LINE_GET_CORRECTION_REPLY_SIN_OFFSET, (uint64_t)values->sin_offset, 2);
    line_answer(LINE_GET_CORRECTION_REPLY_COS_OFFSET, (uint64_t)values->cos_offset, 2);
    line_answer(LINE_GET_CORRECTION_REPLY_GAIN, (uint64_t)values->gain, 4);
    line_answer(LINE_GET_CORRECTION_REPLY_SHEAR, (uint64_t)values->shear, 4);
    return LINE_CAUSE_OK;
}

static uint8_t get_harmonic(unsigned axis)
{
    const struct learner_values *values = &grating_learner(axis)->values;
    uint8_t order = (uint8_t)line_field(LINE_GET_HARMONIC_REQUEST_ORDER, 1);
    if (order < 1 || order > LEARNER_ORDERS) return LINE_CAUSE_OUT_OF_RANGE;
    line_answer(LINE_GET_HARMONIC_REPLY_COSINE, (uint64_t)values->cosine[order - 1], 4);
    line_answer(LINE_GET_HARMONIC_REPLY_SINE, (uint64_t)values->sine[order - 1], 4);
    return LINE_CAUSE_OK;
}

static uint8_t set_correction(unsigned axis)
{
    uint8_t apply = (uint8_t)line_field(LINE_SET_CORRECTION_REQUEST_APPLY, 1);
    struct learner_values values = {.sin_offset = (int16_t)line_field(LINE_SET_CORRECTION_REQUEST_SIN_OFFSET, 2),
                                    .cos_offset = (int16_t)line_field(LINE_SET_CORRECTION_REQUEST_COS_OFFSET, 2),
                                    .gain = (int32_t)line_field(LINE_SET_CORRECTION_REQUEST_GAIN, 4),
                                    .shear = (int32_t)line_field(LINE_SET_CORRECTION_REQUEST_SHEAR, 4)};
    return apply > 1 ? LINE_CAUSE_OUT_OF_RANGE : grating_set_correction(axis, &values, apply);
}

static uint8_t set_harmonic(unsigned axis)
{
    return grating_set_harmonic(axis, (uint8_t)line_field(LINE_SET_HARMONIC_REQUEST_ORDER, 1),
                                (int32_t)line_field(LINE_SET_HARMONIC_REQUEST_COSINE, 4),
                                (int32_t)line_field(LINE_SET_HARMONIC_REQUEST_SINE, 4));
}

uint8_t correction_operation(uint8_t operation)
{
    unsigned axis = (unsigned)line_field(LINE_REQUEST_HEAD, 1);
    if (axis < axes && !hardware_has_sine(axis)) return LINE_CAUSE_NOT_BUILT;
    switch (operation) {
    case LINE_OPERATION_LEARNER: return learner(axis);
    case LINE_OPERATION_GET_CORRECTION: return get_correction(axis);
    case LINE_OPERATION_GET_HARMONIC: return get_harmonic(axis);
    case LINE_OPERATION_SET_CORRECTION: return set_correction(axis);
    case LINE_OPERATION_SET_HARMONIC: return set_harmonic(axis);
    default: return LINE_CAUSE_NOT_BUILT;
    }
}
