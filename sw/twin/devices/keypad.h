// SPDX-License-Identifier: Apache-2.0
// Key-pad of 34 keys, 5 rows of 7 but one, behind a TCA8418 (Texas Instruments): key n, from 0, is
// at row n / 7, column n % 7, and its event has the number 10 row + column + 1, with bit 7 set when
// it goes down. Ten events wait; only keys whose row and column are switched to the key-pad
// (KP_GPIO) make any.
#pragma once
#include <array>
#include <deque>

#include "devices/i2c_device.h"

namespace twin {

class Keypad : public I2cDevice {
 public:
    static constexpr unsigned ADDRESS = 0x34;
    static constexpr int KEYS = 34, COLUMNS = 7;

    Keypad() : I2cDevice(ADDRESS) {}
    void power_cut() {  // the keys stay where they are
        registers_.fill(0);
        events_.clear();
        let_go();
    }
    void key(int n, bool down) {
        const int row = n / COLUMNS, column = n % COLUMNS;
        if (down_[size_t(n)] == down) return;
        down_[size_t(n)] = down;
        if (!(registers_[KP_GPIO_ROWS] >> row & 1) || !(registers_[KP_GPIO_COLUMNS] >> column & 1))
            return;
        registers_[INT_STAT] |= KEY_EVENT;
        if (events_.size() == DEPTH) {
            registers_[INT_STAT] |= OVERFLOWED;
            if (!(registers_[CFG] & SHIFT_ON_OVERFLOW)) return;
            events_.pop_front();
        }
        events_.push_back(uint8_t(down << 7 | (10 * row + column + 1)));
    }
    uint64_t waiting() const { return events_.size(); }

 protected:
    bool addressed(uint64_t, bool reads) override {
        pointed_ = reads;
        return true;
    }
    bool written(uint64_t, uint8_t byte) override {
        if (!pointed_) {
            pointer_ = byte;
            pointed_ = true;
            return true;
        }
        if (pointer_ == INT_STAT)
            registers_[INT_STAT] &= uint8_t(
                ~byte | (events_.empty() ? 0 : KEY_EVENT));  // set as long as an event waits
        else if (pointer_ < registers_.size() && (pointer_ < COUNT || pointer_ > LAST_EVENT))
            registers_[pointer_] = byte;
        next();
        return true;
    }
    uint8_t read(uint64_t) override {
        uint8_t byte = pointer_ < registers_.size() ? registers_[pointer_] : 0;
        if (pointer_ == COUNT) byte = uint8_t(events_.size());
        if (pointer_ >= FIRST_EVENT && pointer_ <= LAST_EVENT) {
            const size_t index = pointer_ - FIRST_EVENT;
            byte = index < events_.size() ? events_[index] : 0;
            if (index == 0 && byte) events_.pop_front();
        }
        next();
        return byte;
    }

 private:
    enum Register : uint8_t {
        CFG = 0x01,
        INT_STAT = 0x02,
        COUNT = 0x03,
        FIRST_EVENT = 0x04,
        LAST_EVENT = 0x0D,
        KP_GPIO_ROWS = 0x1D,
        KP_GPIO_COLUMNS = 0x1E
    };
    enum Bit : uint8_t {
        KEY_EVENT = 1,
        OVERFLOWED = 8,
        SHIFT_ON_OVERFLOW = 0x20,
        AUTO_INCREMENT = 0x80
    };
    static constexpr size_t DEPTH = 10;

    void next() { pointer_ = uint8_t(pointer_ + ((registers_[CFG] & AUTO_INCREMENT) != 0)); }

    std::array<uint8_t, 0x2F> registers_{};
    std::array<bool, KEYS> down_{};
    std::deque<uint8_t> events_;
    uint8_t pointer_ = 0;
    bool pointed_ = false;  // the register has been named
};

}  // namespace twin
