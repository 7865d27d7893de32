// SPDX-License-Identifier: Apache-2.0
// learner -- offset, gain, phase and harmonics of a sine/cosine signal, learned in motion (docs/interpolation.md).
//
// Ellipse: least squares of x^2 + y^2 on 1, x, y, x^2 - y^2, 2xy. Exact without noise for any ellipse and any spread of the
// samples, and the equations stay well conditioned as long as the whole circle was seen.
// Harmonics: on smooth motion every place of the period is as frequent as every other. If place = phase - c(phase), phases are as
// frequent as 1 - c'(phase) says, and the mean of exp(-i m phase) is -i m c_m, not only for small c: the correction is read off the
// phases as they are. A burst weighs them by a Hann window, so that it needs no whole number of periods. Each order of a pass is the
// mean of those bursts that lie within three median distances of the median: a vibration that meets an order does so in few.
#include "learner.h"

#define UNIT ((int64_t)1 << 28)             // 1 of the equations
#define STEEPEST (4 * UNIT)                 // largest factor of an elimination
#define SMALLEST (UNIT >> 16)               // smallest pivot
#define LOUDEST (UNIT + UNIT / 4)           // mean of x^2 + y^2
#define LARGEST_CORRECTION 0x1FFFF          // the 18 bits of harmonic_correction
#define SCATTER_LIMIT 64                    // 4 LSB of a 16-bit phase
#define PARTS 16                            // of a burst, for its steadiness
#define FEWEST_PERIODS 8                    // in a burst of phases

const struct learner_values learner_identity = {.gain = 65536};

static uint16_t quarter[257];               // sine of the first quarter, 1.0 = 2^15

static void fill_quarter(void)
{
    int64_t sine = 0, cosine = 1 << 30;
    for (int n = 0; n <= 256; n++) {
        quarter[n] = (uint16_t)((sine + (1 << 14)) >> 15);
        int64_t next = (sine * 1073721611 + cosine * 6588356 + (1 << 29)) >> 30;        // turn by pi / 512
        cosine = (cosine * 1073721611 - sine * 6588356 + (1 << 29)) >> 30;
        sine = next;
    }
}

static int32_t sine_of(uint32_t phase)      // one period = 2^16
{
    uint32_t point = (phase + 32) >> 6, in_quarter = point & 255;
    int32_t size = quarter[point & 256 ? 256 - in_quarter : in_quarter];
    return point & 512 ? -size : size;
}

static int32_t cosine_of(uint32_t phase)
{
    return sine_of(phase + 16384);
}

static int32_t clamp(int64_t value, int32_t limit)
{
    return value > limit ? limit : value < -limit ? -limit : (int32_t)value;
}

static int32_t size_of(int32_t value)
{
    return value < 0 ? -value : value;
}

static int64_t root_of(int64_t square)
{
    uint64_t root = 0;
    for (uint64_t bit = (uint64_t)1 << 31; bit; bit >>= 1)
        if ((root + bit) * (root + bit) <= (uint64_t)square) root += bit;
    return (int64_t)root;
}

const char *learner_words(enum learner_reason reason)
{
    static const char *const words[LEARNER_REASONS] = {
        [LEARNER_LEARNING] = "learning",
        [LEARNER_FROZEN] = "frozen",
        [LEARNER_STANDSTILL] = "the scale stands still",
        [LEARNER_PARTIAL_CIRCLE] = "too little motion: no whole circles",
        [LEARNER_AMPLITUDE] = "amplitude outside its window",
        [LEARNER_DISTORTED] = "offset, gain or phase farther off than can be corrected",
        [LEARNER_TOO_FAST] = "fewer than eight samples a period",
        [LEARNER_UNSTEADY] = "the speed changes too much",
        [LEARNER_ONE_SPEED] = "all at one speed: a vibration locked to the fringe would not show",
        [LEARNER_VIBRATION] = "vibration locked to the fringe: the bursts disagree",
    };
    return reason < LEARNER_REASONS ? words[reason] : "unknown";
}

// ---- the ellipse

void learner_ellipse_start(struct learner_ellipse *ellipse)
{
    *ellipse = (struct learner_ellipse){.lowest = {INT16_MAX, INT16_MAX}, .highest = {INT16_MIN, INT16_MIN}};
}

