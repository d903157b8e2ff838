//! All integration tests of the crate, in one program.

mod complete;
mod examples;
mod in_motion;
mod overlap;
mod saves;
