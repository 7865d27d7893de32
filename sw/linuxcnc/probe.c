// SPDX-License-Identifier: GPL-2.0-or-later
#include "probe.h"

static const unsigned STEADY = 10;    // replies; longer than a contact bounces
static const unsigned PATIENCE = 20;  // replies; reading eight axes takes 9

// Whether all latches have come to a phase.
static bool all(const struct latch* latches, unsigned axes, enum latch_phase phase) {
    for (unsigned n = 0; n < axes; n++)
        if (latches[n].phase < phase) return false;
    return true;
}

static bool one_has_captured(const struct latch* latches, unsigned axes) {
    for (unsigned n = 0; n < axes; n++)
        if (latches[n].phase > LATCH_ARMED) return true;
    return false;
}

static void settle(struct probe* probe, struct latch* latches, unsigned axes) {
    for (unsigned n = 0; n < axes; n++) latches[n].phase = LATCH_OFF;
    probe->phase = PROBE_SETTLING;
    probe->steady = 0;
}

bool probe_take(struct probe* probe, struct latch* latches, unsigned axes, bool pin, bool ready) {
    probe->steady = pin == probe->pin ? probe->steady + 1 : 0;
    probe->pin = pin;
    if (!ready && probe->phase != PROBE_SETTLING) settle(probe, latches, axes);
    switch (probe->phase) {
    case PROBE_SETTLING:
        if (probe->steady < STEADY) break;
        probe->level = pin;
        if (!ready) break;
        for (unsigned n = 0; n < axes; n++)
            latch_arm(&latches[n], pin ? SOURCE_PROBE_FALLING : SOURCE_PROBE_RISING);
        probe->phase = PROBE_ARMING;
        break;
    case PROBE_ARMING:
        if (pin != probe->level)
            settle(probe, latches, axes);
        else if (all(latches, axes, LATCH_ARMED))
            probe->phase = PROBE_ARMED;
        break;
    case PROBE_ARMED:
        if (pin == probe->level && !one_has_captured(latches, axes)) break;
        probe->phase = PROBE_TAKING;
        probe->waiting = 0;
        break;
    case PROBE_TAKING:
        if (all(latches, axes, LATCH_DONE)) {
            probe->level = !probe->level;
            settle(probe, latches, axes);
            return true;
        }
        if (++probe->waiting > PATIENCE) settle(probe, latches, axes);
        break;
    }
    return false;
}
