// SPDX-License-Identifier: Apache-2.0
// equations -- up to five linear equations of least squares, solved in 64-bit fixed point a step at
// a time.
//
// Gaussian elimination without exchange of rows, which a positive definite matrix does not need; a
// small pivot or a large factor says that the samples do not determine the unknowns.
#include "calibration/equations.h"

#define LARGEST_FACTOR (4 * EQUATIONS_ONE)
#define SMALLEST_PIVOT (EQUATIONS_ONE >> 16)

void equations_begin(struct equations* e, uint32_t size, int64_t largest) {
    e->size = size;
    for (uint32_t i = 0; i < 5; i++) e->solution[i] = 0;
    e->largest = largest;
    e->back = false;
    e->row = 0;
    e->column = 1;
}

enum equations_state equations_step(struct equations* e) {
    uint32_t i = e->row, j = e->column;
    int64_t pivot = e->m[i][i];
    if (e->back) {
        int64_t *residual = &e->m[i][5], *solution = &e->solution[i];
        if (j == 0) {  // first coarsely, then the remainder: both fit 64 bits
            for (j = i + 1; j < e->size; j++) *residual -= (e->m[i][j] * e->solution[j]) >> 28;
            *solution = *residual * 16 / pivot;
            *residual = *residual * 16 - *solution * pivot;
            e->column = 1;
            return EQUATIONS_BUSY;
        }
        *solution = *solution * (EQUATIONS_ONE / 16) + *residual * (EQUATIONS_ONE / 16) / pivot;
        if (*solution > e->largest || *solution < -e->largest) return EQUATIONS_ILL;
        if (i == 0) return EQUATIONS_SOLVED;
        e->row--;
        e->column = 0;
    } else if (pivot < SMALLEST_PIVOT) {
        return EQUATIONS_ILL;
    } else if (j < e->size) {
        int64_t factor = e->m[i][j] * EQUATIONS_ONE / pivot;
        if (factor > LARGEST_FACTOR || factor < -LARGEST_FACTOR) return EQUATIONS_ILL;
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
    return EQUATIONS_BUSY;
}

int32_t clamp(int64_t value, int32_t limit) {
    return value > limit ? limit : value < -limit ? -limit : (int32_t)value;
}
