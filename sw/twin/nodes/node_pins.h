// SPDX-License-Identifier: Apache-2.0
// Converts the pins of a Verilated node, which are vectors over its axes, to one word for each
// machine and one for the peripherals, and back.
#pragma once
#include <cstdint>

#include "machines/machine.h"
#include "devices/devices.h"

namespace twin {

class DrivePins {  // those that the node drives, of all axes
 public:
    static constexpr int MOST_AXES = 8;

    template <class Pins>
    bool take(const Pins& pins) {  // true when one has changed
        const uint64_t first = bytes(pins.adc_cs_n, pins.adc_sclk, pins.bridge_a, pins.bridge_b,
                                     pins.drive_enable, pins.step, pins.direction, pins.dac_cs_n),
                       last = bytes(pins.dac_sclk, pins.dac_sdi);
        const bool changed = (first != first_) | (last != last_);
        first_ = first;
        last_ = last;
        return changed;
    }
    unsigned of(int n) const {  // Drive of axis n
        return gathered(first_ >> n) | gathered(last_ >> n) << 8;
    }

 private:
    template <class... Vectors>
    static uint64_t bytes(Vectors... vectors) {  // one of each vector over the axes
        uint64_t word = 0;
        unsigned place = 0;
        ((word |= uint64_t(vectors) << place, place += 8), ...);
        return word;
    }
    // The lowest bits of all bytes: the product puts that of byte n into bit 56 + n.
    static unsigned gathered(uint64_t word) {
        return unsigned((word & 0x0101010101010101) * 0x0102040810204080 >> 56);
    }

    uint64_t first_ = 0, last_ = 0;
};

class SensePins {
 public:
    void add(int n, unsigned levels) {  // Sense of axis n
        for (unsigned bit = 0; bit < SENSE_PINS; bit++) vectors_[bit] |= (levels >> bit & 1) << n;
    }
    template <class Pins>
    void set(Pins& pins, uint32_t all) const {
        pins.encoder_a = of(ENCODER_A);
        pins.encoder_b = of(ENCODER_B);
        pins.encoder_z = of(ENCODER_Z);
        pins.adc_sin = of(ADC_SIN);
        pins.adc_cos = of(ADC_COS);
        pins.limit_low_open = of(LIMIT_LOW_OPEN);
        pins.limit_high_open = of(LIMIT_HIGH_OPEN);
        pins.drive_fault_n = ~of(DRIVE_FAULT) & all;
        pins.sensor_rx = of(SENSOR_RX) & 1;  // the node has one, that of its first axis
    }

 private:
    uint32_t of(Sense pin) const { return vectors_[unsigned(__builtin_ctz(pin))]; }

    uint32_t vectors_[SENSE_PINS] = {};
};

template <class Pins>
unsigned peripheral_drive_of(const Pins& pins) {  // PeripheralDrive
    return pins.i2c_scl_low * I2C_SCL_LOW | pins.i2c_sda_low * I2C_SDA_LOW |
           pins.keyboard_clock_low * KEYBOARD_CLOCK_LOW |
           pins.keyboard_data_low * KEYBOARD_DATA_LOW | pins.edm_clock_low * EDM_CLOCK_LOW |
           pins.edm_data_low * EDM_DATA_LOW | pins.display_cs_n * DISPLAY_CS_N |
           pins.display_sclk * DISPLAY_SCLK | pins.display_data * DISPLAY_DATA;
}

template <class Pins>
void set_peripheral_pins(Pins& pins, unsigned levels) {  // PeripheralSense
    pins.i2c_scl = (levels & I2C_SCL) != 0;
    pins.i2c_sda = (levels & I2C_SDA) != 0;
    pins.keyboard_clock = (levels & KEYBOARD_CLOCK) != 0;
    pins.keyboard_data = (levels & KEYBOARD_DATA) != 0;
    pins.edm_clock = (levels & EDM_CLOCK) != 0;
    pins.edm_data = (levels & EDM_DATA) != 0;
    pins.edm_status = bool(levels & EDM_CUTTING) | bool(levels & EDM_ALARM) << 1;
}

}  // namespace twin
