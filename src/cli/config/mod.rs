//! Settings from the command line, the environment and `brickmend.toml`, in that order.
//!
//! What is not on the command line becomes a default of the parser: so a value is read in one way,
//! whatever it comes from, and the command line overrides it.

mod error;
mod file;
mod keys;
mod shown;

pub use error::ConfigError;
pub use shown::{ConfigArguments, run};

use std::collections::{BTreeMap, HashMap};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use brickmend::catalogue::Wanted;
use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory, FromArgMatches};

use crate::cli::config::file::{Entry, File};
use crate::cli::config::keys::{alternatives, takes};
use crate::cli::{Arguments, Command};

/// The file that is read from the current folder where no other is named.
const FILE: &str = "brickmend.toml";
/// What names of the environment begin with.
const PREFIX: &str = "BRICKMEND_";

/// Where a value comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The command line.
    Flag,
    /// A variable of the environment.
    Environment(String),
    /// A line of the file, for all models, or for those of the folder that this pattern fits.
    File(usize, Option<String>),
    /// Nobody said otherwise.
    Default,
}

/// A value that is not from the command line.
#[derive(Clone, Debug)]
struct Layered {
    values: Vec<String>,
    origin: Origin,
}

/// All that was said but on the command line, and the command line.
pub struct Config {
    file: Option<File>,
    environment: Vec<(String, Layered)>,
    words: Vec<OsString>,
    /// By the patterns that fit: what is wanted of such models.
    known: Mutex<HashMap<Vec<usize>, Wanted>>,
}

impl Config {
    /// Parses the command line over what else was said. A usage error on the command line ends the
    /// process with 2, as the parser does.
    ///
    /// # Errors
    /// The file or a variable of the environment says what cannot be.
    pub fn parse() -> Result<(Arguments, Self), ConfigError> {
        let words: Vec<OsString> = std::env::args_os().collect();
        let flags = Arguments::command().get_matches_from(&words);
        let mut config =
            Self { file: None, environment: Vec::new(), words, known: Mutex::default() };
        let Some((name, _)) = flags.subcommand() else { unreachable!("a command is required") };
        if !keys::COMMANDS.contains(&name) {
            let arguments = Arguments::from_arg_matches(&flags);
            return Ok((arguments.unwrap_or_else(|error| error.exit()), config));
        }
        config.file = match flags.get_one::<PathBuf>("config").cloned().or_else(named_file) {
            Some(path) => Some(File::read(&path)?),
            None => {
                Some(Path::new(FILE)).filter(|path| path.exists()).map(File::read).transpose()?
            }
        };
        config.environment = environment()?;
        let arguments = config.parse_with(&[])?;
        for number in 0..config.folders().len() {
            config.parse_with(&[number])?;
        }
        Ok((arguments, config))
    }

    fn folders(&self) -> &[file::Folder] {
        self.file.as_ref().map_or(&[], |file| &file.folders)
    }

    /// The command line, over what the folders with these numbers say, and all else.
    fn parse_with(&self, folders: &[usize]) -> Result<Arguments, ConfigError> {
        let command = Arguments::command();
        let flags = command.clone().get_matches_from(&self.words);
        let Some((name, given)) = flags.subcommand() else { unreachable!("a command is required") };
        let layered = self.resolve(name, given, folders);
        let mut layered_command = command;
        for (key, value) in &layered {
            let Some(id) = keys::id_of(name, key) else { continue };
            layered_command = layered_command.mut_subcommand(name, |command| {
                command.mut_arg(id, |argument| argument.default_values(value.values.clone()))
            });
        }
        let parsed = layered_command.try_get_matches_from(&self.words);
        let parsed = parsed.and_then(|matches| Arguments::from_arg_matches(&matches));
        parsed.map_err(|error| self.refuse(&error, &layered))
    }

