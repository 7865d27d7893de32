// SPDX-License-Identifier: Apache-2.0
// calibration -- offset, gain, phase and harmonics of a sine/cosine signal, learned in motion
// (docs/interpolation.md).
//
// Ellipse: least squares of x^2 + y^2 on 1, x, y, x^2 - y^2, 2xy. Exact without noise for any
// ellipse and any spread of the samples, and the equations stay well conditioned as long as the
// whole circle was seen. Harmonics: position = phase - c(phase) is smooth motion, plus one
// vibration, plus noise. A burst is taken twice. First: what the pass knows of c is taken off, the
// means of 8 are fitted by position, speed and acceleration, and the spectrum of the residual shows
// the vibration as the line that no burst of the pass is without (the lines of c move with the
// speed). Then, motion and vibration fitted together and taken off every phase, the remainder is
// projected on each order. What an order shares with the vibration is lost to it; so much less the
// burst informs of it. A burst weighs as the inverse of the power that is left in it. All of it is
// in 32 bits where they hold it, and sums over the circle use its four mirrored quarters: the core
// takes 4 clk an instruction, and a burst costs it 1.4 million clk.
#include "calibration/calibration.h"

#define UNIT ((int64_t)1 << 28)                // 1 of the equations
#define STEEPEST (4 * UNIT)                    // largest factor of an elimination
#define SMALLEST (UNIT >> 16)                  // smallest pivot
#define LARGEST_SHAPE (4 * UNIT)               // of an ellipse
#define LARGEST_POSITION ((int64_t)1 << 33)    // 512 periods, 2^-24 period
#define LARGEST_MEAN_SQUARE (UNIT + UNIT / 4)  // mean of x^2 + y^2
#define LARGEST_CORRECTION 0x1FFFF             // the 18 bits of harmonic_correction
#define SCATTER_LIMIT 64                       // 4 LSB of a 16-bit phase
#define PARTS 16                               // of a burst, for its steadiness
#define FEWEST_PERIODS 8                       // in a burst of phases
#define BLOCKS 256u                          // of a burst; their means are what motion is fitted to
#define BLOCK (CALIBRATION_PHASES / BLOCKS)  // 8: see attenuation
#define BINS 128u                            // of a period
#define QUARTER (BINS / 4)
#define POINTS (BLOCKS / 2)     // of the transform: two blocks in each, one real, one imaginary
#define PAIRS (POINTS / 2)      // of a level of the transform
#define LEVELS 7u               // of the transform
#define TOGETHER 2u             // blocks, pairs, lines, bins of one piece of work
#define LARGEST_RESIDUAL 32767  // of a phase from smooth motion: 1/32 period
#define LARGEST_VIBRATION (1 << 22)  // 4 periods: a slow one and the motion may nearly cancel
#define QUIET (1 << 20)        // mean square below which a burst has full weight, 2^-40 period^2
#define FIRST_LINE 2u          // slower vibration is motion,
#define SLOWEST (3u << 15)     // below 1.5 cycles a burst
#define FEWEST_SPECTRA 3u      // that show which line stays
#define FEWEST_BURSTS 4u       // from which on the candidate is believed
#define LEAST_INFORMATION 256  // 2^-15 burst

const struct calibration_values calibration_identity = {.gain = 65536};

static int16_t wave[640];  // sine of 512 points of a circle and a quarter, 1.0 = 32767
static int32_t
    motion[3][3];  // window times products of 1, time and its square, summed over the blocks

enum stage {
    UPDATE,
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
    TAKE_ELLIPSE
};

struct equations {        // symmetric and positive; column 5 is the right side
    int64_t m[5][6];      // on and right of its diagonal
    int64_t solution[5];  // 0 beyond size
    int64_t largest;      // of the solution
    bool back;            // eliminated: the unknowns are next
    uint32_t size;
    uint32_t row, column;  // what comes next
};

static struct {
    const struct calibration* owner;  // none: free
    enum stage stage;
    uint32_t next;  // block, butterfly, line, bin: what comes next of the stage
    uint16_t every;
    struct calibration_values candidate;  // what the pass says so far

    uint32_t taken;            // samples or phases of this reading
    uint16_t last;             // phase
    int32_t travel;            // 2^-16 period
    int32_t part;              // travel at the start of this 16th of the burst
    int32_t slowest, fastest;  // travel of a 16th
    int32_t least_step, largest_step;

    int32_t table[BINS];    // c in the middle of each bin, 2^-20 period
    int32_t block[BLOCKS];  // position, 2^-20 period
    uint32_t strongest;     // line of the pass
    uint32_t vibration;     // 2^-16 cycle a burst
    int32_t bend;  // of the vibration from phase to phase, 2 - 2 cos of its step, 1.0 = 2^17
    int32_t attenuation_of_block;  // of the vibration in the mean of a block, 1.0 = 2^15
    int32_t across[2][5];  // window times products of each wave of the vibration with 1, time,
                           // square and both waves
    int64_t right[5];      // window times position times those
    struct equations fit;
    union {
        struct {
            int32_t real[POINTS], imaginary[POINTS];
        };                      // of the transform
        int32_t seen[3][BINS];  // by phase: window times residual of each phase, cosine and sine of
                                // the vibration of each block
    };
    int64_t power;  // of the residual at the end of each block, 2^-30 (window) 2^-20 period squared
    int64_t weight;  // of the burst, 1.0 = 2^15
    uint32_t order;
    int64_t projected[3][2];  // of the order at hand, cosine and sine
} work;

