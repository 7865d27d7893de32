// SPDX-License-Identifier: GPL-2.0-or-later
#include "axis.h"

#include <math.h>

#include "made/registers.h"
#include "node.h"

static const double VELOCITY_LSB = 1 << 24;  // per period and tick, of a set-point
static const double OFFSET_S = 0.05;         // in which an offset at the start falls to 1/e
static const double PATIENCE_S = 3;          // for the firmware to do what it was asked for
static const double UNSEEN_S = 1;            // a homing that is not seen meanwhile was a short one
static const double STOP_S = 1;              // longest controlled stop
static const unsigned WARM_UP = 3;           // periods until the commands are those after homing
static const unsigned ACCEPTED = 20;         // periods until the node has accepted a set-point

enum { MODE_OFF, MODE_PREPARED, MODE_STREAMING, MODE_EXTRAPOLATING, MODE_ENDED };
enum { ENDED_LATE = 3 };

static void enter(struct axis* axis, enum phase phase) {
    axis->phase = phase;
    axis->periods = 0;
    axis->seen = false;
}

static void fail(struct axis* axis, uint32_t cause) {
    enter(axis, FAILED);
    *axis->pins.fault_cause = cause;
}

static void stop(struct axis* axis, uint32_t cause) {
    enter(axis, STOPPING);
    *axis->pins.fault_cause = cause;
}

void axis_take(struct axis* axis, const uint32_t* words, unsigned axes, unsigned number,
               double tick_s) {
    struct axis_pins* pins = &axis->pins;
    double scale = scale_of(*pins->scale);
    int64_t position = position_word(words, READ_AXIS_POSITION, axes, number);
    int64_t target = position_word(words, READ_AXIS_TARGET, axes, number);
    uint32_t state = words[list_word(READ_AXIS_STATE, axes, number)];
    uint32_t stream = words[list_word(READ_AXIS_STREAM_STATE, axes, number)];
    uint32_t counts = words[list_word(READ_AXIS_STREAM_COUNTS, axes, number)];
    uint32_t supervision = words[list_word(READ_AXIS_SUPERVISION, axes, number)];
    int32_t velocity = (int32_t)words[list_word(READ_AXIS_VELOCITY, axes, number)];
    int32_t error = (int32_t)words[list_word(READ_AXIS_FOLLOWING_ERROR, axes, number)];
    axis->faults = words[list_word(READ_AXIS_FAULTS, axes, number)];
    axis->first_fault = words[list_word(READ_AXIS_FIRST_FAULT, axes, number)];
    axis->target = (double)target / POSITION_LSB / scale;
    axis->mode = FIELD_GET(stream, AXIS_STREAM_STATE_MODE);
    axis->ended = FIELD_GET(stream, AXIS_STREAM_STATE_ENDED);
    axis->state = FIELD_GET(supervision, AXIS_SUPERVISION_STATE);
    *pins->position = (double)position / POSITION_LSB / scale;
    *pins->rawcounts = (int32_t)(position >> COUNT_SHIFT);
    *pins->velocity_fb = velocity / POSITION_LSB / tick_s / scale;
    *pins->f_error = error / POSITION_LSB / scale;
    *pins->enabled = FIELD_GET(state, AXIS_STATE_ENABLED);
    *pins->limit_low = FIELD_GET(state, AXIS_STATE_LIMIT_LOW);
    *pins->limit_high = FIELD_GET(state, AXIS_STATE_LIMIT_HIGH);
    *pins->saturated = FIELD_GET(state, AXIS_STATE_SATURATED);
    *pins->homed = FIELD_GET(supervision, AXIS_SUPERVISION_HOMED);
    *pins->streaming = axis->mode == MODE_STREAMING || axis->mode == MODE_EXTRAPOLATING;
    *pins->set_points_late = FIELD_GET(counts, AXIS_STREAM_COUNTS_LATE);
    *pins->set_points_refused = FIELD_GET(counts, AXIS_STREAM_COUNTS_REFUSED);
    *pins->ticks_extrapolated = FIELD_GET(stream, AXIS_STREAM_STATE_EXTRAPOLATED);
}

// The cause of a latched fault: its bit and 1.
static uint32_t fault_cause(const struct axis* axis) {
    uint32_t faults = axis->first_fault ? axis->first_fault : axis->faults;
    return (uint32_t)__builtin_ctz(faults) + 1;
}

static uint32_t end_cause(const struct axis* axis) {
    if (axis->faults) return fault_cause(axis);
    return axis->ended == ENDED_LATE ? CAUSE_SET_POINT_LATE : CAUSE_STREAM_ENDED;
}

static bool holds(const struct axis* axis) {
    return *axis->pins.enabled && axis->state == STATE_HOLDING;
}

// Homing: the node has its own methods; `index-enable` falls when it is homed and streams. Where
// LinuxCNC aborts it, `index-enable` falls before.
static void home(struct axis* axis, bool patient, double waited_s) {
    if (axis->state == STATE_HOMING || !*axis->pins.homed) axis->seen = true;
    bool done = axis->seen || waited_s > UNSEEN_S;
    if (done && holds(axis) && *axis->pins.homed) {
        enter(axis, PREPARING);
        axis->seen = true;
    } else if (axis->seen && axis->state != STATE_HOMING && !*axis->pins.homed && !patient) {
        fail(axis, CAUSE_HOMING_FAILED);
    }
}

