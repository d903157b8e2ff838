//! All integration tests of the crate, in one program.

mod complete;
mod exact;
mod examples;
mod overlap;
mod saves;
