//! What can be wrong with settings that are not on the command line.

use std::path::PathBuf;

/// Why settings are refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("Cannot read the settings in {path}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's word.
        source: std::io::Error,
    },
    /// The file is no TOML, or a value is of another kind.
    #[error("{path}:{line}: {reason}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
    /// A key that means nothing.
    #[error("{path}:{line}: no setting is called {key}{}", .close.as_ref().map_or_else(String::new, |close| format!("; did you mean {close}?")))]
    UnknownKey {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// One that is much like it.
        close: Option<String>,
    },
    /// A value that cannot be.
    #[error("{place}: {reason}")]
    Value {
        /// Where it stands.
        place: String,
        /// What is wrong.
        reason: String,
    },
    /// A variable of the environment that is no text.
    #[error("{name} is no text")]
    NoText {
        /// Its name.
        name: String,
    },
}
