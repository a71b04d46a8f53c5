//! Reads `brickmend.toml`: keys and values with their lines, for all models and by folder.

use std::path::{Path, PathBuf};

use brickmend::catalogue::Selection;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::cli::config::ConfigError;
use crate::cli::config::keys::{self, close_to, is_list, is_of_folders};

/// The tables that hold for some folders.
const FOLDER: &str = "folder";
/// In such a table: for which models.
const MATCH: &str = "match";

/// A key with its value.
#[derive(Clone, Debug)]
pub struct Entry {
    pub key: String,
    pub values: Vec<String>,
    /// From 1.
    pub line: usize,
}

/// What holds for models whose path fits a pattern.
pub struct Folder {
    pub pattern: String,
    pub selection: Selection,
    pub entries: Vec<Entry>,
}

/// A file that was read.
pub struct File {
    pub path: PathBuf,
    /// For all models.
    pub entries: Vec<Entry>,
    /// In the order of the file; later ones override.
    pub folders: Vec<Folder>,
}

impl File {
    /// Reads a file. Values are only looked at when they are used.
    ///
    /// # Errors
    /// [`ConfigError`]: it cannot be read, is no TOML, or has keys that mean nothing.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ConfigError::Read { path: path.to_path_buf(), source })?;
        Reading { path, text: &text }.file()
    }
}

struct Reading<'r> {
    path: &'r Path,
    text: &'r str,
}

impl Reading<'_> {
    fn file(&self) -> Result<File, ConfigError> {
        let table = DeTable::parse(self.text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            self.refuse(at, error.message())
        })?;
        let mut file =
            File { path: self.path.to_path_buf(), entries: Vec::new(), folders: Vec::new() };
        for (key, value) in table.get_ref().iter() {
            if key.get_ref() != FOLDER {
                file.entries.push(self.entry(key, value)?);
                continue;
            }
            let DeValue::Array(tables) = value.get_ref() else {
                return Err(self.refuse(key.span().start, "folders begin with [[folder]]"));
            };
            for table in tables.iter() {
                let DeValue::Table(table) = table.get_ref() else {
                    return Err(self.refuse(key.span().start, "folders begin with [[folder]]"));
                };
                file.folders.push(self.folder(key.span().start, table)?);
            }
        }
        file.entries.sort_by_key(|entry| entry.line);
        Ok(file)
    }

    fn folder(&self, at: usize, table: &DeTable) -> Result<Folder, ConfigError> {
        let (mut patterns, mut entries, mut place) = (Vec::new(), Vec::new(), at);
        for (key, value) in table.iter() {
            if key.get_ref() == MATCH {
                place = key.span().start;
                patterns = self.values(value, true)?;
                continue;
            }
            let entry = self.entry(key, value)?;
            if !is_of_folders(&entry.key) {
                let reason = format!("{} is the same for all folders", entry.key);
                return Err(self.refuse(key.span().start, &reason));
            }
            entries.push(entry);
        }
        if patterns.is_empty() {
            let reason = "a folder says which models it is about: match = \"chairs/**\"";
            return Err(self.refuse(place, reason));
        }
        let selection = Selection::new(&patterns, &[], None)
            .map_err(|error| self.refuse(place, &error.to_string()))?;
        entries.sort_by_key(|entry| entry.line);
        Ok(Folder { pattern: patterns.join(", "), selection, entries })
    }

    fn entry(
        &self,
        key: &Spanned<std::borrow::Cow<str>>,
        value: &Spanned<DeValue>,
    ) -> Result<Entry, ConfigError> {
        let (name, line) = (key.get_ref().to_string(), self.line(key.span().start));
        if !keys::all().contains(&name) {
            let (path, close) = (self.path.to_path_buf(), close_to(&name));
            return Err(ConfigError::UnknownKey { path, line, key: name, close });
        }
        Ok(Entry { values: self.values(value, is_list(&name))?, key: name, line })
    }

    fn values(&self, value: &Spanned<DeValue>, is_list: bool) -> Result<Vec<String>, ConfigError> {
        let expected = if is_list {
            "expected a text or a list of texts"
        } else {
            "expected a text, a number, or true or false"
        };
        match value.get_ref() {
            DeValue::Array(items) if is_list => {
                let texts = items.iter().map(|item| match item.get_ref() {
                    DeValue::String(text) => Ok(text.to_string()),
                    _ => Err(self.refuse(item.span().start, expected)),
                });
                texts.collect()
            }
            DeValue::String(text) => Ok(vec![text.to_string()]),
            DeValue::Integer(number) if number.radix() == 10 => {
                Ok(vec![number.as_str().to_owned()])
            }
            DeValue::Float(number) => Ok(vec![number.as_str().to_owned()]),
            DeValue::Boolean(is_set) => Ok(vec![is_set.to_string()]),
            _ => Err(self.refuse(value.span().start, expected)),
        }
    }

    fn refuse(&self, at: usize, reason: &str) -> ConfigError {
        let (path, line) = (self.path.to_path_buf(), self.line(at));
        ConfigError::Syntax { path, line, reason: reason.to_owned() }
    }

    fn line(&self, at: usize) -> usize {
        1 + self.text.as_bytes()[..at.min(self.text.len())].iter().filter(|&&b| b == b'\n').count()
    }
}
