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
         const unsigned char {name}[{size}] = {{\n",
        about.replace("*/", "* /")
    );
    lines(&mut text, blob);
    writeln!(text, "}};\nconst size_t {name}_bytes = {size};").expect("a String takes all text");
    text
}

/// Rust: `pub static NAME: [u8; …]`.
pub fn rust_table(blob: &[u8], name: &str, about: &str) -> String {
    let (name, size) = (identifier(name).to_uppercase(), blob.len());
    let mut text = format!(
        "// {} Written by sdftool. For sdf_core::grid::Blob::open.\n\
         #[rustfmt::skip]\n\
         pub static {name}: [u8; {size}] = [\n",
        about.replace('\n', " ")
    );
    lines(&mut text, blob);
    text.push_str("];\n");
    text
}

fn lines(text: &mut String, blob: &[u8]) {
    // Three digits and a comma.
    text.reserve(4 * blob.len() + blob.len() / LINE + 1);
    for line in blob.chunks(LINE) {
        line.iter().for_each(|byte| write!(text, "{byte},").expect("a String takes all text"));
        text.push('\n');
    }
}

/// The name, then `_sdf`, with `_` for whatever may not stand in one, and before a digit in front; `sdf` if nothing else is left.
/// C reserves names that begin with two.
fn identifier(name: &str) -> String {
    let letters = name.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' });
    let letters: String = letters.collect();
    match letters.trim_start_matches('_') {
        "" => "sdf".to_owned(),
        letters if letters.starts_with(|first: char| first.is_ascii_digit()) => format!("_{letters}_sdf"),
        letters => format!("{letters}_sdf"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_allowed_in_c() {
        for (name, wanted) in [
            ("part", "part_sdf"),
            ("my part-2", "my_part_2_sdf"),
            ("2 parts", "_2_parts_sdf"),
            ("", "sdf"),
            ("-", "sdf"),
            ("\u{6c34}\u{74f6}", "sdf"),
            ("__Part", "Part_sdf"),
        ] {
            let table = c_table(&[1, 2], name, "");
            assert!(table.contains(&format!("unsigned char {wanted}[2]")), "{table}");
            assert!(table.contains(&format!("size_t {wanted}_bytes = 2;")), "{table}");
            assert!(rust_table(&[1, 2], name, "").contains(&format!("static {}: [u8; 2]", wanted.to_uppercase())));
        }
    }
}
