// SPDX-License-Identifier: Apache-2.0
// calibration -- offset, gain, quadrature error and harmonics of a sine/cosine signal, determined
// in motion and without a reference (docs/interpolation.md).
//
// This is the order of the work; ellipse, spectrum and harmonics do it. Two bursts of samples give
// the ellipse. From then on passes of CALIBRATION_PASS bursts of phases give the harmonics, and
// each pass that is accepted corrects the values in force. Once calibrated it can follow the drift
// of the signal: further ellipses are compared with the first one after the calibration, so that
// what the harmonics do to an ellipse does not matter, and their changes are added to the values.
#include "calibration/calibration.h"

#include "calibration/calibration_burst.h"
#include "calibration/ellipse.h"
#include "calibration/equations.h"
#include "calibration/harmonics.h"
#include "calibration/spectrum.h"
#include "calibration/waves.h"
#include "made/bus_protocol.h"

#define SCATTER_LIMIT 64      // 4 LSB of a 16-bit phase
#define LIMITS_OF_LONGEST 3u  // of them are accepted from a pass that cannot become longer
#define FEWEST_SPECTRA 3u     // that show which line stays

enum stage {
    UPDATE,
    LAST_UPDATE,
    TABLE,
    FIRST_READING,
    FIT,
    SOLVE,
    RESIDUAL,
    TRANSFORM,
    SPECTRUM,
    FIND,
    CLEAR,
    SECOND_READING,
    FOLD,
    PROJECT,
    SOLVE_ELLIPSE,
    ELLIPSE_VALUES
};

struct calibration_burst burst;

static void begin_stage(enum stage stage) {
    burst.stage = (uint8_t)stage;
    burst.next = 0;
}

static bool collects_phases(const struct calibration* calibration) {
    return calibration->harmonics && calibration->mode != CALIBRATION_FOLLOWS;
}

static uint8_t reason_of_mode(const struct calibration* calibration) {
    return calibration->mode == CALIBRATION_FROZEN ? BUS_CALIBRATION_REASON_FROZEN
                                                   : BUS_CALIBRATION_REASON_CALIBRATING;
}

static void reject(struct calibration* calibration, enum bus_calibration_reason reason) {
    calibration->reason = (uint8_t)reason;
    calibration->refused++;
}

static void begin_pass(struct calibration* calibration) {
    calibration->pass = (struct calibration_pass){0};
    calibration->need = CALIBRATION_NEEDS_PHASES;
}

static void release_burst(const struct calibration* calibration) {
    if (burst.owner == calibration) burst.owner = 0;
}

void calibration_forget(struct calibration* calibration) {
    calibration->values = calibration_identity;
    calibration->harmonics = false;
    calibration->complete = false;
    calibration->referenced = false;
    release_burst(calibration);
    ellipse_start(&calibration->ellipse);
    calibration->reason = reason_of_mode(calibration);
    calibration->need = CALIBRATION_NEEDS_LOADING;
}

void calibration_start(struct calibration* calibration) {
    release_burst(calibration);
    *calibration = (struct calibration){.amplitude_high = UINT16_MAX,
                                        .scatter_limit = SCATTER_LIMIT,
                                        .mode = CALIBRATION_CALIBRATES};
    calibration_forget(calibration);
}

bool calibration_restore(struct calibration* calibration, const struct calibration_values* values) {
    if (!calibration_values_fit(values)) return false;
    release_burst(calibration);
    calibration->values = *values;
    calibration->harmonics = true;
    calibration->complete = true;
    calibration->referenced = false;
    calibration->reason = reason_of_mode(calibration);
    calibration->need = CALIBRATION_NEEDS_LOADING;
    return true;
}

// Begins what follows once the values are in force.
static void begin_next(struct calibration* calibration) {
    release_burst(calibration);
    if (calibration->mode == CALIBRATION_FROZEN) {
        calibration->need = CALIBRATION_NEEDS_NOTHING;
    } else if (collects_phases(calibration)) {
        begin_pass(calibration);
    } else {
        ellipse_start(&calibration->ellipse);
        calibration->need = CALIBRATION_NEEDS_SAMPLES;
    }
}

