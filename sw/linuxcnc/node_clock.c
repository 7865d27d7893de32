// SPDX-License-Identifier: GPL-2.0-or-later
#include "node_clock.h"

#include <math.h>

// a natural frequency of 0.01 rad per period, critically damped: 1.6 Hz at a period of 1 ms
static const double PROPORTIONAL = 0.02, INTEGRAL = 0.0001;
static const double MOST_DRIFT = 1e-3;  // of the nominal frequency
static const double MOST_LATE = 50;     // periods; more is another clock: the node was restarted
static const double MILLION = 1e6;

void node_clock_start(struct node_clock* clock, double period_s, double clk_hz, double tick) {
    *clock = (struct node_clock){.nominal = period_s * clk_hz, .tick = tick};
    clock->step = clock->nominal;
}

void node_clock_step(struct node_clock* clock) { clock->now += clock->step; }

void node_clock_take(struct node_clock* clock, uint32_t time, uint32_t tick, uint32_t tick_time) {
    int32_t late = (int32_t)(time - (uint32_t)(int64_t)floor(clock->now));
    if (!clock->running || fabs((double)late) > MOST_LATE * clock->nominal) {
        clock->running = true;
        clock->step = clock->nominal;
        clock->now = time;
        clock->base = clock->now + (int32_t)(tick_time - time);
        clock->base_tick = tick;
        clock->late = 0;
        return;
    }
    clock->late = late;
    clock->now += PROPORTIONAL * late;
    clock->step += INTEGRAL * late;
    double range = MOST_DRIFT * clock->nominal;
    clock->step = fmin(fmax(clock->step, clock->nominal - range), clock->nominal + range);
}

double node_clock_tick(const struct node_clock* clock, double cycles) {
    return clock->base_tick + (clock->now + cycles - clock->base) / clock->tick;
}

double node_clock_drift(const struct node_clock* clock) {
    return (clock->step / clock->nominal - 1) * MILLION;
}

struct motion motion_through(const double positions[3], double period_s) {
    double before = positions[1] - positions[0], after = positions[2] - positions[1];
    return (struct motion){
        .position = positions[1],
        .velocity = (before + after) / (2 * period_s),
        .acceleration = (after - before) / (period_s * period_s),
    };
}

struct motion motion_after(struct motion at, double seconds) {
    at.position += seconds * (at.velocity + seconds / 2 * at.acceleration);
    at.velocity += seconds * at.acceleration;
    return at;
}
