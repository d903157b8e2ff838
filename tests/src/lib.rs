//! Shared parts of the tests: oracles, random numbers, and tables of fields and methods that every law runs over.

pub mod dual;
pub mod extremes;
pub mod lanes;
pub mod methods;
pub mod oracle;
pub mod random;
pub mod scene_field;
pub mod scenes;
pub mod stability;

/// The README's example is compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