void calibration_set_mode(struct calibration* calibration, enum calibration_mode mode) {
    calibration->mode = (uint8_t)mode;
    calibration->reason = reason_of_mode(calibration);
    // Values that are not in the hardware yet are loaded even so.
    if (calibration->need != CALIBRATION_NEEDS_LOADING) begin_next(calibration);
}

void calibration_loaded(struct calibration* calibration) {
    if (calibration->need == CALIBRATION_NEEDS_LOADING) begin_next(calibration);
}

static void end_burst(struct calibration* calibration, enum calibration_need need) {
    calibration->need = (uint8_t)need;
    release_burst(calibration);
}

static void accept(struct calibration* calibration) {
    calibration->reason = BUS_CALIBRATION_REASON_CALIBRATING;
    if (calibration->mode == CALIBRATION_CALIBRATES) calibration->referenced = false;
    calibration->accepted++;
    end_burst(calibration, CALIBRATION_NEEDS_LOADING);
}

// A burst that is refused takes the samples of the ellipse that were collected before with it. A
// burst of phases is refused alone.
static void refuse_burst(struct calibration* calibration, enum bus_calibration_reason reason) {
    reject(calibration, reason);
    if (!collects_phases(calibration)) ellipse_start(&calibration->ellipse);
    end_burst(calibration,
              collects_phases(calibration) ? CALIBRATION_NEEDS_PHASES : CALIBRATION_NEEDS_SAMPLES);
}

bool calibration_open(struct calibration* calibration, uint16_t every, bool spoiled) {
    if (burst.owner && burst.owner != calibration) return false;
    if (calibration->need != CALIBRATION_NEEDS_SAMPLES &&
        calibration->need != CALIBRATION_NEEDS_PHASES)
        return false;
    burst.owner = calibration;
    burst.every = every;
    burst.candidate = calibration->values;
    burst.vibration = 0;
    burst.taken = 0;
    begin_stage(UPDATE);
    if (spoiled)
        refuse_burst(calibration, BUS_CALIBRATION_REASON_AMPLITUDE);
    else
        calibration->need =
            collects_phases(calibration) ? CALIBRATION_NEEDS_WORK : CALIBRATION_NEEDS_WORDS;
    return true;
}

static void end_of_samples(struct calibration* calibration) {
    if (calibration->ellipse.count < CALIBRATION_ELLIPSE_BURSTS * CALIBRATION_BURST) {
        end_burst(calibration, CALIBRATION_NEEDS_SAMPLES);
        return;
    }
    enum bus_calibration_reason reason = ellipse_equations(&calibration->ellipse, &burst.fit);
    begin_stage(SOLVE_ELLIPSE);
    calibration->need = CALIBRATION_NEEDS_WORK;
    if (reason != BUS_CALIBRATION_REASON_CALIBRATING) refuse_burst(calibration, reason);
}

static void end_of_first_reading(struct calibration* calibration) {
    enum bus_calibration_reason reason = harmonics_check_burst();
    if (reason != BUS_CALIBRATION_REASON_CALIBRATING) {
        refuse_burst(calibration, reason);
        return;
    }
    harmonics_begin_equations(3);
    begin_stage(SOLVE);
    calibration->need = CALIBRATION_NEEDS_WORK;
}

static void end_of_second_reading(struct calibration* calibration) {
    harmonics_weigh();
    begin_stage(FOLD);
    calibration->need = CALIBRATION_NEEDS_WORK;
}

void calibration_take(struct calibration* calibration, const uint32_t words[CALIBRATION_WORDS]) {
    if (calibration->need != CALIBRATION_NEEDS_WORDS) return;
    if (!collects_phases(calibration)) {
        ellipse_take(&calibration->ellipse, calibration, words[0]);
        if (++burst.taken == CALIBRATION_BURST) end_of_samples(calibration);
    } else if (burst.stage == SECOND_READING) {
        harmonics_read_second(words);
        if (burst.taken == CALIBRATION_PHASES) end_of_second_reading(calibration);
    } else {
        harmonics_read_first(words);
        if (burst.taken == CALIBRATION_PHASES) end_of_first_reading(calibration);
    }
}

