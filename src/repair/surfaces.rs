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
use crate::repair::settings::NormalRule;
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
            (
                self.ruler(findings).unit.is_some_and(|unit| !self.format.holds_unit(unit)),
                "the unit",
            ),
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
            self.each_image_to_put(&options, workspace, |_| Ok(()))?;
        }
        Ok(())
    }

    /// Puts the images that the output names, and the input has inside, beside the output.
    pub(crate) fn put_images(
        &self,
        workspace: &Workspace,
        findings: &Findings,
    ) -> Result<(), RepairError> {
        let options = self.write_options(workspace, findings)?;
        let scratch = workspace.scratch();
        self.each_image_to_put(&options, workspace, |image| {
            workspace.put_beside(&image.path, |part| image.write(part, scratch))
        })
    }

    /// Shows the images that are not in their place yet; what else is there stays.
    fn each_image_to_put(
        &self,
        options: &WriteOptions,
        workspace: &Workspace,
        mut visit: impl FnMut(&ImageBeside) -> Result<(), RepairError>,
    ) -> Result<(), RepairError> {
        let scratch = workspace.scratch();
        images_beside(self.format, options, scratch, RepairError::Output, |image| {
            if image.is_there().map_err(RepairError::Output)? {
                return Ok(());
            }
            if image.path.symlink_metadata().is_ok() {
                return Err(RepairError::ForeignLibrary { path: image.path.clone() });
            }
            visit(image)
        })
    }

    /// Puts the material library of an OBJ file in its place, before the file.
    pub(crate) fn put_library(
        &self,
        workspace: &Workspace,
        findings: &Findings,
    ) -> Result<(), RepairError> {
        let options = self.write_options(workspace, findings)?;
        let Some(palette) = options.palette.as_ref().filter(|_| self.format == Format::Obj) else {
            return Ok(());
        };
        let path = workspace.output_path().with_file_name(&options.library);
        keep_foreign(&path)?;
        workspace
            .put_beside(&path, |part| write_library(part, palette, &options, workspace.scratch()))
    }
}

/// Refuses OBJ outputs whose libraries would replace one of another's making, the input's perhaps.
pub(super) fn keep_libraries<'o>(
    format: Format,
    outputs: impl Iterator<Item = &'o PathBuf>,
) -> Result<(), RepairError> {
    if format != Format::Obj {
        return Ok(());
    }
    outputs
        .into_iter()
        .try_for_each(|output| keep_foreign(&output.with_file_name(library_name(output))))
}

fn keep_foreign(path: &Path) -> Result<(), RepairError> {
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
