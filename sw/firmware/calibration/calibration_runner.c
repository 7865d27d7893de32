// SPDX-License-Identifier: Apache-2.0
// grating -- serves the calibration of each axis: bursts from calibration_recorder, values into
// signal_correction and harmonic_correction.
//
// A burst is begun while the axis moves fast enough to cover CALIBRATION_PERIODS within LONGEST_MS,
// and begun again when the speed has changed twofold since. It is read a few words a poll, and
// worked on a few pieces a poll, at most about WORK_MS. New values are written beside those in
// force, and one strobe exchanges both the correction and the table.
#include "calibration/calibration_runner.h"

#include "axis/axis.h"
#include "axis/feedback.h"
#include "core/clock.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"
#include "axis/parameters.h"

#define WORK_MS 1u        // words, pieces and points of a poll
#define PIECES 32u        // of them at most
#define LONGEST_MS 1000u  // of a burst
#define LARGEST_EVERY 65535u

_Static_assert((int)BUS_CALIBRATION_REASON_CALIBRATING == CALIBRATION_RUNNING &&
                   (int)BUS_CALIBRATION_REASON_FROZEN == CALIBRATION_FROZEN &&
                   (int)BUS_CALIBRATION_REASON_STANDSTILL == CALIBRATION_STANDSTILL &&
                   (int)BUS_CALIBRATION_REASON_PARTIAL_CIRCLE == CALIBRATION_PARTIAL_CIRCLE &&
                   (int)BUS_CALIBRATION_REASON_AMPLITUDE == CALIBRATION_AMPLITUDE &&
                   (int)BUS_CALIBRATION_REASON_DISTORTED == CALIBRATION_DISTORTED &&
                   (int)BUS_CALIBRATION_REASON_TOO_FAST == CALIBRATION_TOO_FAST &&
                   (int)BUS_CALIBRATION_REASON_UNSTEADY == CALIBRATION_UNSTEADY &&
                   (int)BUS_CALIBRATION_REASON_ONE_SPEED == CALIBRATION_ONE_SPEED &&
                   (int)BUS_CALIBRATION_REASON_VIBRATION == CALIBRATION_VIBRATION &&
                   CALIBRATION_REASONS == 10,
               "the reasons of bus.toml are those of the calibration");

struct calibration_runner {
    struct calibration calibration;
    struct calibration_values waiting;  // set by the host, not yet in force
    bool recording;
    bool phases;  // of the burst
    bool moving;  // fast enough to record
    uint16_t every;
    uint16_t point;  // of the table, the next one to be written
};

static struct calibration_runner runners[HARDWARE_AXES];
static uint32_t work_cycles;

static void restart(struct calibration_runner* g)  // whatever was under way for the calibration
{
    g->recording = false;
    g->point = 0;
}

// The setting of the recorder at the present speed; 0: too slow.
static uint32_t every_now(unsigned n, bool phases) {
    int32_t velocity = (int32_t)axis_read(n, AXIS_VELOCITY);
    uint64_t size = velocity < 0 ? -(uint64_t)velocity : (uint64_t)velocity;
    uint64_t speed = size * PLANNER_TICK_HZ;  // 2^-16 period/s
    if (speed * LONGEST_MS < ((uint64_t)CALIBRATION_PERIODS << 16) * 1000u) return 0;
    uint32_t kept = phases ? CALIBRATION_PHASES : CALIBRATION_BURST;
    uint64_t every =
        ((uint64_t)parameters_sample_hz() * CALIBRATION_PERIODS << 16) / (speed * kept);
    return every < 1 ? 1 : every > LARGEST_EVERY ? LARGEST_EVERY : (uint32_t)every;
}

static bool near(uint32_t every,
                 uint32_t required)  // within 2/3 … 2: enough periods, and samples enough of each
{
    return 3u * every >= 2u * required && every <= 2u * required;
}