// A change of the quadrature error turns the sine alone, so the phase turns with the cosine. Which
// of both has drifted cannot be known: half of the turn is taken back.
static int32_t half_turn(int32_t quadrature_error) {  // 2^-16 rad; the result in 2^-24 period
    return (int32_t)(((int64_t)quadrature_error * 20861 + 512) >> 10);  // 2^8 / 4 pi
}

// The first ellipse since the values came into force is what later ones are compared with.
static void follow(struct calibration* calibration) {
    struct calibration_values* values = &calibration->values;
    struct calibration_values found = *values;
    enum bus_calibration_reason reason = ellipse_values(burst.fit.solution, &found);
    if (reason == BUS_CALIBRATION_REASON_CALIBRATING && calibration->referenced) {
        found.sin_offset = (int16_t)(found.sin_offset + calibration->beside[0]);
        found.cos_offset = (int16_t)(found.cos_offset + calibration->beside[1]);
        found.gain += calibration->beside[2];
        found.quadrature_error += calibration->beside[3];
        found.shift += half_turn(found.quadrature_error - values->quadrature_error);
        if (!calibration_values_fit(&found)) reason = BUS_CALIBRATION_REASON_DISTORTED;
    }
    if (reason != BUS_CALIBRATION_REASON_CALIBRATING) {
        refuse_burst(calibration, reason);
    } else if (calibration->referenced) {
        *values = found;
        accept(calibration);
    } else {
        calibration->beside[0] = values->sin_offset - found.sin_offset;
        calibration->beside[1] = values->cos_offset - found.cos_offset;
        calibration->beside[2] = values->gain - found.gain;
        calibration->beside[3] = values->quadrature_error - found.quadrature_error;
        calibration->referenced = true;
        begin_next(calibration);
    }
}

static void end_of_ellipse(struct calibration* calibration) {
    if (calibration->mode == CALIBRATION_FOLLOWS) {
        follow(calibration);
        return;
    }
    enum bus_calibration_reason reason = ellipse_values(burst.fit.solution, &calibration->values);
    if (reason == BUS_CALIBRATION_REASON_CALIBRATING) {
        calibration->harmonics = true;
        accept(calibration);
    } else {
        refuse_burst(calibration, reason);
    }
}

static void begin_burst(struct calibration* calibration) {
    harmonics_begin_first_reading();
    begin_stage(FIRST_READING);
    calibration->need = CALIBRATION_NEEDS_WORDS;
}

static void begin_second_reading(struct calibration* calibration) {
    harmonics_begin_second_reading();
    begin_stage(SECOND_READING);
    calibration->need = CALIBRATION_NEEDS_WORDS;
}

static void end_of_spectrum(struct calibration* calibration) {
    struct calibration_pass* pass = &calibration->pass;
    pass->every = burst.every;
    if (pass->spectra < UINT8_MAX) pass->spectra++;
    begin_stage(pass->spectra >= FEWEST_SPECTRA ? FIND : CLEAR);
}

static void end_of_projection(struct calibration* calibration) {
    struct calibration_pass* pass = &calibration->pass;
    uint32_t gone = (uint32_t)magnitude(burst.travel);
    // The reason why a pass was refused stays until one is accepted.
    if (calibration->reason < BUS_CALIBRATION_REASON_ONE_SPEED)
        calibration->reason = BUS_CALIBRATION_REASON_CALIBRATING;
    if (pass->bursts == 0 || gone < pass->slowest) pass->slowest = gone;
    if (pass->bursts == 0 || gone > pass->fastest) pass->fastest = gone;
    if (++pass->bursts % CALIBRATION_PASS)
        end_burst(calibration, CALIBRATION_NEEDS_PHASES);
    else
        begin_stage(LAST_UPDATE);
}

