//! The parts or materials of a file, numbered in the order in which faces first use them.

use std::collections::HashMap;
use std::path::Path;

use crate::io::error::IoError;

/// The most parts or materials of one file.
const MOST_NAMES: u64 = 1 << 20;

/// Numbered entries that are found again by name. Memory: the names, twice.
#[derive(Debug)]
pub(crate) struct Names<T> {
    entries: Vec<T>,
    numbers: HashMap<String, u32>,
}

impl<T> Names<T> {
    pub(crate) fn new() -> Self {
        Self { entries: Vec::new(), numbers: HashMap::new() }
    }

    pub(crate) fn entries(&self) -> &[T] {
        &self.entries
    }

    /// The number of `name`; a new name gets the entry that `make` gives.
    pub(crate) fn number(
        &mut self,
        path: &Path,
        name: &str,
        make: impl FnOnce(String) -> T,
    ) -> Result<u32, IoError> {
        if let Some(&number) = self.numbers.get(name) {
            return Ok(number);
        }
        let number = self.entries.len();
        if number as u64 >= MOST_NAMES {
            return Err(IoError::too_many(path, "parts or materials", MOST_NAMES));
        }
        self.entries.push(make(name.to_owned()));
        self.numbers.insert(name.to_owned(), number as u32);
        Ok(number as u32)
    }
}
