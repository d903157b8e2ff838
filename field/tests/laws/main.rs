//! All integration tests of the crate, in one program.

mod examples;
mod overlap;
mod saves;
