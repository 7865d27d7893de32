// SPDX-License-Identifier: Apache-2.0
// Character display of 4 lines of 20 behind an I2C port: HD44780 (Hitachi) on a PCF8574 (NXP),
// wired as the common boards are: P0 RS, P1 RW, P2 E, P3 back light, P4..P7 data. What is written
// while the display is busy is lost, and counted.
#pragma once
#include <array>

#include "devices/i2c_device.h"

namespace twin {

class Hd44780 {
 public:
    static constexpr int LINES = 4, COLUMNS = 20;

    void configure(double clk_hz) { clk_hz_ = clk_hz; }
    void power_up(uint64_t now) {
        *this = Hd44780(clk_hz_, too_soon);
        characters_.fill(' ');
        busy_until_ = now + clk(POWER_UP);
    }
    void strobe(uint64_t now, bool data, unsigned nibble) {  // falling edge of E with RW low
        if (!four_bits_) return execute(now, data, uint8_t(nibble << 4));
        if (half_) execute(now, data, uint8_t(high_ << 4 | nibble));
        high_ = nibble;
        half_ = !half_;
    }
    unsigned shown(uint64_t now, bool data) const {  // the nibble that a read finds while E is high
        const unsigned byte =
            data ? characters_[address_] : unsigned(now < busy_until_) << 7 | address_;
        return four_bits_ && half_ ? byte & 15 : byte >> 4;
    }
    void shown_to_end(bool data) {  // falling edge of E with RW high
        if (four_bits_) half_ = !half_;
        if (data && !half_) advance();
    }
    void text(uint8_t* out) const {  // codes of the characters, line by line
        for (unsigned line = 0; line < LINES; line++)
            for (unsigned column = 0; column < COLUMNS; column++) {
                const unsigned cell = (line / 2 * COLUMNS + column + shift_) % ROW;
                *out++ = on_ && (two_rows_ || line % 2 == 0)
                             ? characters_[(line % 2) * SECOND + cell]
                             : ' ';
            }
    }

    uint64_t too_soon = 0;

    explicit Hd44780(double clk_hz = 1, uint64_t too_soon = 0)
        : too_soon(too_soon), clk_hz_(clk_hz) {}

 private:
    static constexpr unsigned ROW = 40, SECOND = 0x40;
    static constexpr double POWER_UP = 15e-3, MOST = 37e-6, CLEARING = 1.52e-3;

    uint64_t clk(double seconds) const { return uint64_t(seconds * clk_hz_ + 1); }
    void advance() { address_ = moved(up_ ? 1 : -1); }
    uint8_t moved(int by) const {  // 0x00..0x27 and 0x40..0x67 make one ring
        const int cell = int(address_ % SECOND + (address_ >= SECOND ? ROW : 0)) + by,
                  wrapped = (cell + 2 * int(ROW)) % (2 * int(ROW));
        return uint8_t(wrapped < int(ROW) ? wrapped : wrapped - int(ROW) + int(SECOND));
    }
    void execute(uint64_t now, bool data, uint8_t byte) {
        if (now < busy_until_) {
            too_soon++;
            return;
        }
        busy_until_ = now + clk(!data && byte < 4 ? CLEARING : MOST);
        if (data) {
            if (!drawing_) {
                characters_[address_] = byte;
                if (shifts_) shift_ = (shift_ + (up_ ? 1 : ROW - 1)) % ROW;
                advance();
            }
        } else if (byte & 0x80) {
            address_ = (byte & 0x3F) < ROW ? byte & 0x7F : 0;
            drawing_ = false;
        } else if (byte & 0x40) {
            drawing_ = true;  // characters of one's own are not shown here
        } else if (byte & 0x20) {
            four_bits_ = !(byte & 0x10);
            two_rows_ = byte & 0x08;
        } else if (byte & 0x10) {
            const bool right = byte & 0x04;
            if (byte & 0x08)
                shift_ = (shift_ + (right ? ROW - 1 : 1)) % ROW;
            else
                address_ = moved(right ? 1 : -1);
        } else if (byte & 0x08) {
            on_ = byte & 0x04;
        } else if (byte & 0x04) {
            up_ = byte & 0x02;
            shifts_ = byte & 0x01;
        } else if (byte) {  // home, and clear
            if (byte == 1) characters_.fill(' ');
            if (byte == 1) up_ = true;
            address_ = 0;
            shift_ = 0;
            drawing_ = false;
        }
    }

    double clk_hz_;
    uint64_t busy_until_ = 0;
    std::array<uint8_t, 128> characters_{};
    uint8_t address_ = 0;
    unsigned shift_ = 0, high_ = 0;
    bool four_bits_ = false, two_rows_ = false, on_ = false, up_ = true, shifts_ = false,
         drawing_ = false;
    bool half_ = false;  // the high nibble has come
};

class CharacterDisplay : public I2cDevice {
 public:
    static constexpr unsigned ADDRESS = 0x27;

    CharacterDisplay() : I2cDevice(ADDRESS) {}
    void power_up(uint64_t now) {
        let_go();
        port_ = 0xFF;
        glass.power_up(now);
    }
    bool back_light() const { return port_ & BACK_LIGHT; }

    Hd44780 glass;

 protected:
    bool addressed(uint64_t, bool) override { return true; }
    bool written(uint64_t now, uint8_t byte) override {
        if ((port_ & E) && !(byte & E)) {
            if (port_ & RW)
                glass.shown_to_end(port_ & RS);
            else
                glass.strobe(now, port_ & RS, port_ >> 4);
        }
        port_ = byte;
        return true;
    }
    uint8_t read(uint64_t now) override {  // a pin is low if the port or the display pulls it
        const bool shows = (port_ & RW) && (port_ & E);
        return port_ & (shows ? uint8_t(glass.shown(now, port_ & RS) << 4 | 15) : 0xFF);
    }

 private:
    enum Pin : uint8_t { RS = 1, RW = 2, E = 4, BACK_LIGHT = 8 };

    uint8_t port_ = 0xFF;
};

}  // namespace twin
