//! Progress of a bake.

/// Work done so far, and all of it as far as it is known, in steps of no fixed length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// So many more steps are to come.
    Total(u64),
    /// So many more are done.
    Done(u64),
}
