// SPDX-License-Identifier: Apache-2.0
// main -- starts everything, then polls bus, clock, axes and the parts of the image in turn. There
// are no interrupts, and no function waits.
#include "axis/axis.h"
#include "core/clock.h"
#include "core/hardware.h"
#include "core/image.h"
#include "bus/bus.h"
#include "axis/parameters.h"

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
    for (unsigned part = 0; part < image_part_count; part++) {
        if (!image_parts[part].work) continue;
        image_parts[part].work();
        bus_poll();
    }
}

int main(void) {
    firmware_start();
    while (hardware_stack_intact()) firmware_poll();
    hardware_halt();
    return 0;
}
