// SPDX-License-Identifier: Apache-2.0
// Microchip 24AA128: 16 KiB in pages of 64 bytes. A write rolls over within its page and begins
// with the stop; until it has ended the device does not acknowledge. The whole page is written
// again, so a power cut during the write may leave each of its bytes with its old value, its new
// value, or any other.
#pragma once
#include <algorithm>
#include <array>

#include "devices/i2c_device.h"
#include "parts/random_source.h"

namespace twin {

class Eeprom : public I2cDevice {
 public:
    static constexpr unsigned ADDRESS = 0x50, BYTES = 16384, PAGE = 64;

    Eeprom(uint64_t seed, uint64_t stream) : I2cDevice(ADDRESS), random_(seed, stream) {
        memory.fill(0xFF);
    }
    void power_cut(uint64_t now) {
        if (now < busy_until_)
            for (unsigned n = 0; n < PAGE; n++) {
                const uint64_t choice = random_.bits() % 3;
                if (choice == 0) memory[page_ + n] = before_[n];
                if (choice == 1) memory[page_ + n] = uint8_t(random_.bits());
            }
        torn += now < busy_until_;
        busy_until_ = 0;
        let_go();
    }

    std::array<uint8_t, BYTES> memory;
    uint64_t write_clk = 0;
    uint64_t writes = 0, torn = 0;  // pages

 protected:
    bool addressed(uint64_t now, bool) override {
        came_ = 0;
        return now >= busy_until_;
    }
    bool written(uint64_t, uint8_t byte) override {
        if (came_ < 2) {
            pointer_ = (pointer_ << 8 | byte) % BYTES;
            if (++came_ == 2) new_.fill(-1);
            return true;
        }
        came_ = 3;
        new_[pointer_ % PAGE] = byte;
        pointer_ = pointer_ / PAGE * PAGE + (pointer_ + 1) % PAGE;
        return true;
    }
    uint8_t read(uint64_t) override {
        const uint8_t byte = memory[pointer_];
        pointer_ = (pointer_ + 1) % BYTES;
        return byte;
    }
    void ended(uint64_t now, bool stopped) override {
        if (!stopped || came_ < 3) return;
        page_ = pointer_ / PAGE * PAGE;
        std::copy_n(&memory[page_], PAGE, before_.begin());
        for (unsigned n = 0; n < PAGE; n++)
            if (new_[n] >= 0) memory[page_ + n] = uint8_t(new_[n]);
        busy_until_ = now + write_clk;
        writes++;
    }

 private:
    RandomSource random_;
    unsigned pointer_ = 0, page_ = 0;
    int came_ = 0;                 // bytes since the address; 3: data
    std::array<int, PAGE> new_{};  // -1: not written
    std::array<uint8_t, PAGE> before_{};
    uint64_t busy_until_ = 0;
};

}  // namespace twin
