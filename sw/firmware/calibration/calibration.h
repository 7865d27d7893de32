// SPDX-License-Identifier: Apache-2.0
// calibration -- offset, gain, phase and harmonics of a sine/cosine signal, learned in motion
// without a reference. No hardware.
//
// The machine runs it like this, a few words or one piece of work a poll:
//   CALIBRATION_NEEDS_SAMPLES, _PHASES   let calibration_recorder fill, then calibration_open
//   CALIBRATION_NEEDS_WORDS              calibration_take for each sample of the burst, or each
//   four words of phases; phases are taken twice CALIBRATION_NEEDS_WORK calibration_work
//   CALIBRATION_NEEDS_LOADING            values into signal_correction, calibration_table_entry 0 …
//   255 into harmonic_correction, calibration_loaded
// All calibrations share one work area: while a burst is in it, calibration_open of the others
// answers "not yet".
#ifndef MOIRE_CALIBRATION_H
#define MOIRE_CALIBRATION_H

#include <stdbool.h>
#include <stdint.h>

#define CALIBRATION_ORDERS \
    10u  // of phase error: order k - 1 is harmonic k, order k + 1 harmonic -k; so +-2 … +-8 are
         // inside
#define CALIBRATION_POINTS 256u   // of the table of harmonic_correction
#define CALIBRATION_BURST 1024u   // words of calibration_recorder
#define CALIBRATION_WORDS 4u      // words of phases that are taken at once
#define CALIBRATION_PHASES 2048u  // phases in them
#define CALIBRATION_ELLIPSE_BURSTS 2u
#define CALIBRATION_PASS 39u     // bursts of phases
#define CALIBRATION_LINES 128u   // of the spectrum of a burst: 0 … 127 cycles in it
#define CALIBRATION_PERIODS 15u  // what a burst should cover; 8 at least

enum calibration_reason {  // why nothing is learned just now
    CALIBRATION_RUNNING,   // it is
    CALIBRATION_FROZEN,
    CALIBRATION_STANDSTILL,
    CALIBRATION_PARTIAL_CIRCLE,
    CALIBRATION_AMPLITUDE,
    CALIBRATION_DISTORTED,
    CALIBRATION_TOO_FAST,
    CALIBRATION_UNSTEADY,
    CALIBRATION_ONE_SPEED,
    CALIBRATION_VIBRATION,
    CALIBRATION_REASONS
};

enum calibration_need {
    CALIBRATION_NEEDS_NOTHING,  // frozen
    CALIBRATION_NEEDS_SAMPLES,  // a burst of {cos, sin}, 16 bits each, full scale 2^15
    CALIBRATION_NEEDS_PHASES,   // a burst of phases before harmonic_correction, two a word, the
                                // earlier one low
    CALIBRATION_NEEDS_WORDS,    // the burst that was opened, from its first word to its last
    CALIBRATION_NEEDS_WORK,
    CALIBRATION_NEEDS_LOADING  // there are new values
};

struct calibration_values {  // all that is learned: to be read, stored, restored
    int16_t sin_offset;      // 2^-15 of full scale
    int16_t cos_offset;
    int32_t gain;  // 2^-16; sin' = gain (sin - sin_offset) + quadrature_error (cos - cos_offset)
    int32_t quadrature_error;            // 2^-16
    int32_t cosine[CALIBRATION_ORDERS];  // 2^-24 period; phase' = phase - sum of cosine[k-1] cos k
                                         // phase + sine[k-1] sin k phase
    int32_t sine[CALIBRATION_ORDERS];
};

struct calibration_ellipse {  // sums over samples
    uint16_t count;           // at most 4096
    uint16_t outside;         // samples outside the amplitude window
    uint16_t sector[16];      // samples in each, about equal, of the circle
    int16_t lowest[2];        // cos, sin; 13 bits
    int16_t highest[2];
    int64_t sum[20];  // of products of 1, x, y, x^2 - y^2, 2xy with those from itself on and x^2 +
                      // y^2, in
};  // that order; x = cos, y = sin

struct calibration_pass {       // sums over bursts
    uint32_t slowest, fastest;  // |travel| of a burst, 2^-16 period
    uint16_t every;             // setting of the recorder, for which `line` holds
    uint8_t bursts;
    uint8_t spectra;                          // in `line`
    uint8_t line[CALIBRATION_LINES];          // weakest power of that line in any burst, 4 log2
    int32_t information[CALIBRATION_ORDERS];  // 2^-15 burst
    int32_t cosine[CALIBRATION_ORDERS];  // what each burst says times what it informs: 2^-27 period
    int32_t sine[CALIBRATION_ORDERS];
    int64_t squares;  // of weight times what a burst added, all orders, 2^-48 period^2
};

struct calibration {
    struct calibration_values values;  // in force
    uint16_t amplitude_low;            // the window, full scale 2^15
    uint16_t amplitude_high;
    uint16_t scatter_limit;  // largest standard error of what is learned, 2^-20 period
    uint8_t reason;          // a calibration_reason: of the last burst or pass
    uint8_t need;            // a calibration_need
    bool frozen;
    bool harmonics;     // passes of phases; else the ellipse is being learned
    bool complete;      // a pass has been accepted: all is learned
    uint32_t refused;   // bursts and passes, since start
    uint32_t accepted;  // ellipses and passes, since start
    uint32_t scatter;   // standard error of the last pass, 2^-20 period
    union {
        struct calibration_ellipse ellipse;
        struct calibration_pass pass;
    };
};

extern const struct calibration_values calibration_identity;  // corrects nothing

void calibration_start(struct calibration* calibration);  // from reset: nothing is known
void calibration_forget(
    struct calibration* calibration);  // the same, but window, limit and counters stay
bool calibration_restore(
    struct calibration* calibration,
    const struct calibration_values* values);  // false: out of range, nothing changed
void calibration_freeze(struct calibration* calibration, bool frozen);  // what is in force stays
bool calibration_values_fit(const struct calibration_values* values);

// A burst is recorded, one of `every` samples; spoiled: its amplitude left the window. false:
// another calibration is at work, ask again.
bool calibration_open(struct calibration* calibration, uint16_t every, bool spoiled);
void calibration_take(struct calibration* calibration,
                      const uint32_t words[CALIBRATION_WORDS]);  // a sample is in the first one
void calibration_work(struct calibration* calibration);    // one piece: some hundred instructions
void calibration_loaded(struct calibration* calibration);  // the hardware has the values in force

int32_t calibration_table_entry(const struct calibration_values* values,
                                uint32_t point);  // 2^-20 period

// The ellipse alone.
void calibration_ellipse_start(struct calibration_ellipse* ellipse);
void calibration_ellipse_take(struct calibration_ellipse* ellipse,
                              const struct calibration* calibration, uint32_t word);
enum calibration_reason calibration_ellipse_fit(const struct calibration_ellipse* ellipse,
                                                struct calibration_values* values);

#endif
