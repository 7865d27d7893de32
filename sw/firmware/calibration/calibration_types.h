// SPDX-License-Identifier: Apache-2.0
// calibration_types -- the state of the calibration of one sine/cosine signal: what is in force,
// what it needs next, and the sums of its samples and phases.
#ifndef MOIRE_CALIBRATION_TYPES_H
#define MOIRE_CALIBRATION_TYPES_H

#include <stdbool.h>
#include <stdint.h>

#include "calibration/calibration_values.h"

#define CALIBRATION_POINTS 256u   // of the table of harmonic_correction
#define CALIBRATION_BURST 1024u   // words of calibration_recorder
#define CALIBRATION_WORDS 4u      // words of phases that are taken at once
#define CALIBRATION_PHASES 2048u  // phases in a burst
#define CALIBRATION_ELLIPSE_BURSTS 2u
#define CALIBRATION_PASS 39u           // bursts of phases in a pass
#define CALIBRATION_LONGEST_PASS 312u  // of one that a vibration makes longer
#define CALIBRATION_LINES 128u         // of the spectrum of a burst: 0 … 127 cycles in it
#define CALIBRATION_PERIODS 15u        // that a burst should cover; it must cover 8

enum calibration_need {
    CALIBRATION_NEEDS_NOTHING,  // it is frozen
    CALIBRATION_NEEDS_SAMPLES,  // a burst of {cos, sin}, 16 bits each, full scale 2^15
    CALIBRATION_NEEDS_PHASES,   // a burst of phases before harmonic_correction, 2^-16 period, two
                                // in a word, the earlier one in the low half
    CALIBRATION_NEEDS_WORDS,    // the burst that was opened, from its first word to its last
    CALIBRATION_NEEDS_WORK,     // calibration_work
    CALIBRATION_NEEDS_LOADING   // its values in the hardware
};

enum calibration_mode {      // as the parameter auto_calibration counts them
    CALIBRATION_FROZEN,      // the values stay
    CALIBRATION_CALIBRATES,  // determines everything
    CALIBRATION_FOLLOWS      // adds what the ellipse has changed since to the values
};

// Sums over samples. x = cos and y = sin in 13 bits, so that the sums of 4096 samples fit.
struct calibration_ellipse {
    uint16_t count;       // samples, at most 4096
    uint16_t outside;     // samples outside the amplitude window
    uint16_t sector[16];  // samples in each of 16 about equal parts of the circle
    int16_t lowest[2];    // cos, sin; 13 bits
    int16_t highest[2];
    // Products of 1, x, y, x^2 - y^2, 2xy, each with itself and those after it and with x^2 + y^2.
    int64_t sum[20];
};

// Sums over the bursts of phases of a pass.
struct calibration_pass {
    uint32_t slowest, fastest;  // |travel| of a burst, 2^-16 period
    uint16_t every;             // decimation of the recorder for which `line` holds
    uint16_t bursts;
    uint8_t spectra;                          // that `line` covers
    uint8_t line[CALIBRATION_LINES];          // weakest power of the line in any burst, 4 log2
    int32_t information[CALIBRATION_ORDERS];  // weight of the bursts for an order, 2^-15 burst
    int64_t cosine[CALIBRATION_ORDERS];  // weighted sum of the results of the bursts, 2^-27 period
    int64_t sine[CALIBRATION_ORDERS];
    int64_t squares;  // of the weighted changes that the bursts made, all orders, 2^-48 period^2
};

struct calibration {
    struct calibration_values values;  // in force
    uint16_t amplitude_low;            // the amplitude window, full scale 2^15
    uint16_t amplitude_high;
    uint16_t scatter_limit;  // largest standard error that is accepted, 2^-20 period
    uint8_t reason;          // a bus_calibration_reason: of the last burst or pass
    uint8_t need;            // a calibration_need
    uint8_t mode;            // a calibration_mode
    bool harmonics;          // the ellipse is known: bursts of phases are next, unless it follows
    bool complete;           // a pass has been accepted since the last reset
    bool referenced;         // `beside` is known
    // The values in force less those of an ellipse of the same time: offsets of sine and cosine,
    // gain, quadrature error. An ellipse takes some of the harmonics for its own.
    int32_t beside[4];
    uint32_t refused;   // bursts and passes, since start
    uint32_t accepted;  // ellipses and passes, since start
    uint32_t scatter;   // standard error of the last pass, 2^-20 period
    union {
        struct calibration_ellipse ellipse;
        struct calibration_pass pass;
    };
};

#endif
