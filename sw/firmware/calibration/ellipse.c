// SPDX-License-Identifier: Apache-2.0
// ellipse -- offsets, gain and quadrature error of a sine/cosine signal, from its samples.
//
// Least squares of x^2 + y^2 on 1, x, y, x^2 - y^2, 2xy. Without noise it is exact for any ellipse
// and any spread of the samples, and the equations stay well conditioned as long as the whole
// circle was seen.
#include "calibration/ellipse.h"

#include "core/arithmetic.h"

#define LARGEST_SHAPE (4 * EQUATIONS_ONE)                        // solution of an ellipse
#define LARGEST_MEAN_SQUARE (EQUATIONS_ONE + EQUATIONS_ONE / 4)  // mean of x^2 + y^2

void ellipse_start(struct calibration_ellipse* ellipse) {
    *ellipse = (struct calibration_ellipse){.lowest = {INT16_MAX, INT16_MAX},
                                            .highest = {INT16_MIN, INT16_MIN}};
}

void ellipse_take(struct calibration_ellipse* ellipse, const struct calibration* calibration,
                  uint32_t word) {
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
    int32_t along = magnitude(x), across = magnitude(y);
    bool steep = along < across;
    int32_t shorter = steep ? along : across, longer = steep ? across : along;
    bool middle = shorter * 12 > longer * 5;  // above 22.6 degrees
    ellipse->sector[(x < 0) + 2 * (y < 0) + 4 * steep + 8 * middle]++;
    ellipse->count++;
}

enum bus_calibration_reason ellipse_equations(const struct calibration_ellipse* ellipse,
                                              struct equations* e) {
    static const uint8_t degree[6] = {0, 1, 1, 2, 2, 2};
    equations_begin(e, 5, LARGEST_SHAPE);
    int64_t count = ellipse->count;
    uint32_t shift = 0;
    if (count == 0) return BUS_CALIBRATION_REASON_PARTIAL_CIRCLE;
    // All sums are divided by the count, within a factor of 2: the solution does not depend on it.
    while (count >> shift > 1) shift++;
    const int64_t* sum = ellipse->sum;
    for (int i = 0; i < 5; i++)
        for (int j = i; j < 6; j++) {  // full scale becomes 1
            int up = 28 - 12 * (degree[i] + degree[j]);
            int64_t scaled = up > 0 ? *sum * (INT64_C(1) << up) : *sum >> -up;
            e->m[i][j] = scaled >> shift;
            sum++;
        }
    int64_t mean_square = e->m[0][5] * EQUATIONS_ONE / e->m[0][0];
    if (ellipse->outside * 16 > ellipse->count || mean_square > LARGEST_MEAN_SQUARE)
        return BUS_CALIBRATION_REASON_AMPLITUDE;
    // An eighth of the amplitude, in units of x.
    int64_t eighth = root((uint64_t)(mean_square * EQUATIONS_ONE)) >> 19;
    if (ellipse->highest[0] - ellipse->lowest[0] < eighth &&
        ellipse->highest[1] - ellipse->lowest[1] < eighth)
        return BUS_CALIBRATION_REASON_STANDSTILL;
    for (int n = 0; n < 16; n++)
        if (ellipse->sector[n] < ellipse->count / 128 ||
            (ellipse->sector[n] + ellipse->sector[n ^ 8]) * 64 < ellipse->count)
            return BUS_CALIBRATION_REASON_PARTIAL_CIRCLE;
    return BUS_CALIBRATION_REASON_CALIBRATING;
}

enum bus_calibration_reason ellipse_values(const int64_t solution[5],
                                           struct calibration_values* values) {
    // The ellipse is p x^2 + q y^2 - 2 e xy - b x - c y = solution[0].
    int64_t b = solution[1], c = solution[2], e = solution[4];
    int64_t p = EQUATIONS_ONE - solution[3], q = EQUATIONS_ONE + solution[3];
    if (p < EQUATIONS_ONE / 4 || q < EQUATIONS_ONE / 4) return BUS_CALIBRATION_REASON_DISTORTED;
    int64_t determinant = (p * q - e * e) >> 28;
    if (determinant < EQUATIONS_ONE / 4) return BUS_CALIBRATION_REASON_DISTORTED;
    int64_t root_of_determinant = root((uint64_t)(determinant * EQUATIONS_ONE));
    int64_t x = ((q * b + e * c) / determinant) >> 1, y = ((p * c + e * b) / determinant) >> 1;
    struct calibration_values fit = *values;
    fit.cos_offset = (int16_t)clamp((x + (1 << 12)) >> 13, INT16_MAX);
    fit.sin_offset = (int16_t)clamp((y + (1 << 12)) >> 13, INT16_MAX);
    fit.gain = (int32_t)((q * 65536 + root_of_determinant / 2) / root_of_determinant);
    fit.quadrature_error = (int32_t)(-(e * 65536) / root_of_determinant);
    if (!calibration_values_fit(&fit)) return BUS_CALIBRATION_REASON_DISTORTED;
    *values = fit;
    return BUS_CALIBRATION_REASON_CALIBRATING;
}

enum bus_calibration_reason ellipse_fit(const struct calibration_ellipse* ellipse,
                                        struct calibration_values* values) {
    struct equations e;
    enum bus_calibration_reason reason = ellipse_equations(ellipse, &e);
    if (reason != BUS_CALIBRATION_REASON_CALIBRATING) return reason;
    enum equations_state state = EQUATIONS_BUSY;
    while (state == EQUATIONS_BUSY) state = equations_step(&e);
    if (state == EQUATIONS_ILL) return BUS_CALIBRATION_REASON_PARTIAL_CIRCLE;
    return ellipse_values(e.solution, values);
}