void learner_ellipse_take(struct learner_ellipse *ellipse, const struct learner *learner, uint32_t word)
{
    int32_t cosine = (int16_t)(word >> 16), sine = (int16_t)word;
    int32_t x = (cosine + 4) >> 3, y = (sine + 4) >> 3;                     // 13 bits: the sums of 4096 samples fit
    int32_t low = learner->amplitude_low >> 3, high = learner->amplitude_high >> 3;
    int32_t base[6] = {1, x, y, x * x - y * y, 2 * x * y, x * x + y * y};
    int32_t leg[2] = {x, y};
    for (int i = 0; i < 5; i++)
        for (int j = i; j < 6; j++) ellipse->sum[i][j] += (int64_t)base[i] * base[j];
    for (int i = 0; i < 2; i++) {
        if (leg[i] < ellipse->lowest[i]) ellipse->lowest[i] = leg[i];
        if (leg[i] > ellipse->highest[i]) ellipse->highest[i] = leg[i];
    }
    if (base[5] < low * low || base[5] > (int64_t)high * high) ellipse->outside++;
    x = cosine - learner->values.cos_offset;
    y = sine - learner->values.sin_offset;
    int32_t along = size_of(x), across = size_of(y);
    bool steep = along < across, middle = steep ? along * 12 > across * 5 : across * 12 > along * 5;        // 5/12: tan 22.6 degrees
    ellipse->sector[(x < 0) + 2 * (y < 0) + 4 * steep + 8 * middle]++;
    ellipse->count++;
}

// Elimination without exchange of rows: symmetric and positive. false: not well conditioned.
static bool solve(int64_t m[5][6], int64_t solution[5])
{
    for (int i = 0; i < 5; i++) {
        if (m[i][i] < SMALLEST) return false;
        for (int j = i + 1; j < 5; j++) {
            int64_t factor = m[i][j] * UNIT / m[i][i];
            if (factor > STEEPEST || factor < -STEEPEST) return false;
            for (int k = j; k < 6; k++) m[j][k] -= (factor * m[i][k]) >> 28;
        }
    }
    for (int i = 4; i >= 0; i--) {
        int64_t rest = m[i][5];
        for (int j = i + 1; j < 5; j++) rest -= (m[i][j] * solution[j]) >> 28;
        solution[i] = rest * 16 / m[i][i] * (UNIT / 16);                    // coarse, then the remainder: both fit 64 bits
        solution[i] += (rest * 16 % m[i][i]) * (UNIT / 16) / m[i][i];
        if (solution[i] > STEEPEST || solution[i] < -STEEPEST) return false;
    }
    return true;
}

enum learner_reason learner_ellipse_fit(const struct learner_ellipse *ellipse, struct learner_values *values)
{
    static const uint8_t degree[6] = {0, 1, 1, 2, 2, 2};
    int64_t m[5][6] = {{0}}, s[5];
    int64_t count = ellipse->count;
    if (count == 0) return LEARNER_PARTIAL_CIRCLE;
    for (int i = 0; i < 5; i++)
        for (int j = i; j < 6; j++) {                                       // the mean, full scale 1
            int64_t sum = ellipse->sum[i][j];
            switch (degree[i] + degree[j]) {
            case 0: sum *= UNIT; break;
            case 1: sum *= 1 << 16; break;
            case 2: sum *= 1 << 4; break;
            case 3: sum >>= 8; break;
            default: sum >>= 20; break;
            }
            m[i][j] = sum / count;
        }
    int64_t mean_square = m[0][5];
    if (ellipse->outside * 16 > ellipse->count || mean_square > LOUDEST) return LEARNER_AMPLITUDE;
    int64_t eighth = root_of(mean_square * UNIT) >> 19;                     // of the amplitude, in units of x
    if (ellipse->highest[0] - ellipse->lowest[0] < eighth && ellipse->highest[1] - ellipse->lowest[1] < eighth) return LEARNER_STANDSTILL;
    for (int n = 0; n < 16; n++)
        if (ellipse->sector[n] < ellipse->count / 128 || (ellipse->sector[n] + ellipse->sector[n ^ 8]) * 64 < ellipse->count)
            return LEARNER_PARTIAL_CIRCLE;
    if (!solve(m, s)) return LEARNER_PARTIAL_CIRCLE;

