//! TOML tables, read key by key. Errors name the table; keys that nobody reads are errors.

use std::ops::RangeInclusive;
use std::path::Path;

use toml::Value;

use super::FieldError;

/// A table of the file and its name there. Keys are read one by one; [`Self::finish`] refuses those that nobody read.
pub(super) struct Table<'a> {
    file: &'a Path,
    name: String,
    values: &'a toml::Table,
    keys_read: Vec<&'static str>,
}

impl<'a> Table<'a> {
    pub fn new(file: &'a Path, name: String, values: &'a toml::Table) -> Self {
        Self { file, name, values, keys_read: Vec::new() }
    }

    pub fn refuse(&self, what: impl Into<String>) -> FieldError {
        FieldError::Refused { path: self.file.to_owned(), table: self.name.clone(), what: what.into() }
    }

    fn value(&mut self, key: &'static str) -> Option<&'a Value> {
        self.keys_read.push(key);
        self.values.get(key)
    }

    fn missing(&self, key: &str, expected: &str) -> FieldError {
        // Keys that were read are spelled right.
        let others = self.values.keys().filter(|other| !self.keys_read.contains(&other.as_str()));
        let nearest = others.map(|other| (edit_distance(other, key), other)).min();
        match nearest.filter(|(distance, _)| *distance <= key.len().div_ceil(3)) {
            Some((_, misspelt)) => self.refuse(format!("needs {key}, {expected}; {misspelt:.40?} is misspelt")),
            None => self.refuse(format!("needs {key}, {expected}")),
        }
    }

    fn wrong(&self, key: &str, expected: &str, found: &Value) -> FieldError {
        self.refuse(format!("{key} must be {expected}, not {}", kind(found)))
    }

    pub fn text(&mut self, key: &'static str) -> Result<&'a str, FieldError> {
        let value = self.value(key).ok_or_else(|| self.missing(key, "a string"))?;
        value.as_str().ok_or_else(|| self.wrong(key, "a string", value))
    }

    pub fn number(&mut self, key: &'static str) -> Result<f64, FieldError> {
        self.optional_number(key)?.ok_or_else(|| self.missing(key, "a number"))
    }

    /// An angle in radians, under a key in radians or one in degrees.
    pub fn angle(&mut self, degrees: &'static str, radians: &'static str) -> Result<f64, FieldError> {
        match [degrees, radians].map(|key| self.values.contains_key(key)) {
            [true, true] => Err(self.refuse(format!("give one of {degrees} and {radians}"))),
            [false, true] => self.number(radians),
            _ => Ok(self.number(degrees)?.to_radians()),
        }
    }

    pub fn optional_number(&mut self, key: &'static str) -> Result<Option<f64>, FieldError> {
        let value = self.value(key);
        value.map(|value| number(value).ok_or_else(|| self.wrong(key, "a finite number", value))).transpose()
    }

    pub fn numbers<const N: usize>(&mut self, key: &'static str) -> Result<[f64; N], FieldError> {
        self.optional_numbers(key)?.ok_or_else(|| self.missing(key, &format!("a list of {N} numbers")))
    }

    pub fn optional_numbers<const N: usize>(&mut self, key: &'static str) -> Result<Option<[f64; N]>, FieldError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let list = value.as_array().and_then(|list| list.iter().map(number).collect::<Option<Vec<f64>>>());
        match list.and_then(|list| <[f64; N]>::try_from(list).ok()) {
            Some(numbers) => Ok(Some(numbers)),
            None => Err(self.refuse(format!("{key} must be a list of {N} finite numbers"))),
        }
    }

    /// `true` if a number, or one of a list, is so large or so small that its square is no normal number. Zero is not.
    pub fn is_out_of_range(&self) -> bool {
        let is_beyond = |number: f64| number != 0.0 && !LENGTHS.contains(&number.abs());
        let lists = self.values.values().filter_map(Value::as_array).flatten();
        self.values.values().chain(lists).filter_map(number).any(is_beyond)
    }

    /// `true` if the key is there and has a list.
    pub fn is_list(&self, key: &'static str) -> bool {
        self.values.get(key).is_some_and(Value::is_array)
    }

    pub fn table(&mut self, key: &'static str) -> Result<Table<'a>, FieldError> {
        self.optional_table(key)?.ok_or_else(|| self.missing(key, "a table"))
    }

    pub fn optional_table(&mut self, key: &'static str) -> Result<Option<Table<'a>>, FieldError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let values = value.as_table().ok_or_else(|| self.wrong(key, "a table", value))?;
        Ok(Some(Table::new(self.file, self.full_name(key), values)))
    }

    /// A list of tables, not empty.
    pub fn tables(&mut self, key: &'static str) -> Result<Vec<Table<'a>>, FieldError> {
        let value = self.value(key).ok_or_else(|| self.missing(key, "a list of tables"))?;
        let list = value.as_array().filter(|list| !list.is_empty());
        let list = list.ok_or_else(|| self.wrong(key, "a list of at least one table", value))?;
        let table = |(index, value): (usize, &'a Value)| {
            let name = format!("{}[{index}]", self.full_name(key));
            let values = value.as_table().ok_or_else(|| self.wrong(&name, "a table", value))?;
            Ok(Table::new(self.file, name, values))
        };
        list.iter().enumerate().map(table).collect()
    }

    /// An error if a key was not read.
    pub fn finish(self) -> Result<(), FieldError> {
        match self.values.keys().find(|key| !self.keys_read.contains(&key.as_str())) {
            Some(key) => Err(self.refuse(format!("unknown key {key:.40?}; known here: {}", self.keys_read.join(", ")))),
            None => Ok(()),
        }
    }

    fn full_name(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }
}

/// Lengths whose squares are normal numbers, with room for sums.
const LENGTHS: RangeInclusive<f64> = 1e-150..=1e150;

/// Longest key that is compared.
const MAX_KEY_CHARS: usize = 40;

/// Number of characters to insert, remove or replace to make one word the other (Levenshtein 1966), by rows of the table.
/// Swapped neighbours count two.
fn edit_distance(from: &str, to: &str) -> usize {
    if from.chars().nth(MAX_KEY_CHARS).is_some() {
        return usize::MAX;
    }
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, b) in to.iter().enumerate() {
            let replaced = diagonal + usize::from(a != *b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[to.len()]
}

/// The kind of a value, in words.
fn kind(value: &Value) -> &'static str {
    match value {
        Value::String(_) => "a string",
        Value::Integer(_) => "an integer",
        Value::Float(number) if number.is_nan() => "nan",
        Value::Float(number) if number.is_infinite() => "inf",
        Value::Float(_) => "a number",
        Value::Boolean(_) => "true or false",
        Value::Datetime(_) => "a date",
        Value::Array(list) if list.is_empty() => "an empty list",
        Value::Array(_) => "a list",
        Value::Table(_) => "a table",
    }
}

fn number(value: &Value) -> Option<f64> {
    let number = value.as_float().or_else(|| value.as_integer().map(|integer| integer as f64))?;
    number.is_finite().then_some(number)
}