static void record(unsigned n) {
    struct calibration_runner* g = &runners[n];
    const struct calibration_pass* pass = &g->calibration.pass;
    g->phases = g->calibration.need == CALIBRATION_NEEDS_PHASES;
    uint32_t every = every_now(n, g->phases);
    g->moving = g->recording = every != 0;
    if (!g->moving) return;
    if (g->phases && pass->spectra && near(pass->every, every))
        every = pass->every;  // spectra of one pass are compared
    g->every = (uint16_t)every;
    feedback_write(n, FEEDBACK_RECORDER,
                   FIELD_PUT(FEEDBACK_RECORDER_DECIMATION, every) |
                       FIELD_PUT(FEEDBACK_RECORDER_PHASES, g->phases));
    feedback_write(n, FEEDBACK_STROBES, FEEDBACK_STROBES_RECORD_MASK);
}

static bool time_left(uint32_t began, uint32_t pieces) {
    return pieces < PIECES && node_read(NODE_TIME_STAMP_LOW) - began < work_cycles;
}

static void burst_poll(unsigned n) {
    struct calibration_runner* g = &runners[n];
    if (!g->recording || g->phases != (g->calibration.need == CALIBRATION_NEEDS_PHASES)) {
        record(n);
        return;
    }
    uint32_t state = feedback_read(n, FEEDBACK_RECORDER_STATE), every = every_now(n, g->phases);
    if (state & FEEDBACK_RECORDER_STATE_FULL_MASK)
        g->recording = !calibration_open(&g->calibration, g->every,
                                         state & FEEDBACK_RECORDER_STATE_INVALID_MASK);
    else if (every == 0 || every > 2u * g->every || 2u * every < g->every)
        record(n);
}

static void words_poll(unsigned n) {
    struct calibration* calibration = &runners[n].calibration;
    uint32_t began = node_read(NODE_TIME_STAMP_LOW),
             count = runners[n].phases ? CALIBRATION_WORDS : 1;
    for (uint32_t pieces = 0;
         calibration->need == CALIBRATION_NEEDS_WORDS && time_left(began, pieces); pieces++) {
        uint32_t words[CALIBRATION_WORDS];
        for (uint32_t i = 0; i < count; i++) words[i] = feedback_read(n, FEEDBACK_RECORDER_WORD);
        calibration_take(calibration, words);
    }
}

static void work_poll(unsigned n) {
    struct calibration* calibration = &runners[n].calibration;
    uint32_t began = node_read(NODE_TIME_STAMP_LOW);
    for (uint32_t pieces = 0;
         calibration->need == CALIBRATION_NEEDS_WORK && time_left(began, pieces); pieces++)
        calibration_work(calibration);
}

static void loading_poll(unsigned n) {
    struct calibration_runner* g = &runners[n];
    const struct calibration_values* values = &g->calibration.values;
    uint32_t began = node_read(NODE_TIME_STAMP_LOW);
    for (uint32_t pieces = 0; g->point < CALIBRATION_POINTS && time_left(began, pieces);
         pieces++, g->point++)
        feedback_write(
            n, FEEDBACK_HARMONIC_POINT,
            FIELD_PUT(FEEDBACK_HARMONIC_POINT, calibration_table_entry(values, g->point)) |
                FIELD_PUT(FEEDBACK_HARMONIC_POINT_POINT, g->point));
    if (g->point < CALIBRATION_POINTS) return;
    g->point = 0;
    feedback_write(n, FEEDBACK_CORRECTION_OFFSET,
                   FIELD_PUT(FEEDBACK_CORRECTION_OFFSET_SIN, values->sin_offset) |
                       FIELD_PUT(FEEDBACK_CORRECTION_OFFSET_COS, values->cos_offset));
    feedback_write(n, FEEDBACK_CORRECTION_GAIN, FIELD_PUT(FEEDBACK_CORRECTION_GAIN, values->gain));
    feedback_write(n, FEEDBACK_CORRECTION_QUADRATURE_ERROR,
                   FIELD_PUT(FEEDBACK_CORRECTION_QUADRATURE_ERROR, values->quadrature_error));
    feedback_write(n, FEEDBACK_STROBES,
                   FEEDBACK_STROBES_LOAD_CORRECTION_MASK | FEEDBACK_STROBES_SWAP_HARMONICS_MASK);
    calibration_loaded(&g->calibration);
}

