// SPDX-License-Identifier: Apache-2.0
// The devices of a node besides its axes: devices on its I2C bus, a PS/2 keyboard, the PC of a
// machine at the other PS/2 port, the state of that machine, a numeric display. Like a Machine it
// costs one comparison a cycle while nothing happens.
#pragma once
#include <functional>

#include "devices/character_display.h"
#include "devices/edm.h"
#include "devices/eeprom.h"
#include "devices/keypad.h"
#include "devices/numeric_display.h"
#include "parameters.h"  // made by build.py
#include "devices/ps2_computer.h"
#include "devices/ps2_keyboard.h"

namespace twin {

enum PeripheralDrive : unsigned {  // pins that the node drives
    I2C_SCL_LOW = 1 << 0,
    I2C_SDA_LOW = 1 << 1,
    KEYBOARD_CLOCK_LOW = 1 << 2,
    KEYBOARD_DATA_LOW = 1 << 3,
    EDM_CLOCK_LOW = 1 << 4,
    EDM_DATA_LOW = 1 << 5,
    DISPLAY_CS_N = 1 << 6,
    DISPLAY_SCLK = 1 << 7,
    DISPLAY_DATA = 1 << 8,
};

enum PeripheralSense : unsigned {  // pins that it sees
    I2C_SCL = 1 << 0,
    I2C_SDA = 1 << 1,
    KEYBOARD_CLOCK = 1 << 2,
    KEYBOARD_DATA = 1 << 3,
    EDM_CLOCK = 1 << 4,
    EDM_DATA = 1 << 5,
    EDM_CUTTING = 1 << 6,
    EDM_ALARM = 1 << 7,
};
constexpr unsigned PERIPHERAL_DRIVE_IDLE = DISPLAY_CS_N;
constexpr unsigned PERIPHERAL_SENSE_IDLE =
    I2C_SCL | I2C_SDA | KEYBOARD_CLOCK | KEYBOARD_DATA | EDM_CLOCK | EDM_DATA;

enum Fitted : unsigned {
    FITTED_EEPROM = 1,
    FITTED_KEYPAD = 2,
    FITTED_DISPLAY = 4,
    FITTED_KEYBOARD = 8,
    FITTED_EDM = 16
};

class Devices {
 public:
    Devices(const DevicesParameters& parameters, unsigned fitted, uint64_t seed, uint64_t stream,
            double clk_hz);

    // the node's pins after cycle `now`; true when levels may have changed
    bool clk(uint64_t now, unsigned drive) {
        if (drive == drive_ && now < event_at_) return false;
        advance(now, drive);
        return true;
    }
    uint64_t event_at() const { return event_at_; }
    unsigned levels() const { return levels_; }  // PeripheralSense
    void wake() { event_at_ = 0; }               // something was changed from outside

    void power_cut(uint64_t now);  // of the node: the panel goes dark, the EEPROM keeps what it has
    void power_on(uint64_t now);
    bool fault(const char* name, bool on);  // false: there is no such fault
    static const char* faults();
    bool set(const char* name, double value);  // false: there is no such parameter
    bool get(const char* name, double& value);
    static const char* state_names();  // as those of a Machine
    void state(uint64_t now, double* out) const;

    Eeprom eeprom;
    Keypad keypad;
    CharacterDisplay display;
    NumericDisplay digits;
    Ps2Keyboard keyboard;
    Ps2Computer computer;
    Edm edm;
    std::function<double()> table_angle = [] { return NAN; };  // rad, true

 private:
    void advance(uint64_t now, unsigned drive);
    void bus(uint64_t now);
    void configure();
    unsigned lines() const;  // those of I2C and PS/2, wired-AND

    DevicesParameters p_;
    double clk_hz_;
    unsigned fitted_, drive_ = PERIPHERAL_DRIVE_IDLE, levels_ = PERIPHERAL_SENSE_IDLE;
    uint64_t event_at_ = 0, keyboard_at_ = 0, computer_at_ = 0, edm_at_ = 0;
    bool scl_stuck_ = false, sda_stuck_ = false;
};

}  // namespace twin
