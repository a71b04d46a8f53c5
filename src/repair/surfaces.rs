//! What the output tells of its triangles: materials, patches, and the library beside an OBJ file.

use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use crate::contour::{Method, SurfaceDetail};
use crate::ingest::LOOK_MATERIALS;
use crate::io::{
    Format, IMAGES, ImageBeside, LIBRARY_MARK, MATERIALS, Palette, WriteOptions, images_beside,
    library_name, lost_of_materials, write_library,
};
use crate::repair::RepairError;
use crate::repair::outcome::TransferReport;
use crate::repair::run::Run;
use crate::repair::settings::{Limits, NormalRule, TextureRule};
use crate::repair::stages::Findings;
use crate::repair::workspace::Workspace;
use crate::store::FileState;

impl Run<'_> {
    /// What the output tells of its triangles, as far as its format can and the method knows it.
    pub(crate) fn surface_detail(&self, findings: &Findings) -> SurfaceDetail {
        if !self.format.has_materials() || self.settings.method == Method::Mc {
            SurfaceDetail::None
        } else if self.settings.tag_patches {
            SurfaceDetail::MaterialAndPatch
        } else if findings.soup().has_materials {
            SurfaceDetail::Material
        } else {
            SurfaceDetail::None
        }
    }

    /// What reached the output, and what did not.
    pub(crate) fn transfer_report(&self, findings: &Findings) -> TransferReport {
        let (soup, surfaces) = (findings.soup(), self.surface_detail(findings));
        let attributes = self.attributes(findings);
        let wants_normals = self.settings.normals != NormalRule::None;
        let lost = [
            (soup.has_materials && surfaces == SurfaceDetail::None, "materials"),
            (soup.has_uvs && !attributes.uvs, "texture coordinates"),
            (soup.has_colours && !attributes.colours, "colours of vertices"),
            (soup.has_normals && wants_normals && !attributes.normals, "normals"),
            (soup.parts > 1, "names of parts"),
            (self.ruler(findings).unit.is_some() && !self.format.holds_unit(), "the unit"),
        ];
        let lost = lost.iter().filter(|(is_lost, _)| *is_lost);
        let lost = lost.map(|(_, what)| (*what).to_owned());
        TransferReport {
            surfaces,
            attributes,
            looks: soup.looks,
            borders: findings.borders,
            lost: lost.chain(findings.lost_maps.iter().cloned()).collect(),
        }
    }

    /// How the output is written.
    pub(crate) fn write_options(
        &self,
        workspace: &Workspace,
        findings: &Findings,
    ) -> Result<WriteOptions, RepairError> {
        let palette = match self.surface_detail(findings) {
            SurfaceDetail::None => None,
            SurfaceDetail::Material | SurfaceDetail::MaterialAndPatch => {
                let files = workspace.files();
                let palette =
                    Palette::new(workspace.scratch(), FileState::find(&files, MATERIALS)?);
                let palette = palette.with_images(FileState::find(&files, IMAGES)?, self.input);
                Some(if self.has_sources(findings) {
                    palette.with_looks(FileState::find(&files, LOOK_MATERIALS)?)
                } else {
                    palette
                })
            }
        };
        let library = library_name(&workspace.output_path());
        let unit = self.ruler(findings).unit;
        Ok(WriteOptions {
            palette,
            tag_patches: self.settings.tag_patches,
            attributes: self.attributes(findings),
            scene: None,
            copies_images: self.settings.textures == TextureRule::Copy,
            output: workspace.output_path(),
            unit,
            library,
        })
    }

    /// Images and maps of materials that the output does not show.
    pub(crate) fn lost_maps(
        &self,
        options: &WriteOptions,
        workspace: &Workspace,
    ) -> Result<Vec<String>, RepairError> {
        let Some(palette) = &options.palette else { return Ok(Vec::new()) };
        lost_of_materials(palette, self.format, options, workspace.scratch())
            .map_err(RepairError::Output)
    }

    /// Refuses outputs whose images would replace others, before any work is done for them.
    pub(crate) fn keep_images(
        &self,
        workspace: &Workspace,
        findings: &Findings,
    ) -> Result<(), RepairError> {
        let mut options = self.write_options(workspace, findings)?;
        for level in &self.levels()[findings.finished.len()..] {
            options.output.clone_from(&level.output);
            self.beside(&options, workspace).keep_images()?;
        }
        Ok(())
    }

    /// Puts images and the library of the output beside it.
    pub(crate) fn put_beside(
        &self,
        workspace: &Workspace,
        findings: &Findings,
    ) -> Result<(), RepairError> {
        let options = self.write_options(workspace, findings)?;
        self.beside(&options, workspace).put()
    }

    fn beside<'o>(&'o self, options: &'o WriteOptions, workspace: &'o Workspace) -> Beside<'o> {
        Beside { format: self.format, options, workspace, replaces: &self.limits.replaces }
    }
}

