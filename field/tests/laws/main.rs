//! All integration tests of the crate, in one program.

mod certify;
mod complete;
mod doors;
mod exact;
mod examples;
#[cfg(feature = "exchange")]
mod exchange;
mod in_motion;
mod overlap;
mod saves;
