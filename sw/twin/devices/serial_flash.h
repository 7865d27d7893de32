// SPDX-License-Identifier: Apache-2.0
// A serial flash with the firmware of a node, in SPI mode 0. It sleeps until command ABh. Then it
// reads from an address on (03h), erases a sector (20h) and programs bytes of a page (02h) after
// command 06h, and reports in its status (05h) that it does; meanwhile it takes no other command.
// All others it ignores. Its bytes outside the firmware are FFh. Erasing takes 20 000 cycles,
// programming 2000, which is less than in a real flash.
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

namespace twin {

class SerialFlash {
 public:
    static constexpr uint32_t START = 0x20000;  // address of the firmware, FLASH_START of a node
    explicit SerialFlash(const std::vector<uint32_t>& firmware) : bytes_(0x80000, 0xFF) {
        for (size_t n = 0; n < 4 * firmware.size() && START + n < bytes_.size(); n++)
            bytes_[START + n] = uint8_t(firmware[n / 4] >> 8 * (n % 4));
    }

    // The levels of its pins after a cycle; returns the level of its output.
    bool clk(bool cs_n, bool sclk, bool mosi) {
        if (busy_ > 0) busy_--;
        if (cs_n) {
            if (bits_ >= 8) execute();
            bits_ = 0;
        } else if (sclk && !sclk_) {
            if (bits_ < 8) command_ = uint8_t(command_ << 1 | mosi);
            if (bits_ >= 8 && bits_ < 32) address_ = (address_ << 1 | mosi) & 0xFFFFFF;
            if (bits_ >= 32) data_ = uint8_t(data_ << 1 | mosi);
            bits_++;
            if (bits_ > 32 && bits_ % 8 == 0 && command_ == PROGRAM && enabled_)
                byte_at(address_ / PAGE * PAGE + (address_ + bits_ / 8 - 5) % PAGE) &= data_;
        } else if (!sclk && sclk_ && awake_) {
            if (bits_ >= 32 && command_ == READ && busy_ == 0) {
                const uint32_t bit = bits_ - 32;
                out_ = byte_at(address_ + bit / 8) >> (7 - bit % 8) & 1;
            }
            if (bits_ >= 8 && command_ == STATUS) out_ = bits_ % 8 == 7 && busy_ > 0;
        }
        sclk_ = sclk;
        return out_;
    }

 private:
    static constexpr uint8_t PROGRAM = 0x02, READ = 0x03, STATUS = 0x05, WRITE_ENABLE = 0x06,
                             ERASE = 0x20, WAKE = 0xAB;
    static constexpr uint32_t PAGE = 256, SECTOR = 4096, PROGRAMS = 2000, ERASES = 20000;
    uint8_t& byte_at(uint32_t address) { return bytes_[address % bytes_.size()]; }
    void execute() {  // a command has ended
        if (command_ == WAKE) awake_ = true;
        if (command_ == WRITE_ENABLE && awake_ && busy_ == 0) {
            enabled_ = true;
        } else if (enabled_ && command_ == ERASE) {
            const auto first = bytes_.begin() + address_ % bytes_.size() / SECTOR * SECTOR;
            std::fill(first, first + SECTOR, uint8_t(0xFF));
            busy_ = ERASES;
            enabled_ = false;
        } else if (enabled_ && command_ == PROGRAM) {
            busy_ = PROGRAMS;
            enabled_ = false;
        }
    }

    std::vector<uint8_t> bytes_;
    uint32_t bits_ = 0, address_ = 0, busy_ = 0;  // busy_: cycles
    uint8_t command_ = 0, data_ = 0;
    bool awake_ = false, enabled_ = false, sclk_ = false, out_ = true;
};

}  // namespace twin
