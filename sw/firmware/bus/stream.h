// SPDX-License-Identifier: Apache-2.0
// stream -- plays set-points (position, velocity, time) that the host sends, as a part of an image.
//
// Between two set-points the target follows a cubic. Each set-point becomes one piece of constant
// jerk for the player, which is computed when it arrives; so the queue of the player is the queue
// of the stream.
#ifndef MOIRE_STREAM_H
#define MOIRE_STREAM_H

#include <stdint.h>

void stream_start(unsigned axes);
uint8_t stream_operation(uint8_t operation);  // a bus_cause

#endif