    /// What holds for a command where its command line says nothing: by key.
    fn resolve(
        &self,
        command: &str,
        given: &ArgMatches,
        folders: &[usize],
    ) -> BTreeMap<String, Layered> {
        let mut layered: BTreeMap<String, Layered> = BTreeMap::new();
        let mut set = |key: &str, value: Layered| {
            if takes(command, key) {
                alternatives(key).iter().for_each(|other| drop(layered.remove(*other)));
                layered.insert(key.to_owned(), value);
            }
        };
        if let Some(file) = &self.file {
            for entry in &file.entries {
                set(&entry.key, entry.layered(None));
            }
            for folder in folders.iter().filter_map(|number| file.folders.get(*number)) {
                for entry in &folder.entries {
                    set(&entry.key, entry.layered(Some(folder.pattern.clone())));
                }
            }
        }
        for (key, value) in &self.environment {
            set(key, value.clone());
        }
        for (key, id) in keys::arguments_of(command) {
            if given.value_source(&id) == Some(ValueSource::CommandLine) {
                layered.remove(&key);
                alternatives(&key).iter().for_each(|other| drop(layered.remove(*other)));
            }
        }
        layered
    }

    /// An error of a value, with the place where it stands.
    fn refuse(&self, error: &clap::Error, layered: &BTreeMap<String, Layered>) -> ConfigError {
        let text = error.to_string();
        let text = text.split("\n\n").next().unwrap_or_default();
        let text = text.strip_prefix("error: ").unwrap_or(text);
        let reason = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let named = |key: &&String| {
            text.contains(&format!("'--{key} ")) || text.contains(&format!("'--{key}'"))
        };
        let place = layered.keys().find(named).map(|key| self.place(&layered[key].origin));
        ConfigError::Value { place: place.unwrap_or_else(|| "settings".to_owned()), reason }
    }

    /// An origin in words.
    fn place(&self, origin: &Origin) -> String {
        let path = || self.file.as_ref().map_or_else(String::new, |f| f.path.display().to_string());
        match origin {
            Origin::Flag => "flag".to_owned(),
            Origin::Environment(name) => name.clone(),
            Origin::File(line, None) => format!("{}:{line}", path()),
            Origin::File(line, Some(pattern)) => format!("{}:{line} for {pattern}", path()),
            Origin::Default => "default".to_owned(),
        }
    }

    /// Numbers of the folders that the model at this path is in.
    fn folders_of(&self, relative: &Path) -> Vec<usize> {
        let folders = self.folders().iter().enumerate();
        folders.filter(|(_, folder)| folder.selection.fits(relative)).map(|(n, _)| n).collect()
    }

    /// What is wanted of the model at this path within the folder of the models; `all` is what is
    /// wanted of models of no folder.
    pub fn wanted(&self, relative: &Path, all: Wanted) -> Wanted {
        let folders = self.folders_of(relative);
        if folders.is_empty() {
            return all;
        }
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        *known.entry(folders).or_insert_with_key(|folders| {
            // Every folder was parsed alone before, and what excludes each other replaces each other.
            match self.parse_with(folders).map(|arguments| arguments.command) {
                Ok(Command::Batch(arguments)) => arguments.wanted(),
                _ => all,
            }
        })
    }
}

impl Entry {
    fn layered(&self, pattern: Option<String>) -> Layered {
        Layered { values: self.values.clone(), origin: Origin::File(self.line, pattern) }
    }
}

/// The file that the environment names.
fn named_file() -> Option<PathBuf> {
    let path = std::env::var_os(format!("{PREFIX}CONFIG")).filter(|path| !path.is_empty());
    path.map(PathBuf::from)
}

/// What the environment says of settings, by key.
fn environment() -> Result<Vec<(String, Layered)>, ConfigError> {
    let mut found = Vec::new();
    for key in keys::all() {
        let name = format!("{PREFIX}{}", key.to_uppercase().replace('-', "_"));
        let Some(value) = std::env::var_os(&name).filter(|value| !value.is_empty()) else {
            continue;
        };
        let value = value.into_string().map_err(|_| ConfigError::NoText { name: name.clone() })?;
        let values = match keys::is_list(&key) {
            true => value.split(':').map(str::to_owned).collect(),
            false => vec![value],
        };
        found.push((key, Layered { values, origin: Origin::Environment(name) }));
    }
    Ok(found)
}
