// SPDX-License-Identifier: Apache-2.0
// harmonics -- the periodic error of a sine/cosine signal, from bursts of phases in motion.
//
// Position = phase - c(phase) is smooth motion, plus one vibration, plus noise, where c is the
// periodic error. A burst is read twice. First, the present estimate of c is subtracted, the means
// of 8 phases are fitted by position, speed and acceleration, and the spectrum of the residual
// shows the vibration. Then motion and vibration, fitted together, are subtracted from every phase,
// and the residual is projected on each order. An order and a vibration of nearly the same
// frequency cannot be told apart, so the burst then has less information about that order. The
// weight of a burst is the inverse of the power of its residual. Sums over the circle use its four
// mirrored quarters. A burst costs the core, which takes 4 cycles an instruction, 1.4 million
// cycles.
#include "calibration/harmonics.h"

#include "calibration/calibration_burst.h"
#include "calibration/equations.h"
#include "calibration/spectrum.h"
#include "calibration/waves.h"
#include "core/arithmetic.h"

#define LARGEST_POSITION ((int64_t)1 << 33)  // 512 periods, 2^-24 period
#define LARGEST_CORRECTION 0x1FFFF           // the 18 bits of harmonic_correction
#define LARGEST_RESIDUAL 32767               // of a phase from smooth motion: 1/32 period
#define LARGEST_VIBRATION (1 << 22)  // 4 periods: a slow one and the motion may nearly cancel
#define PARTS 16                     // of a burst, to check its steadiness
#define FEWEST_PERIODS 8             // in a burst of phases
#define QUIET (1 << 20)        // mean square below which a burst has full weight, 2^-40 period^2
#define FEWEST_BURSTS 4u       // from which on the candidate is used
#define LEAST_INFORMATION 256  // 2^-15 burst

// Sums over the blocks of window times products of 1, time and its square.
static const int32_t motion[3][3] = {WAVES_MOTION_SUMS};
_Static_assert(BLOCKS == WAVES_BLOCKS, "the made sums are of the blocks of a burst");

static int32_t clamp_residual(int32_t value) {
    return value > LARGEST_RESIDUAL    ? LARGEST_RESIDUAL
           : value < -LARGEST_RESIDUAL ? -LARGEST_RESIDUAL
                                       : value;
}

// Sums of the cosines of even and odd orders, then of the sines, at a point of the circle. Their
// sums with other signs are the values at the three mirrored points.
static void sums_at(const struct calibration_values* values, uint32_t point, int64_t sum[4]) {
    sum[0] = sum[1] = sum[2] = sum[3] = 0;
    for (uint32_t k = 0, at = point; k < CALIBRATION_ORDERS; k++, at += point) {
        uint32_t odd = (k + 1) % 2;
        sum[odd] += (int64_t)values->cosine[k] * cosine_at(at);
        sum[2 + odd] += (int64_t)values->sine[k] * sine_at(at);
    }
}

// A correction for the table, 2^-20 period.
static int32_t entry_of(int64_t sum) { return clamp((sum + (1 << 18)) >> 19, LARGEST_CORRECTION); }

int32_t harmonics_table_entry(const struct calibration_values* values, uint32_t point) {
    int64_t sum[4];
    sums_at(values, point * (512 / CALIBRATION_POINTS), sum);
    return entry_of(sum[0] + sum[1] + sum[2] + sum[3] + (int64_t)values->shift * (1 << 15));
}

// Fills four bins, which mirror each other.
static void fill_bins(uint32_t n) {
    int64_t s[4];
    sums_at(&burst.candidate, n * (512 / BINS) + 256 / BINS, s);
    burst.table[n] = entry_of(s[0] + s[1] + s[2] + s[3]);
    burst.table[BINS - 1 - n] = entry_of(s[0] + s[1] - s[2] - s[3]);
    burst.table[BINS / 2 - 1 - n] = entry_of(s[0] - s[1] - s[2] + s[3]);
    burst.table[BINS / 2 + n] = entry_of(s[0] - s[1] + s[2] - s[3]);
}

bool harmonics_fill_table(uint32_t next) {
    fill_bins(next);
    return next == QUARTER - 1;
}

static void begin_reading(void) {
    burst.taken = 0;
    burst.travel = 0;
    burst.part = 0;
    burst.slowest = INT32_MAX;
    burst.fastest = INT32_MIN;
    burst.least_step = burst.largest_step = 0;
}

// A time in a burst is in 2^-16 of its length, or the number of a block, which means its middle.

static uint32_t time_of_block(uint32_t n) { return n * (65536 / BLOCKS) + 32768 / BLOCKS; }

