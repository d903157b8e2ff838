//! What the tests of several crates share: oracles, random numbers, and a table of fields to run every law over.

pub mod any_field;
pub mod dual;
pub mod extremes;
pub mod lanes;
pub mod methods;
pub mod oracle;
pub mod random;
pub mod scenes;
pub mod stability;

/// The README's example is compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