    int64_t b = s[1], c = s[2], p = UNIT - s[3], q = UNIT + s[3], e = s[4];  // p x^2 + q y^2 - 2 e xy - b x - c y = s[0]
    if (p < UNIT / 4 || q < UNIT / 4) return LEARNER_DISTORTED;
    int64_t determinant = (p * q - e * e) >> 28;
    if (determinant < UNIT / 4) return LEARNER_DISTORTED;
    int64_t root = root_of(determinant * UNIT);
    int64_t x = ((q * b + e * c) / determinant) >> 1, y = ((p * c + e * b) / determinant) >> 1;
    struct learner_values fit = *values;
    fit.cos_offset = (int16_t)clamp((x + (1 << 12)) >> 13, INT16_MAX);
    fit.sin_offset = (int16_t)clamp((y + (1 << 12)) >> 13, INT16_MAX);
    fit.gain = (int32_t)((q * 65536 + root / 2) / root);
    fit.shear = (int32_t)(-(e * 65536) / root);
    if (!learner_values_fit(&fit)) return LEARNER_DISTORTED;
    *values = fit;
    return LEARNER_LEARNING;
}

// ---- the harmonics

int32_t learner_table_entry(const struct learner_values *values, uint32_t point)
{
    int64_t sum = 0;
    for (uint32_t k = 0; k < LEARNER_ORDERS; k++) {
        uint32_t phase = (k + 1) * point * (65536 / LEARNER_POINTS);
        sum += (int64_t)values->cosine[k] * cosine_of(phase) + (int64_t)values->sine[k] * sine_of(phase);
    }
    return clamp((sum + (1 << 18)) >> 19, LARGEST_CORRECTION);
}

static void begin_burst(struct learner *learner)
{
    learner->taken = 0;
    learner->travel = 0;
    learner->part = 0;
    learner->slowest = INT32_MAX;
    learner->fastest = INT32_MIN;
    learner->largest_step = 0;
    for (uint32_t k = 0; k < LEARNER_ORDERS; k++) learner->real[k] = learner->imaginary[k] = 0;
}

static void take_phase(struct learner *learner, uint16_t phase)
{
    if (learner->taken) {
        int32_t step = (int16_t)(phase - learner->last);
        learner->travel += step;
        if (size_of(step) > learner->largest_step) learner->largest_step = size_of(step);
    }
    learner->last = phase;
    int32_t window = (32768 - cosine_of(learner->taken * (65536 / LEARNER_PHASES) + 32768 / LEARNER_PHASES)) >> 2;
    for (uint32_t k = 0; k < LEARNER_ORDERS; k++) {
        uint32_t multiple = (k + 1) * phase;
        learner->real[k] += (window * cosine_of(multiple)) >> 10;
        learner->imaginary[k] += (window * sine_of(multiple)) >> 10;
    }
    learner->taken++;
    if (learner->taken % (LEARNER_PHASES / PARTS) == 0) {
        int32_t gone = learner->travel - learner->part;
        learner->part = learner->travel;
        if (gone < learner->slowest) learner->slowest = gone;
        if (gone > learner->fastest) learner->fastest = gone;
    }
}

static enum learner_reason judge_burst(const struct learner *learner)
{
    int32_t travel = learner->travel, slowest = learner->slowest, fastest = learner->fastest;
    if (learner->spoiled) return LEARNER_AMPLITUDE;
    if (learner->largest_step > 8192) return LEARNER_TOO_FAST;
    if (size_of(travel) < 65536 / 4 && fastest < 65536 / 4 && slowest > -65536 / 4) return LEARNER_STANDSTILL;
    if (size_of(travel) < FEWEST_PERIODS * 65536) return LEARNER_PARTIAL_CIRCLE;
    if (travel < 0) {
        slowest = -learner->fastest;
        fastest = -learner->slowest;
    }
    return slowest <= 0 || fastest > 2 * slowest ? LEARNER_UNSTEADY : LEARNER_LEARNING;
}