static void fill_wave(void) {
    int64_t sine = 0, cosine = 1 << 30;
    for (int n = 0; n <= 128; n++) {
        wave[n] = wave[256 - n] = (int16_t)((sine * 32767 + (1 << 29)) >> 30);
        int64_t next =
            (sine * 1073660973 + cosine * 13176464 + (1 << 29)) >> 30;  // turn by pi / 256
        cosine = (cosine * 1073660973 - sine * 13176464 + (1 << 29)) >> 30;
        sine = next;
    }
    for (int n = 0; n < 256; n++) wave[256 + n] = (int16_t)-wave[n];
    for (int n = 0; n < 128; n++) wave[512 + n] = wave[n];
}

// Of a point of the circle, which has 512.

static int32_t sine_at(uint32_t point) { return wave[point % 512]; }

static int32_t cosine_at(uint32_t point) { return wave[point % 512 + 128]; }

// Of any phase, one period = 2^16: the nearest point turned by the residual.

static int32_t turn_of(int32_t size, uint32_t phase) {
    return (size * (int32_t)((phase + 64) % 128 - 64) * 201) >> 21;  // pi / 2^15
}

static int32_t sine_of(uint32_t phase) {
    uint32_t point = (phase + 64) >> 7;
    return sine_at(point) + turn_of(cosine_at(point), phase);
}

static int32_t cosine_of(uint32_t phase) {
    uint32_t point = (phase + 64) >> 7;
    return cosine_at(point) - turn_of(sine_at(point), phase);
}

static int32_t clamp(int64_t value, int32_t limit) {
    return value > limit ? limit : value < -limit ? -limit : (int32_t)value;
}

static int32_t clamp_residual(int32_t value) {
    return value > LARGEST_RESIDUAL    ? LARGEST_RESIDUAL
           : value < -LARGEST_RESIDUAL ? -LARGEST_RESIDUAL
                                       : value;
}

static int32_t size_of(int32_t value) { return value < 0 ? -value : value; }

static int64_t root_of(int64_t square) {
    int64_t root = 0;
    for (int64_t bit = INT64_C(1) << 62; bit; bit >>= 2) {
        bool fits = square >= root + bit;
        if (fits) square -= root + bit;
        root = (root >> 1) + (fits ? bit : 0);
    }
    return root;
}

// ---- the ellipse

void calibration_ellipse_start(struct calibration_ellipse* ellipse) {
    *ellipse = (struct calibration_ellipse){.lowest = {INT16_MAX, INT16_MAX},
                                            .highest = {INT16_MIN, INT16_MIN}};
}

void calibration_ellipse_take(struct calibration_ellipse* ellipse,
                              const struct calibration* calibration, uint32_t word) {
    int32_t cosine = (int16_t)(word >> 16), sine = (int16_t)word;
    int32_t x = (cosine + 4) >> 3, y = (sine + 4) >> 3;  // 13 bits: the sums of 4096 samples fit
    int32_t low = calibration->amplitude_low >> 3, high = calibration->amplitude_high >> 3;
    int32_t base[6] = {1, x, y, x * x - y * y, 2 * x * y, x * x + y * y};
    int32_t channel[2] = {x, y};
    int64_t* sum = ellipse->sum;
    for (int i = 0; i < 5; i++)
        for (int j = i; j < 6; j++) *sum++ += (int64_t)base[i] * base[j];
    for (int i = 0; i < 2; i++) {
        if (channel[i] < ellipse->lowest[i]) ellipse->lowest[i] = (int16_t)channel[i];
        if (channel[i] > ellipse->highest[i]) ellipse->highest[i] = (int16_t)channel[i];
    }
    if (base[5] < low * low || base[5] > (int64_t)high * high) ellipse->outside++;
    x = cosine - calibration->values.cos_offset;
    y = sine - calibration->values.sin_offset;
    int32_t along = size_of(x), across = size_of(y);
    bool steep = along < across, middle = steep
                                              ? along * 12 > across * 5
                                              : across * 12 > along * 5;  // 5/12: tan 22.6 degrees
    ellipse->sector[(x < 0) + 2 * (y < 0) + 4 * steep + 8 * middle]++;
    ellipse->count++;
}

static void begin_equations(struct equations* e, uint32_t size, int64_t largest) {
    e->size = size;
    for (uint32_t i = 0; i < 5; i++) e->solution[i] = 0;
    e->largest = largest;
    e->back = false;
    e->row = 0;
    e->column = 1;
}

enum solve_state { SOLVE_BUSY, SOLVE_DONE, SOLVE_ILL };

// One factor of the elimination, without exchange of rows, or half an unknown: a division takes the
// core 2500 clk.
static enum solve_state solve(struct equations* e) {
    uint32_t i = e->row, j = e->column;
    int64_t pivot = e->m[i][i];
    if (e->back) {
        int64_t *residual = &e->m[i][5], *solution = &e->solution[i];
        if (j == 0) {  // first coarsely, then the remainder: both fit 64 bits
            for (j = i + 1; j < e->size; j++) *residual -= (e->m[i][j] * e->solution[j]) >> 28;
            *solution = *residual * 16 / pivot;
            *residual = *residual * 16 - *solution * pivot;
            e->column = 1;
            return SOLVE_BUSY;
        }
        *solution = *solution * (UNIT / 16) + *residual * (UNIT / 16) / pivot;
        if (*solution > e->largest || *solution < -e->largest) return SOLVE_ILL;
        if (i == 0) return SOLVE_DONE;
        e->row--;
        e->column = 0;
    } else if (pivot < SMALLEST) {
        return SOLVE_ILL;
    } else if (j < e->size) {
        int64_t factor = e->m[i][j] * UNIT / pivot;
        if (factor > STEEPEST || factor < -STEEPEST) return SOLVE_ILL;
        for (uint32_t k = j; k < e->size; k++) e->m[j][k] -= (factor * e->m[i][k]) >> 28;
        e->m[j][5] -= (factor * e->m[i][5]) >> 28;
        e->column++;
    } else if (i + 1 < e->size) {
        e->row++;
        e->column = e->row + 1;
    } else {
        e->back = true;
        e->column = 0;
    }
    return SOLVE_BUSY;
}

