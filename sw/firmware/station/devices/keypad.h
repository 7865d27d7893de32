// SPDX-License-Identifier: Apache-2.0
// keypad -- 34 keys on a key-pad controller TCA8418: 5 rows of 7, the last one short.
#ifndef MOIRE_KEYPAD_H
#define MOIRE_KEYPAD_H

#include <stdbool.h>
#include <stdint.h>

#define KEYPAD_KEYS 34u
#define KEYPAD_NONE 0xFFu

void keypad_start(unsigned axes);
void keypad_work(void);
bool keypad_present(void);

// The oldest key that was pressed, counted row by row from 0; KEYPAD_NONE if there is none.
uint8_t keypad_take(void);

#endif
