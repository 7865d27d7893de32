// SPDX-License-Identifier: Apache-2.0
// line -- frames in, requests done, replies out. docs/protocol.md
#ifndef MOIRE_LINE_H
#define MOIRE_LINE_H

#include <stdint.h>

void line_start(unsigned axes);
void line_poll(void);

#endif