// Whether the samples are fit to be learned from, and their equations.
static enum calibration_reason check_ellipse(const struct calibration_ellipse* ellipse,
                                             struct equations* e) {
    static const uint8_t degree[6] = {0, 1, 1, 2, 2, 2};
    begin_equations(e, 5, LARGEST_SHAPE);
    int64_t count = ellipse->count;
    uint32_t shift = 0;
    if (count == 0) return CALIBRATION_PARTIAL_CIRCLE;
    while (count >> shift > 1)
        shift++;  // the sums by 1 to 2 counts: what is solved does not change
    const int64_t* sum = ellipse->sum;
    for (int i = 0; i < 5; i++)
        for (int j = i; j < 6; j++) {  // full scale 1
            int up = 28 - 12 * (degree[i] + degree[j]);
            int64_t scaled = up > 0 ? *sum * (INT64_C(1) << up) : *sum >> -up;
            e->m[i][j] = scaled >> shift;
            sum++;
        }
    int64_t mean_square = e->m[0][5] * UNIT / e->m[0][0];
    if (ellipse->outside * 16 > ellipse->count || mean_square > LARGEST_MEAN_SQUARE)
        return CALIBRATION_AMPLITUDE;
    int64_t eighth = root_of(mean_square * UNIT) >> 19;  // of the amplitude, in units of x
    if (ellipse->highest[0] - ellipse->lowest[0] < eighth &&
        ellipse->highest[1] - ellipse->lowest[1] < eighth)
        return CALIBRATION_STANDSTILL;
    for (int n = 0; n < 16; n++)
        if (ellipse->sector[n] < ellipse->count / 128 ||
            (ellipse->sector[n] + ellipse->sector[n ^ 8]) * 64 < ellipse->count)
            return CALIBRATION_PARTIAL_CIRCLE;
    return CALIBRATION_RUNNING;
}

static enum calibration_reason accept_ellipse(const int64_t s[5],
                                              struct calibration_values* values) {
    int64_t b = s[1], c = s[2], p = UNIT - s[3], q = UNIT + s[3],
            e = s[4];  // p x^2 + q y^2 - 2 e xy - b x - c y = s[0]
    if (p < UNIT / 4 || q < UNIT / 4) return CALIBRATION_DISTORTED;
    int64_t determinant = (p * q - e * e) >> 28;
    if (determinant < UNIT / 4) return CALIBRATION_DISTORTED;
    int64_t root = root_of(determinant * UNIT);
    int64_t x = ((q * b + e * c) / determinant) >> 1, y = ((p * c + e * b) / determinant) >> 1;
    struct calibration_values fit = *values;
    fit.cos_offset = (int16_t)clamp((x + (1 << 12)) >> 13, INT16_MAX);
    fit.sin_offset = (int16_t)clamp((y + (1 << 12)) >> 13, INT16_MAX);
    fit.gain = (int32_t)((q * 65536 + root / 2) / root);
    fit.quadrature_error = (int32_t)(-(e * 65536) / root);
    if (!calibration_values_fit(&fit)) return CALIBRATION_DISTORTED;
    *values = fit;
    return CALIBRATION_RUNNING;
}

enum calibration_reason calibration_ellipse_fit(const struct calibration_ellipse* ellipse,
                                                struct calibration_values* values) {
    struct equations e;
    enum calibration_reason reason = check_ellipse(ellipse, &e);
    if (reason != CALIBRATION_RUNNING) return reason;
    enum solve_state state = SOLVE_BUSY;
    while (state == SOLVE_BUSY) state = solve(&e);
    if (state == SOLVE_ILL) return CALIBRATION_PARTIAL_CIRCLE;
    return accept_ellipse(e.solution, values);
}

// ---- the harmonics

// Sums of the cosines of even and odd orders, then of the sines, at a point of the circle. With a
// sign each they are those of the three mirrored points as well.
static void sums_at(const struct calibration_values* values, uint32_t point, int64_t sum[4]) {
    sum[0] = sum[1] = sum[2] = sum[3] = 0;
    for (uint32_t k = 0, at = point; k < CALIBRATION_ORDERS; k++, at += point) {
        uint32_t odd = (k + 1) % 2;
        sum[odd] += (int64_t)values->cosine[k] * cosine_at(at);
        sum[2 + odd] += (int64_t)values->sine[k] * sine_at(at);
    }
}

static int32_t entry_of(int64_t sum)  // 2^-20 period
{
    return clamp((sum + (1 << 18)) >> 19, LARGEST_CORRECTION);
}

int32_t calibration_table_entry(const struct calibration_values* values, uint32_t point) {
    int64_t sum[4];
    sums_at(values, point * (512 / CALIBRATION_POINTS), sum);
    return entry_of(sum[0] + sum[1] + sum[2] + sum[3]);
}

static void fill_table(uint32_t n)  // four bins
{
    int64_t s[4];
    sums_at(&work.candidate, n * (512 / BINS) + 256 / BINS, s);
    work.table[n] = entry_of(s[0] + s[1] + s[2] + s[3]);
    work.table[BINS - 1 - n] = entry_of(s[0] + s[1] - s[2] - s[3]);
    work.table[BINS / 2 - 1 - n] = entry_of(s[0] - s[1] - s[2] + s[3]);
    work.table[BINS / 2 + n] = entry_of(s[0] - s[1] + s[2] - s[3]);
}

