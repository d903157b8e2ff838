//! Shared parts of the tests: oracles, random numbers, and tables of fields and methods that every law runs over.

pub mod dual;
pub mod extremes;
pub mod lanes;
pub mod methods;
pub mod oracle;
pub mod own_number;
pub mod random;
pub mod scene_field;
pub mod scenes;
pub mod stability;

/// The examples of the READMEs are compiled and run.
#[cfg(doctest)]
mod readmes {
    #[doc = include_str!("../../README.md")]
    struct Whole;

    #[doc = include_str!("../../core/README.md")]
    struct Core;

    #[doc = include_str!("../../bake/README.md")]
    struct Bake;

    #[doc = include_str!("../../formats/README.md")]
    struct Formats;

    #[doc = include_str!("../../field/README.md")]
    struct Field;

    #[doc = include_str!("../../procedural/README.md")]
    struct Procedural;
}
