//! All integration tests of the crate, in one program.

mod beyond_band;
#[cfg(feature = "exchange")]
mod blobs;
mod budgets;
mod certify;
mod combined_errors;
mod complete;
mod doors;
mod errors;
mod exact;
mod exact_bounds;
mod examples;
#[cfg(feature = "exchange")]
mod exchange;
#[cfg(feature = "exchange")]
mod exported_band;
mod first_touch;
mod in_motion;
mod lean;
// Only its count of memory is needed here.
#[allow(dead_code)]
#[path = "../../../formats/tests/formats/memory.rs"]
mod memory;
mod overlap;
mod reach;
mod refusals;
mod saves;
mod stretched;
mod unions;
mod visited_contacts;
