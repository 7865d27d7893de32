// SPDX-License-Identifier: Apache-2.0
#include "devices/devices.h"

#include <cstring>

namespace twin {

Devices::Devices(const DevicesParameters& parameters, unsigned fitted, uint64_t seed,
                 uint64_t stream, double clk_hz)
    : eeprom(seed, stream + 1),
      computer(seed, stream + 2),
      edm(seed, stream + 3),
      p_(parameters),
      clk_hz_(clk_hz),
      fitted_(fitted) {
    for (const char* name : {"eeprom_dead", "keypad_dead", "display_dead", "keyboard_dead"})
        fault(name, false);
    configure();
    power_on(0);
}

void Devices::configure() {
    eeprom.write_clk = uint64_t(p_.eeprom_write_time * clk_hz_);
    display.glass.configure(clk_hz_);
    keyboard.configure(clk_hz_, p_.keyboard_self_test);
    computer.configure(clk_hz_, p_.computer_inhibits, p_.computer_processing);
    edm.configure(p_, clk_hz_);
    wake();
}

unsigned Devices::lines() const {
    const bool scl_low = (drive_ & I2C_SCL_LOW) || scl_stuck_;
    const bool sda_low = (drive_ & I2C_SDA_LOW) || sda_stuck_ || eeprom.sda_low() ||
                         keypad.sda_low() || display.sda_low();
    return I2C_SCL * !scl_low | I2C_SDA * !sda_low |
           KEYBOARD_CLOCK * !((drive_ & KEYBOARD_CLOCK_LOW) || keyboard.clock_low) |
           KEYBOARD_DATA * !((drive_ & KEYBOARD_DATA_LOW) || keyboard.data_low) |
           EDM_CLOCK * !((drive_ & EDM_CLOCK_LOW) || computer.clock_low) |
           EDM_DATA * !((drive_ & EDM_DATA_LOW) || computer.data_low);
}

void Devices::bus(uint64_t now) {
    const unsigned level = lines();
    for (I2cDevice* device : {static_cast<I2cDevice*>(&eeprom), static_cast<I2cDevice*>(&keypad),
                              static_cast<I2cDevice*>(&display)})
        device->lines(now, level & I2C_SCL, level & I2C_SDA);
}

void Devices::advance(uint64_t now, unsigned drive) {
    constexpr unsigned BUS = I2C_SCL | I2C_SDA, KEYBOARD = KEYBOARD_CLOCK | KEYBOARD_DATA,
                       MACHINE = EDM_CLOCK | EDM_DATA;
    const bool woken = event_at_ == 0,
               shown = (drive ^ drive_) & (DISPLAY_CS_N | DISPLAY_SCLK | DISPLAY_DATA);
    drive_ = drive;
    if (shown) digits.pins(drive & DISPLAY_CS_N, drive & DISPLAY_SCLK, drive & DISPLAY_DATA);
    const unsigned changed = lines() ^ levels_;
    if (changed & BUS) bus(now);
    if ((changed & KEYBOARD) || woken || now >= keyboard_at_)
        keyboard_at_ = std::max(
            now + 1, keyboard.step(now, lines() & KEYBOARD_CLOCK, lines() & KEYBOARD_DATA));
    if ((changed & MACHINE) || woken || now >= computer_at_) {
        computer_at_ =
            std::max(now + 1, computer.step(now, lines() & EDM_CLOCK, lines() & EDM_DATA));
        if (fitted_ & FITTED_EDM)
            for (const uint8_t code : computer.keys) {
                edm.key(now, code);
                edm_at_ = 0;
            }
        computer.keys.clear();
    }
    if (woken || now >= edm_at_) edm_at_ = std::max(now + 1, edm.step(now, table_angle));
    const unsigned after = lines(), own = after ^ levels_ ^ changed;
    if (own & KEYBOARD) keyboard_at_ = now + 1;  // they see their own pulls a cycle later
    if (own & MACHINE) computer_at_ = now + 1;
    event_at_ = std::min({keyboard_at_, computer_at_, edm_at_});
    levels_ = after | EDM_CUTTING * edm.cutting.level() | EDM_ALARM * edm.alarming.level();
}

void Devices::power_cut(uint64_t now) {
    eeprom.power_cut(now);
    keypad.power_cut();
    digits.power_cut();
    display.power_up(now);
    wake();
}

void Devices::power_on(uint64_t now) {
    display.power_up(now);
    wake();
}

namespace {
constexpr const char* FAULTS =
    "eeprom_dead keypad_dead display_dead keyboard_dead scl_low sda_low edm_alarm edm_endless "
    "edm_deaf";
}

const char* Devices::faults() { return FAULTS; }

bool Devices::fault(const char* name, bool on) {
    const struct {
        const char* name;
        bool* flag;
        bool always;  // what is not there is dead
    } known[] = {{"eeprom_dead", &eeprom.dead, !(fitted_ & FITTED_EEPROM)},
                 {"keypad_dead", &keypad.dead, !(fitted_ & FITTED_KEYPAD)},
                 {"display_dead", &display.dead, !(fitted_ & FITTED_DISPLAY)},
                 {"keyboard_dead", &keyboard.dead, !(fitted_ & FITTED_KEYBOARD)},
                 {"scl_low", &scl_stuck_, false},
                 {"sda_low", &sda_stuck_, false},
                 {"edm_alarm", &edm.alarm, false},
                 {"edm_endless", &edm.endless, false},
                 {"edm_deaf", &edm.deaf, false}};
    for (const auto& fault : known)
        if (!std::strcmp(fault.name, name)) {
            *fault.flag = on || fault.always;
            wake();
            return true;
        }
    return false;
}

bool Devices::set(const char* name, double value) {
    double* found = find_parameter(p_, name);
    if (!found) return false;
    *found = value;
    configure();
    return true;
}

bool Devices::get(const char* name, double& value) {
    const double* found = find_parameter(p_, name);
    if (found) value = *found;
    return found;
}

const char* Devices::state_names() {
    return "time_s eeprom_writes# eeprom_torn# keypad_waiting# display_too_soon# back_light? "
           "digits_cut_short# keyboard_waiting# "
           "keyboard_sent# keyboard_aborts# keyboard_damaged_commands# keyboard_lights# "
           "computer_waiting# computer_damaged# "
           "computer_unanswered# computer_inhibits# edm_starts# edm_ignored# edm_cutting? "
           "edm_alarm?";
}

void Devices::state(uint64_t now, double* out) const {
    for (const double value : {double(now) / clk_hz_,
                               double(eeprom.writes),
                               double(eeprom.torn),
                               double(keypad.waiting()),
                               double(display.glass.too_soon),
                               double(display.back_light()),
                               double(digits.cut_short),
                               double(keyboard.waiting()),
                               double(keyboard.sent),
                               double(keyboard.aborts),
                               double(keyboard.damaged_commands),
                               double(keyboard.lights),
                               double(computer.waiting()),
                               double(computer.damaged),
                               double(computer.unanswered),
                               double(computer.inhibits),
                               double(edm.starts),
                               double(edm.ignored),
                               double(edm.cutting.on()),
                               double(edm.alarming.on())})
        *out++ = value;
}

}  // namespace twin
