// SPDX-License-Identifier: Apache-2.0
// core_run -- run a program on a Verilated soft core, whose registers are words that keep what is
// written.
//
//   core_run CYCLES [ADDRESS=VALUE …]
//
// With CODE, the name of a file of hexadecimal words, the core has a flash with these words.
//
// A read of ADDRESS gives VALUE until it is written; the time stamp counts cycles. Each write to
// the last register ends a section of the program: core_run prints the number that was written and
// the cycle. 0 ends the run; a trap or CYCLES cycles without it are a failure.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <vector>

#include "Vtop.h"
#include "firmware/made/registers.h"
#include "twin/devices/serial_flash.h"
#include "verilated.h"

namespace {
constexpr uint32_t LAST_REGISTER = 0xFFFC;
constexpr uint64_t RESET = 4;  // cycles
}  // namespace

int main(int count, char** words) {
    if (count < 2) return 2;
    const uint64_t most = std::strtoull(words[1], nullptr, 0);
    std::vector<uint32_t> registers(0x4000, 0);
    for (int n = 2; n < count; n++) {
        char* rest;
        const uint32_t address = uint32_t(std::strtoul(words[n], &rest, 0));
        registers.at(address / 4) = uint32_t(std::strtoul(rest + 1, nullptr, 0));
    }
    auto top = std::make_unique<Vtop>();
    uint64_t now = 0;
    top->ready = 1;
#ifdef CODE
    std::ifstream file(CODE);
    std::vector<uint32_t> code;
    for (uint32_t word; file >> std::hex >> word;) code.push_back(word);
    twin::SerialFlash flash(code);
#endif
    for (top->rst = 1; now < most && !(now > RESET && top->trap); now++) {
        top->rst = now < RESET;
        top->clk = 0;
        top->eval();
        const bool select = top->select, write = top->write;
        const uint32_t address = top->address, wdata = top->wdata;
        top->clk = 1;
        top->eval();
#ifdef CODE
        top->flash_miso = flash.clk(top->flash_cs_n, top->flash_sclk, top->flash_mosi);
#endif
        if (!select) continue;
        if (write && address == LAST_REGISTER) {
            if (wdata == 0) return 0;
            std::printf("%u %llu\n", wdata, (unsigned long long)now);
        }
        if (write) registers[address / 4] = wdata;
        top->rdata =
            address == NODE_BASE + NODE_TIME_STAMP_LOW ? uint32_t(now) : registers[address / 4];
    }
    std::fprintf(stderr, "core_run: %s in cycle %llu\n", now < most ? "trap" : "no end",
                 (unsigned long long)now);
    return 1;
}
