//! The program `sdftool` as a process of its own.

use std::ffi::OsStr;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use serde_json::Value;

/// Runs `sdftool WORDS… --json` and returns what it prints.
///
/// The program is expected beside the one that runs, where cargo puts both.
pub fn sdftool(words: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Result<Value> {
    let program = std::env::current_exe()?.with_file_name(format!("sdftool{}", std::env::consts::EXE_SUFFIX));
    if !program.exists() {
        bail!("{} is missing: build it first, with `cargo build --release -p sdftool`", program.display());
    }
    let mut command = Command::new(&program);
    let output = command.args(words).arg("--json").stdin(Stdio::null()).output();
    let output = output.with_context(|| program.display().to_string())?;
    if !output.status.success() {
        bail!("{command:?}: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}
