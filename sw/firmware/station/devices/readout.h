// SPDX-License-Identifier: Apache-2.0
// readout -- the position of axis 0 on a numeric display of eight digits (MAX7219).
#ifndef MOIRE_READOUT_H
#define MOIRE_READOUT_H

void readout_start(unsigned axes);
void readout_work(void);

#endif
