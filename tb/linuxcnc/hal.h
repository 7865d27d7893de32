// SPDX-License-Identifier: Apache-2.0
// hal.h -- the types of the HAL of LinuxCNC that made/pins.h names, for tests without LinuxCNC.
#ifndef HAL_H
#define HAL_H

#include <stdbool.h>
#include <stdint.h>

typedef bool hal_bit_t;
typedef double hal_float_t;
typedef int32_t hal_s32_t;
typedef uint32_t hal_u32_t;
typedef enum { HAL_BIT, HAL_FLOAT, HAL_S32, HAL_U32 } hal_type_t;
typedef enum { HAL_IN, HAL_OUT, HAL_IO } hal_pin_dir_t;

#endif
