//! What can go wrong with a model file, and whose fault it is.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::store::StoreError;

/// Where in a file: lines for text, bytes or numbered things for everything else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line number, from 1.
    Line(u64),
    /// Byte offset, from 0; in the content where the file is packed.
    Byte(u64),
    /// Byte offset in a packed file, from 0.
    PackedByte(u64),
    /// One of the numbered things of the file, from 0.
    Item {
        /// What it is, such as an accessor.
        kind: &'static str,
        /// Its number.
        number: u64,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(offset) => write!(f, "byte {offset}"),
            Self::PackedByte(offset) => write!(f, "byte {offset} of the packed file"),
            Self::Item { kind, number } => write!(f, "{kind} {number}"),
        }
    }
}

/// An error of reading or writing a model file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IoError {
    /// The content is not what the format says, or ends too early.
    #[error("Cannot read {path}, {place}: expected {expected}, found {found}")]
    Unreadable {
        /// The input file.
        path: PathBuf,
        /// Where it stopped making sense.
        place: Place,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A folder, a pipe or a device instead of a file.
    #[error("{path} is {found}, not a file")]
    NotAFile {
        /// The path as given.
        path: PathBuf,
        /// What it is.
        found: &'static str,
    },
    /// The input holds more of something than can be numbered or held.
    #[error("{path} has more than {limit} {what}")]
    TooMany {
        /// The input file.
        path: PathBuf,
        /// What there are too many of.
        what: &'static str,
        /// The largest number allowed.
        limit: u64,
    },
    /// A packed file whose content is out of all proportion to its size.
    #[error(
        "{path} is refused: its first {read_bytes} bytes unpack to {unpacked_bytes} bytes, more than \
         any model's would"
    )]
    Bomb {
        /// The packed file.
        path: PathBuf,
        /// Bytes that were unpacked.
        unpacked_bytes: u64,
        /// Bytes of the packed file that they came from.
        read_bytes: u64,
    },
    /// The output's format cannot number that much.
    #[error("{path} cannot hold more than {limit} {what}")]
    TooLarge {
        /// The output file.
        path: PathBuf,
        /// What there are too many of.
        what: &'static str,
        /// The largest number that the format allows.
        limit: u64,
    },
    /// The operating system refused to open or read the input.
    #[error("Cannot {doing} {path}")]
    Input {
        /// What was tried, as a verb.
        doing: &'static str,
        /// The input file.
        path: PathBuf,
        /// The system's own word.
        source: std::io::Error,
    },
    /// The scratch folder or the output failed.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl IoError {
    /// Whether the input is to blame (missing, forbidden, no file, no model), and not the world.
    #[must_use]
    pub fn is_input(&self) -> bool {
        match self {
            Self::Unreadable { .. }
            | Self::NotAFile { .. }
            | Self::TooMany { .. }
            | Self::Bomb { .. }
            | Self::Input { .. } => true,
            Self::TooLarge { .. } | Self::Store(_) => false,
        }
    }

    pub(crate) fn unreadable(
        path: &Path,
        place: Place,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        Self::Unreadable {
            path: path.to_path_buf(),
            place,
            expected: expected.into(),
            found: found.into(),
        }
    }

    pub(crate) fn input(doing: &'static str, path: &Path, source: std::io::Error) -> Self {
        Self::Input { doing, path: path.to_path_buf(), source }
    }

    pub(crate) fn too_many(path: &Path, what: &'static str, limit: u64) -> Self {
        Self::TooMany { path: path.to_path_buf(), what, limit }
    }
}

/// Bytes of the input as they may stand in a message: short, and printable.
pub(crate) fn shown(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(LONGEST)]);
    let dots = if bytes.len() > LONGEST { "..." } else { "" };
    format!("\"{}{dots}\"", text.escape_debug())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_name_path_place_expectation_and_finding() {
        let error = IoError::unreadable(
            Path::new("a.obj"),
            Place::Line(7),
            "a number",
            shown(b"x\x1b[31m"),
        );
        assert_eq!(
            error.to_string(),
            "Cannot read a.obj, line 7: expected a number, found \"x\\u{1b}[31m\""
        );
        assert!(error.is_input());
        assert!(!IoError::Store(StoreError::Cancelled).is_input());
    }
}
