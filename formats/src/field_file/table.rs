use std::path::Path;

use toml::Value;

use super::FieldError;

/// A table of the file, with its name in it, whose keys are taken one by one: one that nobody took is an error.
pub(super) struct Table<'a> {
    pub file: &'a Path,
    place: String,
    values: &'a toml::Table,
    taken: Vec<&'static str>,
}

impl<'a> Table<'a> {
    pub fn new(file: &'a Path, place: String, values: &'a toml::Table) -> Self {
        Self { file, place, values, taken: Vec::new() }
    }

    pub fn refuse(&self, what: impl Into<String>) -> FieldError {
        FieldError::Refused { path: self.file.to_owned(), place: self.place.clone(), what: what.into() }
    }

    fn take(&mut self, key: &'static str) -> Option<&'a Value> {
        self.taken.push(key);
        self.values.get(key)
    }

    fn missing(&self, key: &str, wanted: &str) -> FieldError {
        self.refuse(format!("needs {key}, {wanted}"))
    }

    fn wrong(&self, key: &str, wanted: &str, found: &Value) -> FieldError {
        self.refuse(format!("{key} must be {wanted}, not {}", found.type_str()))
    }

    pub fn text(&mut self, key: &'static str) -> Result<&'a str, FieldError> {
        let value = self.take(key).ok_or_else(|| self.missing(key, "a text"))?;
        value.as_str().ok_or_else(|| self.wrong(key, "a text", value))
    }

    pub fn number(&mut self, key: &'static str) -> Result<f64, FieldError> {
        self.number_if_there(key)?.ok_or_else(|| self.missing(key, "a number"))
    }

    pub fn number_if_there(&mut self, key: &'static str) -> Result<Option<f64>, FieldError> {
        let value = self.take(key);
        value.map(|value| number(value).ok_or_else(|| self.wrong(key, "a finite number", value))).transpose()
    }

    pub fn numbers<const N: usize>(&mut self, key: &'static str) -> Result<[f64; N], FieldError> {
        self.numbers_if_there(key)?.ok_or_else(|| self.missing(key, &format!("a list of {N} numbers")))
    }

    pub fn numbers_if_there<const N: usize>(&mut self, key: &'static str) -> Result<Option<[f64; N]>, FieldError> {
        let Some(value) = self.take(key) else { return Ok(None) };
        let list = value.as_array().and_then(|list| list.iter().map(number).collect::<Option<Vec<f64>>>());
        match list.and_then(|list| <[f64; N]>::try_from(list).ok()) {
            Some(numbers) => Ok(Some(numbers)),
            None => Err(self.refuse(format!("{key} must be a list of {N} finite numbers"))),
        }
    }

    /// Whether it is there, and a list.
    pub fn is_list(&self, key: &'static str) -> bool {
        self.values.get(key).is_some_and(Value::is_array)
    }

    pub fn table(&mut self, key: &'static str) -> Result<Table<'a>, FieldError> {
        self.table_if_there(key)?.ok_or_else(|| self.missing(key, "a table"))
    }

    pub fn table_if_there(&mut self, key: &'static str) -> Result<Option<Table<'a>>, FieldError> {
        let Some(value) = self.take(key) else { return Ok(None) };
        let values = value.as_table().ok_or_else(|| self.wrong(key, "a table", value))?;
        Ok(Some(Table::new(self.file, self.name_of(key), values)))
    }

    /// A list of tables, not empty.
    pub fn tables(&mut self, key: &'static str) -> Result<Vec<Table<'a>>, FieldError> {
        let value = self.take(key).ok_or_else(|| self.missing(key, "a list of tables"))?;
        let list = value.as_array().filter(|list| !list.is_empty());
        let list = list.ok_or_else(|| self.wrong(key, "a list of at least one table", value))?;
        let table = |(index, value): (usize, &'a Value)| {
            let name = format!("{}[{index}]", self.name_of(key));
            let values = value.as_table().ok_or_else(|| self.wrong(&name, "a table", value))?;
            Ok(Table::new(self.file, name, values))
        };
        list.iter().enumerate().map(table).collect()
    }

    /// All keys must have been taken.
    pub fn finish(self) -> Result<(), FieldError> {
        match self.values.keys().find(|key| !self.taken.contains(&key.as_str())) {
            Some(key) => Err(self.refuse(format!("unknown key {key:.40?}; known here: {}", self.taken.join(", ")))),
            None => Ok(()),
        }
    }

    fn name_of(&self, key: &str) -> String {
        if self.place.is_empty() { key.to_owned() } else { format!("{}.{key}", self.place) }
    }
}

fn number(value: &Value) -> Option<f64> {
    let number = value.as_float().or_else(|| value.as_integer().map(|integer| integer as f64))?;
    number.is_finite().then_some(number)
}
