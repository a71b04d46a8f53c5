//! Levels of detail: thresholds of decimation, and the file of each.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::repair::RepairError;
use crate::repair::length::{LengthError, Reach};

/// A list of thresholds, such as `0,0.1,0.5,2cells`. A number without a unit has that of the last
/// one.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels(pub Vec<Reach>);

impl FromStr for Levels {
    type Err = LengthError;

    fn from_str(text: &str) -> Result<Self, LengthError> {
        let last = text.rsplit(',').next().unwrap_or_default().trim();
        let unit = last.trim_start_matches(|c: char| c.is_ascii_digit() || "+-.eE".contains(c));
        let level = |item: &str| match item.trim().parse::<f64>() {
            Ok(number) if number != 0.0 => format!("{}{unit}", item.trim()).parse(),
            _ => item.parse(),
        };
        text.split(',').map(level).collect::<Result<_, _>>().map(Self)
    }
}

/// One threshold of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// How far a vertex may lie from the planes it stands for.
    pub decimate: Reach,
    /// Where its file goes.
    pub output: PathBuf,
}

impl Level {
    /// The levels of a run for `output`: the file of each has its threshold before the extension.
    ///
    /// # Errors
    /// [`RepairError::SameLevel`].
    pub fn beside(output: &Path, thresholds: &[Reach]) -> Result<Vec<Self>, RepairError> {
        let mut levels: Vec<Self> = Vec::with_capacity(thresholds.len());
        for &decimate in thresholds {
            let output = named(output, decimate);
            if levels.iter().any(|level| level.output == output) {
                return Err(RepairError::SameLevel { level: decimate });
            }
            levels.push(Self { decimate, output });
        }
        Ok(levels)
    }
}

/// `out.0.1cells.ply` for `out.ply`.
fn named(output: &Path, decimate: Reach) -> PathBuf {
    let mut name = output.file_stem().map_or_else(|| OsString::from("out"), OsString::from);
    name.push(format!(".{decimate}").replace('%', "pct"));
    if let Some(extension) = output.extension() {
        name.push(".");
        name.push(extension);
    }
    output.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repair::Length;

    fn parsed(text: &str) -> Option<Vec<Reach>> {
        text.parse().ok().map(|levels: Levels| levels.0)
    }

    #[test]
    fn numbers_without_a_unit_have_that_of_the_last_one() {
        let cells = [0.0, 0.1, 0.5, 2.0].map(Reach::Cells);
        assert_eq!(parsed("0,0.1,0.5,2cells"), Some(cells.into()));
        assert_eq!(parsed("0, 1e-1 , 0.5,2 cells"), Some(cells.into()));
        let shares = [Reach::Cells(0.0), Reach::Length(Length::Percent(0.5))];
        let last = Reach::Length(Length::Percent(1.0));
        assert_eq!(parsed("0,0.5,1%"), Some([&shares[..], &[last]].concat()));
        assert_eq!(parsed("2cells,0.5,1%"), Some(vec![Reach::Cells(2.0), shares[1], last]));
        let units = [0.5, 1.0].map(|x| Reach::Length(Length::Model(x)));
        assert_eq!(parsed("0.5,1"), Some(units.into()));
        assert_eq!(parsed("1cell"), Some(vec![Reach::Cells(1.0)]));
        for wrong in ["", ",", "1cells,", "1,,2cells", "-1,2cells", "a,2cells", "1,cells"] {
            assert_eq!(parsed(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn the_file_of_a_level_has_its_threshold_before_the_extension() {
        let thresholds: Levels = "0,0.1cells,2%,0.5,3mm".parse().expect("a list");
        let levels = Level::beside(Path::new("folder/a.b.ply"), &thresholds.0).expect("distinct");
        let names = levels.iter().map(|level| level.output.to_string_lossy());
        assert_eq!(
            names.collect::<Vec<_>>(),
            [
                "folder/a.b.0cells.ply",
                "folder/a.b.0.1cells.ply",
                "folder/a.b.2pct.ply",
                "folder/a.b.0.0005m.ply",
                "folder/a.b.0.003m.ply"
            ]
        );
        let same: Levels = "0.5,0,0.50cells".parse().expect("a list");
        let error = Level::beside(Path::new("a.ply"), &same.0);
        assert!(matches!(error, Err(RepairError::SameLevel { .. })));
    }
}