void calibration_runner_start(unsigned n) {
    struct calibration_runner* g = &runners[n];
    work_cycles = node_read(NODE_CLK_HZ) / 1000u * WORK_MS;
    if (work_cycles == 0) work_cycles = 1;
    calibration_start(&g->calibration);
    g->waiting = calibration_identity;
    g->moving = false;
    restart(g);
    feedback_write(n, FEEDBACK_HARMONIC_ENABLE, 1);
    feedback_write(n, FEEDBACK_CAPTURE_SOURCES, 0);
    feedback_write(n, FEEDBACK_STROBES,
                   FEEDBACK_STROBES_CAPTURE_CLEAR_MASK | FEEDBACK_STROBES_COMPARE_DISARM_MASK);
    feedback_clear_signal_faults(n);
}

static void follow_parameter(unsigned n) {
    struct calibration_runner* g = &runners[n];
    bool frozen = parameters_get(n, BUS_PARAMETER_AUTO_CALIBRATION) == 0;
    if (g->calibration.frozen == frozen) return;
    calibration_freeze(&g->calibration, frozen);
    g->recording = false;
    g->moving = true;  // until a look at the speed says otherwise
}

void calibration_runner_poll(unsigned n) {
    struct calibration_runner* g = &runners[n];
    follow_parameter(n);
    switch (g->calibration.need) {
    case CALIBRATION_NEEDS_SAMPLES:
    case CALIBRATION_NEEDS_PHASES: burst_poll(n); break;
    case CALIBRATION_NEEDS_WORDS: words_poll(n); break;
    case CALIBRATION_NEEDS_WORK: work_poll(n); break;
    case CALIBRATION_NEEDS_LOADING: loading_poll(n); break;
    default: break;
    }
}

const struct calibration* calibration_runner_state(unsigned n) { return &runners[n].calibration; }

uint8_t calibration_runner_reason(unsigned n) {
    const struct calibration_runner* g = &runners[n];
    bool waits = g->calibration.need == CALIBRATION_NEEDS_SAMPLES ||
                 g->calibration.need == CALIBRATION_NEEDS_PHASES;
    if (waits && !g->moving && !g->recording && g->calibration.reason < CALIBRATION_ONE_SPEED)
        return CALIBRATION_STANDSTILL;
    return g->calibration.reason;
}

uint8_t calibration_runner_do(unsigned n, uint8_t action) {
    struct calibration_runner* g = &runners[n];
    if (action > BUS_CALIBRATION_ACTION_CLEAR) return BUS_CAUSE_OUT_OF_RANGE;
    if (action == BUS_CALIBRATION_ACTION_CALIBRATE || action == BUS_CALIBRATION_ACTION_FREEZE)
        parameters_set(n, BUS_PARAMETER_AUTO_CALIBRATION,
                       action == BUS_CALIBRATION_ACTION_CALIBRATE);
    follow_parameter(n);
    if (action == BUS_CALIBRATION_ACTION_CLEAR) {
        calibration_forget(&g->calibration);
        restart(g);
    }
    return BUS_CAUSE_OK;
}

uint8_t calibration_runner_set_harmonic(unsigned n, uint8_t order, int32_t cosine, int32_t sine) {
    struct calibration_values values = calibration_identity;
    if (order < 1 || order > CALIBRATION_ORDERS) return BUS_CAUSE_OUT_OF_RANGE;
    values.cosine[order - 1] = cosine;
    values.sine[order - 1] = sine;
    if (!calibration_values_fit(&values)) return BUS_CAUSE_OUT_OF_RANGE;
    runners[n].waiting.cosine[order - 1] = cosine;
    runners[n].waiting.sine[order - 1] = sine;
    return BUS_CAUSE_OK;
}

uint8_t calibration_runner_set_correction(unsigned n, const struct calibration_values* ellipse,
                                          bool apply) {
    struct calibration_runner* g = &runners[n];
    struct calibration_values values = g->waiting;
    values.sin_offset = ellipse->sin_offset;
    values.cos_offset = ellipse->cos_offset;
    values.gain = ellipse->gain;
    values.quadrature_error = ellipse->quadrature_error;
    if (!calibration_values_fit(&values)) return BUS_CAUSE_OUT_OF_RANGE;
    g->waiting = apply ? calibration_identity : values;
    if (!apply) return BUS_CAUSE_OK;
    calibration_restore(&g->calibration, &values);
    restart(g);
    return BUS_CAUSE_OK;
}
