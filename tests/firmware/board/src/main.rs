#![no_std]
#![no_main]

use core::arch::asm;
use core::panic::PanicInfo;

use cortex_m_rt::{STACK_PAINT_VALUE, entry};
use scene::page::Page;

#[entry]
fn main() -> ! {
    let write = |byte: u8| call_debugger(WRITE_BYTE, (&raw const byte).addr());
    scene::report(write);
    // A line of the board alone, which `.ci/firmware.sh` takes off before it compares the others.
    let mut page = Page(write);
    page.integer("bytes of stack never used:", untouched_stack());
    page.text("\n");
    exit(APPLICATION_EXIT)
}

unsafe extern "C" {
    /// Lowest word of the stack, behind all data, and the end of it: placed by the linker script of cortex-m-rt.
    static _stack_end: u32;
    static _stack_start: u32;
}

/// Bytes at the low end of the stack that are as cortex-m-rt painted them before `main`. A stack that grew beyond its end has left none.
fn untouched_stack() -> u32 {
    let (mut word, end) = (&raw const _stack_end, &raw const _stack_start);
    let mut untouched = 0;
    // SAFETY: words between the two are memory of the stack, which no reference points to.
    while word < end && unsafe { word.read_volatile() } == STACK_PAINT_VALUE {
        (word, untouched) = (word.wrapping_add(1), untouched + 4);
    }
    untouched
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
