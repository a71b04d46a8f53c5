//! What the output tells of its triangles: materials, patches, and the library beside an OBJ file.

use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use crate::contour::{Method, SurfaceDetail};
use crate::io::{
    Format, LIBRARY_MARK, MATERIALS, Palette, WriteOptions, library_name, write_library,
};
use crate::mesh::Attributes;
use crate::repair::RepairError;
use crate::repair::outcome::TransferReport;
use crate::repair::run::Run;
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
        let lost = [
            (soup.has_materials && surfaces == SurfaceDetail::None, "materials"),
            (soup.has_uvs, "texture coordinates"),
            (soup.has_colours, "colours of vertices"),
            (soup.parts > 1, "names of parts"),
            (
                self.ruler(findings).unit.is_some_and(|unit| !self.format.holds_unit(unit)),
                "the unit",
            ),
        ];
        let lost = lost.iter().filter(|(is_lost, _)| *is_lost);
        TransferReport {
            surfaces,
            borders: findings.borders,
            lost: lost.map(|(_, what)| (*what).to_owned()).collect(),
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
                let materials = workspace.files();
                let state = FileState::find(&materials, MATERIALS)?;
                Some(Palette::new(workspace.scratch(), state))
            }
        };
        let library = library_name(&workspace.output_path());
        let unit = self.ruler(findings).unit;
        Ok(WriteOptions {
            palette,
            tag_patches: self.settings.tag_patches,
            attributes: Attributes::NONE,
            output: workspace.output_path(),
            unit,
            library,
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
