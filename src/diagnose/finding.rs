//! What was found of one kind of defect: how many, how large, and where.

use std::cmp::Reverse;

use serde::{Deserialize, Serialize};

use crate::defect::{Defect, DefectKind, Smallest};

/// What the size of a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// A length of all of them together, model units.
    TotalLength,
    /// The length of the longest one, model units.
    LongestLength,
    /// The smallest length among them, model units.
    LeastLength,
    /// An area of all of them together, model units squared.
    TotalArea,
    /// Only their number is known.
    None,
}

/// All defects of a kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// The kind.
    pub kind: DefectKind,
    /// How many.
    pub count: u64,
    /// Whether it is a remark: by itself it harms nothing.
    pub is_note: bool,
    /// What `size` is.
    pub measure: Measure,
    /// How large, as `measure` says; 0 where there is none.
    pub size: f64,
    /// The first eight in the file, or the eight largest where they have a size of their own.
    pub places: Vec<Defect>,
}

impl Finding {
    /// None of a kind.
    #[must_use]
    pub const fn none(kind: DefectKind) -> Self {
        let places = Vec::new();
        Self { kind, count: 0, is_note: kind.is_note(), measure: Measure::None, size: 0.0, places }
    }

    /// Some of a kind whose sizes are not known.
    #[must_use]
    pub fn counted(kind: DefectKind, count: u64, places: Vec<Defect>) -> Self {
        Self { count, places, ..Self::none(kind) }
    }

    /// Some of a kind, with a size.
    #[must_use]
    pub fn sized(
        kind: DefectKind,
        count: u64,
        (measure, size): (Measure, f64),
        places: Vec<Defect>,
    ) -> Self {
        Self { count, measure, size, places, ..Self::none(kind) }
    }
}

/// The largest few of a kind.
#[derive(Default)]
pub struct SizedPlaces {
    kept: Smallest<(Reverse<u64>, u64), Defect>,
}

impl SizedPlaces {
    /// Keeps a defect if few are larger; `number` decides among those of one size.
    pub fn offer(&mut self, size: f64, number: u64, defect: Defect) {
        // The bits of numbers that are not negative are in their order.
        self.kept.offer((Reverse(size.max(0.0).to_bits()), number), defect);
    }

    /// Those that were kept, the largest first.
    #[must_use]
    pub fn into_places(self) -> Vec<Defect> {
        self.kept.iter().map(|&(_, defect)| defect).collect()
    }
}
