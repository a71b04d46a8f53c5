//! The page and the pictures of one model of a catalogue, beside the page of all.

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::catalogue::Pages;
use crate::io::IoError;
use crate::monitor::Monitor;
use crate::report::image_staged::StagedFile;
use crate::report::model_page::{look, write_shown};
use crate::report::pictures::Picture;
use crate::report::{INDEX, ModelPage, PageOptions, ReportError};
use crate::store::Scratch;

/// Folder of pages, in that of the report.
const PAGES: &str = "models";
/// Folder of pictures.
const PICTURES: &str = "pictures";
/// Width of the small pictures.
const THUMBNAIL_PX: u32 = 128;

/// Where a model's page and pictures are.
#[derive(Clone, Debug)]
pub struct Gallery {
    folder: PathBuf,
    number: i64,
}

impl Gallery {
    /// Of the model with this number in the journal; `folder` is that of the report.
    #[must_use]
    pub fn new(folder: &Path, number: i64) -> Self {
        Self { folder: folder.to_path_buf(), number }
    }

    /// Its page.
    #[must_use]
    pub fn page(&self) -> PathBuf {
        self.folder.join(PAGES).join(format!("{}.html", self.number))
    }

    /// The small picture of the model.
    #[must_use]
    pub fn before(&self) -> PathBuf {
        self.folder.join(PICTURES).join(format!("{}-before.png", self.number))
    }

    /// The small picture of the result.
    #[must_use]
    pub fn after(&self) -> PathBuf {
        self.folder.join(PICTURES).join(format!("{}-after.png", self.number))
    }

    /// Removes what was written of an earlier result.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub fn clear(&self) -> Result<(), ReportError> {
        for path in [self.page(), self.before(), self.after()] {
            match std::fs::remove_file(&path) {
                Err(source) if source.kind() != ErrorKind::NotFound => {
                    return Err(ReportError::Folder { doing: "remove", path, source });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Writes what is wanted, in place of what is there.
    ///
    /// # Errors
    /// As for [`crate::report::write_model_page`].
    pub fn write(
        &self,
        model: &ModelPage,
        wanted: Pages,
        share_bytes: u64,
        scratch: &Scratch,
        monitor: &dyn Monitor,
    ) -> Result<(), ReportError> {
        self.clear()?;
        let options = match wanted {
            Pages::None => return Ok(()),
            Pages::Thumbnails => {
                PageOptions { picture_px: THUMBNAIL_PX, mesh_triangles: 0, share_bytes, map: None }
            }
            Pages::All => PageOptions::small(share_bytes),
        };
        for folder in [PAGES, PICTURES].map(|name| self.folder.join(name)) {
            std::fs::create_dir_all(&folder).map_err(|source| ReportError::Folder {
                doing: "create",
                path: folder,
                source,
            })?;
        }
        let shown = look(model, &options, scratch, monitor)?;
        if wanted == Pages::All {
            let back = format!("../{INDEX}");
            write_shown(&self.page(), &ModelPage { back: Some(&back), ..*model }, &shown)?;
        }
        let factor = options.picture_px / THUMBNAIL_PX;
        let [before, after] = &shown.pictures;
        write_picture(&self.before(), &before.shrunk(factor))?;
        // Last: where it is, the other one is as well.
        write_picture(&self.after(), &after.shrunk(factor))
    }
}

fn write_picture(path: &Path, picture: &Picture) -> Result<(), ReportError> {
    let staged = StagedFile::create::<IoError>(path)?;
    let written = picture.encode().and_then(|bytes| staged.file().write_all(&bytes));
    written.map_err(|source| ReportError::Write { path: path.to_path_buf(), source })?;
    staged.put_in_place::<IoError>()?;
    Ok(())
}