static void begin_reading(void) {
    work.taken = 0;
    work.travel = 0;
    work.part = 0;
    work.slowest = INT32_MAX;
    work.fastest = INT32_MIN;
    work.least_step = work.largest_step = 0;
}

static void begin_stage(enum stage stage) {
    work.stage = stage;
    work.next = 0;
}

// Places in a burst: `turn`, all of it being 65536, or the number of a block for its middle.

static uint32_t turn_of_block(uint32_t n) { return n * (65536 / BLOCKS) + 32768 / BLOCKS; }

static int32_t window_of(uint32_t n)  // Hann, 1.0 = 2^15
{
    return (32767 - cosine_at((2 * n + 1) * (256 / BLOCKS))) >> 1;
}

static void motion_of(uint32_t n, int32_t base[3]) {
    base[0] = 32768;
    base[1] = (int32_t)turn_of_block(n) - 32768;
    base[2] = base[1] * base[1] >> 15;
}

static void vibration_of(uint32_t turn, int32_t waves[2]) {
    uint32_t phase = (uint32_t)((uint64_t)work.vibration * turn >> 16);
    waves[0] = cosine_of(phase);
    waves[1] = sine_of(phase);
}

static int32_t position_of_motion(const int32_t base[3])  // fitted, 2^-20 period
{
    const int64_t* s = work.fit.solution;
    return (int32_t)((s[0] * base[0] + s[1] * base[1] + s[2] * base[2]) >> 19);
}

static int32_t position_of_vibration(const int32_t waves[2]) {
    const int64_t* s = work.fit.solution;
    return clamp((s[3] * waves[0] + s[4] * waves[1]) >> 19, LARGEST_VIBRATION);
}

static void fill_motion(void) {
    for (uint32_t i = 0; i < 3; i++) motion[i][0] = motion[i][1] = motion[i][2] = 0;
    for (uint32_t n = 0; n < BLOCKS; n++) {
        int32_t base[3], window = window_of(n);
        motion_of(n, base);
        for (uint32_t i = 0; i < 3; i++)
            for (uint32_t j = 0; j < 3; j++)
                motion[i][j] += (window * base[i] >> 15) * base[j] >> 10;
    }
}

static void take_first(const uint32_t words[BLOCK / 2])  // a block
{
    int32_t travel = work.travel, travels = 0, corrections = 0;
    uint16_t last = work.taken ? work.last : (uint16_t)words[0];
    for (uint32_t i = 0; i < BLOCK; i++) {
        uint16_t phase = (uint16_t)(words[i / 2] >> 16 * (i % 2));
        int32_t step = (int16_t)(phase - last);
        if (step > work.largest_step) work.largest_step = step;
        if (step < work.least_step) work.least_step = step;
        travel += step;
        travels += travel;
        corrections += work.table[phase / (65536 / BINS)];
        last = phase;
    }
    work.travel = travel;
    work.last = last;
    uint32_t n = work.taken / BLOCK;
    int32_t base[3], window = window_of(n), position = travels * 2 - (corrections >> 3);
    motion_of(n, base);
    work.block[n] = position;
    for (uint32_t i = 0; i < 3; i++) work.right[i] += (int64_t)(window * base[i] >> 15) * position;
    work.taken += BLOCK;
    if (work.taken % (CALIBRATION_PHASES / PARTS) == 0) {
        int32_t gone = work.travel - work.part;
        work.part = work.travel;
        if (gone < work.slowest) work.slowest = gone;
        if (gone > work.fastest) work.fastest = gone;
    }
}

// Within the block motion is straight, and the vibration goes on from its first two places by its
// bend.
static void take_second(const uint32_t words[BLOCK / 2]) {
    uint32_t n = work.taken / BLOCK, turn = n * (65536 / BLOCKS) + 32768 / CALIBRATION_PHASES;
    int32_t base[3], waves[2], window = window_of(n) >> 5, residual = 0, travel = 0;
    uint16_t last = work.taken ? work.last : (uint16_t)words[0];
    const int64_t* s = work.fit.solution;
    motion_of(n, base);
    int32_t speed = (int32_t)((s[1] * 32768 + 2 * s[2] * base[1] + (1 << 28)) >>
                              29);  // a phase is 2^-11 of the burst
    int32_t motion_position =
        position_of_motion(base) - speed * (int32_t)(BLOCK - 1) / 2 - work.travel * 16;
    vibration_of(turn - 65536 / CALIBRATION_PHASES, waves);
    int32_t before = position_of_vibration(waves);
    vibration_of(turn, waves);
    int32_t vibration_position = position_of_vibration(waves),
            vibration_increment = vibration_position - before, bend = work.bend;
    uint32_t first = (uint16_t)words[0] / (65536 / BINS);
    work.seen[1][first] += window * waves[0] >> 5;
    work.seen[2][first] += window * waves[1] >> 5;
    for (uint32_t i = 0; i < BLOCK; i++) {
        uint16_t phase = (uint16_t)(words[i / 2] >> 16 * (i % 2));
        uint32_t bin = phase / (65536 / BINS);
        travel += (int16_t)(phase - last);
        last = phase;
        residual =
            clamp_residual(travel * 16 - work.table[bin] - motion_position - vibration_position);
        work.seen[0][bin] += window * residual >> 5;
        motion_position += speed;
        vibration_increment -= (int32_t)(((int64_t)bend * vibration_position + (1 << 16)) >> 17);
        vibration_position += vibration_increment;
    }
    work.travel += travel;
    work.last = last;
    work.power += (int64_t)window * (residual * residual);
    work.taken += BLOCK;
}

