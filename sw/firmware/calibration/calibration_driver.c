// SPDX-License-Identifier: Apache-2.0
// calibration_driver -- connects the calibration of each axis to its registers: bursts come from
// calibration_recorder, values go into signal_correction and harmonic_correction.
//
// A burst is begun while the axis moves fast enough to cover CALIBRATION_PERIODS within LONGEST_MS,
// and begun again at twice the speed; one of phases also at half the speed. It is read
// a few words a poll, and worked on a few pieces a poll, for at most about WORK_MS. New values are
// written beside those in force, and one strobe exchanges both the correction and the table.
#include "calibration/calibration_driver.h"

#include "axis/axis.h"
#include "axis/feedback.h"
#include "calibration/harmonics.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"
#include "axis/parameters.h"

#define WORK_MS 1u        // that a poll spends on words, pieces or points
#define PIECES 32u        // of them in a poll, at most
#define LONGEST_MS 1000u  // that a burst may take
#define LARGEST_EVERY 65535u

struct calibration_driver {
    struct calibration calibration;
    struct calibration_values waiting;  // set by the host, not yet in force
    bool recording;
    bool phases;  // of the burst
    bool moving;  // fast enough to record
    uint16_t every;
    uint16_t point;  // of the table, the next one to be written
};

static struct calibration_driver drivers[HARDWARE_AXES];
static uint32_t work_cycles;

// Ends the burst or the loading that was under way for the calibration.
static void restart(struct calibration_driver* driver) {
    driver->recording = false;
    driver->point = 0;
}

// The decimation of the recorder at the present speed; 0: too slow, or in open loop, where
// fine_response uses the recorder.
static uint32_t every_now(unsigned n, bool phases) {
    if (axis_state(n) == BUS_STATE_EXCITED) return 0;
    int32_t velocity = (int32_t)axis_read(n, AXIS_VELOCITY);
    uint64_t magnitude = velocity < 0 ? -(uint64_t)velocity : (uint64_t)velocity;
    uint64_t speed = magnitude * PLANNER_TICK_HZ;  // 2^-16 period/s
    if (speed * LONGEST_MS < ((uint64_t)CALIBRATION_PERIODS << 16) * 1000u) return 0;
    uint32_t recorded = phases ? CALIBRATION_PHASES : CALIBRATION_BURST;
    uint64_t every =
        ((uint64_t)parameters_sample_hz() * CALIBRATION_PERIODS << 16) / (speed * recorded);
    return every < 1 ? 1 : every > LARGEST_EVERY ? LARGEST_EVERY : (uint32_t)every;
}

// Within 2/3 … 2 of what is required: enough periods, and enough samples of each.
static bool near(uint32_t every, uint32_t required) {
    return 3u * every >= 2u * required && every <= 2u * required;
}

// It is better to begin a burst again at the present speed: at twice the speed it ends sooner, and
// phases must be from one speed. Samples may be from any.
static bool outdated(const struct calibration_driver* driver, uint32_t every) {
    return every == 0 || 2u * every < driver->every ||
           (driver->phases && every > 2u * driver->every);
}

static void record(unsigned n) {
    struct calibration_driver* driver = &drivers[n];
    const struct calibration_pass* pass = &driver->calibration.pass;
    driver->phases = driver->calibration.need == CALIBRATION_NEEDS_PHASES;
    uint32_t every = every_now(n, driver->phases);
    driver->moving = driver->recording = every != 0;
    if (!driver->moving) return;
    if (driver->phases && pass->spectra && near(pass->every, every))
        every = pass->every;  // the spectra of a pass can be compared only at one decimation
    driver->every = (uint16_t)every;
    feedback_write(n, FEEDBACK_RECORDER,
                   FIELD_PUT(FEEDBACK_RECORDER_DECIMATION, every) |
                       FIELD_PUT(FEEDBACK_RECORDER_PHASES, driver->phases));
    feedback_write(n, FEEDBACK_STROBES, FEEDBACK_STROBES_RECORD_MASK);
}

static bool time_left(uint32_t began, uint32_t pieces) {
    return pieces < PIECES && node_read(NODE_TIME_STAMP_LOW) - began < work_cycles;
}