// 1, time and its square over the burst, -1 … 1 = -32768 … 32768.
static void motion_of(uint32_t n, int32_t base[3]) {
    base[0] = 32768;
    base[1] = (int32_t)time_of_block(n) - 32768;
    base[2] = base[1] * base[1] >> 15;
}

static void vibration_of(uint32_t time, int32_t waves[2]) {
    uint32_t phase = (uint32_t)((uint64_t)burst.vibration * time >> 16);
    waves[0] = cosine_of(phase);
    waves[1] = sine_of(phase);
}

// The motion that was fitted, 2^-20 period.
static int32_t position_of_motion(const int32_t base[3]) {
    const int64_t* s = burst.fit.solution;
    return (int32_t)((s[0] * base[0] + s[1] * base[1] + s[2] * base[2]) >> 19);
}

static int32_t position_of_vibration(const int32_t waves[2]) {
    const int64_t* s = burst.fit.solution;
    return clamp((s[3] * waves[0] + s[4] * waves[1]) >> 19, LARGEST_VIBRATION);
}

void harmonics_begin_first_reading(void) {
    begin_reading();
    for (uint32_t i = 0; i < 5; i++) burst.right[i] = burst.across[0][i] = burst.across[1][i] = 0;
}

void harmonics_read_first(const uint32_t words[CALIBRATION_WORDS]) {
    int32_t travel = burst.travel, travels = 0, corrections = 0;
    uint16_t last = burst.taken ? burst.last : (uint16_t)words[0];
    for (uint32_t i = 0; i < BLOCK; i++) {
        uint16_t phase = (uint16_t)(words[i / 2] >> 16 * (i % 2));
        int32_t step = (int16_t)(phase - last);
        if (step > burst.largest_step) burst.largest_step = step;
        if (step < burst.least_step) burst.least_step = step;
        travel += step;
        travels += travel;
        corrections += burst.table[phase / (65536 / BINS)];
        last = phase;
    }
    burst.travel = travel;
    burst.last = last;
    uint32_t n = burst.taken / BLOCK;
    int32_t base[3], window = spectrum_window(n), position = travels * 2 - (corrections >> 3);
    motion_of(n, base);
    burst.block[n] = position;
    for (uint32_t i = 0; i < 3; i++) burst.right[i] += (int64_t)(window * base[i] >> 15) * position;
    burst.taken += BLOCK;
    if (burst.taken % (CALIBRATION_PHASES / PARTS) == 0) {
        int32_t gone = burst.travel - burst.part;
        burst.part = burst.travel;
        if (gone < burst.slowest) burst.slowest = gone;
        if (gone > burst.fastest) burst.fastest = gone;
    }
}

// Within a block the motion is straight, and the vibration is continued from its first two
// positions by its bend.
void harmonics_read_second(const uint32_t words[CALIBRATION_WORDS]) {
    uint32_t n = burst.taken / BLOCK, time = n * (65536 / BLOCKS) + 32768 / CALIBRATION_PHASES;
    int32_t base[3], waves[2], window = spectrum_window(n) >> 5, residual = 0, travel = 0;
    uint16_t last = burst.taken ? burst.last : (uint16_t)words[0];
    const int64_t* s = burst.fit.solution;
    motion_of(n, base);
    // From phase to phase, which is 2^-11 of the burst.
    int32_t speed = (int32_t)((s[1] * 32768 + 2 * s[2] * base[1] + (1 << 28)) >> 29);
    int32_t motion_position =
        position_of_motion(base) - speed * (int32_t)(BLOCK - 1) / 2 - burst.travel * 16;
    vibration_of(time - 65536 / CALIBRATION_PHASES, waves);
    int32_t before = position_of_vibration(waves);
    vibration_of(time, waves);
    int32_t vibration_position = position_of_vibration(waves),
            vibration_increment = vibration_position - before, bend = burst.bend;
    uint32_t first = (uint16_t)words[0] / (65536 / BINS);
    burst.seen[1][first] += window * waves[0] >> 5;
    burst.seen[2][first] += window * waves[1] >> 5;
    for (uint32_t i = 0; i < BLOCK; i++) {
        uint16_t phase = (uint16_t)(words[i / 2] >> 16 * (i % 2));
        uint32_t bin = phase / (65536 / BINS);
        travel += (int16_t)(phase - last);
        last = phase;
        residual =
            clamp_residual(travel * 16 - burst.table[bin] - motion_position - vibration_position);
        burst.seen[0][bin] += window * residual >> 5;
        motion_position += speed;
        vibration_increment -= (int32_t)(((int64_t)bend * vibration_position + (1 << 16)) >> 17);
        vibration_position += vibration_increment;
    }
    burst.travel += travel;
    burst.last = last;
    burst.power += (int64_t)window * (residual * residual);
    burst.taken += BLOCK;
}

