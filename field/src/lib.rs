//! Fields as a program holds them, and contacts with them in the widest vectors that the processor has.

#![forbid(unsafe_code)]

mod search;

pub use search::Search;