static enum calibration_reason check_burst(void) {
    int32_t travel = work.travel, slowest = work.slowest, fastest = work.fastest;
    if (work.largest_step > 8192 || work.least_step < -8192) return CALIBRATION_TOO_FAST;
    if (size_of(travel) < 65536 / 4 && fastest < 65536 / 4 && slowest > -65536 / 4)
        return CALIBRATION_STANDSTILL;
    if (size_of(travel) < FEWEST_PERIODS * 65536) return CALIBRATION_PARTIAL_CIRCLE;
    if (travel < 0) {
        slowest = -work.fastest;
        fastest = -work.slowest;
    }
    return slowest <= 0 || fastest > 2 * slowest ? CALIBRATION_UNSTEADY : CALIBRATION_RUNNING;
}

// Of a wave in the mean of a block, 1.0 = 2^15; by half of its step from phase to phase.
static int32_t attenuation(uint32_t half) {
    int32_t twice = cosine_of(half) * cosine_of(2 * half) >> 15;
    return twice * cosine_of(4 * half) >> 15;
}

static void begin_fit(void) {
    uint32_t half = work.vibration / (2 * CALIBRATION_PHASES);
    int32_t sine = sine_of(half);
    work.bend = sine * sine >> 11;
    work.attenuation_of_block = attenuation(half);
    begin_stage(FIT);
}

// One block more of what the waves of the vibration add to the least squares.
static void fit_block(uint32_t n) {
    int32_t base[5], window = window_of(n), position = work.block[n];
    motion_of(n, base);
    vibration_of(turn_of_block(n), &base[3]);
    for (uint32_t i = 0; i < 2; i++) base[3 + i] = base[3 + i] * work.attenuation_of_block >> 15;
    for (uint32_t i = 0; i < 2; i++) {
        int32_t weighed = window * base[3 + i] >> 15;
        for (uint32_t j = 0; j < 4 + i; j++) work.across[i][j] += weighed * base[j] >> 10;
        work.right[3 + i] += (int64_t)weighed * position;
    }
}

static void begin_solve(uint32_t size) {
    struct equations* e = &work.fit;
    begin_equations(e, size, LARGEST_POSITION);
    for (uint32_t j = 0; j < size; j++) {
        for (uint32_t i = 0; i <= j; i++) e->m[i][j] = j < 3 ? motion[i][j] : work.across[j - 3][i];
        e->m[j][5] = work.right[j] >> 19;
    }
    begin_stage(SOLVE);
}

static void window_block(
    uint32_t n)  // what the motion leaves, into the order that the transform wants
{
    int32_t base[3];
    uint32_t at = 0;
    motion_of(n, base);
    int32_t residual = clamp_residual(work.block[n] - position_of_motion(base));
    for (uint32_t bit = 2; bit < BLOCKS; bit *= 2) at = at * 2 + (n & bit ? 1 : 0);
    int32_t* half = n % 2 ? work.imaginary : work.real;
    half[at] = (int32_t)((int64_t)residual * window_of(n) >> 16);
}

static void butterfly(uint32_t n)  // halved, so that nothing grows
{
    uint32_t level = n / PAIRS, half = 1u << level, in = n % half;
    uint32_t a = (n % PAIRS - in) * 2 + in, b = a + half, point = in << (8 - level);
    int32_t cosine = cosine_at(point), sine = sine_at(point);
    int32_t real = (cosine * work.real[b] + sine * work.imaginary[b]) >> 15;
    int32_t imaginary = (cosine * work.imaginary[b] - sine * work.real[b]) >> 15;
    work.real[b] = (work.real[a] - real) >> 1;
    work.imaginary[b] = (work.imaginary[a] - imaginary) >> 1;
    work.real[a] = (work.real[a] + real) >> 1;
    work.imaginary[a] = (work.imaginary[a] + imaginary) >> 1;
}

struct line {
    int32_t real, imaginary;
};

static struct line line_of(uint32_t n)  // from the transforms of even and odd blocks
{
    uint32_t m = (POINTS - n) % POINTS;
    int32_t cosine = cosine_at(n * (512 / BLOCKS)), sine = sine_at(n * (512 / BLOCKS));
    int32_t real = work.imaginary[n] + work.imaginary[m], imaginary = work.real[m] - work.real[n];
    return (struct line){
        .real = (work.real[n] + work.real[m] + ((cosine * real + sine * imaginary) >> 15)) >> 1,
        .imaginary =
            (work.imaginary[n] - work.imaginary[m] + ((cosine * imaginary - sine * real) >> 15)) >>
            1,
    };
}

static uint32_t power_of(uint32_t n) {
    struct line line = line_of(n);
    return (uint32_t)(line.real * line.real) + (uint32_t)(line.imaginary * line.imaginary);
}

static uint8_t quarter_log2(uint32_t power)  // 4 log2
{
    uint8_t level = 0;
    for (; power >= 64; power >>= 3) level = (uint8_t)(level + 12);
    for (; power >= 8; power >>= 1) level = (uint8_t)(level + 4);
    return (uint8_t)(level + power);
}

static void note_weakest_power(struct calibration_pass* pass, uint32_t n) {
    uint8_t level = quarter_log2(power_of(n));
    if (pass->spectra == 0 || level < pass->line[n]) pass->line[n] = level;
    if (n == FIRST_LINE ||
        (n > FIRST_LINE && n < CALIBRATION_LINES - 2 && pass->line[n] > pass->line[work.strongest]))
        work.strongest = n;
}