enum bus_calibration_reason harmonics_check_burst(void) {
    int32_t travel = burst.travel, slowest = burst.slowest, fastest = burst.fastest;
    if (burst.largest_step > 8192 || burst.least_step < -8192)
        return BUS_CALIBRATION_REASON_TOO_FAST;
    if (magnitude(travel) < 65536 / 4 && fastest < 65536 / 4 && slowest > -65536 / 4)
        return BUS_CALIBRATION_REASON_STANDSTILL;
    if (magnitude(travel) < FEWEST_PERIODS * 65536) return BUS_CALIBRATION_REASON_PARTIAL_CIRCLE;
    if (travel < 0) {
        slowest = -burst.fastest;
        fastest = -burst.slowest;
    }
    return slowest <= 0 || fastest > 2 * slowest ? BUS_CALIBRATION_REASON_UNSTEADY
                                                 : BUS_CALIBRATION_REASON_CALIBRATING;
}

// Attenuation of a wave in the mean of a block, 1.0 = 2^15; `half` is half of its step from phase
// to phase.
static int32_t attenuation(uint32_t half) {
    int32_t twice = cosine_of(half) * cosine_of(2 * half) >> 15;
    return twice * cosine_of(4 * half) >> 15;
}

void harmonics_begin_vibration(void) {
    uint32_t half = burst.vibration / (2 * CALIBRATION_PHASES);
    int32_t sine = sine_of(half);
    burst.bend = sine * sine >> 11;
    burst.attenuation_of_block = attenuation(half);
}

// Adds what a block contributes to the least squares of the two waves of the vibration.
static void fit_block(uint32_t n) {
    int32_t base[5], window = spectrum_window(n), position = burst.block[n];
    motion_of(n, base);
    vibration_of(time_of_block(n), &base[3]);
    for (uint32_t i = 0; i < 2; i++) base[3 + i] = base[3 + i] * burst.attenuation_of_block >> 15;
    for (uint32_t i = 0; i < 2; i++) {
        int32_t weighed = window * base[3 + i] >> 15;
        for (uint32_t j = 0; j < 4 + i; j++) burst.across[i][j] += weighed * base[j] >> 10;
        burst.right[3 + i] += (int64_t)weighed * position;
    }
}

bool harmonics_fit_vibration(uint32_t next) {
    for (uint32_t n = 0; n < TOGETHER; n++) fit_block(next * TOGETHER + n);
    return next == BLOCKS / TOGETHER - 1;
}

void harmonics_begin_equations(uint32_t unknowns) {
    struct equations* e = &burst.fit;
    equations_begin(e, unknowns, LARGEST_POSITION);
    for (uint32_t j = 0; j < unknowns; j++) {
        for (uint32_t i = 0; i <= j; i++)
            e->m[i][j] = j < 3 ? motion[i][j] : burst.across[j - 3][i];
        e->m[j][5] = burst.right[j] >> 19;
    }
}

bool harmonics_put_residuals(uint32_t next) {
    for (uint32_t n = next * TOGETHER; n < (next + 1) * TOGETHER; n++) {
        int32_t base[3];
        motion_of(n, base);
        spectrum_put(n, clamp_residual(burst.block[n] - position_of_motion(base)));
    }
    return next == BLOCKS / TOGETHER - 1;
}

bool harmonics_clear(uint32_t next) {
    for (uint32_t i = 0; i < 3; i++)
        for (uint32_t n = 0; n < TOGETHER; n++) burst.seen[i][next * TOGETHER + n] = 0;
    return next == BINS / TOGETHER - 1;
}

void harmonics_begin_second_reading(void) {
    burst.power = 0;
    begin_reading();
}

void harmonics_weigh(void) {
    int64_t square = burst.power >> 17;
    burst.weight = square <= QUIET ? 32768 : QUIET * INT64_C(32768) / square;
    burst.order = 0;
}

// The four mirrored bins become their sums for the cosines of even and odd orders, then for the
// sines.
static void fold_bin(uint32_t n) {
    for (uint32_t i = 0; i < 3; i++) {
        int32_t *seen = burst.seen[i], *a = &seen[n], *b = &seen[BINS / 2 - 1 - n],
                *c = &seen[BINS / 2 + n], *d = &seen[BINS - 1 - n];
        int32_t even = *a + *d, uneven = *a - *d, opposite_even = *b + *c,
                opposite_uneven = *c - *b;
        *a = even + opposite_even;
        *b = even - opposite_even;
        *c = uneven + opposite_uneven;
        *d = uneven - opposite_uneven;
    }
}

