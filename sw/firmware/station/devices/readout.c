// SPDX-License-Identifier: Apache-2.0
// readout -- the position of axis 0 in mm on a numeric display of eight digits (MAX7219), ten times
// a second (S0's display).
//
// The set-up of the display is sent each time, so that a display which lost its power comes back. A
// position that does not fit is shown as a row of dashes.
#include "station/devices/readout.h"

#include "core/clock.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"
#include "axis/parameters.h"
#include "station/settings.h"

#define PERIOD_MS 100u
#define DIGITS 8u
#define PM_PER_MM_DIGITS 9u  // decimals of a mm in pm
#define MINUS 10u            // in the code B of the display, as is BLANK
#define BLANK 15u
#define POINT 0x80u
#define WORDS (DIGITS + sizeof set_up / sizeof *set_up)

// register in the high byte: code B for all digits, brightness, all digits, running, no test
static const uint16_t set_up[] = {0x09FF, 0x0A07, 0x0B07, 0x0C01, 0x0F00};

static uint32_t shown_ms;

static uint32_t power_of_ten(uint32_t exponent) {
    uint32_t power = 1;
    while (exponent--) power *= 10u;
    return power;
}

static void show(uint32_t digit, uint32_t code) {
    peripherals_write(PERIPHERALS_DISPLAY, (digit + 1) << 8 | code);
}

static void show_number(int64_t number, uint32_t decimals) {
    bool negative = number < 0;
    uint64_t size = negative ? -(uint64_t)number : (uint64_t)number;
    if (size >= power_of_ten(negative ? DIGITS - 1 : DIGITS)) {
        for (uint32_t digit = 0; digit < DIGITS; digit++) show(digit, MINUS);
        return;
    }
    for (uint32_t digit = 0, remainder = (uint32_t)size; digit < DIGITS;
         digit++, remainder /= 10u) {
        bool leading = remainder == 0 && digit > decimals;
        uint32_t code = !leading ? remainder % 10u : negative ? MINUS : BLANK;
        if (leading) negative = false;
        show(digit, code | (decimals && digit == decimals ? POINT : 0));
    }
}

void readout_start(unsigned axes) {
    (void)axes;
    shown_ms = clock_ms();
}

void readout_work(void) {
    if (clock_ms() - shown_ms < PERIOD_MS) return;
    shown_ms = clock_ms();
    if (!(peripherals_read(PERIPHERALS_BUILT) & PERIPHERALS_BUILT_DISPLAY_MASK)) return;
    if (FIELD_GET(peripherals_read(PERIPHERALS_DISPLAY_STATE), PERIPHERALS_DISPLAY_STATE_FREE) <
        WORDS)
        return;
    uint32_t decimals = (uint32_t)settings_get(BUS_SETTING_READOUT_DECIMALS);
    int64_t position = axis_read_position(0, AXIS_POSITION),
            period = parameters_get(0, BUS_PARAMETER_PERIOD);
    int64_t pm = (position >> 16) * period + ((position & 0xFFFF) * period >> 16),
            unit = power_of_ten(PM_PER_MM_DIGITS - decimals);
    for (uint32_t n = 0; n < WORDS - DIGITS; n++) peripherals_write(PERIPHERALS_DISPLAY, set_up[n]);
    show_number((pm < 0 ? pm - unit / 2 : pm + unit / 2) / unit, decimals);
}
