// SPDX-License-Identifier: Apache-2.0
// spectrum -- the spectrum of a burst, and the vibration of the machine in it.
//
// A complex transform of 128 points holds the 256 blocks, even ones real and odd ones imaginary.
// The lines of the harmonics move with the speed of the burst and those of a vibration do not: so
// of each line the weakest power in any burst of the pass is kept.
#include "calibration/spectrum.h"

#include "calibration/calibration_burst.h"
#include "calibration/waves.h"

#define PAIRS (POINTS / 2)  // of a level of the transform
#define LEVELS 7u           // of the transform
#define FIRST_LINE 2u       // a slower vibration counts as motion
#define SLOWEST (3u << 15)  // 1.5 cycles a burst, 2^-16 cycle

int32_t spectrum_window(uint32_t n) {
    return (32767 - cosine_at((2 * n + 1) * (256 / BLOCKS))) >> 1;
}

void spectrum_put(uint32_t n, int32_t residual) {
    uint32_t at = 0;
    for (uint32_t bit = 2; bit < BLOCKS; bit *= 2) at = at * 2 + (n & bit ? 1 : 0);
    int32_t* half = n % 2 ? burst.imaginary : burst.real;
    half[at] = (int32_t)((int64_t)residual * spectrum_window(n) >> 16);
}

// Halves what it adds, so that nothing grows.
static void butterfly(uint32_t n) {
    uint32_t level = n / PAIRS, half = 1u << level, in = n % half;
    uint32_t a = (n % PAIRS - in) * 2 + in, b = a + half, point = in << (8 - level);
    int32_t cosine = cosine_at(point), sine = sine_at(point);
    int32_t real = (cosine * burst.real[b] + sine * burst.imaginary[b]) >> 15;
    int32_t imaginary = (cosine * burst.imaginary[b] - sine * burst.real[b]) >> 15;
    burst.real[b] = (burst.real[a] - real) >> 1;
    burst.imaginary[b] = (burst.imaginary[a] - imaginary) >> 1;
    burst.real[a] = (burst.real[a] + real) >> 1;
    burst.imaginary[a] = (burst.imaginary[a] + imaginary) >> 1;
}

bool spectrum_transform(uint32_t next) {
    for (uint32_t n = 0; n < TOGETHER; n++) butterfly(next * TOGETHER + n);
    return next == LEVELS * PAIRS / TOGETHER - 1;
}

struct line {
    int32_t real, imaginary;
};

// A line of the spectrum, from the transforms of even and odd blocks.
static struct line line_of(uint32_t n) {
    uint32_t m = (POINTS - n) % POINTS;
    int32_t cosine = cosine_at(n * (512 / BLOCKS)), sine = sine_at(n * (512 / BLOCKS));
    int32_t real = burst.imaginary[n] + burst.imaginary[m],
            imaginary = burst.real[m] - burst.real[n];
    return (struct line){
        .real = (burst.real[n] + burst.real[m] + ((cosine * real + sine * imaginary) >> 15)) >> 1,
        .imaginary = (burst.imaginary[n] - burst.imaginary[m] +
                      ((cosine * imaginary - sine * real) >> 15)) >>
                     1,
    };
}

static uint32_t power_of(uint32_t n) {
    struct line line = line_of(n);
    return (uint32_t)(line.real * line.real) + (uint32_t)(line.imaginary * line.imaginary);
}

static uint8_t four_log2(uint32_t power) {
    uint8_t level = 0;
    for (; power >= 64; power >>= 3) level = (uint8_t)(level + 12);
    for (; power >= 8; power >>= 1) level = (uint8_t)(level + 4);
    return (uint8_t)(level + power);
}

static void keep_weakest(struct calibration_pass* pass, uint32_t n) {
    uint8_t level = four_log2(power_of(n));
    if (pass->spectra == 0 || level < pass->line[n]) pass->line[n] = level;
    if (n == FIRST_LINE || (n > FIRST_LINE && n < CALIBRATION_LINES - 2 &&
                            pass->line[n] > pass->line[burst.strongest]))
        burst.strongest = n;
}

bool spectrum_weakest_lines(struct calibration_pass* pass, uint32_t next) {
    for (uint32_t n = 0; n < TOGETHER; n++) keep_weakest(pass, next * TOGETHER + n);
    return next == CALIBRATION_LINES / TOGETHER - 1;
}

// With a Hann window the line beside the vibration is (1 + d) / (2 - d) of the line next to it,
// where d is the distance from that line.
bool spectrum_find_vibration(void) {
    uint32_t at = burst.strongest;
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
    burst.vibration = vibration;
    return true;
}