static void burst_poll(unsigned n) {
    struct calibration_driver* driver = &drivers[n];
    if (!driver->recording ||
        driver->phases != (driver->calibration.need == CALIBRATION_NEEDS_PHASES)) {
        record(n);
        return;
    }
    uint32_t state = feedback_read(n, FEEDBACK_RECORDER_STATE),
             every = every_now(n, driver->phases);
    if (state & FEEDBACK_RECORDER_STATE_FULL_MASK)
        driver->recording = !calibration_open(&driver->calibration, driver->every,
                                              state & FEEDBACK_RECORDER_STATE_INVALID_MASK);
    else if (outdated(driver, every))
        record(n);
}

static void words_poll(unsigned n) {
    struct calibration* calibration = &drivers[n].calibration;
    uint32_t began = node_read(NODE_TIME_STAMP_LOW),
             count = drivers[n].phases ? CALIBRATION_WORDS : 1;
    for (uint32_t pieces = 0;
         calibration->need == CALIBRATION_NEEDS_WORDS && time_left(began, pieces); pieces++) {
        uint32_t words[CALIBRATION_WORDS];
        for (uint32_t i = 0; i < count; i++) words[i] = feedback_read(n, FEEDBACK_RECORDER_WORD);
        calibration_take(calibration, words);
    }
}

static void work_poll(unsigned n) {
    struct calibration* calibration = &drivers[n].calibration;
    uint32_t began = node_read(NODE_TIME_STAMP_LOW);
    for (uint32_t pieces = 0;
         calibration->need == CALIBRATION_NEEDS_WORK && time_left(began, pieces); pieces++)
        calibration_work(calibration);
}

static void loading_poll(unsigned n) {
    struct calibration_driver* driver = &drivers[n];
    const struct calibration_values* values = &driver->calibration.values;
    uint32_t began = node_read(NODE_TIME_STAMP_LOW);
    for (uint32_t pieces = 0; driver->point < CALIBRATION_POINTS && time_left(began, pieces);
         pieces++, driver->point++)
        feedback_write(
            n, FEEDBACK_HARMONIC_POINT,
            FIELD_PUT(FEEDBACK_HARMONIC_POINT, harmonics_table_entry(values, driver->point)) |
                FIELD_PUT(FEEDBACK_HARMONIC_POINT_POINT, driver->point));
    if (driver->point < CALIBRATION_POINTS) return;
    driver->point = 0;
    feedback_write(n, FEEDBACK_CORRECTION_OFFSET,
                   FIELD_PUT(FEEDBACK_CORRECTION_OFFSET_SIN, values->sin_offset) |
                       FIELD_PUT(FEEDBACK_CORRECTION_OFFSET_COS, values->cos_offset));
    feedback_write(n, FEEDBACK_CORRECTION_GAIN, FIELD_PUT(FEEDBACK_CORRECTION_GAIN, values->gain));
    feedback_write(n, FEEDBACK_CORRECTION_QUADRATURE_ERROR,
                   FIELD_PUT(FEEDBACK_CORRECTION_QUADRATURE_ERROR, values->quadrature_error));
    feedback_write(n, FEEDBACK_STROBES,
                   FEEDBACK_STROBES_LOAD_CORRECTION_MASK | FEEDBACK_STROBES_SWAP_HARMONICS_MASK);
    calibration_loaded(&driver->calibration);
}

void calibration_driver_start(unsigned n) {
    struct calibration_driver* driver = &drivers[n];
    work_cycles = node_read(NODE_CLK_HZ) / 1000u * WORK_MS;
    if (work_cycles == 0) work_cycles = 1;
    calibration_start(&driver->calibration);
    driver->waiting = calibration_identity;
    driver->moving = false;
    restart(driver);
    feedback_write(n, FEEDBACK_HARMONIC_ENABLE, 1);
    feedback_write(n, FEEDBACK_CAPTURE_SOURCES, 0);
    feedback_write(n, FEEDBACK_STROBES,
                   FEEDBACK_STROBES_CAPTURE_CLEAR_MASK | FEEDBACK_STROBES_COMPARE_DISARM_MASK);
    feedback_clear_signal_faults(n);
}

