// SPDX-License-Identifier: Apache-2.0
// calibration_axes -- the calibrations of all axes as a part of an image: one axis a poll, and the
// bus operations about them.
#include "calibration/calibration_axes.h"

#include "axis/axis.h"
#include "calibration/calibration_driver.h"
#include "core/hardware.h"
#include "bus/bus.h"
#include "made/bus_protocol.h"

static unsigned axes;
static unsigned served;  // axis that was polled last

void calibration_axes_start(unsigned axes_to_serve) {
    axes = axes_to_serve;
    served = 0;
    for (unsigned n = 0; n < axes; n++) calibration_driver_start(n);
}

void calibration_axes_work(void) {
    if (axes == 0) return;
    for (unsigned n = 0; n < axes; n++)
        if (axis_state(n) == BUS_STATE_HOMING) return;  // the poll must see its switch in time
    served = served + 1 < axes ? served + 1 : 0;
    calibration_driver_poll(served);
}

bool calibration_axes_idle(void) {
    for (unsigned n = 0; n < axes; n++)
        if (!calibration_driver_idle(n)) return false;
    return true;
}

static uint8_t calibration(unsigned axis) {
    const struct calibration* calibration = calibration_driver_state(axis);
    uint8_t cause =
        calibration_driver_do(axis, (uint8_t)bus_request_field(BUS_CALIBRATION_REQUEST_ACTION, 1));
    bus_reply_field(BUS_CALIBRATION_REPLY_REASON, calibration_driver_reason(axis), 1);
    bus_reply_field(BUS_CALIBRATION_REPLY_CONVERGED, calibration->complete, 1);
    bus_reply_field(BUS_CALIBRATION_REPLY_FROZEN, calibration->mode == CALIBRATION_FROZEN, 1);
    bus_reply_field(BUS_CALIBRATION_REPLY_ACCEPTED, calibration->accepted, 4);
    bus_reply_field(BUS_CALIBRATION_REPLY_REFUSED, calibration->refused, 4);
    bus_reply_field(BUS_CALIBRATION_REPLY_SCATTER, calibration->scatter, 4);
    return cause;
}

static uint8_t get_correction(unsigned axis) {
    const struct calibration_values* values = &calibration_driver_state(axis)->values;
    bus_reply_field(BUS_GET_CORRECTION_REPLY_SIN_OFFSET, (uint64_t)values->sin_offset, 2);
    bus_reply_field(BUS_GET_CORRECTION_REPLY_COS_OFFSET, (uint64_t)values->cos_offset, 2);
    bus_reply_field(BUS_GET_CORRECTION_REPLY_GAIN, (uint64_t)values->gain, 4);
    bus_reply_field(BUS_GET_CORRECTION_REPLY_QUADRATURE_ERROR, (uint64_t)values->quadrature_error,
                    4);
    return BUS_CAUSE_OK;
}

static uint8_t get_harmonic(unsigned axis) {
    const struct calibration_values* values = &calibration_driver_state(axis)->values;
    uint8_t order = (uint8_t)bus_request_field(BUS_GET_HARMONIC_REQUEST_ORDER, 1);
    if (order < 1 || order > CALIBRATION_ORDERS) return BUS_CAUSE_OUT_OF_RANGE;
    bus_reply_field(BUS_GET_HARMONIC_REPLY_COSINE, (uint64_t)values->cosine[order - 1], 4);
    bus_reply_field(BUS_GET_HARMONIC_REPLY_SINE, (uint64_t)values->sine[order - 1], 4);
    return BUS_CAUSE_OK;
}

static uint8_t set_correction(unsigned axis) {
    uint8_t apply = (uint8_t)bus_request_field(BUS_SET_CORRECTION_REQUEST_APPLY, 1);
    struct calibration_values values = {
        .sin_offset = (int16_t)bus_request_field(BUS_SET_CORRECTION_REQUEST_SIN_OFFSET, 2),
        .cos_offset = (int16_t)bus_request_field(BUS_SET_CORRECTION_REQUEST_COS_OFFSET, 2),
        .gain = (int32_t)bus_request_field(BUS_SET_CORRECTION_REQUEST_GAIN, 4),
        .quadrature_error =
            (int32_t)bus_request_field(BUS_SET_CORRECTION_REQUEST_QUADRATURE_ERROR, 4)};
    return apply > 1 ? BUS_CAUSE_OUT_OF_RANGE
                     : calibration_driver_set_correction(axis, &values, apply);
}

static uint8_t set_harmonic(unsigned axis) {
    return calibration_driver_set_harmonic(
        axis, (uint8_t)bus_request_field(BUS_SET_HARMONIC_REQUEST_ORDER, 1),
        (int32_t)bus_request_field(BUS_SET_HARMONIC_REQUEST_COSINE, 4),
        (int32_t)bus_request_field(BUS_SET_HARMONIC_REQUEST_SINE, 4));
}

uint8_t calibration_axes_operation(uint8_t operation) {
    unsigned axis = (unsigned)bus_request_field(BUS_REQUEST_HEAD, 1);
    uint32_t feature = operation == BUS_OPERATION_CALIBRATION    ? AXIS_BUILT_RECORDER_MASK
                       : operation == BUS_OPERATION_SET_HARMONIC ? AXIS_BUILT_HARMONICS_MASK
                                                                 : AXIS_BUILT_SINE_MASK;
    if (axis < axes && !hardware_built(axis, feature)) return BUS_CAUSE_NOT_BUILT;
    switch (operation) {
    case BUS_OPERATION_CALIBRATION: return calibration(axis);
    case BUS_OPERATION_GET_CORRECTION: return get_correction(axis);
    case BUS_OPERATION_GET_HARMONIC: return get_harmonic(axis);
    case BUS_OPERATION_SET_CORRECTION: return set_correction(axis);
    case BUS_OPERATION_SET_HARMONIC: return set_harmonic(axis);
    default: return BUS_CAUSE_NOT_BUILT;
    }
}
