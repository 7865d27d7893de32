// SPDX-License-Identifier: Apache-2.0
// flash -- the serial flash of a node, through the port of the serial core.
#ifndef MOIRE_FLASH_H
#define MOIRE_FLASH_H

#include <stdbool.h>
#include <stdint.h>

#define FLASH_SECTOR 4096u  // bytes that are erased together
#define FLASH_PAGE 256u     // bytes that one command may program; it may not go beyond their end

uint32_t flash_start(void);  // byte address of image 0; 0: the port is not built
unsigned flash_image(void);  // the image that runs: 0 to 2

void flash_read(uint32_t address, void* to, uint32_t bytes);

// Both only begin: the flash is busy afterwards, and takes no other command.
void flash_erase(uint32_t address);  // of a sector
void flash_program(uint32_t address, const void* from, uint32_t bytes);
bool flash_busy(void);
bool flash_wait(void);  // until a page is programmed, 3 ms; false if the flash does not end

// Copies an image into the memory and starts it. Unless flash_keep is called in time, an image on
// trial is replaced by image 0.
void flash_run(unsigned image, bool trial);
void flash_keep(void);

#endif
