//! All integration tests of the crate, in one program.

mod complete;
mod doors;
mod examples;
mod overlap;
mod saves;
