// SPDX-License-Identifier: Apache-2.0
// edm -- the wire-EDM machine: keys of its keyboard start a cut, and two status inputs say whether
// it cuts and whether it has an alarm.
//
// When nobody has typed for QUIET_MS, all keys go into the queue of the PS/2 pass-through, which
// sends them when the keyboard lines are free. Keys that still wait there are taken back when the
// machine is released or has failed; a sequence that is being sent is finished. Keys are put in
// only while the queue is empty, and until it is empty again the machine does not count as at rest.
#include "station/job/edm.h"

#include "core/clock.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"
#include "station/settings.h"

#define QUEUE 32u   // scan codes of the pass-through
#define CUTTING 1u  // bits of the status inputs
#define ALARM 2u
#define QUIET_MS 300u
#define TAKE_MS 20000u  // the machine takes the keys within this, unless a person types
#define END_MS 300u     // an alarm that ended the cut shows within this

static const uint8_t start_keys[] = {0x14, 0x1D, 0xF0,
                                     0x1D, 0xF0, 0x14};  // left Ctrl and W, pressed and released

static uint8_t state, cause;
static uint32_t since_ms, begun_ms;

static uint32_t status(void) { return peripherals_read(PERIPHERALS_EDM_STATUS); }

static bool input(unsigned bit) { return FIELD_GET(status(), PERIPHERALS_EDM_STATUS_INPUTS) & bit; }

static bool queued(void) {
    uint32_t ps2 = peripherals_read(PERIPHERALS_PS2_STATE);
    return FIELD_GET(ps2, PERIPHERALS_PS2_STATE_FREE) != QUEUE ||
           ps2 & PERIPHERALS_PS2_STATE_INJECTING_MASK;
}

static void go(enum edm_state to) {
    state = (uint8_t)to;
    since_ms = clock_ms();
}

static void take_keys_back(void) {
    peripherals_write(PERIPHERALS_PS2_STATE, PERIPHERALS_PS2_STATE_DROP_MASK);
}

static void fail(uint8_t with) {
    take_keys_back();
    cause = with;
    go(EDM_FAILED);
}

static uint32_t limit_ms(uint8_t setting) { return 1000u * (uint32_t)settings_get(setting); }

static void begun(void) {
    begun_ms = clock_ms();
    go(EDM_CUTTING);
}

static bool longer_than(uint32_t ms) { return clock_ms() - since_ms > ms; }

bool edm_built(void) {
    uint32_t needed = PERIPHERALS_BUILT_PS2_MASK | PERIPHERALS_BUILT_EDM_MASK;
    return (peripherals_read(PERIPHERALS_BUILT) & needed) == needed;
}

bool edm_cutting(void) { return input(CUTTING); }

bool edm_alarm(void) { return input(ALARM); }

bool edm_keys_pending(void) { return edm_built() && (state == EDM_QUIET || queued()); }

bool edm_at_rest(void) { return !edm_cutting() && !queued(); }

enum edm_state edm_state(void) { return state; }

uint8_t edm_cause(void) { return cause; }

void edm_start(unsigned axes) {
    (void)axes;
    cause = BUS_CAUSE_OK;
    go(EDM_IDLE);
}

// Whether somebody has typed since the last call. The count of the hardware saturates.
static bool person_types(void) {
    bool types = peripherals_read(PERIPHERALS_PS2_TYPED);
    if (types) peripherals_write(PERIPHERALS_PS2_TYPED, 0);
    return types;
}

void edm_begin(void) {
    if (edm_alarm()) return fail(BUS_CAUSE_EDM_ALARM);
    if (!edm_at_rest()) return fail(BUS_CAUSE_EDM_BUSY);
    peripherals_write(PERIPHERALS_EDM_STATUS, PERIPHERALS_EDM_STATUS_ROSE_1_MASK);
    person_types();  // only what is typed from now on counts
    go(EDM_QUIET);
}

static void send_keys(void) {
    peripherals_write(PERIPHERALS_EDM_STATUS, PERIPHERALS_EDM_STATUS_ROSE_0_MASK);
    for (unsigned n = 0; n < sizeof start_keys; n++)
        peripherals_write(PERIPHERALS_PS2_INJECT,
                          FIELD_PUT(PERIPHERALS_PS2_INJECT_DATA, start_keys[n]) |
                              FIELD_PUT(PERIPHERALS_PS2_INJECT_LAST, n + 1 == sizeof start_keys));
    go(EDM_KEYS_PENDING);
}

void edm_follow(void) {
    peripherals_write(PERIPHERALS_EDM_STATUS, PERIPHERALS_EDM_STATUS_ROSE_1_MASK);
    begun();
}

void edm_release(void) {
    take_keys_back();
    go(EDM_IDLE);
}

void edm_work(void) {
    uint32_t seen = status();
    bool followed = state >= EDM_QUIET && state <= EDM_ENDING;
    if (!followed) return;
    if (seen & PERIPHERALS_EDM_STATUS_ROSE_1_MASK ||
        FIELD_GET(seen, PERIPHERALS_EDM_STATUS_INPUTS) & ALARM)
        return fail(BUS_CAUSE_EDM_ALARM);
    switch (state) {
    case EDM_QUIET:
        if (!edm_at_rest())
            fail(BUS_CAUSE_EDM_BUSY);
        else if (person_types())
            since_ms = clock_ms();
        else if (longer_than(QUIET_MS))
            send_keys();
        break;
    case EDM_KEYS_PENDING:
        if (!queued())
            go(EDM_STARTING);
        else if (person_types())
            since_ms = clock_ms();
        else if (longer_than(TAKE_MS))
            fail(BUS_CAUSE_KEYS_NOT_TAKEN);
        break;
    case EDM_STARTING:
        if (seen & PERIPHERALS_EDM_STATUS_ROSE_0_MASK)
            begun();
        else if (longer_than(limit_ms(BUS_SETTING_JOB_START_LIMIT)))
            fail(BUS_CAUSE_CUT_NOT_STARTED);
        break;
    case EDM_CUTTING:
        if (!(FIELD_GET(seen, PERIPHERALS_EDM_STATUS_INPUTS) & CUTTING))
            go(EDM_ENDING);
        else if (clock_ms() - begun_ms > limit_ms(BUS_SETTING_JOB_CUT_LIMIT))
            fail(BUS_CAUSE_CUT_NOT_ENDED);
        break;
    default:
        if (FIELD_GET(seen, PERIPHERALS_EDM_STATUS_INPUTS) & CUTTING)
            go(EDM_CUTTING);
        else if (longer_than(END_MS))
            go(EDM_CUT);
        break;
    }
}
