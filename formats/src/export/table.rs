//! A blob as the source of a table: C that any compiler takes, or Rust. It goes into flash with the program.

use std::fmt::Write;

/// Bytes in a line.
const LINE: usize = 24;

/// C: `const unsigned char NAME[]`, aligned to four bytes, and its size.
pub fn c_table(blob: &[u8], name: &str, about: &str) -> String {
    let (name, size) = (identifier(name), blob.len());
    let mut text = format!(
        "/* {} Written by sdftool. */\n\
         #include <stddef.h>\n\
         #if defined(__GNUC__)\n\
         __attribute__((aligned(4)))\n\
         #endif\n\
         const unsigned char {name}_sdf[{size}] = {{\n",
        about.replace("*/", "* /")
    );
    lines(&mut text, blob);
    writeln!(text, "}};\nconst size_t {name}_sdf_bytes = {size};").expect("a String takes all text");
    text
}

/// Rust: `pub static NAME: [u8; …]`.
pub fn rust_table(blob: &[u8], name: &str, about: &str) -> String {
    let (name, size) = (identifier(name).to_uppercase(), blob.len());
    let mut text = format!(
        "// {} Written by sdftool. For sdf_core::grid::Blob::open.\n\
         #[rustfmt::skip]\n\
         pub static {name}_SDF: [u8; {size}] = [\n",
        about.replace('\n', " ")
    );
    lines(&mut text, blob);
    text.push_str("];\n");
    text
}

fn lines(text: &mut String, blob: &[u8]) {
    for line in blob.chunks(LINE) {
        line.iter().for_each(|byte| write!(text, "{byte},").expect("a String takes all text"));
        text.push('\n');
    }
}

/// The name with `_` for whatever may not stand in one, and before a digit in front.
fn identifier(name: &str) -> String {
    let letters = name.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' });
    let prefix = if name.starts_with(|first: char| !first.is_ascii_digit()) { "" } else { "_" };
    prefix.chars().chain(letters).collect()
}
