// SPDX-License-Identifier: GPL-2.0-or-later
// homing_bench.c -- homes the axes of a simulated node again and again by the driver's
// index-enable, without LinuxCNC.
//
//     homing_bench PORT SESSION AXES SCALE PERIOD_NS
//
// It homes all axes, moves them away by AWAY_MM, and prints the counts of each (rawcounts) when
// they rest there, or the cause of a fault. The line `again` on its input lets a period pass and
// prints them again, any other line begins the next homing, and the end of the input ends it.
#include "bench_hal.h"
#include "moire.c"

static const double AWAY_MM = -0.1, AWAY_S = 0.06, SETTLED_S = 0.02, PATIENCE_HOMING_S = 60;
static const double PI = 3.14159265358979323846;

static long period_ns;

// A servo period; false after a fault, which it prints.
static bool period(void) {
    functions[0](arguments[0], period_ns);
    functions[1](arguments[1], period_ns);
    for (int n = 0; n < axes[0]; n++) {
        struct axis_pins* pins = &links->axis[n].pins;
        if (!*pins->fault) continue;
        printf("axis %d: %s\n", n, CAUSE_TEXTS[*pins->fault_cause]);
        return false;
    }
    return true;
}

static bool periods(double seconds) {
    for (double left = seconds; left > 0; left -= (double)period_ns * NS)
        if (!period()) return false;
    return true;
}

static bool home(void) {
    for (int n = 0; n < axes[0]; n++) *links->axis[n].pins.index_enable = 1;
    bool all = false;
    for (double left = PATIENCE_HOMING_S; left > 0 && !all; left -= (double)period_ns * NS) {
        if (!period()) return false;
        all = true;
        for (int n = 0; n < axes[0]; n++) {
            struct axis_pins* pins = &links->axis[n].pins;
            if (*pins->index_enable) all = false;
            // LinuxCNC sets the command to the position where a homing ends
            if (*pins->index_enable) *pins->position_cmd = *pins->position;
        }
    }
    if (!all) printf("an axis is not homed\n");
    return all;
}

// Along a cosine: LinuxCNC limits the acceleration, and the node refuses what exceeds its limit.
static bool away(void) {
    double moved = 0;
    for (double at = 0; at < AWAY_S; at += (double)period_ns * NS) {
        double share = (1 - cos(PI * fmin(1, at / AWAY_S + (double)period_ns * NS / AWAY_S))) / 2;
        for (int n = 0; n < axes[0]; n++)
            *links->axis[n].pins.position_cmd += AWAY_MM * share - moved;
        moved = AWAY_MM * share;
        if (!period()) return false;
    }
    return periods(SETTLED_S);
}

int main(int count, char** words) {
    if (count != 6) return 2;
    char place[40], line[8];
    snprintf(place, sizeof place, "udp:127.0.0.1:%s", words[1]);
    node[0] = place;
    session[0] = atoi(words[2]);
    axes[0] = atoi(words[3]);
    period_ns = atol(words[5]);
    simulated = 1;
    setvbuf(stdout, NULL, _IOLBF, 0);
    if (rtapi_app_main()) return 1;
    for (int n = 0; n < axes[0]; n++) *links->axis[n].pins.scale = atof(words[4]);
    *links->pins.set_point_delay = 3 * (double)period_ns / (double)NS_PER_MS;
    if (!periods(SETTLED_S)) return 1;
    for (int n = 0; n < axes[0]; n++) *links->axis[n].pins.enable = 1;
    bool homes = true;
    do {
        if (homes ? !home() || !away() : !period()) return 1;
        for (int n = 0; n < axes[0]; n++)
            printf("%d%c", *links->axis[n].pins.rawcounts, n + 1 < axes[0] ? ' ' : '\n');
        if (!fgets(line, sizeof line, stdin)) return 0;
        homes = strcmp(line, "again\n");
    } while (true);
}
