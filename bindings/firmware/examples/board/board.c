/* Start of a Cortex-M4F without a C library, and letters to the debugger by Arm's semihosting. */
#include <stdint.h>

extern uint32_t stack_end, data_start, data_end, data_in_flash, bss_start, bss_end;
extern int main(void);

static int debugger(uint32_t operation, uintptr_t argument) {
    register uint32_t r0 __asm("r0") = operation;
    register uintptr_t r1 __asm("r1") = argument;
    __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return (int)r0;
}

void put(char letter) { debugger(0x03, (uintptr_t)&letter); }

void reset(void) {
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* CPACR: the floating-point unit */
    __asm volatile("dsb; isb");
    for (uint32_t *to = &data_start, *from = &data_in_flash; to < &data_end;) *to++ = *from++;
    for (uint32_t *to = &bss_start; to < &bss_end;) *to++ = 0;
    /* ADP_Stopped_ApplicationExit, or an unknown error. */
    debugger(0x18, main() == 0 ? 0x20026 : 0x20024);
    for (;;) {}
}

__attribute__((section(".vectors"), used)) void *const vectors[] = {&stack_end, (void *)reset};