bool harmonics_fold(uint32_t next) {
    fold_bin(next);
    return next == QUARTER - 1;
}

static void project_bin(uint32_t n) {
    uint32_t order = burst.order + 1, point = order * (n * (512 / BINS) + 256 / BINS);
    uint32_t at[2] = {order % 2 ? BINS / 2 - 1 - n : n, order % 2 ? BINS - 1 - n : BINS / 2 + n};
    int32_t waves[2] = {cosine_at(point), sine_at(point)};
    for (uint32_t i = 0; i < 3; i++)
        for (uint32_t j = 0; j < 2; j++)
            burst.projected[i][j] += (int64_t)burst.seen[i][at[j]] * waves[j];
}

bool harmonics_project(uint32_t next) {
    if (next == 0)
        for (uint32_t i = 0; i < 3; i++) burst.projected[i][0] = burst.projected[i][1] = 0;
    for (uint32_t n = 0; n < TOGETHER; n++) project_bin(next * TOGETHER + n);
    return next == QUARTER / TOGETHER - 1;
}

// The part of an order that the vibration hides: its two sidebands, each as attenuated in the mean
// of a block. 1.0 = 2^15.
static int64_t lost_to_vibration(int32_t order) {
    int32_t step = (int32_t)(burst.vibration / CALIBRATION_PHASES),
            own = order * (burst.travel / (int32_t)(CALIBRATION_PHASES - 1));
    int64_t cosine[2], sine[2], lost = 0;
    for (uint32_t j = 0; j < 2; j++) {
        cosine[j] = burst.projected[1][j] >> 27;
        sine[j] = burst.projected[2][j] >> 27;
    }
    int64_t near[2] = {cosine[0] + sine[1], sine[0] - cosine[1]},
            far[2] = {cosine[0] - sine[1], sine[0] + cosine[1]};
    int64_t near_attenuation = attenuation((uint32_t)(step - own) / 2),
            far_attenuation = attenuation((uint32_t)(step + own) / 2);
    for (uint32_t j = 0; j < 2; j++) {
        int64_t a = near[j] * near_attenuation >> 15, b = far[j] * far_attenuation >> 15;
        lost += a * a + b * b;
    }
    return lost >> 15;
}

bool harmonics_add_order(struct calibration_pass* pass) {
    uint32_t k = burst.order++;
    int64_t cosine = burst.projected[0][0] >> 25;  // 2^-24 period
    int64_t sine = burst.projected[0][1] >> 25;
    int64_t retained = 32768 - lost_to_vibration((int32_t)k + 1);
    if (retained < 0) retained = 0;
    pass->information[k] += (int32_t)(burst.weight * retained >> 15);
    pass->cosine[k] +=
        (int32_t)(burst.weight * (cosine + (retained * burst.candidate.cosine[k] >> 15)) >> 12);
    pass->sine[k] +=
        (int32_t)(burst.weight * (sine + (retained * burst.candidate.sine[k] >> 15)) >> 12);
    if (pass->bursts >= FEWEST_BURSTS) {  // the candidate of fewer is still far from the result
        cosine = burst.weight * cosine >> 15;
        sine = burst.weight * sine >> 15;
        pass->squares += cosine * cosine + sine * sine;
    }
    return burst.order == CALIBRATION_ORDERS;
}

bool harmonics_update_candidate(const struct calibration_pass* pass, uint32_t next) {
    uint32_t k = next / 2;
    bool sine = next % 2;
    int32_t* value = sine ? &burst.candidate.sine[k] : &burst.candidate.cosine[k];
    int64_t sum = sine ? pass->sine[k] : pass->cosine[k];
    if (pass->bursts >= FEWEST_BURSTS && pass->information[k] >= LEAST_INFORMATION)
        *value = clamp(sum * 4096 / pass->information[k], 1 << 21);
    return next == 2 * CALIBRATION_ORDERS - 1;
}

uint32_t harmonics_scatter(const struct calibration_pass* pass, bool* even) {
    int32_t strongest = 0, weakest = INT32_MAX;
    for (uint32_t k = 0; k < CALIBRATION_ORDERS; k++) {
        if (pass->information[k] > strongest) strongest = pass->information[k];
        if (pass->information[k] < weakest) weakest = pass->information[k];
    }
    *even = weakest >= strongest / 4;
    int64_t square = weakest < LEAST_INFORMATION
                         ? INT64_MAX
                         : pass->squares / weakest * (1 << 22) / weakest;  // 2^-40 period^2
    return root((uint64_t)square);
}
