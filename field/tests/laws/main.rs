//! All integration tests of the crate, in one program.

mod complete;
mod examples;
// Only its count of memory is needed here.
#[allow(dead_code)]
#[path = "../../../formats/tests/formats/memory.rs"]
mod memory;
mod overlap;
mod saves;
mod visited_contacts;
