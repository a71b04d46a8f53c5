//! Lengths as users give them: with a unit, as a share of the model, or in cells of the grid.

use std::fmt::{self, Display};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::mesh::LengthUnit;
use crate::octree::{Domain, SnapBox};

/// What lengths of a model are measured by.
#[derive(Clone, Copy, Debug)]
pub struct Ruler {
    /// Box of the model.
    pub bounds: SnapBox,
    /// What a model unit is, where the file or the user says so.
    pub unit: Option<LengthUnit>,
}

/// A length with its unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Length {
    /// Plain model units.
    Model(f64),
    /// A share of the bounding box diagonal, in percent.
    Percent(f64),
    /// Metres; only where the file or the user says what a model unit is.
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

impl Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Model(value) => write!(f, "{value}"),
            Self::Percent(value) => write!(f, "{value}%"),
            Self::Metres(value) => write!(f, "{value}m"),
        }
    }
}

impl Length {
    /// The length in model units; `None` for metres where nobody says what those are.
    #[must_use]
    pub fn in_model_units(self, ruler: &Ruler) -> Option<f64> {
        match self {
            Self::Model(value) => Some(value),
            Self::Percent(value) => Some(ruler.bounds.diagonal() * value / 100.0),
            Self::Metres(value) => ruler.unit.map(|unit| value / unit.metres()),
        }
    }
}

/// A length, or a number of cells.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reach {
    /// Cells of the grid, zero included.
    Cells(f64),
    /// A length.
    Length(Length),
}

impl Reach {
    /// How far vertices may lie from the planes they stand for, unless the user says otherwise.
    pub const DEFAULT_DECIMATE: Self = Self::Cells(0.1);

    /// In cells; `None` for metres where nobody says what model units are.
    #[must_use]
    pub fn in_cells(self, ruler: &Ruler, domain: &Domain) -> Option<f64> {
        match self {
            Self::Cells(cells) => Some(cells),
            Self::Length(length) => Some(length.in_model_units(ruler)? / domain.cell_size()),
        }
    }
}

impl FromStr for Reach {
    type Err = LengthError;

    fn from_str(text: &str) -> Result<Self, LengthError> {
        let refuse = || LengthError { found: text.to_owned() };
        let trimmed = text.trim();
        let number = trimmed.strip_suffix("cells").or_else(|| trimmed.strip_suffix("cell"));
        if let Some(number) = number {
            let cells: f64 = number.trim_end().parse().map_err(|_| refuse())?;
            let is_sound = cells.is_finite() && cells >= 0.0;
            return if is_sound { Ok(Self::Cells(cells)) } else { Err(refuse()) };
        }
        if trimmed.parse() == Ok(0.0) {
            return Ok(Self::Cells(0.0));
        }
        trimmed.parse().map(Self::Length).map_err(|_| refuse())
    }
}

impl Display for Reach {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Cells(cells) => write!(f, "{cells}cells"),
            Self::Length(length) => length.fmt(f),
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

    #[test]
    fn reaches_may_be_counted_in_cells_and_may_be_nothing() {
        for (text, expected) in [
            ("0", Reach::Cells(0.0)),
            ("0cells", Reach::Cells(0.0)),
            ("0.1cells", Reach::Cells(0.1)),
            ("1 cell", Reach::Cells(1.0)),
            ("0.5", Reach::Length(Length::Model(0.5))),
            ("0.1%", Reach::Length(Length::Percent(0.1))),
        ] {
            assert_eq!(text.parse::<Reach>().ok(), Some(expected), "{text}");
        }
        for wrong in ["-1cells", "cells", "infcells", "NaN cells", ""] {
            assert!(wrong.parse::<Reach>().is_err(), "{wrong}");
        }
    }
}
