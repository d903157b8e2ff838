use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use anyhow::{Context, Result, bail};

/// Most bytes of a line.
const LONGEST_LINE: u64 = 1 << 16;

/// The points of a file, or of standard input.
pub fn read(path: &Path) -> Result<Vec<[f64; 3]>> {
    if path == Path::new("-") {
        return read_from(std::io::stdin(), "standard input");
    }
    let shown = path.display().to_string();
    read_from(std::fs::File::open(path).with_context(|| shown.clone())?, &shown)
}

/// Reads lines of x,y,z; semicolons or blanks may stand for the commas, and numbers may be quoted. A first line of column names, empty
/// lines and columns after the third are skipped.
pub fn read_from(source: impl Read, shown: &str) -> Result<Vec<[f64; 3]>> {
    let (mut source, mut points, mut line) = (BufReader::new(source), Vec::new(), String::new());
    for number in 1.. {
        line.clear();
        let read = source.by_ref().take(LONGEST_LINE + 1).read_line(&mut line);
        if read.with_context(|| format!("{shown}, line {number}"))? == 0 {
            break;
        }
        if line.len() as u64 > LONGEST_LINE {
            bail!("{shown}, line {number}: longer than {LONGEST_LINE} bytes: give one point a line");
        }
        let line = line.trim().trim_start_matches('\u{feff}');
        if line.is_empty() {
            continue;
        }
        let words: Vec<&str> = words(line).map(unquoted).take(3).collect();
        let numbers: Result<Vec<f64>, _> = words.iter().map(|word| word.parse::<f64>()).collect();
        match numbers.map(<[f64; 3]>::try_from) {
            Ok(Ok(point)) if point.iter().any(|x| !x.is_finite()) => {
                bail!("{shown}, line {number}: expected finite numbers, found {line:.60?}")
            }
            Ok(Ok(point)) => points.push(point),
            Ok(Err(found)) => bail!("{shown}, line {number}: expected 3 numbers, found {}", found.len()),
            Err(_) if number == 1 && is_header(line) => {}
            Err(_) => bail!("{shown}, line {number}: expected x,y,z with points for decimals, found {line:.60?}"),
        }
    }
    Ok(points)
}

/// Columns between semicolons, if there are any, else between commas, else between blanks: so a decimal comma is an error and
/// not a column.
fn words(line: &str) -> Box<dyn Iterator<Item = &str> + '_> {
    match [';', ','].into_iter().find(|separator| line.contains(*separator)) {
        Some(separator) => Box::new(line.split(separator).map(str::trim)),
        None => Box::new(line.split_whitespace()),
    }
}

/// A word without the quotation marks around it.
fn unquoted(word: &str) -> &str {
    word.strip_prefix('"').and_then(|word| word.strip_suffix('"')).map_or(word, str::trim)
}

/// `true` if no word is a number: numbers with something else between them are not names.
fn is_header(line: &str) -> bool {
    line.split(|c: char| matches!(c, ',' | ';' | '"' | '\'') || c.is_whitespace())
        .all(|word| word.parse::<f64>().is_err())
}