static void keep_burst(struct learner *learner)
{
    uint32_t gone = (uint32_t)size_of(learner->travel);
    if (learner->bursts == 0 || gone < learner->slow_burst) learner->slow_burst = gone;
    if (learner->bursts == 0 || gone > learner->fast_burst) learner->fast_burst = gone;
    for (uint32_t k = 0; k < LEARNER_ORDERS; k++) {                         // 2 / (k + 1) radian = 2^20 / pi / (k + 1); 2^29 is 1
        int64_t size = (int64_t)(k + 1) << 29;
        learner->seen_cosine[k][learner->bursts] = (int16_t)clamp(learner->imaginary[k] * INT64_C(333772) / size, INT16_MAX);
        learner->seen_sine[k][learner->bursts] = (int16_t)clamp(-(learner->real[k] * INT64_C(333772)) / size, INT16_MAX);
    }
    learner->bursts++;
}

static int64_t median(const int64_t *value, uint32_t count)
{
    int64_t sorted[LEARNER_PASS] = {0};
    for (uint32_t n = 0; n < count; n++) {
        uint32_t at = n;
        for (; at && sorted[at - 1] > value[n]; at--) sorted[at] = sorted[at - 1];
        sorted[at] = value[n];
    }
    return sorted[count / 2];
}

// What the bursts of a pass say of one order.
static void take_order(struct learner *learner, uint32_t k)
{
    const uint32_t count = LEARNER_PASS;
    uint32_t good = 0;
    int64_t value[LEARNER_PASS] = {0}, cosine = 0, sine = 0, squares = 0;
    for (uint32_t n = 0; n < count; n++) value[n] = learner->seen_cosine[k][n];
    int64_t middle_cosine = median(value, count);
    for (uint32_t n = 0; n < count; n++) value[n] = learner->seen_sine[k][n];
    int64_t middle_sine = median(value, count);
    for (uint32_t n = 0; n < count; n++) {
        int64_t x = learner->seen_cosine[k][n] - middle_cosine, y = learner->seen_sine[k][n] - middle_sine;
        value[n] = x * x + y * y;
    }
    int64_t farthest = 9 * median(value, count) + 4;
    for (uint32_t n = 0; n < count; n++) {
        if (value[n] > farthest) continue;
        good++;
        cosine += learner->seen_cosine[k][n];
        sine += learner->seen_sine[k][n];
        squares += value[n];
    }
    int64_t x = cosine - good * middle_cosine, y = sine - good * middle_sine;
    learner->variance += (squares - (x * x + y * y) / good) / (good * (int64_t)(good - 1));
    learner->candidate.cosine[k] = (int32_t)(cosine * 16 / good);
    learner->candidate.sine[k] = (int32_t)(sine * 16 / good);
}

// ---- the whole

static void refuse(struct learner *learner, enum learner_reason reason)
{
    learner->reason = (uint8_t)reason;
    learner->refused++;
}

static void begin_pass(struct learner *learner)
{
    learner->candidate = learner->values;
    learner->bursts = 0;
    begin_burst(learner);
    learner->need = LEARNER_NEEDS_PHASES;
}

void learner_forget(struct learner *learner)
{
    learner->values = learner_identity;
    learner->harmonics = false;
    learner->settled = false;
    learner->bursts = 0;
    learner_ellipse_start(&learner->ellipse);
    learner->reason = learner->frozen ? LEARNER_FROZEN : LEARNER_LEARNING;
    learner->need = LEARNER_NEEDS_LOADING;
}

void learner_start(struct learner *learner)
{
    fill_quarter();
    *learner = (struct learner){.amplitude_high = UINT16_MAX, .scatter_limit = SCATTER_LIMIT};
    learner_forget(learner);
}

bool learner_values_fit(const struct learner_values *values)
{
    bool fit = values->gain >= 32768 && values->gain < 131072 && size_of(values->shear) <= 65536 && size_of(values->sin_offset) <= 16384
               && size_of(values->cos_offset) <= 16384;
    for (uint32_t k = 0; k < LEARNER_ORDERS; k++)
        fit = fit && size_of(values->cosine[k] / 2) <= 1 << 20 && size_of(values->sine[k] / 2) <= 1 << 20;
    return fit;
}

