// SPDX-License-Identifier: Apache-2.0
// calibration_burst -- the burst that is being worked on: the one work area that all calibrations
// share, one after the other.
//
// It is one object because its parts share their memory: the transform and the sums of the second
// reading are never needed at the same time.
#ifndef MOIRE_CALIBRATION_BURST_H
#define MOIRE_CALIBRATION_BURST_H

#include <stdint.h>

#include "calibration/calibration_types.h"
#include "calibration/equations.h"

#define BLOCKS 256u                          // of a burst; motion is fitted to their means
#define BLOCK (CALIBRATION_PHASES / BLOCKS)  // phases of a block: 8, as attenuation() assumes
#define BINS 128u                            // of a period
#define QUARTER (BINS / 4)
#define POINTS (BLOCKS / 2)  // of the transform: two blocks in each, one real, one imaginary
#define TOGETHER 2u          // blocks, pairs, lines or bins that one piece of work handles

struct calibration_burst {
    const struct calibration* owner;      // whose burst it is; null: free
    uint8_t stage;                        // of calibration.c
    uint32_t next;                        // piece of the stage that is done next
    uint16_t every;                       // decimation of the recorder
    struct calibration_values candidate;  // the result of the pass so far

    uint32_t taken;                    // samples or phases of this reading
    uint16_t last;                     // phase, 2^-16 period
    int32_t travel;                    // 2^-16 period
    int32_t part;                      // travel at the start of this 16th of the burst
    int32_t slowest, fastest;          // travel of a 16th
    int32_t least_step, largest_step;  // from phase to phase

    int32_t table[BINS];    // correction by the candidate in the middle of each bin, 2^-20 period
    int32_t block[BLOCKS];  // mean position of each block, 2^-20 period
    uint32_t strongest;     // line of the pass
    uint32_t vibration;     // its frequency, 2^-16 cycle a burst
    int32_t bend;           // 2 - 2 cos of its phase step from sample to sample, 1.0 = 2^17
    int32_t attenuation_of_block;  // of the vibration in the mean of a block, 1.0 = 2^15
    int32_t across[2][5];  // sums of window times each wave of the vibration times 1, time, its
                           // square and both waves
    int64_t right[5];      // sums of window times position times those
    struct equations fit;
    union {
        struct {
            int32_t real[POINTS], imaginary[POINTS];  // of the transform
        };
        int32_t seen[3][BINS];  // by bin: window times residual of each phase, and window times
                                // cosine and sine of the vibration of each block
    };
    int64_t power;  // of the residual at the end of each block, 2^-30 (window) 2^-20 period squared
    int64_t weight;           // of the burst, 1.0 = 2^15
    uint32_t order;           // that is projected, from 0
    int64_t projected[3][2];  // `seen` times cosine and sine of that order
};

extern struct calibration_burst burst;

#endif
