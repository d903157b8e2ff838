//! Standard output: for a dash in place of a file, and for reports.

use std::io::{self, BufWriter, Write, stdout};
use std::path::Path;

use anyhow::{Context, Result};

/// A dash stands for standard output. The report then goes to standard error.
pub fn is_standard_output(path: &Path) -> bool {
    path == Path::new("-")
}

/// The name of an output in messages and reports.
pub fn shown(path: &Path) -> String {
    if is_standard_output(path) { "standard output".to_owned() } else { path.display().to_string() }
}

/// Writes to standard output through a buffer.
pub fn to_stdout(write: impl FnOnce(&mut BufWriter<io::StdoutLock>) -> io::Result<()>) -> Result<()> {
    let mut out = BufWriter::new(stdout().lock());
    write(&mut out).and_then(|()| out.flush()).context("standard output")
}

/// Writes bytes to standard output.
pub fn print_bytes(bytes: &[u8]) -> Result<()> {
    to_stdout(|out| out.write_all(bytes))
}

/// Prints of a command that goes on without them once one fails: the work is worth more than its lines.
#[derive(Default)]
pub struct Prints(Option<anyhow::Error>);

impl Prints {
    /// Prints unless a print has failed.
    pub fn print(&mut self, print: impl FnOnce() -> Result<()>) {
        if self.0.is_none() {
            self.0 = print().err();
        }
    }

    /// The error of the print that failed.
    pub fn end(self) -> Result<()> {
        self.0.map_or(Ok(()), Err)
    }
}
