// SPDX-License-Identifier: Apache-2.0
// A serial flash with the firmware of a node, in SPI mode 0. It sleeps until command ABh, and
// answers command 03h with its bytes from the address on; all others it ignores. Its bytes outside
// the firmware are FFh.
#pragma once
#include <cstdint>
#include <utility>
#include <vector>

namespace twin {

class SerialFlash {
 public:
    static constexpr uint32_t START = 0x20000;  // address of the firmware, FLASH_START of a node
    explicit SerialFlash(std::vector<uint32_t> firmware) : firmware_(std::move(firmware)) {}

    // The levels of its pins after a cycle; returns the level of its output.
    bool clk(bool cs_n, bool sclk, bool mosi) {
        if (cs_n) {
            if (bits_ >= 8 && command_ == WAKE) awake_ = true;
            bits_ = 0;
        } else if (sclk && !sclk_) {
            if (bits_ < 8) command_ = command_ << 1 | mosi;
            if (bits_ >= 8 && bits_ < 32) address_ = (address_ << 1 | mosi) & 0xFFFFFF;
            bits_++;
        } else if (!sclk && sclk_ && bits_ >= 32 && awake_ && command_ == READ) {
            const uint32_t bit = bits_ - 32;
            out_ = byte_at(address_ + bit / 8) >> (7 - bit % 8) & 1;
        }
        sclk_ = sclk;
        return out_;
    }

 private:
    static constexpr uint8_t WAKE = 0xAB, READ = 0x03;
    uint8_t byte_at(uint32_t address) const {
        const uint32_t at = address - START;
        return at / 4 < firmware_.size() ? uint8_t(firmware_[at / 4] >> 8 * (at % 4)) : 0xFF;
    }

    const std::vector<uint32_t> firmware_;
    uint32_t bits_ = 0, address_ = 0;
    uint8_t command_ = 0;
    bool awake_ = false, sclk_ = false, out_ = true;
};

}  // namespace twin
