// SPDX-License-Identifier: Apache-2.0
// main -- starts everything, then polls bus, clock, axes and the parts of the image in turn. There
// are no interrupts, and no function waits. When all of them are idle, the core waits between two
// rounds, until a word of the bus is received or the time is over.
#include "axis/axis.h"
#include "core/clock.h"
#include "core/code.h"
#include "core/hardware.h"
#include "core/image.h"
#include "bus/bus.h"
#include "axis/parameters.h"
#include "planner/planner.h"

#define LONGEST_IDLE_TICKS 64u  // 16 ms

static unsigned axes;  // number that may be accessed: 0 if the register maps differ

void firmware_start(void) {
    unsigned built = FIELD_GET(node_read(NODE_BUILD), NODE_BUILD_AXES);
    if (built > HARDWARE_AXES) built = HARDWARE_AXES;
    axes = hardware_map_fits() ? built : 0;
    clock_start();
    parameters_start_node();
    for (unsigned n = 0; n < axes; n++) axis_start(n);
    for (unsigned part = 0; part < image_part_count; part++)
        if (image_parts[part].start) image_parts[part].start(axes);
    bus_start(built);
}

void firmware_poll(void) {
    node_write(NODE_HEARTBEAT, NODE_HEARTBEAT_KICK_MASK);
    bus_poll();
    clock_poll();
    for (unsigned n = 0; n < axes; n++) {
        axis_poll(n);
        bus_poll();
    }
    if (axes == 0) return;
    parameters_refresh();
    for (unsigned part = 0; part < image_part_count; part++) {
        if (!image_parts[part].work) continue;
        image_parts[part].work();
        bus_poll();
    }
}

uint32_t firmware_idle_ticks(void) {
    uint32_t ticks = axes && bus_idle() ? LONGEST_IDLE_TICKS : 0;
    for (unsigned n = 0; n < axes && ticks; n++) {
        uint32_t most = axis_idle_ticks(n);
        if (most < ticks) ticks = most;
    }
    for (unsigned part = 0; part < image_part_count && ticks; part++)
        if (image_parts[part].work && (!image_parts[part].idle || !image_parts[part].idle()))
            ticks = 0;
    return ticks;
}

int main(void) {
    if (!code_intact()) hardware_halt();
    firmware_start();
    const uint32_t tick_cycles = node_read(NODE_CLK_HZ) / PLANNER_TICK_HZ;
    while (hardware_stack_intact()) {
        firmware_poll();
        node_write(NODE_WAIT_TIME, firmware_idle_ticks() * tick_cycles);
    }
    hardware_halt();
    return 0;
}
