//! All integration tests of the crate, in one program.

mod certify;
mod complete;
mod examples;
mod overlap;
mod saves;
