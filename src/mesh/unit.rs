//! What a model unit is, where a file says so.

use serde::{Deserialize, Serialize};

/// A unit of length, as 3MF names them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LengthUnit {
    /// 1e-6 m.
    Micron,
    /// 1e-3 m; what 3MF means where it says nothing.
    #[default]
    Millimeter,
    /// 1e-2 m.
    Centimeter,
    /// 0.0254 m.
    Inch,
    /// 0.3048 m.
    Foot,
    /// 1 m; what glTF means always.
    Meter,
}

impl LengthUnit {
    /// All units.
    pub const ALL: [Self; 6] =
        [Self::Micron, Self::Millimeter, Self::Centimeter, Self::Inch, Self::Foot, Self::Meter];

    /// Its name in 3MF.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Micron => "micron",
            Self::Millimeter => "millimeter",
            Self::Centimeter => "centimeter",
            Self::Inch => "inch",
            Self::Foot => "foot",
            Self::Meter => "meter",
        }
    }

    /// The unit of this name.
    #[must_use]
    pub fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|unit| unit.name() == name)
    }

    /// How many metres it is.
    #[must_use]
    pub const fn metres(self) -> f64 {
        match self {
            Self::Micron => 1e-6,
            Self::Millimeter => 1e-3,
            Self::Centimeter => 1e-2,
            Self::Inch => 0.0254,
            Self::Foot => 0.3048,
            Self::Meter => 1.0,
        }
    }
}
