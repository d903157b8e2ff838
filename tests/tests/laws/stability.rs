//! The promises of docs/stability.md.

mod jitter;
mod promises;
