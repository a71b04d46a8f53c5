//! Finds the models of a folder.
//!
//! In:         a folder, or a list of files in it, and a [`Selection`].
//! Out:        every model once, folder by folder, names in order of their bytes; and how many
//!             other files there were, and why they are none.
//! Invariant:  a file is opened only if its name has no extension. Links are followed; loops are
//!             passed by.
//! Memory:     a path and a handle for each level of the folders.
//! Fails:      the folder itself cannot be read. What is unreadable within is counted and told.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use globset::{GlobBuilder, GlobSet, GlobSetBuilder};
use serde::{Deserialize, Serialize};
use walkdir::{DirEntry, WalkDir};

use crate::catalogue::CatalogueError;
use crate::catalogue::stamp::Stamp;
use crate::io::{detect, format_of_name};
use crate::store::StoreError;

/// Examples that are kept of each reason.
const MOST_EXAMPLES: usize = 3;

/// Which files are taken.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Patterns of which one must fit; all files when empty.
    include: GlobSet,
    /// Patterns of which none may fit.
    exclude: GlobSet,
    /// Sizes in bytes, both included.
    sizes: Option<(u64, u64)>,
}

impl Selection {
    /// Files whose path within the folder fits one of `include`, if there are any, and none of
    /// `exclude`. A pattern without a slash is one of names, in whatever folder; upper and lower
    /// case are the same.
    ///
    /// # Errors
    /// A pattern cannot be understood.
    pub fn new(
        include: &[String],
        exclude: &[String],
        sizes: Option<(u64, u64)>,
    ) -> Result<Self, CatalogueError> {
        Ok(Self { include: set_of(include)?, exclude: set_of(exclude)?, sizes })
    }

    /// Whether the path of a file is one of those that are taken, whatever its size.
    #[must_use]
    pub fn fits(&self, relative: &Path) -> bool {
        let is_wanted = self.include.is_empty() || self.include.is_match(relative);
        is_wanted && !self.exclude.is_match(relative)
    }

    fn reason_against(&self, relative: &Path, bytes: u64) -> Option<Passed> {
        if !self.fits(relative) {
            return Some(Passed::Excluded);
        }
        match self.sizes {
            Some((least, most)) if bytes < least || bytes > most => Some(Passed::OtherSize),
            _ => None,
        }
    }
}

/// The set of the files that one of `patterns` fits.
pub(crate) fn set_of(patterns: &[String]) -> Result<GlobSet, CatalogueError> {
    let refused = |pattern: &str, error: globset::Error| CatalogueError::Pattern {
        pattern: pattern.to_owned(),
        reason: error.kind().to_string(),
    };
    let mut set = GlobSetBuilder::new();
    for pattern in patterns {
        let anywhere = if pattern.contains('/') { "" } else { "**/" };
        let pattern = pattern.trim_start_matches("./");
        let glob = GlobBuilder::new(&format!("{anywhere}{pattern}"))
            .literal_separator(true)
            .case_insensitive(true)
            .build()
            .map_err(|error| refused(pattern, error))?;
        set.add(glob);
    }
    set.build().map_err(|error| refused(&patterns.join(" "), error))
}

/// Why a file is passed by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Passed {
    /// Its name is not that of a model.
    NoModel,
    /// By `--include` or `--exclude`.
    Excluded,
    /// By its size.
    OtherSize,
    /// A pipe, a socket, a device.
    Special,
    /// A link to a folder that it lies in.
    Loop,
    /// Folder or file that cannot be looked at.
    Unreadable,
    /// Listed, but not there.
    Missing,
}

impl Passed {
    /// What the files are called in a sentence.
    #[must_use]
    pub const fn noun(self) -> &'static str {
        match self {
            Self::NoModel => "no models",
            Self::Excluded => "excluded",
            Self::OtherSize => "of another size",
            Self::Special => "no regular files",
            Self::Loop => "links in a loop",
            Self::Unreadable => "unreadable",
            Self::Missing => "missing",
        }
    }
}

/// A model that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Its path within the folder.
    pub relative: PathBuf,
    /// What the file system says of it.
    pub stamp: Stamp,
}

/// Files that were passed by.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PassedBy {
    /// How many, by reason.
    pub counts: BTreeMap<Passed, u64>,
    /// A few of each, as text.
    pub examples: BTreeMap<Passed, Vec<String>>,
}

impl PassedBy {
    fn add(&mut self, reason: Passed, path: &Path) {
        *self.counts.entry(reason).or_default() += 1;
        let examples = self.examples.entry(reason).or_default();
        if examples.len() < MOST_EXAMPLES {
            examples.push(path.to_string_lossy().into_owned());
        }
    }
}

/// Shows all models below `source` to `visit`; what lies in one of `hidden` folders (canonical) is
/// not looked at.
///
/// # Errors
/// The folder cannot be read, or what `visit` says.
pub fn walk(
    source: &Path,
    hidden: &[PathBuf],
    selection: &Selection,
    mut visit: impl FnMut(Found) -> Result<(), CatalogueError>,
) -> Result<PassedBy, CatalogueError> {
    std::fs::read_dir(source).map_err(|e| StoreError::io("list", source, e))?;
    let mut passed = PassedBy::default();
    let is_shown = |entry: &DirEntry| {
        !entry.file_type().is_dir()
            || !entry.path().canonicalize().is_ok_and(|folder| hidden.contains(&folder))
    };
    let entries = WalkDir::new(source)
        .follow_links(true)
        .sort_by_file_name()
        .into_iter()
        .filter_entry(is_shown);
    for entry in entries {
        let entry = match entry {
            Ok(entry) => entry,
            Err(error) => {
                let is_loop = error.loop_ancestor().is_some();
                let reason = if is_loop { Passed::Loop } else { Passed::Unreadable };
                passed.add(reason, error.path().unwrap_or(source));
                continue;
            }
        };
        if !entry.file_type().is_dir() {
            consider(source, entry.path(), selection, &mut passed, &mut visit)?;
        }
    }
    Ok(passed)
}

