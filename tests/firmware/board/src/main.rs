#![no_std]
#![no_main]

use core::arch::asm;
use core::panic::PanicInfo;

use cortex_m_rt::entry;

#[entry]
fn main() -> ! {
    scene::report(|byte| call_debugger(WRITE_BYTE, (&raw const byte).addr()));
    exit(APPLICATION_EXIT)
}

/// Not linked as long as nothing can panic, which `.ci/firmware.sh` checks.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    exit(RUN_TIME_ERROR)
}

/// Operations and reasons to exit, from Arm's "Semihosting for AArch32 and AArch64".
const WRITE_BYTE: usize = 0x03;
const EXIT: usize = 0x18;
const APPLICATION_EXIT: usize = 0x20026;
const RUN_TIME_ERROR: usize = 0x20023;

fn exit(reason: usize) -> ! {
    loop {
        call_debugger(EXIT, reason);
    }
}

/// Stops the processor. The debugger, here QEMU, performs the operation and resumes it.
fn call_debugger(operation: usize, argument: usize) {
    // SAFETY: one operation reads the byte at the address `argument`, the other reads no memory.
    unsafe { asm!("bkpt 0xab", inout("r0") operation => _, in("r1") argument, options(nostack, preserves_flags)) };
}