// A burst is needed, but the axis is too slow.
static bool at_standstill(const struct calibration_driver* driver) {
    bool waiting = driver->calibration.need == CALIBRATION_NEEDS_SAMPLES ||
                   driver->calibration.need == CALIBRATION_NEEDS_PHASES;
    return waiting && !driver->moving && !driver->recording;
}

static void follow_parameter(unsigned n) {
    struct calibration_driver* driver = &drivers[n];
    uint8_t mode = (uint8_t)parameters_get(n, BUS_PARAMETER_AUTO_CALIBRATION);
    if (driver->calibration.mode == mode) return;
    calibration_set_mode(&driver->calibration, mode);
    driver->recording = false;
    driver->moving = true;  // until the speed is read
}

void calibration_driver_poll(unsigned n) {
    struct calibration_driver* driver = &drivers[n];
    follow_parameter(n);
    switch (driver->calibration.need) {
    case CALIBRATION_NEEDS_SAMPLES:
    case CALIBRATION_NEEDS_PHASES: burst_poll(n); break;
    case CALIBRATION_NEEDS_WORDS: words_poll(n); break;
    case CALIBRATION_NEEDS_WORK: work_poll(n); break;
    case CALIBRATION_NEEDS_LOADING: loading_poll(n); break;
    default: break;
    }
}

bool calibration_driver_idle(unsigned n) {
    return drivers[n].calibration.need == CALIBRATION_NEEDS_NOTHING || at_standstill(&drivers[n]);
}

const struct calibration* calibration_driver_state(unsigned n) { return &drivers[n].calibration; }

uint8_t calibration_driver_reason(unsigned n) {
    const struct calibration_driver* driver = &drivers[n];
    if (at_standstill(driver) && driver->calibration.reason < BUS_CALIBRATION_REASON_ONE_SPEED)
        return BUS_CALIBRATION_REASON_STANDSTILL;
    return driver->calibration.reason;
}

static void set_mode(unsigned n, enum calibration_mode mode) {
    parameters_set(n, BUS_PARAMETER_AUTO_CALIBRATION, mode);
    follow_parameter(n);
}

uint8_t calibration_driver_do(unsigned n, uint8_t action) {
    struct calibration_driver* driver = &drivers[n];
    uint8_t cause = BUS_CAUSE_OK;
    switch (action) {
    case BUS_CALIBRATION_ACTION_READ: break;
    case BUS_CALIBRATION_ACTION_CALIBRATE: set_mode(n, CALIBRATION_CALIBRATES); break;
    case BUS_CALIBRATION_ACTION_FREEZE: set_mode(n, CALIBRATION_FROZEN); break;
    case BUS_CALIBRATION_ACTION_FOLLOW: set_mode(n, CALIBRATION_FOLLOWS); break;
    case BUS_CALIBRATION_ACTION_CLEAR:
        calibration_forget(&driver->calibration);
        restart(driver);
        break;
    default: cause = BUS_CAUSE_OUT_OF_RANGE;
    }
    return cause;
}

uint8_t calibration_driver_set_harmonic(unsigned n, uint8_t order, int32_t cosine, int32_t sine) {
    struct calibration_values values = calibration_identity;
    if (order < 1 || order > CALIBRATION_ORDERS) return BUS_CAUSE_OUT_OF_RANGE;
    values.cosine[order - 1] = cosine;
    values.sine[order - 1] = sine;
    if (!calibration_values_fit(&values)) return BUS_CAUSE_OUT_OF_RANGE;
    drivers[n].waiting.cosine[order - 1] = cosine;
    drivers[n].waiting.sine[order - 1] = sine;
    return BUS_CAUSE_OK;
}

uint8_t calibration_driver_set_correction(unsigned n, const struct calibration_values* ellipse,
                                          bool apply) {
    struct calibration_driver* driver = &drivers[n];
    struct calibration_values values = driver->waiting;
    values.sin_offset = ellipse->sin_offset;
    values.cos_offset = ellipse->cos_offset;
    values.gain = ellipse->gain;
    values.quadrature_error = ellipse->quadrature_error;
    if (!calibration_values_fit(&values)) return BUS_CAUSE_OUT_OF_RANGE;
    driver->waiting = apply ? calibration_identity : values;
    if (!apply) return BUS_CAUSE_OK;
    calibration_restore(&driver->calibration, &values);
    restart(driver);
    return BUS_CAUSE_OK;
}
