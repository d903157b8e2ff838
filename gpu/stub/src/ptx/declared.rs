//! Types and declarations of PTX.

/// Bytes of a type such as `b32`.
pub fn bytes_of(type_: &str) -> usize {
    match type_.trim_start_matches(['b', 'f', 'u', 's']) {
        "8" => 1,
        "16" => 2,
        "32" => 4,
        "64" => 8,
        _ => panic!("the type {type_}"),
    }
}

/// Name and length of a declaration such as `.param .align 16 .b8 name[320]`.
pub fn declared(text: &str) -> (&str, usize) {
    let words: Vec<&str> = text.split_whitespace().collect();
    let name = words.last().expect("a name");
    let is_type = |word: &&&str| word.strip_prefix(['.']).is_some_and(|type_| type_.ends_with(char::is_numeric));
    let type_ = words.iter().find(is_type).expect("a type").trim_start_matches('.');
    match name.split_once('[') {
        Some((name, count)) => {
            let count: usize = count.trim_end_matches(']').parse().expect("a length");
            (name, count * bytes_of(type_))
        }
        None => (name, bytes_of(type_)),
    }
}