/// What lies beside an output and belongs to it.
#[derive(Clone, Copy)]
pub struct Beside<'o> {
    pub format: Format,
    pub options: &'o WriteOptions,
    pub workspace: &'o Workspace,
    /// What may be replaced though it is not known to be ours.
    pub replaces: &'o [PathBuf],
}

impl Beside<'_> {
    /// Refuses an output whose images would replace others.
    ///
    /// # Errors
    /// [`RepairError::ForeignLibrary`].
    pub fn keep_images(self) -> Result<(), RepairError> {
        self.each_image_to_put(|_| Ok(()))
    }

    /// Puts the images that the output names, and the input has inside, beside the output; and the
    /// material library of an OBJ file.
    ///
    /// # Errors
    /// [`RepairError::ForeignLibrary`], or they cannot be written.
    pub fn put(self) -> Result<(), RepairError> {
        let Self { format, options, workspace, replaces } = self;
        let scratch = workspace.scratch();
        self.each_image_to_put(|image| {
            workspace.put_beside(&image.path, |part| image.write(part, scratch))
        })?;
        let Some(palette) = options.palette.as_ref().filter(|_| format == Format::Obj) else {
            return Ok(());
        };
        let path = workspace.output_path().with_file_name(&options.library);
        keep_foreign(&path, replaces)?;
        workspace.put_beside(&path, |part| write_library(part, palette, options, scratch))
    }

    /// Shows the images that are not in their place yet; what else is there stays.
    fn each_image_to_put(
        self,
        mut visit: impl FnMut(&ImageBeside) -> Result<(), RepairError>,
    ) -> Result<(), RepairError> {
        let scratch = self.workspace.scratch();
        images_beside(self.format, self.options, scratch, RepairError::Output, |image| {
            if image.is_there().map_err(RepairError::Output)? {
                return Ok(());
            }
            let is_ours = self.replaces.contains(&image.path);
            if !is_ours && image.path.symlink_metadata().is_ok() {
                return Err(RepairError::ForeignLibrary { path: image.path.clone() });
            }
            visit(image)
        })
    }
}

/// Refuses OBJ outputs whose libraries would replace one of another's making, the input's perhaps.
pub(super) fn keep_libraries<'o>(
    format: Format,
    outputs: impl Iterator<Item = &'o PathBuf>,
    limits: &Limits,
) -> Result<(), RepairError> {
    if format != Format::Obj {
        return Ok(());
    }
    let mut libraries = outputs.map(|output| output.with_file_name(library_name(output)));
    libraries.try_for_each(|library| keep_foreign(&library, &limits.replaces))
}

fn keep_foreign(path: &Path, replaces: &[PathBuf]) -> Result<(), RepairError> {
    if replaces.iter().any(|ours| ours == path) {
        return Ok(());
    }
    let foreign = || RepairError::ForeignLibrary { path: path.to_path_buf() };
    let file = match std::fs::File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(_) => return Err(foreign()),
    };
    let mut head = Vec::new();
    let read = file.take(LIBRARY_MARK.len() as u64).read_to_end(&mut head);
    if read.is_ok() && head == LIBRARY_MARK.as_bytes() { Ok(()) } else { Err(foreign()) }
}
