// SPDX-License-Identifier: Apache-2.0
// machine -- the wire-EDM machine: its keyboard keys start a cut, two status inputs tell whether it cuts and whether something is wrong.
//
// When nobody has typed for a while the keys go whole into the queue of the PS/2 pass-through, which sends them when the lines are free.
// What still waits there is taken back when the machine is left or has failed, a sequence that is under way is finished. Nothing is put
// in while something is there, and until it is empty the machine does not count as resting.
#include "machine.h"

#include "clock.h"
#include "hardware.h"
#include "line_protocol.h"
#include "settings.h"

#define QUEUE 32u                       // scan codes
#define CUTTING 1u                      // status inputs
#define ALARM 2u
#define QUIET_MS 300u
#define TAKE_MS 20000u                  // the machine takes the keys within this, unless a person types
#define END_MS 300u                     // an alarm that ends a cut shows within this

static const uint8_t start_keys[] = {0x14, 0x1D, 0xF0, 0x1D, 0xF0, 0x14};       // left control and W, pressed and let go

static uint8_t state, cause;
static uint32_t since_ms, begun_ms, typed;

static uint32_t status(void)
{
    return links_read(LINKS_MACHINE_STATUS);
}

static bool input(unsigned bit)
{
    return FIELD_GET(status(), LINKS_MACHINE_STATUS_INPUTS) & bit;
}

static bool queued(void)
{
    uint32_t ps2 = links_read(LINKS_PS2_STATE);
    return FIELD_GET(ps2, LINKS_PS2_STATE_FREE) != QUEUE || ps2 & LINKS_PS2_STATE_INJECTING_MASK;
}

static void go(enum machine_state to)
{
    state = (uint8_t)to;
    since_ms = clock_ms();
}

static void take_keys_back(void)
{
    links_write(LINKS_PS2_STATE, LINKS_PS2_STATE_DROP_MASK);
}

static void fail(uint8_t with)
{
    take_keys_back();
    cause = with;
    go(MACHINE_FAILED);
}

static uint32_t limit_ms(uint8_t setting)
{
    return 1000u * (uint32_t)settings_get(setting);
}

static void begun(void)
{
    begun_ms = clock_ms();
    go(MACHINE_CUTTING);
}

static bool longer_than(uint32_t ms)
{
    return clock_ms() - since_ms > ms;
}

bool machine_built(void)
{
    uint32_t needed = LINKS_BUILT_PS2_MASK | LINKS_BUILT_MACHINE_MASK;
    return (links_read(LINKS_BUILT) & needed) == needed;
}

bool machine_cuts(void)
{
    return input(CUTTING);
}

bool machine_alarms(void)
{
    return input(ALARM);
}

bool machine_keys_wait(void)
{
    return machine_built() && (state == MACHINE_QUIET || queued());
}

bool machine_rests(void)
{
    return !machine_cuts() && !queued();
}

enum machine_state machine_state(void)
{
    return state;
}

uint8_t machine_cause(void)
{
    return cause;
}

void machine_start(unsigned axes)
{
    (void)axes;
    cause = LINE_CAUSE_OK;
    go(MACHINE_LEFT);
}

void machine_begin(void)
{
    if (machine_alarms()) return fail(LINE_CAUSE_MACHINE_ALARM);
    if (!machine_rests()) return fail(LINE_CAUSE_MACHINE_BUSY);
    links_write(LINKS_MACHINE_STATUS, LINKS_MACHINE_STATUS_ROSE_1_MASK);
    typed = links_read(LINKS_PS2_TYPED);
    go(MACHINE_QUIET);
}

static void send_keys(void)
{
    links_write(LINKS_MACHINE_STATUS, LINKS_MACHINE_STATUS_ROSE_0_MASK);
    for (unsigned n = 0; n < sizeof start_keys; n++)
        links_write(LINKS_PS2_INJECT, FIELD_PUT(LINKS_PS2_INJECT_DATA, start_keys[n]) |
                                      FIELD_PUT(LINKS_PS2_INJECT_LAST, n + 1 == sizeof start_keys));
    go(MACHINE_KEYS_WAIT);
}

void machine_follow(void)
{
    links_write(LINKS_MACHINE_STATUS, LINKS_MACHINE_STATUS_ROSE_1_MASK);
    begun();
}

void machine_leave(void)
{
    take_keys_back();
    go(MACHINE_LEFT);
}

static bool person_types(void)
{
    uint32_t now = links_read(LINKS_PS2_TYPED);
    bool types = now != typed;
    typed = now;
    return types;
}

void machine_work(void)
{
    uint32_t seen = status();
    bool followed = state >= MACHINE_QUIET && state <= MACHINE_ENDING;
    if (!followed) return;
    if (seen & LINKS_MACHINE_STATUS_ROSE_1_MASK || FIELD_GET(seen, LINKS_MACHINE_STATUS_INPUTS) & ALARM) return fail(LINE_CAUSE_MACHINE_ALARM);
    switch (state) {
    case MACHINE_QUIET:
        if (!machine_rests()) fail(LINE_CAUSE_MACHINE_BUSY);
        else if (person_types()) since_ms = clock_ms();
        else if (longer_than(QUIET_MS)) send_keys();
        break;
    case MACHINE_KEYS_WAIT:
        if (!queued()) go(MACHINE_STARTING);
        else if (person_types()) since_ms = clock_ms();
        else if (longer_than(TAKE_MS)) fail(LINE_CAUSE_KEYS_NOT_TAKEN);
        break;
    case MACHINE_STARTING:
        if (seen & LINKS_MACHINE_STATUS_ROSE_0_MASK) begun();
        else if (longer_than(limit_ms(LINE_SETTING_JOB_START_LIMIT))) fail(LINE_CAUSE_CUT_NOT_STARTED);
        break;
    case MACHINE_CUTTING:
        if (!(FIELD_GET(seen, LINKS_MACHINE_STATUS_INPUTS) & CUTTING)) go(MACHINE_ENDING);
        else if (clock_ms() - begun_ms > limit_ms(LINE_SETTING_JOB_CUT_LIMIT)) fail(LINE_CAUSE_CUT_NOT_ENDED);
        break;
    default:
        if (FIELD_GET(seen, LINKS_MACHINE_STATUS_INPUTS) & CUTTING) go(MACHINE_CUTTING);
        else if (longer_than(END_MS)) go(MACHINE_CUT);
        break;
    }
}
