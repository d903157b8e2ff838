//! Values of options that clap cannot parse by itself.

use std::fmt;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use sdf_core::contact::MAX_REDUCED;
use sdf_core::grid::owned::{Layout, Precision};
use sdf_field::MaxError;
use sdf_field::file::Compression;
use sdf_formats::contact_file::ContactFormat;
use sdf_formats::mesh::MeshFormat;

use crate::standard_output::is_standard_output;

/// Numbers separated by commas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers<const N: usize>(pub [f64; N]);

impl<const N: usize> FromStr for Numbers<N> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, String> = text.split(',').map(|word| finite(word.trim())).collect();
        let numbers = numbers?;
        let found = numbers.len();
        numbers.try_into().map(Self).map_err(|_| format!("expected {N} numbers separated by commas, found {found}"))
    }
}

pub fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("{text:?} is not a finite number")),
    }
}

pub fn positive(text: &str) -> Result<f64, String> {
    finite(text).and_then(|number| if number > 0.0 { Ok(number) } else { Err("must be more than 0".to_owned()) })
}

/// A number of contacts that a reduction keeps.
pub fn reduced_count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=MAX_REDUCED).contains(&count) => Ok(count),
        _ => Err(format!("give a whole number from 1 to {MAX_REDUCED}")),
    }
}

/// A whole number in a range.
pub fn whole(range: RangeInclusive<u32>) -> impl Fn(&str) -> Result<u32, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| match (*range.start(), *range.end()) {
            (least, u32::MAX) => format!("give a whole number from {least} on"),
            (least, most) => format!("give a whole number from {least} to {most}"),
        })
    }
}

pub fn quaternion(text: &str) -> Result<Numbers<4>, String> {
    let numbers: Numbers<4> = text.parse()?;
    if numbers.0 == [0.0; 4] {
        Err("a zero quaternion is not a rotation; use 0,0,0,1 for none".to_owned())
    } else {
        Ok(numbers)
    }
}

/// The value of --max-error, shown as it is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorLimit(pub MaxError);

impl fmt::Display for ErrorLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            MaxError::Length(length) => write!(f, "{length:?}"),
            MaxError::Fraction(fraction) => write!(f, "{:?}%", MaxError::percent(fraction)),
        }
    }
}

pub fn max_error(text: &str) -> Result<ErrorLimit, String> {
    let error = match text.strip_suffix('%') {
        Some(percent) => positive(percent.trim_end()).map(|percent| MaxError::Fraction(percent / 100.0)),
        None => positive(text).map(MaxError::Length),
    };
    error.map(ErrorLimit)
}

pub fn layouts() -> impl TypedValueParser<Value = Layout> {
    let help = |layout| match layout {
        Layout::Dense => "A sample at every node of the box",
        Layout::Sparse => "Bricks of 8 × 8 × 8 samples near the surface, and every eighth node elsewhere",
    };
    let values = Layout::ALL.map(|layout| PossibleValue::new(layout.name()).help(help(layout)));
    PossibleValuesParser::new(values).map(|name| Layout::from_name(&name).expect("clap has checked the name"))
}

pub fn compressions() -> impl TypedValueParser<Value = Compression> {
    let help = |compression| match compression {
        Compression::Deflate => "Deflate: the smallest file",
        Compression::None => "As they are: the fastest",
    };
    let values = Compression::ALL.map(|kind| PossibleValue::new(kind.name()).help(help(kind)));
    PossibleValuesParser::new(values).map(|name| Compression::from_name(&name).expect("clap has checked the name"))
}

pub fn precisions() -> impl TypedValueParser<Value = Precision> {
    let help = |precision| match precision {
        Precision::F32 => "Single precision",
        Precision::U16 => "65,536 steps between the lowest and the highest sample of a block of 8 × 8 × 8 nodes",
        Precision::U8 => "256 steps",
    };
    let values = Precision::ALL.map(|precision| PossibleValue::new(precision.name()).help(help(precision)));
    PossibleValuesParser::new(values).map(|name| Precision::from_name(&name).expect("clap has checked the name"))
}

