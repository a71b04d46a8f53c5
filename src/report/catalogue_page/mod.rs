//! The page of a catalogue: where it stands, what went wrong, and every model.
//!
//! In:         the journal, and the names of the pictures and pages that lie in the report folder.
//! Out:        one HTML file; pictures stay beside it.
//! Invariant:  all figures are of one moment of the journal. The page is readable without script:
//!             then its table ends after [`PLAIN_ROWS`] models, and says so.
//! Memory:     a row of the journal at a time, and groups of states and causes.
//! Fails:      [`ReportError`].

mod overview;
mod rows;

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::catalogue::{FOLDER as OWN_FOLDER, Journal, Totals};
use crate::io::IoError;
use crate::report::ReportError;
use crate::report::catalogue_page::rows::Surroundings;
use crate::report::error::Halt;
use crate::report::html::{Frame, Markup, way_between, write_page};
use crate::report::image_staged::StagedFile;

/// Folder of pages and pictures, in that of a catalogue's own files.
pub const FOLDER: &str = "report";
/// The page of the catalogue in it.
pub const INDEX: &str = "index.html";
/// Models in the table that stands in the page as text.
const PLAIN_ROWS: u64 = 300;

const SCRIPT: &str = include_str!("../html/assets/catalogue.js");

/// The folder of pages and pictures of the catalogue whose results lie in `target`.
#[must_use]
pub fn report_folder(target: &Path) -> PathBuf {
    target.join(OWN_FOLDER).join(FOLDER)
}

/// Writes the page of the catalogue in `target` to `path`, from its journal; what it sums up.
///
/// Links and pictures are relative, so the page is of use where it is written and, with the folder of
/// the results, anywhere else.
///
/// # Errors
/// The journal cannot be read, or the page cannot be written; then none is put in place.
pub fn write_catalogue_page(
    journal: &mut Journal,
    target: &Path,
    path: &Path,
) -> Result<Totals, ReportError> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let real = |folder: &Path| {
        folder.canonicalize().map_err(|source| {
            let path = folder.to_path_buf();
            ReportError::Folder { doing: "find", path, source }
        })
    };
    let (from, to) = (real(folder)?, real(target)?);
    let surroundings = Surroundings {
        report_folder: report_folder(target),
        to_report: way_between(&from, &report_folder(&to)),
        to_target: way_between(&from, &to),
    };
    let title = match to.file_name() {
        Some(name) => format!("Repairs in {}", name.to_string_lossy()),
        None => "Repairs".to_owned(),
    };
    let staged = StagedFile::create::<IoError>(path)?;
    let mut out = BufWriter::new(staged.file());
    let totals = journal
        .at_one_moment(|journal| {
            let totals = journal.totals()?;
            let frame = Frame { title: &title, back: None, scripts: &[SCRIPT] };
            write_page(&mut out, &frame, |html| {
                write_content(html, journal, &totals, &surroundings)
            })?;
            out.flush()?;
            Ok(totals)
        })
        .map_err(|halt: Halt| halt.at(path))?;
    drop(out);
    staged.put_in_place::<IoError>()?;
    Ok(totals)
}

fn write_content(
    html: &mut Markup,
    journal: &mut Journal,
    totals: &Totals,
    surroundings: &Surroundings,
) -> Result<(), Halt> {
    overview::write_totals(html, journal, totals)?;
    overview::write_failures(html, journal)?;
    overview::write_defects(html, journal)?;
    overview::write_extremes(html, journal)?;
    rows::write_models(html, journal, totals.models, surroundings)
}
