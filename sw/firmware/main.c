// SPDX-License-Identifier: Apache-2.0
// main -- start, then poll for ever: line, clock, axes, gratings. There are no interrupts; nothing waits.
#include "axis.h"
#include "clock.h"
#include "grating.h"
#include "hardware.h"
#include "line.h"
#include "line_protocol.h"
#include "parameters.h"
#include "scope.h"

static unsigned axes;                   // those that may be touched: none if the register maps differ
static unsigned turn;                   // axis whose grating was polled last

void firmware_start(void)
{
    unsigned built = FIELD_GET(node_read(NODE_BUILD), NODE_BUILD_AXES);
    if (built > HARDWARE_AXES) built = HARDWARE_AXES;
    axes = hardware_map_fits() ? built : 0;
    clock_start();
    parameters_start_node();
    for (unsigned n = 0; n < axes; n++) {
        axis_start(n);
        grating_start(n);
    }
    scope_start();
    line_start(built);
}

void firmware_poll(void)
{
    bool homing = false;
    node_write(NODE_ALIVE, NODE_ALIVE_BEAT_MASK);
    line_poll();
    clock_poll();
    for (unsigned n = 0; n < axes; n++) {
        axis_poll(n);
        homing = homing || axis_state(n) == LINE_STATE_HOMING;
        line_poll();
        scope_poll();
    }
    if (axes == 0 || homing) return;    // homing has to see the switch in time
    turn = turn + 1 < axes ? turn + 1 : 0;
    grating_poll(turn);
}

int main(void)
{
    firmware_start();
    while (hardware_stack_intact()) firmware_poll();
    hardware_halt();
    return 0;
}