// The line that stays, and where it lies in this burst: with a Hann window its neighbour is (1 + d)
// / (2 - d) of it at d lines off.
static bool find_vibration(void) {
    uint32_t at = work.strongest;
    if (power_of(at + 1) > power_of(at))
        at++;
    else if (power_of(at - 1) > power_of(at))
        at--;
    uint32_t beside = power_of(at + 1) > power_of(at - 1) ? at + 1 : at - 1;
    struct line line = line_of(at), next = line_of(beside);
    int64_t both = (int64_t)line.real * next.real + (int64_t)line.imaginary * next.imaginary,
            power = power_of(at);
    if (power == 0) return false;
    int64_t share = -both * 65536 / power;
    int32_t ratio = share < 0 ? 0 : share > 65536 ? 65536 : (int32_t)share;
    int32_t away = (2 * ratio - 65536) * 16384 / (65536 + ratio) * 4;
    uint32_t vibration = (uint32_t)((int32_t)(at * 65536) + (beside > at ? away : -away));
    if (vibration < SLOWEST) return false;
    work.vibration = vibration;
    return true;
}

static void begin_second_reading(struct calibration* calibration) {
    work.power = 0;
    begin_reading();
    begin_stage(SECOND_READING);
    calibration->need = CALIBRATION_NEEDS_WORDS;
}

// The four mirrored bins become what the cosines of even and odd orders see of them, then the
// sines.
static void fold_bins(uint32_t n) {
    for (uint32_t i = 0; i < 3; i++) {
        int32_t *seen = work.seen[i], *a = &seen[n], *b = &seen[BINS / 2 - 1 - n],
                *c = &seen[BINS / 2 + n], *d = &seen[BINS - 1 - n];
        int32_t even = *a + *d, uneven = *a - *d, opposite_even = *b + *c,
                opposite_uneven = *c - *b;
        *a = even + opposite_even;
        *b = even - opposite_even;
        *c = uneven + opposite_uneven;
        *d = uneven - opposite_uneven;
    }
}

static void project_bins(uint32_t n) {
    uint32_t order = work.order + 1, point = order * (n * (512 / BINS) + 256 / BINS);
    uint32_t at[2] = {order % 2 ? BINS / 2 - 1 - n : n, order % 2 ? BINS - 1 - n : BINS / 2 + n};
    int32_t waves[2] = {cosine_at(point), sine_at(point)};
    for (uint32_t i = 0; i < 3; i++)
        for (uint32_t j = 0; j < 2; j++)
            work.projected[i][j] += (int64_t)work.seen[i][at[j]] * waves[j];
}

