//! What the surface gets besides its shape: which attributes, and the steps that bring them there.

use crate::bridge::{ORIGINS, SLAB_ORIGINS};
use crate::contour::{CELLS, SURFACE, SurfaceDetail, WriteError, write_surface};
use crate::ingest::ATTRIBUTES;
use crate::io::IoError;
use crate::mesh::{Attributes, MeshSink};
use crate::paint::{Drawing, Drawn, Origins, PaintError, PaintOptions, no_drawing, paint};
use crate::repair::RepairError;
use crate::repair::run::Run;
use crate::repair::stages::{Findings, Handles, open_bricks};
use crate::repair::workspace::Workspace;
use crate::store::{FileState, NoCheckpoints, Resources, Spool};

impl Run<'_> {
    /// The attributes that the output gets if the input has them.
    pub(crate) fn takes(&self) -> Attributes {
        self.settings.takes(self.format)
    }

    /// The attributes that the output gets.
    pub(crate) fn attributes(&self, findings: &Findings) -> Attributes {
        let soup = findings.soup();
        let given =
            Attributes { uvs: soup.has_uvs, colours: soup.has_colours, normals: soup.has_normals };
        self.settings.gets(self.format, given)
    }

    /// Whether crossings tell of their source triangles.
    pub(crate) fn has_sources(&self, findings: &Findings) -> bool {
        findings.soup().looks > 0
    }

    /// What triangles tell of what they are until they are written: their looks at least.
    pub(crate) fn drawn_detail(&self, findings: &Findings) -> SurfaceDetail {
        match self.surface_detail(findings) {
            SurfaceDetail::None if self.has_sources(findings) => SurfaceDetail::Material,
            detail => detail,
        }
    }

    /// Draws the surface into spools, if it gets attributes.
    pub(crate) fn draw(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        let (scratch, attributes) = (resources.scratch, self.attributes(findings));
        if !attributes.any() {
            return Ok(no_drawing(scratch)?.files());
        }
        let resources = &Resources { checkpoints: &NoCheckpoints, ..*resources };
        let files = workspace.files();
        let mended = Spool::open(scratch, FileState::find(&files, ORIGINS)?)?;
        let slabs = Spool::open(scratch, FileState::find(&files, SLAB_ORIGINS)?)?;
        let given = findings.soup().stats.triangles;
        let origins = Origins::new(given, &[&mended, &slabs], resources)?;
        let mut drawing = Drawing::new(attributes, origins, resources)?;
        let cells = open_bricks(&mut handles.cells, CELLS, workspace, resources)?;
        let surface = open_bricks(&mut handles.surface, SURFACE, workspace, resources)?;
        let placed = (&findings.placed, None);
        let (domain, options) = (findings.domain(), self.contour_options(findings));
        findings.contour =
            write_surface((cells, surface), domain, &options, placed, &mut drawing, resources)
                .map_err(|error| match error {
                    WriteError::Contour(error) => RepairError::Contour(error),
                    WriteError::Sink(error) => RepairError::Store(error),
                })?;
        (handles.cells, handles.surface) = (None, None);
        Ok(drawing.end()?.files())
    }

    /// Writes the surface that was drawn, with its attributes.
    pub(crate) fn paint<S: MeshSink<Error = IoError> + ?Sized>(
        &self,
        workspace: &Workspace,
        findings: &Findings,
        sink: &mut S,
        resources: &Resources,
    ) -> Result<(), RepairError> {
        let files = workspace.files();
        let drawn = Drawn::open(resources, &files)?;
        let sources = Spool::open(resources.scratch, FileState::find(&files, ATTRIBUTES)?)?;
        let options = PaintOptions {
            wanted: self.attributes(findings),
            surfaces: self.surface_detail(findings) != SurfaceDetail::None,
            cell: findings.domain().cell_size(),
            crease_deg: self.settings.crease_deg,
            slack: self.contour_options(findings).merged_cells() * findings.domain().cell_size(),
        };
        paint(&drawn, &sources, &options, sink, resources).map_err(|error| match error {
            PaintError::Store(error) => RepairError::Store(error),
            PaintError::Sink(error) => RepairError::Output(error),
        })
    }
}
