use std::path::PathBuf;
use std::process::{Command, Output};

use tempfile::TempDir;

pub const ACCURACY: &str = env!("CARGO_BIN_EXE_accuracy");
pub const GPU: &str = env!("CARGO_BIN_EXE_gpu");
pub const SPEED: &str = env!("CARGO_BIN_EXE_speed");

/// A temporary folder in which a program runs.
pub struct Folder {
    folder: TempDir,
    program: &'static str,
}

impl Folder {
    pub fn new(program: &'static str) -> Self {
        Self { folder: TempDir::new().unwrap(), program }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    fn run(&self, words: &str) -> Output {
        Command::new(self.program).args(words.split_whitespace()).current_dir(self.folder.path()).output().unwrap()
    }

    /// Runs the program, which must succeed without a word on standard error. Returns what it prints.
    pub fn done(&self, words: &str) -> String {
        let Output { status, stdout, stderr } = self.run(words);
        let [stdout, stderr] = [stdout, stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        assert!(status.success() && stderr.is_empty(), "{words}: {status}: {stderr}{stdout}");
        stdout
    }

    /// Runs the program, which must fail and say why in one line that contains `expected`.
    #[track_caller]
    pub fn refuses(&self, words: &str, expected: &[&str]) {
        let Output { status, stdout, stderr } = self.run(words);
        let line = String::from_utf8(stderr).unwrap();
        assert_eq!((status.code(), stdout.len()), (Some(1), 0), "{words}: {line}");
        assert!(line.starts_with("error: ") && line.matches('\n').count() == 1 && line.ends_with('\n'), "{line:?}");
        assert!(expected.iter().all(|word| line.contains(word)), "{words}: {line}");
    }
}
