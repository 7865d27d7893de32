// SPDX-License-Identifier: GPL-2.0-or-later
// node_clock.h -- the clock of a node as the servo thread sees it: a digital PLL on the times in
// the replies, and set-points at whole servo ticks of the node.
#ifndef MOIRE_NODE_CLOCK_H
#define MOIRE_NODE_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

struct node_clock {
    double nominal;  // cycles of the node per servo period of the host
    double tick;     // cycles per servo tick of the node
    double step;     // cycles per servo period, as measured
    double now;      // cycles when the present request reaches the node
    double late;     // cycles by which the last request was later than expected
    double base;     // cycles at base_tick
    uint32_t base_tick;
    bool running;
};

// A position with its derivatives by time in seconds, in any unit of length.
struct motion {
    double position, velocity, acceleration;
};

// period_s: of the servo thread; clk_hz and tick: of the node, in Hz and cycles per servo tick.
void node_clock_start(struct node_clock* clock, double period_s, double clk_hz, double tick);

// A servo period has passed.
void node_clock_step(struct node_clock* clock);

// A reply has come to the request of this period: the time at which the node had the request, its
// tick, and the time at which the tick was read.
void node_clock_take(struct node_clock* clock, uint32_t time, uint32_t tick, uint32_t tick_time);

// The servo tick of the node, with its fraction, `cycles` after the present request.
double node_clock_tick(const struct node_clock* clock, double cycles);

// Difference of the clocks in millionths.
double node_clock_drift(const struct node_clock* clock);

// The motion through three positions that are `period_s` apart, at the middle one: the velocity is
// that of the parabola through them.
struct motion motion_through(const double positions[3], double period_s);

// The same motion `seconds` later.
struct motion motion_after(struct motion at, double seconds);

#endif
