// SPDX-License-Identifier: Apache-2.0
// equations -- up to five linear equations of least squares, solved in 64-bit fixed point a step at
// a time.
#ifndef MOIRE_EQUATIONS_H
#define MOIRE_EQUATIONS_H

#include <stdbool.h>
#include <stdint.h>

#define EQUATIONS_ONE ((int64_t)1 << 28)  // 1.0 of coefficients and solution

struct equations {        // symmetric and positive definite; column 5 is the right side
    int64_t m[5][6];      // on and right of the diagonal
    int64_t solution[5];  // 0 beyond size
    int64_t largest;      // magnitude of a solution that is accepted
    bool back;            // elimination has ended, substitution is under way
    uint32_t size;
    uint32_t row, column;  // of the next step
};

enum equations_state { EQUATIONS_BUSY, EQUATIONS_SOLVED, EQUATIONS_ILL };

// Begins with `size` unknowns; the caller fills m.
void equations_begin(struct equations* e, uint32_t size, int64_t largest);

// One factor of the elimination or half an unknown: a 64-bit division takes the core 2500 cycles.
// Returns EQUATIONS_ILL if they are too close to singular, or a solution is above `largest`.
enum equations_state equations_step(struct equations* e);

static inline int32_t magnitude(int32_t value) { return value < 0 ? -value : value; }

// `value` limited to -limit … limit.
int32_t clamp(int64_t value, int32_t limit);

#endif
