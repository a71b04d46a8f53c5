//! What the user asked for, and what the run may use.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::contour::Method;
use crate::octree::SnapBox;
use crate::sign::FillRule;
use crate::store::Backing;

/// A length with its unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Length {
    /// Plain model units.
    Model(f64),
    /// A share of the bounding box diagonal, in percent.
    Percent(f64),
    /// Metres; only for files that state a unit.
    Metres(f64),
}

/// A length that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("Expected a length such as 0.5, 0.2% or 3mm, found {found:?}")]
pub struct LengthError {
    /// What was given.
    pub found: String,
}

impl FromStr for Length {
    type Err = LengthError;

    fn from_str(text: &str) -> Result<Self, LengthError> {
        let refuse = || LengthError { found: text.to_owned() };
        let units = [("%", None), ("mm", Some(0.001)), ("cm", Some(0.01)), ("in", Some(0.0254))];
        let units = units.into_iter().chain([("m", Some(1.0))]);
        let mut parsed = None;
        for (suffix, metres) in units {
            if let Some(number) = text.trim().strip_suffix(suffix) {
                parsed = Some((number.trim_end().to_owned(), Some((suffix, metres))));
                break;
            }
        }
        let (number, unit) = parsed.unwrap_or_else(|| (text.trim().to_owned(), None));
        let value: f64 = number.parse().map_err(|_| refuse())?;
        if !(value.is_finite() && value > 0.0) {
            return Err(refuse());
        }
        Ok(match unit {
            None => Self::Model(value),
            Some((_, None)) => Self::Percent(value),
            Some((_, Some(metres))) => Self::Metres(value * metres),
        })
    }
}

impl fmt::Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Model(value) => write!(f, "{value}"),
            Self::Percent(value) => write!(f, "{value}%"),
            Self::Metres(value) => write!(f, "{value}m"),
        }
    }
}

impl Length {
    /// The length in model units; `None` for metres, since no file format read so far has a unit.
    #[must_use]
    pub fn in_model_units(self, bounds: &SnapBox) -> Option<f64> {
        match self {
            Self::Model(value) => Some(value),
            Self::Percent(value) => Some(bounds.diagonal() * value / 100.0),
            Self::Metres(_) => None,
        }
    }
}

/// How fine the grid is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Depth {
    /// 2^levels cells a side.
    Levels(u32),
    /// The smallest depth whose cells are at most twice this length, up to `max_depth`.
    Tolerance {
        /// The largest deviation asked for.
        length: Length,
        /// The deepest level that may be chosen.
        max_depth: u32,
    },
}

impl Depth {
    /// Shallowest and deepest grids.
    pub const RANGE: std::ops::RangeInclusive<u32> = 4..=15;
    /// Until depth is chosen by predicted features: this tolerance, at most this depth.
    pub const DEFAULT: Self =
        Self::Tolerance { length: Length::Percent(0.2), max_depth: Self::DEFAULT_MAX };
    /// The deepest level chosen by tolerance unless the user allows more.
    pub const DEFAULT_MAX: u32 = 10;
}

/// Everything that changes the result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// How fine.
    pub depth: Depth,
    /// What is inside.
    pub fill_rule: FillRule,
    /// Smaller dihedral angles are noise.
    pub crease_deg: f64,
    /// The contouring method.
    pub method: Method,
    /// Refuse broken faces in place of dropping them.
    pub strict: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            depth: Depth::DEFAULT,
            fill_rule: FillRule::Solid,
            crease_deg: 12.0,
            method: Method::Mdc,
            strict: false,
        }
    }
}

/// What a run may use; nothing here changes the result.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Peak resident memory of the process.
    pub max_memory_bytes: u64,
    /// Worker threads; fewer are taken when memory is short.
    pub threads: usize,
    /// Most that the work folder and the output may take of the disk; no limit when `None`.
    pub max_disk_bytes: Option<u64>,
    /// Where the work folder goes; beside the output when `None`.
    pub work_dir: Option<PathBuf>,
    /// Discard what an earlier run of the same work left.
    pub fresh: bool,
    /// Long steps note their progress each time they have written this much.
    pub checkpoint_bytes: u64,
    /// Share of every sort and table, for tests of the spilled forms; from the budget when `None`.
    pub share_bytes: Option<u64>,
    /// Where brick files lie.
    pub backing: Backing,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_memory_bytes: 1 << 30,
            threads: 1,
            max_disk_bytes: None,
            work_dir: None,
            fresh: false,
            checkpoint_bytes: 16 << 20,
            share_bytes: None,
            backing: Backing::Mapped,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read_with_their_units() {
        assert_eq!("0.5".parse::<Length>().ok(), Some(Length::Model(0.5)));
        assert_eq!("0.2%".parse::<Length>().ok(), Some(Length::Percent(0.2)));
        assert_eq!("2 m".parse::<Length>().ok(), Some(Length::Metres(2.0)));
        assert_eq!("10mm".parse::<Length>().ok(), Some(Length::Metres(0.01)));
        for wrong in ["", "-1", "0", "nan", "mm", "1km2", "1e999"] {
            assert!(wrong.parse::<Length>().is_err(), "{wrong}");
        }
    }
}
