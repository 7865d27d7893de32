// SPDX-License-Identifier: Apache-2.0
// core_work -- work of the firmware, as a measure of soft cores: main of a program that
// core_run.cpp runs. Each section ends with a write of its number to the last register.
#include "axis/axis.h"
#include "bus/bus.h"
#include "calibration/waves.h"
#include "core/clock.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"
#include "planner/plan.h"
#include "planner/planner.h"

#define LAST_REGISTER 0xFFFCu
#define MOVES 8u
#define ROUNDS 20u

void firmware_start(void);
void firmware_poll(void);
int main(void);

enum section {
    END,
    BEGUN,
    START,
    ROUNDS_OF_POLLING,
    REQUESTS,
    PLANNING,
    TAKING,
    RETARGETING,
    WAVES
};

static struct plan plan, next;

static void ends(enum section section) { register_write(LAST_REGISTER, section); }

static void plan_moves(const struct planner_limits* limits) {
    for (unsigned n = 0; n < MOVES; n++) planner_move(&plan, limits, 1000000ll << 2 * n);
}

static void take_pieces(void) {
    struct planner_segment piece;
    bool last;
    for (unsigned n = 0; n < 100 && planner_take_up_to(&plan, &piece, &last, 128); n++) {}
}

int main(void) {
    static const uint8_t status[] = {1, BUS_OPERATION_STATUS, 0};
    uint8_t reply[BUS_LONGEST_BODY];
    const struct planner_limits limits = planner_limits(200000, 2000000, 40000000);
    int32_t sum = 0;

    ends(BEGUN);
    firmware_start();
    ends(START);
    for (unsigned n = 0; n < ROUNDS; n++) firmware_poll();
    ends(ROUNDS_OF_POLLING);
    for (unsigned n = 0; n < ROUNDS; n++) bus_execute(status, sizeof status, reply);
    ends(REQUESTS);
    plan_moves(&limits);
    ends(PLANNING);
    take_pieces();
    ends(TAKING);
    planner_retarget(&next, &plan, 200, &limits, 3000000000ll, 0);
    ends(RETARGETING);
    for (uint32_t phase = 0; phase < 65536; phase += 64) sum += sine_of(phase) * cosine_of(phase);
    register_write(LAST_REGISTER - 4, (uint32_t)sum);
    ends(WAVES);
    ends(END);
    return 0;
}
