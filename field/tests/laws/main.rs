//! All integration tests of the crate, in one program.

mod complete;
mod exact;
mod doors;
mod examples;
#[cfg(feature = "exchange")]
mod exchange;
mod overlap;
mod saves;