/// Shows the listed models, whose paths are within `source` or relative to it, to `visit`.
///
/// # Errors
/// What `visit` says.
pub fn walk_listed(
    source: &Path,
    listed: &[PathBuf],
    selection: &Selection,
    mut visit: impl FnMut(Found) -> Result<(), CatalogueError>,
) -> Result<PassedBy, CatalogueError> {
    let mut passed = PassedBy::default();
    for path in listed {
        let relative = path.strip_prefix(source).unwrap_or(path);
        consider(source, &source.join(relative), selection, &mut passed, &mut visit)?;
    }
    Ok(passed)
}

fn consider(
    source: &Path,
    path: &Path,
    selection: &Selection,
    passed: &mut PassedBy,
    visit: &mut impl FnMut(Found) -> Result<(), CatalogueError>,
) -> Result<(), CatalogueError> {
    let relative = match path.strip_prefix(source) {
        Ok(relative) if !relative.starts_with("..") => relative.to_path_buf(),
        _ => {
            passed.add(Passed::Missing, path);
            return Ok(());
        }
    };
    let metadata = match std::fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) => {
            let is_missing = error.kind() == std::io::ErrorKind::NotFound;
            passed.add(if is_missing { Passed::Missing } else { Passed::Unreadable }, path);
            return Ok(());
        }
    };
    let reason = if !metadata.is_file() {
        Some(Passed::Special)
    } else if let Some(reason) = selection.reason_against(&relative, metadata.len()) {
        Some(reason)
    } else {
        (!is_model(path)).then_some(Passed::NoModel)
    };
    match reason {
        Some(reason) => passed.add(reason, path),
        None => visit(Found { relative, stamp: Stamp::of(&metadata) })?,
    }
    Ok(())
}

/// By its name; a file whose name has no extension is looked into.
fn is_model(path: &Path) -> bool {
    match path.extension() {
        Some(_) => format_of_name(path).is_some(),
        None => detect(path).is_ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::symlink;

    fn found(source: &Path, hidden: &[PathBuf], selection: &Selection) -> (Vec<PathBuf>, PassedBy) {
        let mut models = Vec::new();
        let passed = walk(source, hidden, selection, |found| {
            models.push(found.relative);
            Ok(())
        });
        (models, passed.expect("the folder is readable"))
    }

    fn write(path: &Path, content: &[u8]) {
        std::fs::create_dir_all(path.parent().expect("in a folder")).expect("a folder");
        std::fs::write(path, content).expect("writable");
    }

    #[test]
    fn models_are_found_whatever_their_names_and_the_rest_is_counted() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let source = folder.path();
        let odd = OsStr::from_bytes(b"b/na\xffme\n.STL");
        for name in ["a b/é.Obj", "a b/wood.png", "c.ply.gz", "out/x.stl", "d.txt"] {
            write(&source.join(name), b"x");
        }
        write(&source.join(odd), b"x");
        write(&source.join("plain"), b"ply\nformat ascii 1.0\n");
        write(&source.join("notes"), b"hello");
        symlink(source, source.join("a b/up")).expect("a link");
        symlink("nowhere", source.join("dead.stl")).expect("a link");
        let hidden = [source.join("out").canonicalize().expect("there")];
        let (models, passed) = found(source, &hidden, &Selection::default());
        let expected =
            [Path::new("a b/é.Obj"), Path::new(odd), "c.ply.gz".as_ref(), "plain".as_ref()];
        assert_eq!(models, expected);
        assert_eq!(passed.counts[&Passed::NoModel], 3);
        assert_eq!(passed.counts[&Passed::Loop], 1);
        assert_eq!(passed.counts[&Passed::Unreadable], 1, "a link to nothing");
    }

    #[test]
    fn patterns_are_of_names_or_of_paths() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let source = folder.path();
        for name in ["a/chair.obj", "a/old/chair.obj", "b/TABLE.STL"] {
            write(&source.join(name), b"x");
        }
        let select = |include: &[&str], exclude: &[&str], sizes| {
            let texts =
                |patterns: &[&str]| patterns.iter().map(|&p| p.to_owned()).collect::<Vec<_>>();
            Selection::new(&texts(include), &texts(exclude), sizes).expect("good patterns")
        };
        let names = |selection| found(source, &[], &selection).0;
        assert_eq!(names(select(&["*.stl"], &[], None)), [Path::new("b/TABLE.STL")]);
        assert_eq!(names(select(&["a/*"], &[], None)), [Path::new("a/chair.obj")]);
        assert_eq!(
            names(select(&["a/**"], &["old/**", "**/old/**"], None)),
            [Path::new("a/chair.obj")]
        );
        assert_eq!(names(select(&[], &[], Some((2, 9)))), Vec::<PathBuf>::new());
        let broken = Selection::new(&["a[".to_owned()], &[], None);
        assert!(matches!(broken, Err(CatalogueError::Pattern { .. })));
    }

    #[test]
    fn listed_files_are_within_the_folder() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let source = folder.path();
        write(&source.join("a.obj"), b"x");
        let listed = ["a.obj".into(), source.join("a.obj"), "gone.obj".into(), "../x.obj".into()];
        let mut models = Vec::new();
        let passed = walk_listed(source, &listed, &Selection::default(), |found| {
            models.push(found.relative);
            Ok(())
        });
        assert_eq!(models, [Path::new("a.obj"), Path::new("a.obj")]);
        assert_eq!(passed.expect("all is told").counts[&Passed::Missing], 2);
    }
}
