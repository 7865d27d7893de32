# SPDX-License-Identifier: Apache-2.0
# start -- from reset to main: sets the stack and clears the data. If main returns, the core stops, as after any trap, and the
# drive-enable interlock switches the drives off.
    .section .start, "ax"
    .globl _start
_start:
    la      sp, _stack_top
    la      t0, _zero_start
    la      t1, _zero_end
    j       2f
1:  sw      zero, 0(t0)                     # both are multiples of 16
    sw      zero, 4(t0)
    sw      zero, 8(t0)
    sw      zero, 12(t0)
    addi    t0, t0, 16
2:  bltu    t0, t1, 1b
    la      t0, _stack_limit
    li      t1, 0x4d6f6972                  # STACK_MARK
    sw      t1, 0(t0)
    call    main
    li      t0, 0x40000000                  # nothing is there: the core stops
    sw      zero, 0(t0)
