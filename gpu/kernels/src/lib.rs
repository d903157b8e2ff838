//! Kernels for NVIDIA GPUs: the functions of `sdf-core` and nothing beside them, one thread per element, or a team.
//!
//! | file | holds |
//! |---|---|
//! | `abi` | plain numbers that the host sends and reads; the same file as in `sdf-gpu` |
//! | `fields` | fields made of these numbers |
//! | `team` | grids whose lanes eight threads share |
//! | `stages` | cull, search, report |
//! | `kernels` | which kernels there are |
//!
//! No product and sum is contracted to an fma, so that every answer has the bits of the CPU's `f32`. All files but this one compile for
//! the CPU, too: `gpu/stub` runs them there.

#![no_std]
#![feature(abi_ptx, asm_experimental_arch, link_llvm_intrinsics, stdarch_nvptx)]
#![allow(internal_features, reason = "no other way to a shuffle")]

#[path = "../../src/abi.rs"]
mod abi;
mod fields;
mod kernels;
mod stages;
mod team;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // SAFETY: ends the kernel with an error that the host sees.
    unsafe { core::arch::nvptx::trap() }
}