bool learner_restore(struct learner *learner, const struct learner_values *values)
{
    if (!learner_values_fit(values)) return false;
    learner->values = *values;
    learner->harmonics = true;
    learner->settled = true;
    learner->reason = learner->frozen ? LEARNER_FROZEN : LEARNER_LEARNING;
    learner->need = LEARNER_NEEDS_LOADING;
    return true;
}

// Go on with what comes after the values in force.
static void go_on(struct learner *learner)
{
    if (learner->frozen) {
        learner->need = LEARNER_NEEDS_NOTHING;
    } else if (learner->harmonics) {
        begin_pass(learner);
    } else {
        learner->bursts = 0;
        learner_ellipse_start(&learner->ellipse);
        learner->need = LEARNER_NEEDS_SAMPLES;
    }
}

void learner_freeze(struct learner *learner, bool frozen)
{
    learner->frozen = frozen;
    learner->reason = frozen ? LEARNER_FROZEN : LEARNER_LEARNING;
    if (learner->need != LEARNER_NEEDS_LOADING) go_on(learner);             // what is in force is loaded even so
}

void learner_loaded(struct learner *learner)
{
    if (learner->need == LEARNER_NEEDS_LOADING) go_on(learner);
}

void learner_open(struct learner *learner, bool spoiled)
{
    learner->spoiled = spoiled;
    begin_burst(learner);
}

static void accept(struct learner *learner)
{
    learner->reason = LEARNER_LEARNING;
    learner->accepted++;
    learner->need = LEARNER_NEEDS_LOADING;
}

static void end_of_samples(struct learner *learner)
{
    enum learner_reason reason = LEARNER_AMPLITUDE;
    if (!learner->spoiled && ++learner->bursts < LEARNER_ELLIPSE_BURSTS) return;
    if (!learner->spoiled) reason = learner_ellipse_fit(&learner->ellipse, &learner->values);
    if (reason == LEARNER_LEARNING) {
        learner->harmonics = true;
        accept(learner);
    } else {
        refuse(learner, reason);
        learner->bursts = 0;
        learner_ellipse_start(&learner->ellipse);
    }
}

static void end_of_phases(struct learner *learner)
{
    enum learner_reason reason = judge_burst(learner);
    if (reason != LEARNER_LEARNING) {
        refuse(learner, reason);
        return;
    }
    if (learner->reason < LEARNER_ONE_SPEED) learner->reason = LEARNER_LEARNING;    // what a pass was refused for stands until one is accepted
    keep_burst(learner);
    if (learner->bursts == LEARNER_PASS) {
        learner->step = 0;
        learner->variance = 0;
        learner->need = LEARNER_NEEDS_WORK;
    }
}

void learner_take(struct learner *learner, uint32_t word)
{
    bool samples = learner->need == LEARNER_NEEDS_SAMPLES;
    if (!samples && learner->need != LEARNER_NEEDS_PHASES) return;
    if (samples) {
        learner_ellipse_take(&learner->ellipse, learner, word);
        if (++learner->taken < LEARNER_BURST) return;
        end_of_samples(learner);
    } else {
        take_phase(learner, (uint16_t)word);
        take_phase(learner, (uint16_t)(word >> 16));
        if (learner->taken < LEARNER_PHASES) return;
        end_of_phases(learner);
    }
    begin_burst(learner);
}

// After the last order of a pass.
static void end_of_pass(struct learner *learner)
{
    learner->scatter = (uint32_t)root_of(learner->variance);
    enum learner_reason reason = LEARNER_LEARNING;
    if (learner->scatter > learner->scatter_limit) reason = LEARNER_VIBRATION;
    else if ((uint64_t)learner->fast_burst * 8 < (uint64_t)learner->slow_burst * 9) reason = LEARNER_ONE_SPEED;
    else if (!learner_values_fit(&learner->candidate)) reason = LEARNER_DISTORTED;
    if (reason == LEARNER_LEARNING) {
        learner->values = learner->candidate;
        learner->settled = true;
        accept(learner);
    } else {
        refuse(learner, reason);
        begin_pass(learner);
    }
}

void learner_work(struct learner *learner)
{
    if (learner->need != LEARNER_NEEDS_WORK) return;
    take_order(learner, learner->step);
    if (++learner->step == LEARNER_ORDERS) end_of_pass(learner);
}
