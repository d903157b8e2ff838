//! The command lines.

use crate::program::{ACCURACY, Folder, GPU, SPEED};

/// In a debug build clap checks the arguments before it prints them.
#[test]
fn the_command_lines_are_consistent() {
    for program in [ACCURACY, GPU, SPEED] {
        assert!(Folder::new(program).done("--help").contains("Usage: "));
    }
}