// What the vibration takes of an order: its two sidebands, each as far as it shows in the mean of a
// block.
static int64_t lost_to_vibration(int32_t order) {
    int32_t step = (int32_t)(work.vibration / CALIBRATION_PHASES),
            own = order * (work.travel / (int32_t)(CALIBRATION_PHASES - 1));
    int64_t cosine[2], sine[2], lost = 0;
    for (uint32_t j = 0; j < 2; j++) {
        cosine[j] = work.projected[1][j] >> 27;
        sine[j] = work.projected[2][j] >> 27;
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

static void add_order(struct calibration* calibration, uint32_t k) {
    struct calibration_pass* pass = &calibration->pass;
    int64_t cosine = work.projected[0][0] >> 25, sine = work.projected[0][1] >> 25;  // 2^-24 period
    int64_t retained = 32768 - lost_to_vibration((int32_t)k + 1);
    if (retained < 0) retained = 0;
    pass->information[k] += (int32_t)(work.weight * retained >> 15);
    pass->cosine[k] +=
        (int32_t)(work.weight * (cosine + (retained * work.candidate.cosine[k] >> 15)) >> 12);
    pass->sine[k] +=
        (int32_t)(work.weight * (sine + (retained * work.candidate.sine[k] >> 15)) >> 12);
    if (pass->bursts < FEWEST_BURSTS) return;  // still far from what it will be
    cosine = work.weight * cosine >> 15;
    sine = work.weight * sine >> 15;
    pass->squares += cosine * cosine + sine * sine;
}

static void update_order(const struct calibration* calibration, uint32_t k, bool sine) {
    const struct calibration_pass* pass = &calibration->pass;
    int32_t* value = sine ? &work.candidate.sine[k] : &work.candidate.cosine[k];
    if (pass->bursts < FEWEST_BURSTS || pass->information[k] < LEAST_INFORMATION) return;
    *value = clamp((int64_t)(sine ? pass->sine[k] : pass->cosine[k]) * 4096 / pass->information[k],
                   1 << 21);
}

// ---- the whole

static void reject(struct calibration* calibration, enum calibration_reason reason) {
    calibration->reason = (uint8_t)reason;
    calibration->refused++;
}

static void begin_pass(struct calibration* calibration) {
    calibration->pass = (struct calibration_pass){0};
    calibration->need = CALIBRATION_NEEDS_PHASES;
}

static void release_work(const struct calibration* calibration)  // the work area
{
    if (work.owner == calibration) work.owner = 0;
}

void calibration_forget(struct calibration* calibration) {
    calibration->values = calibration_identity;
    calibration->harmonics = false;
    calibration->complete = false;
    release_work(calibration);
    calibration_ellipse_start(&calibration->ellipse);
    calibration->reason = calibration->frozen ? CALIBRATION_FROZEN : CALIBRATION_RUNNING;
    calibration->need = CALIBRATION_NEEDS_LOADING;
}

void calibration_start(struct calibration* calibration) {
    if (wave[128] == 0) {  // once for all axes
        fill_wave();
        fill_motion();
    }
    release_work(calibration);
    *calibration =
        (struct calibration){.amplitude_high = UINT16_MAX, .scatter_limit = SCATTER_LIMIT};
    calibration_forget(calibration);
}

bool calibration_values_fit(const struct calibration_values* values) {
    bool fit = values->gain >= 32768 && values->gain < 131072 &&
               size_of(values->quadrature_error) <= 65536 && size_of(values->sin_offset) <= 16384 &&
               size_of(values->cos_offset) <= 16384;
    for (uint32_t k = 0; k < CALIBRATION_ORDERS; k++)
        fit = fit && size_of(values->cosine[k] / 2) <= 1 << 20 &&
              size_of(values->sine[k] / 2) <= 1 << 20;
    return fit;
}

bool calibration_restore(struct calibration* calibration, const struct calibration_values* values) {
    if (!calibration_values_fit(values)) return false;
    release_work(calibration);
    calibration->values = *values;
    calibration->harmonics = true;
    calibration->complete = true;
    calibration->reason = calibration->frozen ? CALIBRATION_FROZEN : CALIBRATION_RUNNING;
    calibration->need = CALIBRATION_NEEDS_LOADING;
    return true;
}

// Go on with what comes after the values in force.
static void begin_next(struct calibration* calibration) {
    release_work(calibration);
    if (calibration->frozen) {
        calibration->need = CALIBRATION_NEEDS_NOTHING;
    } else if (calibration->harmonics) {
        begin_pass(calibration);
    } else {
        calibration_ellipse_start(&calibration->ellipse);
        calibration->need = CALIBRATION_NEEDS_SAMPLES;
    }
}

void calibration_freeze(struct calibration* calibration, bool frozen) {
    calibration->frozen = frozen;
    calibration->reason = frozen ? CALIBRATION_FROZEN : CALIBRATION_RUNNING;
    if (calibration->need != CALIBRATION_NEEDS_LOADING)
        begin_next(calibration);  // what is in force is loaded even so
}

void calibration_loaded(struct calibration* calibration) {
    if (calibration->need == CALIBRATION_NEEDS_LOADING) begin_next(calibration);
}

static void end_burst(struct calibration* calibration, enum calibration_need need) {
    calibration->need = (uint8_t)need;
    release_work(calibration);
}

static void accept(struct calibration* calibration) {
    calibration->reason = CALIBRATION_RUNNING;
    calibration->accepted++;
    end_burst(calibration, CALIBRATION_NEEDS_LOADING);
}

// What was collected of the ellipse is lost with a burst that is refused; bursts of phases stand
// each for itself.
static void refuse_burst(struct calibration* calibration, enum calibration_reason reason) {
    reject(calibration, reason);
    if (!calibration->harmonics) calibration_ellipse_start(&calibration->ellipse);
    end_burst(calibration,
              calibration->harmonics ? CALIBRATION_NEEDS_PHASES : CALIBRATION_NEEDS_SAMPLES);
}

bool calibration_open(struct calibration* calibration, uint16_t every, bool spoiled) {
    if (work.owner && work.owner != calibration) return false;
    if (calibration->need != CALIBRATION_NEEDS_SAMPLES &&
        calibration->need != CALIBRATION_NEEDS_PHASES)
        return false;
    work.owner = calibration;
    work.every = every;
    work.candidate = calibration->values;
    work.vibration = 0;
    begin_reading();
    begin_stage(UPDATE);
    if (spoiled)
        refuse_burst(calibration, CALIBRATION_AMPLITUDE);
    else
        calibration->need =
            calibration->harmonics ? CALIBRATION_NEEDS_WORK : CALIBRATION_NEEDS_WORDS;
    return true;
}

static void end_of_samples(struct calibration* calibration) {
    if (calibration->ellipse.count < CALIBRATION_ELLIPSE_BURSTS * CALIBRATION_BURST) {
        end_burst(calibration, CALIBRATION_NEEDS_SAMPLES);
        return;
    }
    enum calibration_reason reason = check_ellipse(&calibration->ellipse, &work.fit);
    begin_stage(SOLVE_ELLIPSE);
    calibration->need = CALIBRATION_NEEDS_WORK;
    if (reason != CALIBRATION_RUNNING) refuse_burst(calibration, reason);
}

static void end_of_first_reading(struct calibration* calibration) {
    enum calibration_reason reason = check_burst();
    if (reason != CALIBRATION_RUNNING) {
        refuse_burst(calibration, reason);
        return;
    }
    begin_solve(3);
    calibration->need = CALIBRATION_NEEDS_WORK;
}

static void end_of_second_reading(struct calibration* calibration) {
    int64_t square = work.power >> 17;
    work.weight = square <= QUIET ? 32768 : QUIET * INT64_C(32768) / square;
    work.order = 0;
    begin_stage(FOLD);
    calibration->need = CALIBRATION_NEEDS_WORK;
}

void calibration_take(struct calibration* calibration, const uint32_t words[CALIBRATION_WORDS]) {
    if (calibration->need != CALIBRATION_NEEDS_WORDS) return;
    if (!calibration->harmonics) {
        calibration_ellipse_take(&calibration->ellipse, calibration, words[0]);
        if (++work.taken == CALIBRATION_BURST) end_of_samples(calibration);
    } else if (work.stage == SECOND_READING) {
        take_second(words);
        if (work.taken == CALIBRATION_PHASES) end_of_second_reading(calibration);
    } else {
        take_first(words);
        if (work.taken == CALIBRATION_PHASES) end_of_first_reading(calibration);
    }
}

static void end_of_ellipse(struct calibration* calibration) {
    enum calibration_reason reason = accept_ellipse(work.fit.solution, &calibration->values);
    if (reason == CALIBRATION_RUNNING) {
        calibration->harmonics = true;
        accept(calibration);
    } else {
        refuse_burst(calibration, reason);
    }
}

static void begin_burst(struct calibration* calibration) {
    begin_reading();
    for (uint32_t i = 0; i < 5; i++) work.right[i] = work.across[0][i] = work.across[1][i] = 0;
    begin_stage(FIRST_READING);
    calibration->need = CALIBRATION_NEEDS_WORDS;
}

static void end_of_spectrum(struct calibration* calibration) {
    struct calibration_pass* pass = &calibration->pass;
    pass->every = work.every;
    if (pass->spectra < UINT8_MAX) pass->spectra++;
    begin_stage(pass->spectra >= FEWEST_SPECTRA ? FIND : CLEAR);
}

static void end_of_projection(struct calibration* calibration) {
    struct calibration_pass* pass = &calibration->pass;
    uint32_t gone = (uint32_t)size_of(work.travel);
    if (calibration->reason < CALIBRATION_ONE_SPEED)
        calibration->reason =
            CALIBRATION_RUNNING;  // what a pass was refused for stands until one is good
    if (pass->bursts == 0 || gone < pass->slowest) pass->slowest = gone;
    if (pass->bursts == 0 || gone > pass->fastest) pass->fastest = gone;
    begin_stage(UPDATE);
    if (++pass->bursts < CALIBRATION_PASS) end_burst(calibration, CALIBRATION_NEEDS_PHASES);
}

static void end_of_pass(struct calibration* calibration) {
    const struct calibration_pass* pass = &calibration->pass;
    enum calibration_reason reason = CALIBRATION_RUNNING;
    int32_t most = 0, least = INT32_MAX;
    for (uint32_t k = 0; k < CALIBRATION_ORDERS; k++) {
        if (pass->information[k] > most) most = pass->information[k];
        if (pass->information[k] < least) least = pass->information[k];
    }
    int64_t square = least < LEAST_INFORMATION
                         ? INT64_MAX
                         : pass->squares / least * (1 << 22) / least;  // 2^-40 period^2
    calibration->scatter = (uint32_t)root_of(square);
    if ((uint64_t)pass->fastest * 8 < (uint64_t)pass->slowest * 9)
        reason = CALIBRATION_ONE_SPEED;
    else if (least < most / 4 || calibration->scatter > calibration->scatter_limit)
        reason = CALIBRATION_VIBRATION;
    else if (!calibration_values_fit(&work.candidate))
        reason = CALIBRATION_DISTORTED;
    if (reason == CALIBRATION_RUNNING) {
        calibration->values = work.candidate;
        calibration->complete = true;
        accept(calibration);
    } else {
        reject(calibration, reason);
        release_work(calibration);
        begin_pass(calibration);
    }
}

void calibration_work(struct calibration* calibration) {
    if (calibration->need != CALIBRATION_NEEDS_WORK) return;
    struct calibration_pass* pass = &calibration->pass;
    uint32_t next = work.next++;
    enum solve_state state = SOLVE_BUSY;
    switch (work.stage) {
    case UPDATE:
        update_order(calibration, next / 2, next % 2);
        if (next < 2 * CALIBRATION_ORDERS - 1) break;
        begin_stage(TABLE);
        if (pass->bursts == CALIBRATION_PASS) end_of_pass(calibration);
        break;
    case TABLE:
        fill_table(next);
        if (next == QUARTER - 1) begin_burst(calibration);
        break;
    case FIT:
        for (uint32_t n = 0; n < TOGETHER; n++) fit_block(next * TOGETHER + n);
        if (next == BLOCKS / TOGETHER - 1) begin_solve(5);
        break;
    case SOLVE:
        state = solve(&work.fit);
        if (state == SOLVE_ILL)
            refuse_burst(calibration, CALIBRATION_UNSTEADY);
        else if (state == SOLVE_DONE)
            begin_stage(work.fit.size == 3 ? RESIDUAL : CLEAR);
        break;
    case RESIDUAL:
        for (uint32_t n = 0; n < TOGETHER; n++) window_block(next * TOGETHER + n);
        if (next == BLOCKS / TOGETHER - 1) begin_stage(TRANSFORM);
        break;
    case TRANSFORM:
        for (uint32_t n = 0; n < TOGETHER; n++) butterfly(next * TOGETHER + n);
        if (next == LEVELS * PAIRS / TOGETHER - 1) begin_stage(SPECTRUM);
        break;
    case SPECTRUM:
        if (work.every != pass->every) pass->spectra = 0;
        for (uint32_t n = 0; n < TOGETHER; n++) note_weakest_power(pass, next * TOGETHER + n);
        if (next == CALIBRATION_LINES / TOGETHER - 1) end_of_spectrum(calibration);
        break;
    case FIND:
        if (find_vibration())
            begin_fit();
        else
            begin_stage(CLEAR);
        break;
    case CLEAR:
        for (uint32_t i = 0; i < 3; i++)
            for (uint32_t n = 0; n < TOGETHER; n++) work.seen[i][next * TOGETHER + n] = 0;
        if (next == BINS / TOGETHER - 1) begin_second_reading(calibration);
        break;
    case FOLD:
        fold_bins(next);
        if (next == QUARTER - 1) begin_stage(PROJECT);
        break;
    case PROJECT:
        if (next == 0)
            for (uint32_t i = 0; i < 3; i++) work.projected[i][0] = work.projected[i][1] = 0;
        for (uint32_t n = 0; n < TOGETHER; n++) project_bins(next * TOGETHER + n);
        if (next < QUARTER / TOGETHER - 1) break;
        add_order(calibration, work.order++);
        begin_stage(PROJECT);
        if (work.order == CALIBRATION_ORDERS) end_of_projection(calibration);
        break;
    case SOLVE_ELLIPSE:
        state = solve(&work.fit);
        if (state == SOLVE_ILL)
            refuse_burst(calibration, CALIBRATION_PARTIAL_CIRCLE);
        else if (state == SOLVE_DONE)
            begin_stage(TAKE_ELLIPSE);
        break;
    case TAKE_ELLIPSE: end_of_ellipse(calibration); break;
    default: break;
    }
}
