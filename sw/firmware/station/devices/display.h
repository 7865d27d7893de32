// SPDX-License-Identifier: Apache-2.0
// display -- four lines of 20 characters: HD44780 behind an I2C port PCF8574.
#ifndef MOIRE_DISPLAY_H
#define MOIRE_DISPLAY_H

#include <stdbool.h>
#include <stdint.h>

#define DISPLAY_LINES 4u
#define DISPLAY_COLUMNS 20u

void display_start(unsigned axes);
void display_work(void);
bool display_present(void);

// Shows a text of at most DISPLAY_COLUMNS characters; the remaining columns become blank.
void display_show(unsigned line, const char* text);

#endif
