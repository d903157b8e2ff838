#![no_std]
#![no_main]

use core::arch::asm;
use core::panic::PanicInfo;

use cortex_m_rt::entry;

#[entry]
fn main() -> ! {
    scene::report(|byte| ask_debugger(WRITE_BYTE, (&raw const byte).addr()));
    exit(APPLICATION_EXIT)
}

/// Not linked as long as nothing can panic; the test looks for that.
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
        ask_debugger(EXIT, reason);
    }
}

/// Stops the processor; the debugger, here QEMU, carries out the operation and lets it go on.
fn ask_debugger(operation: usize, argument: usize) {
    // SAFETY: of the two operations one reads the byte that the argument is the address of, the other reads nothing.
    unsafe { asm!("bkpt 0xab", inout("r0") operation => _, in("r1") argument, options(nostack, preserves_flags)) };
}