static void advance(struct axis* axis, double period_s) {
    bool homes = axis->phase == RELEASING || axis->phase == HOMING ||
                 (axis->phase == PREPARING && axis->seen);
    if (homes && !*axis->pins.index_enable) enter(axis, ABORTING);
    double waited_s = axis->periods * period_s;
    bool patient = waited_s < PATIENCE_S;
    switch (axis->phase) {
    case OFF:
        if (!*axis->pins.enabled && axis->mode == MODE_OFF) {
            *axis->pins.fault_cause = 0;
            enter(axis, axis->faults ? RESETTING : ENABLING);
        } else if (!patient) {
            fail(axis, CAUSE_NOT_ENABLED);
        }
        break;
    case RESETTING:
        if (!axis->faults)
            enter(axis, ENABLING);
        else if (!patient)
            fail(axis, fault_cause(axis));
        break;
    case ENABLING:
        axis->aborted = 0;
        if (holds(axis))
            enter(axis, *axis->pins.homed ? PREPARING : ENABLED);
        else if (!patient)
            fail(axis, CAUSE_NOT_ENABLED);
        break;
    case ENABLED:
        if (*axis->pins.index_enable) enter(axis, HOMING);
        break;
    case RELEASING:
        if (axis->mode == MODE_OFF && holds(axis))
            enter(axis, HOMING);
        else if (!patient)
            fail(axis, CAUSE_HOMING_FAILED);
        break;
    case HOMING: home(axis, patient, waited_s); break;
    case ABORTING:
        axis->aborted = *axis->pins.position_cmd - *axis->pins.position;
        if (waited_s > UNSEEN_S && holds(axis))
            enter(axis, ENABLED);
        else if (!patient)
            fail(axis, CAUSE_HOMING_FAILED);
        break;
    case PREPARING:
        if (axis->mode == MODE_PREPARED) {
            enter(axis, STARTING);
            *axis->pins.index_enable = 0;
        } else if (!patient) {
            fail(axis, CAUSE_NOT_PREPARED);
        }
        break;
    case STARTING:
        if (axis->periods >= WARM_UP) {
            enter(axis, FOLLOWING);
            axis->offset = axis->target - axis->commands[2];
        }
        break;
    case FOLLOWING:
        if (axis->mode == MODE_OFF || axis->mode == MODE_ENDED)
            stop(axis, end_cause(axis));
        else if (axis->mode == MODE_PREPARED && axis->periods > ACCEPTED)
            fail(axis, CAUSE_NOT_PREPARED);
        else if (*axis->pins.index_enable)
            enter(axis, RELEASING);
        break;
    case STOPPING:
        if (!*axis->pins.enabled || axis->state == STATE_HOLDING || waited_s > STOP_S)
            enter(axis, FAILED);
        break;
    case FAILED: break;
    }
    axis->periods++;
}

void axis_decide(struct axis* axis, uint32_t cause, double period_s) {
    struct axis_pins* pins = &axis->pins;
    bool on = axis->phase > RESETTING && axis->phase < FAILED;
    if (axis->phase == STOPPING && cause != CAUSE_NOT_ALLOWED) {
        advance(axis, period_s);
    } else if (!*pins->enable) {
        if (axis->phase != OFF) enter(axis, OFF);
        axis->periods = 0;
    } else if (cause) {
        if (axis->phase == FOLLOWING && cause == CAUSE_LINK_LOST)
            stop(axis, cause);
        else if (axis->phase != FAILED)
            fail(axis, cause);
    } else if (on && axis->faults) {
        fail(axis, fault_cause(axis));
    } else {
        advance(axis, period_s);
    }
    *pins->fault = axis->phase >= STOPPING;
    bool homes = *pins->index_enable && axis->phase >= RELEASING && axis->phase <= PREPARING;
    *pins->position_fb = homes || axis->phase == ABORTING ? *pins->position_cmd
                         : axis->phase == ENABLED         ? *pins->position + axis->aborted
                                                          : *pins->position;
}

void axis_show_edge(struct axis* axis, int64_t position) {
    double at = (double)position / POSITION_LSB / scale_of(*axis->pins.scale);
    *axis->pins.position_latch = *axis->pins.position_fb = at;
}

static int64_t rounded(double value, double most) {
    return (int64_t)llround(fmin(fmax(value, -most), most));
}

struct axis_request axis_give(struct axis* axis, double period_s, double tick_s, double shift_s) {
    for (unsigned n = 0; n < 2; n++) axis->commands[n] = axis->commands[n + 1];
    axis->commands[2] = *axis->pins.position_cmd;
    enum phase phase = axis->phase;
    if (phase != FOLLOWING) {
        axis->commands[0] = axis->commands[1] = axis->commands[2];
        axis->offset = 0;
    }
    struct motion at = motion_after(motion_through(axis->commands, period_s), shift_s);
    at.position += axis->offset;
    axis->offset -= axis->offset * period_s / OFFSET_S;
    double scale = scale_of(*axis->pins.scale);
    *axis->pins.velocity_cmd = phase == FOLLOWING ? at.velocity : 0;
    return (struct axis_request){
        .position = rounded(at.position * scale * POSITION_LSB, 0x1p47 - 1),
        .velocity = (int32_t)rounded(at.velocity * scale * tick_s * VELOCITY_LSB, 0x1p31 - 1),
        .enable = phase >= ENABLING && phase < FAILED,
        .home = phase == HOMING,
        .stream = phase >= PREPARING && phase < STOPPING,
        .reset = phase == RESETTING,
        .commit = phase == FOLLOWING,
    };
}