static void end_of_pass(struct calibration* calibration) {
    const struct calibration_pass* pass = &calibration->pass;
    enum bus_calibration_reason reason = BUS_CALIBRATION_REASON_CALIBRATING;
    bool even, longest = pass->bursts >= CALIBRATION_LONGEST_PASS;
    uint32_t limit = (longest ? LIMITS_OF_LONGEST : 1u) * calibration->scatter_limit;
    calibration->scatter = harmonics_scatter(pass, &even);
    if ((uint64_t)pass->fastest * 8 < (uint64_t)pass->slowest * 9)
        reason = BUS_CALIBRATION_REASON_ONE_SPEED;
    else if (!even || calibration->scatter > limit)
        reason = BUS_CALIBRATION_REASON_VIBRATION;
    else if (!calibration_values_fit(&burst.candidate))
        reason = BUS_CALIBRATION_REASON_DISTORTED;
    if (reason == BUS_CALIBRATION_REASON_CALIBRATING) {
        calibration->values = burst.candidate;
        calibration->complete = true;
        accept(calibration);
    } else if (reason == BUS_CALIBRATION_REASON_VIBRATION && !longest) {
        // Further bursts average the vibration out.
        calibration->reason = (uint8_t)reason;
        end_burst(calibration, CALIBRATION_NEEDS_PHASES);
    } else {
        reject(calibration, reason);
        release_burst(calibration);
        begin_pass(calibration);
    }
}

void calibration_work(struct calibration* calibration) {
    if (calibration->need != CALIBRATION_NEEDS_WORK) return;
    struct calibration_pass* pass = &calibration->pass;
    uint32_t next = burst.next++;
    enum equations_state state = EQUATIONS_BUSY;
    switch (burst.stage) {
    case UPDATE:
        if (!harmonics_update_candidate(pass, next)) break;
        begin_stage(TABLE);
        break;
    case LAST_UPDATE:
        if (harmonics_update_candidate(pass, next)) end_of_pass(calibration);
        break;
    case TABLE:
        if (harmonics_fill_table(next)) begin_burst(calibration);
        break;
    case FIT:
        if (!harmonics_fit_vibration(next)) break;
        harmonics_begin_equations(5);
        begin_stage(SOLVE);
        break;
    case SOLVE:
        state = equations_step(&burst.fit);
        if (state == EQUATIONS_ILL)
            refuse_burst(calibration, BUS_CALIBRATION_REASON_UNSTEADY);
        else if (state == EQUATIONS_SOLVED)
            begin_stage(burst.fit.size == 3 ? RESIDUAL : CLEAR);
        break;
    case RESIDUAL:
        if (harmonics_put_residuals(next)) begin_stage(TRANSFORM);
        break;
    case TRANSFORM:
        if (spectrum_transform(next)) begin_stage(SPECTRUM);
        break;
    case SPECTRUM:
        if (burst.every != pass->every) pass->spectra = 0;
        if (spectrum_weakest_lines(pass, next)) end_of_spectrum(calibration);
        break;
    case FIND:
        begin_stage(CLEAR);
        if (!spectrum_find_vibration()) break;
        harmonics_begin_vibration();
        begin_stage(FIT);
        break;
    case CLEAR:
        if (harmonics_clear(next)) begin_second_reading(calibration);
        break;
    case FOLD:
        if (harmonics_fold(next)) begin_stage(PROJECT);
        break;
    case PROJECT:
        if (!harmonics_project(next)) break;
        begin_stage(PROJECT);
        if (harmonics_add_order(pass)) end_of_projection(calibration);
        break;
    case SOLVE_ELLIPSE:
        state = equations_step(&burst.fit);
        if (state == EQUATIONS_ILL)
            refuse_burst(calibration, BUS_CALIBRATION_REASON_PARTIAL_CIRCLE);
        else if (state == EQUATIONS_SOLVED)
            begin_stage(ELLIPSE_VALUES);
        break;
    case ELLIPSE_VALUES: end_of_ellipse(calibration); break;
    default: break;
    }
}