pub fn contact_file(path: PathBuf) -> Result<PathBuf, &'static str> {
    let is_known = is_standard_output(&path) || ContactFormat::from_extension(&path).is_some();
    is_known.then_some(path).ok_or("use a name that ends in .csv, .json, .ply or .h5, or - for CSV on standard output")
}

pub fn grid_file(path: PathBuf) -> Result<PathBuf, &'static str> {
    if is_standard_output(&path) {
        return Ok(path);
    }
    ends_in(path, &["h5", "hdf5"], "use a name that ends in .sdf.h5, .h5 or .hdf5, or - for standard output")
}

/// A grid that is joined from parts, which cannot go to standard output: the command says why.
pub fn merged_file(path: PathBuf) -> Result<PathBuf, &'static str> {
    if is_standard_output(&path) {
        return Ok(path);
    }
    ends_in(path, &["h5", "hdf5"], "use a name that ends in .sdf.h5, .h5 or .hdf5")
}

pub fn picture_file(path: PathBuf) -> Result<PathBuf, &'static str> {
    if is_standard_output(&path) {
        return Ok(path);
    }
    ends_in(path, &["png"], "use a name that ends in .png, or - for standard output")
}

/// Refuses a dash where standard output cannot take what is written, and says why.
pub fn not_standard_output(why: &'static str) -> impl Fn(PathBuf) -> Result<PathBuf, &'static str> + Clone {
    move |path| if is_standard_output(&path) { Err(why) } else { Ok(path) }
}

pub fn histogram_file(path: PathBuf) -> Result<PathBuf, &'static str> {
    ends_in(path, &["svg"], "use a name that ends in .svg")
}

pub fn page_file(path: PathBuf) -> Result<PathBuf, &'static str> {
    ends_in(path, &["html", "htm"], "use a name that ends in .html")
}

fn ends_in(path: PathBuf, endings: &[&str], refusal: &'static str) -> Result<PathBuf, &'static str> {
    let is_one = |found: &str| endings.iter().any(|ending| found.eq_ignore_ascii_case(ending));
    if path.extension().and_then(|found| found.to_str()).is_some_and(is_one) { Ok(path) } else { Err(refusal) }
}

pub fn mesh_file(path: PathBuf) -> Result<PathBuf, &'static str> {
    let is_known = is_standard_output(&path) || MeshFormat::from_extension(&path).is_some();
    is_known.then_some(path).ok_or("use a name that ends in .obj, .ply, .stl or .off, or - for OBJ on standard output")
}

/// A number of bytes: 500MB, 2GiB, 1.5G.
pub fn bytes(text: &str) -> Result<u64, String> {
    let units = [("KiB", 10), ("MiB", 20), ("GiB", 30), ("TiB", 40)].map(|(unit, bits)| (unit, (1_u64 << bits) as f64));
    let units = units.into_iter().chain([("kB", 1e3), ("MB", 1e6), ("GB", 1e9), ("TB", 1e12)]);
    let mut units = units.chain([("K", 1024.0), ("M", 1_048_576.0), ("G", 1_073_741_824.0), ("B", 1.0), ("", 1.0)]);
    let number =
        units.find_map(|(unit, bytes)| text.strip_suffix(unit)?.trim_end().parse::<f64>().ok().map(|n| n * bytes));
    match number {
        Some(bytes) if bytes >= 1.0 && bytes < u64::MAX as f64 => Ok(bytes as u64),
        _ => Err(format!("{text:?} is not a size: use a number and a unit, such as 500MB or 2GiB")),
    }
}

/// A share of the work: of a list, elements `index`, `index + count`, …
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    pub index: u32,
    pub count: u32,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(index, count)| Some([index.parse().ok()?, count.parse().ok()?]));
        match numbers {
            Some([index, count]) if index < count => Ok(Self { index, count }),
            _ => Err("use I/N with I from 0 to N - 1, such as 0/4".to_owned()),
        }
    }
}
