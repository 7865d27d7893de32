// SPDX-License-Identifier: Apache-2.0
// Numeric display of eight digits on a MAX7219 (Maxim): words of 16 bits, the highest first, each
// bit taken with the rising edge of sclk and the word with that of cs_n. Bits 11..8 are the
// register, 7..0 its contents.
#pragma once
#include <array>
#include <cstdint>

namespace twin {

class NumericDisplay {
 public:
    static constexpr int DIGITS = 8;

    void power_cut() {
        registers_.fill(0);
        word_ = 0;
        bits_ = 0;
    }
    void pins(bool cs_n, bool sclk, bool data) {  // whenever one of them has changed
        if (sclk && !sclk_ && !cs_n) {
            word_ = uint16_t(word_ << 1 | data);
            bits_++;
        }
        if (cs_n && !cs_n_) {
            if (bits_ >= 16)
                registers_[word_ >> 8 & 15] = uint8_t(word_);
            else
                cut_short++;
            bits_ = 0;
        }
        cs_n_ = cs_n;
        sclk_ = sclk;
    }
    void segments(uint8_t* out) const {  // of each digit from the left: point, A..G from bit 7 down
        for (unsigned n = DIGITS; n--;) {
            const uint8_t code = registers_[DIGIT_0 + n];
            const uint8_t lit =
                registers_[DECODE] >> n & 1 ? (code & 0x80) | CODE_B[code & 15] : code;
            *out++ = registers_[TEST] & 1                                         ? 0xFF
                     : (registers_[ON] & 1) && n <= (registers_[SCAN_LIMIT] & 7u) ? lit
                                                                                  : 0;
        }
    }

    uint64_t cut_short = 0;  // words of less than 16 bits

 private:
    enum Register { DIGIT_0 = 1, DECODE = 9, SCAN_LIMIT = 11, ON = 12, TEST = 15 };
    static constexpr uint8_t CODE_B[16] = {0x7E, 0x30, 0x6D, 0x79, 0x33, 0x5B, 0x5F, 0x70,
                                           0x7F, 0x7B, 0x01, 0x4F, 0x37, 0x0E, 0x67, 0x00};

    std::array<uint8_t, 16> registers_{};
    uint16_t word_ = 0;
    int bits_ = 0;
    bool cs_n_ = true, sclk_ = false;
};

}  // namespace twin
