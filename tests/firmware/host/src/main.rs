use std::io::{self, Write};

fn main() -> io::Result<()> {
    let mut lines = Vec::new();
    scene::report(|byte| lines.push(byte));
    io::stdout().write_all(&lines)
}
