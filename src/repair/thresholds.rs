//! What a verdict rests on: measures, each with a value from which a person should look, and one
//! from which the file fails.

use std::fmt::{self, Display};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::mesh::LengthUnit;
use crate::repair::length::Length;

/// Values that a measure should not pass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Threshold<T> {
    /// Beyond it the verdict is `review`.
    pub review: T,
    /// Beyond it the verdict is `fail`; `None` for never.
    pub fail: Option<T>,
}

impl<T> Threshold<T> {
    const fn new(review: T, fail: T) -> Self {
        Self { review, fail: Some(fail) }
    }

    const fn never_fails(review: T) -> Self {
        Self { review, fail: None }
    }
}

/// A threshold that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("Expected REVIEW, or REVIEW,FAIL, such as {example}, found {found:?}")]
pub struct ThresholdError {
    example: &'static str,
    found: String,
}

/// What a threshold may be of.
pub trait Measured: FromStr + Copy + PartialOrd + Display {
    /// For messages.
    const EXAMPLE: &'static str;
}

impl<T: Measured> FromStr for Threshold<T> {
    type Err = ThresholdError;

    fn from_str(text: &str) -> Result<Self, ThresholdError> {
        let refuse = || ThresholdError { example: T::EXAMPLE, found: text.to_owned() };
        let value = |text: &str| text.trim().parse::<T>().map_err(|_| refuse());
        match text.split_once(',') {
            None => Ok(Self::never_fails(value(text)?)),
            Some((review, fail)) => Ok(Self::new(value(review)?, value(fail)?)),
        }
    }
}

impl<T: Display> Display for Threshold<T> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.review.fmt(f)?;
        match &self.fail {
            Some(fail) => write!(f, ",{fail}"),
            None => Ok(()),
        }
    }
}

/// A part of something, 0 to 1 and more; read and written in percent.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Share(pub f64);

/// An angle in degrees.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Degrees(pub f64);

/// A number that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("Expected a number that is not negative")]
pub struct NoNumber;

fn number(text: &str, unit: &str) -> Result<f64, NoNumber> {
    let text = text.trim().trim_end_matches(unit).trim_end();
    let value = text.parse().ok().filter(|value: &f64| value.is_finite() && *value >= 0.0);
    value.ok_or(NoNumber)
}

impl FromStr for Share {
    type Err = NoNumber;
    fn from_str(text: &str) -> Result<Self, NoNumber> {
        Ok(Self(number(text, "%")? / 100.0))
    }
}

impl Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        // Shares are read in percent: rounding must not show.
        write!(f, "{}%", (self.0 * 1e8).round() / 1e6)
    }
}

impl FromStr for Degrees {
    type Err = NoNumber;
    fn from_str(text: &str) -> Result<Self, NoNumber> {
        number(text, "deg").map(Self)
    }
}

impl Display for Degrees {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}deg", self.0)
    }
}

impl PartialOrd for Length {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        match (self, other) {
            (Self::Model(one), Self::Model(other))
            | (Self::Percent(one), Self::Percent(other))
            | (Self::Metres(one), Self::Metres(other)) => one.partial_cmp(other),
            _ => None,
        }
    }
}

impl Measured for Share {
    const EXAMPLE: &'static str = "2% or 2%,20%";
}

impl Measured for Degrees {
    const EXAMPLE: &'static str = "10deg or 10deg,45deg";
}

impl Measured for Length {
    const EXAMPLE: &'static str = "1% or 0.5mm,3mm";
}

impl Measured for u64 {
    const EXAMPLE: &'static str = "0 or 0,10";
}

/// How a file is verified.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerifySettings {
    /// Vertices in one place are one, whatever their numbers.
    pub by_place: bool,
    /// What a model unit is, for files that do not say so.
    pub unit: Option<LengthUnit>,
    /// Samples of the area of each surface.
    pub samples: u64,
    /// What lies farther away is lost or invented.
    pub tolerance: Length,
    /// Side of a cell, for those who want to be told distances in cells as well.
    pub cell: Option<Length>,
    /// The largest distance, from what is seen of the original to the file or from the file.
    pub max_deviation: Threshold<Length>,
    /// Share of what is seen of the original that the file lacks.
    pub max_lost: Threshold<Share>,
    /// Share of the file's area that the original lacks.
    pub max_invented: Threshold<Share>,
    /// The median angle between normals, of the worse way.
    pub max_normal: Threshold<Degrees>,
    /// Share of the original's sharp edges that the file has; below it.
    pub min_creases: Threshold<Share>,
    /// Difference of the volumes over that of the original, where both are sound.
    pub max_volume: Threshold<Share>,
    /// Difference of the numbers of components, where both are sound.
    pub max_components: Threshold<u64>,
    /// Difference of the genus, where both are sound.
    pub max_genus: Threshold<u64>,
}

impl Default for VerifySettings {
    fn default() -> Self {
        Self {
            by_place: false,
            unit: None,
            samples: 200_000,
            tolerance: Length::Percent(0.5),
            cell: None,
            max_deviation: Threshold::new(Length::Percent(1.0), Length::Percent(10.0)),
            max_lost: Threshold::new(Share(0.02), Share(0.2)),
            max_invented: Threshold::new(Share(0.02), Share(0.2)),
            max_normal: Threshold::new(Degrees(10.0), Degrees(45.0)),
            min_creases: Threshold::never_fails(Share(0.9)),
            max_volume: Threshold::never_fails(Share(0.05)),
            max_components: Threshold::never_fails(0),
            max_genus: Threshold::never_fails(0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_read_as_they_are_written() {
        for text in ["2%,20%", "0.35%", "0%"] {
            assert_eq!(text.parse::<Threshold<Share>>().expect("sound").to_string(), text);
        }
        for text in ["1%,10%", "0.5", "0.5,2%"] {
            assert_eq!(text.parse::<Threshold<Length>>().expect("sound").to_string(), text);
        }
        assert_eq!("10,45deg".parse::<Threshold<Degrees>>().expect("sound").review, Degrees(10.0));
        assert_eq!("0,3".parse::<Threshold<u64>>().expect("sound").fail, Some(3));
        for wrong in ["", "2%,", "-1%", "2%;3%", "x"] {
            assert!(wrong.parse::<Threshold<Share>>().is_err(), "{wrong}");
        }
    }
}
