use std::io::Write;

use anyhow::{Context, Result};
use clap::CommandFactory;

use crate::args::{Args, CompletionsArgs, ManArgs};
use crate::standard_output::to_stdout;

pub fn completions(args: &CompletionsArgs) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Args::command(), "sdftool", &mut script);
    to_stdout(|out| out.write_all(&script))
}

/// The page of the program on standard output, or a page for each command into a folder.
pub fn man(args: &ManArgs) -> Result<()> {
    match &args.output {
        Some(folder) => {
            std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
            clap_mangen::generate_to(Args::command(), folder).with_context(|| folder.display().to_string())
        }
        None => {
            let mut page = Vec::new();
            clap_mangen::Man::new(Args::command()).render(&mut page)?;
            to_stdout(|out| out.write_all(&page))
        }
    }
}
