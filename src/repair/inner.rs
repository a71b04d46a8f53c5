//! Names of work folders inside of another one: of the parts of a model, and of all of it.

/// What names of the folders of parts begin with.
const PART_FOLDER: &str = "part-";
/// Name of the folder in which the whole is looked at.
const WHOLE_FOLDER: &str = "whole";

/// A work folder inside of another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inner {
    /// That of the whole model.
    Whole,
    /// That of the part with this number.
    Part(u32),
}

impl Inner {
    /// Its name.
    pub fn name(self) -> String {
        match self {
            Self::Whole => WHOLE_FOLDER.to_owned(),
            Self::Part(number) => format!("{PART_FOLDER}{number}"),
        }
    }

    /// The folder with this name.
    pub fn named(name: &str) -> Option<Self> {
        let of_number = |number: &str| number.parse().ok().map(Self::Part);
        match name {
            WHOLE_FOLDER => Some(Self::Whole),
            name => name.strip_prefix(PART_FOLDER).and_then(of_number),
        }
    }

    /// Whether it is that of one of the first parts.
    pub fn is_below(self, count: u32) -> bool {
        matches!(self, Self::Part(number) if number < count)
    }
}
