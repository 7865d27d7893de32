// SPDX-License-Identifier: Apache-2.0
// learner -- offset, gain, phase and harmonics of a sine/cosine signal, learned in motion without a reference. No hardware.
//
// The machine runs it like this, a few words or one piece of work a poll:
//   LEARNER_NEEDS_SAMPLES, _PHASES   let learner_recorder fill, then learner_open
//   LEARNER_NEEDS_WORDS              learner_take for each sample of the burst, or each four words of phases; phases are taken twice
//   LEARNER_NEEDS_WORK               learner_work
//   LEARNER_NEEDS_LOADING            values into signal_correction, learner_table_entry 0 … 255 into harmonic_correction, learner_loaded
// All learners share one work area: while a burst is in it, learner_open of the others answers "not yet".
#ifndef MOIRE_LEARNER_H
#define MOIRE_LEARNER_H

#include <stdbool.h>
#include <stdint.h>

#define LEARNER_ORDERS 10u              // of phase error: order k - 1 is harmonic k, order k + 1 harmonic -k; so +-2 … +-8 are inside
#define LEARNER_POINTS 256u             // of the table of harmonic_correction
#define LEARNER_BURST 1024u             // words of learner_recorder
#define LEARNER_WORDS 4u                // words of phases that are taken at once
#define LEARNER_PHASES 2048u            // phases in them
#define LEARNER_ELLIPSE_BURSTS 2u
#define LEARNER_PASS 39u                // bursts of phases
#define LEARNER_LINES 128u              // of the spectrum of a burst: 0 … 127 cycles in it
#define LEARNER_PERIODS 15u             // what a burst should cover; 8 at least

enum learner_reason {                   // why nothing is learned just now
    LEARNER_LEARNING,                   // it is
    LEARNER_FROZEN,
    LEARNER_STANDSTILL,
    LEARNER_PARTIAL_CIRCLE,
    LEARNER_AMPLITUDE,
    LEARNER_DISTORTED,
    LEARNER_TOO_FAST,
    LEARNER_UNSTEADY,
    LEARNER_ONE_SPEED,
    LEARNER_VIBRATION,
    LEARNER_REASONS
};

enum learner_need {
    LEARNER_NEEDS_NOTHING,              // frozen
    LEARNER_NEEDS_SAMPLES,              // a burst of {cos, sin}, 16 bits each, full scale 2^15
    LEARNER_NEEDS_PHASES,               // a burst of phases before harmonic_correction, two a word, the earlier one low
    LEARNER_NEEDS_WORDS,                // the burst that was opened, from its first word to its last
    LEARNER_NEEDS_WORK,
    LEARNER_NEEDS_LOADING               // there are new values
};

struct learner_values {                 // all that is learned: to be read, stored, restored
    int16_t sin_offset;                 // 2^-15 of full scale
    int16_t cos_offset;
    int32_t gain;                       // 2^-16; sin' = gain (sin - sin_offset) + shear (cos - cos_offset)
    int32_t shear;                      // 2^-16
    int32_t cosine[LEARNER_ORDERS];     // 2^-24 period; phase' = phase - sum of cosine[k-1] cos k phase + sine[k-1] sin k phase
    int32_t sine[LEARNER_ORDERS];
};

struct learner_ellipse {                // sums over samples
    uint16_t count;                     // at most 4096
    uint16_t outside;                   // samples outside the amplitude window
    uint16_t sector[16];                // samples in each, about equal, of the circle
    int16_t lowest[2];                  // cos, sin; 13 bits
    int16_t highest[2];
    int64_t sum[20];                    // of products of 1, x, y, x^2 - y^2, 2xy with those from itself on and x^2 + y^2, in
};                                      // that order; x = cos, y = sin

struct learner_pass {                   // sums over bursts
    uint32_t slowest, fastest;          // |travel| of a burst, 2^-16 period
    uint16_t every;                     // setting of the recorder, for which `line` holds
    uint8_t bursts;
    uint8_t spectra;                    // in `line`
    uint8_t line[LEARNER_LINES];        // weakest power of that line in any burst, 4 log2
    int32_t information[LEARNER_ORDERS];            // 2^-15 burst
    int32_t cosine[LEARNER_ORDERS];                 // what each burst says times what it informs: 2^-27 period
    int32_t sine[LEARNER_ORDERS];
    int64_t squares;                    // of weight times what a burst added, all orders, 2^-48 period^2
};

struct learner {
    struct learner_values values;       // in force
    uint16_t amplitude_low;             // the window, full scale 2^15
    uint16_t amplitude_high;
    uint16_t scatter_limit;             // largest standard error of what is learned, 2^-20 period
    uint8_t reason;                     // a learner_reason: of the last burst or pass
    uint8_t need;                       // a learner_need
    bool frozen;
    bool harmonics;                     // passes of phases; else the ellipse is being learned
    bool settled;                       // a pass has been accepted: all is learned
    uint32_t refused;                   // bursts and passes, since start
    uint32_t accepted;                  // ellipses and passes, since start
    uint32_t scatter;                   // standard error of the last pass, 2^-20 period
    union {
        struct learner_ellipse ellipse;
        struct learner_pass pass;
    };
};

extern const struct learner_values learner_identity;            // corrects nothing

const char *learner_words(enum learner_reason reason);

void learner_start(struct learner *learner);                    // from reset: nothing is known
void learner_forget(struct learner *learner);                   // the same, but window, limit and counters stay
bool learner_restore(struct learner *learner, const struct learner_values *values);     // false: out of range, nothing changed
void learner_freeze(struct learner *learner, bool frozen);      // what is in force stays
bool learner_values_fit(const struct learner_values *values);

// A burst is recorded, one of `every` samples; spoiled: its amplitude left the window. false: another learner is at work, ask again.
bool learner_open(struct learner *learner, uint16_t every, bool spoiled);
void learner_take(struct learner *learner, const uint32_t words[LEARNER_WORDS]);       // a sample is in the first one
void learner_work(struct learner *learner);                     // one piece: some hundred instructions
void learner_loaded(struct learner *learner);                   // the hardware has the values in force

int32_t learner_table_entry(const struct learner_values *values, uint32_t point);       // 2^-20 period

// The ellipse alone.
void learner_ellipse_start(struct learner_ellipse *ellipse);
void learner_ellipse_take(struct learner_ellipse *ellipse, const struct learner *learner, uint32_t word);
enum learner_reason learner_ellipse_fit(const struct learner_ellipse *ellipse, struct learner_values *values);

#endif
