//! The surface on its way into a file, and the proof of that.

use crate::contour::{CELLS, SURFACE, WriteProgress, write_surface};
use crate::io::{Format, IoError, ReadOptions, check_output};
use crate::mesh::{CornerForm, MeshSink};
use crate::monitor::{Counter, Monitor};
use crate::repair::RepairError;
use crate::repair::finish::broken_promises;
use crate::repair::run::Run;
use crate::repair::stages::{Findings, Handles, open_bricks};
use crate::repair::step::OUTPUT_PART;
use crate::repair::workspace::Workspace;
use crate::sign::FillRule;
use crate::store::{FileState, Resources};
use crate::verify::{Outward, ProofOptions, ProvedSource, Vertices, prove};

impl Run<'_> {
    /// Writes the surface into the work folder.
    pub(crate) fn write(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        handles: &mut Handles,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        let is_painted = self.attributes(findings).any();
        // What is painted begins anew: the long part of it lies in spools.
        let start = WriteProgress::noted(resources).filter(|_| !is_painted);
        let (part, scratch) = (workspace.part(), resources.scratch);
        let write_options = self.write_options(workspace, findings)?;
        findings.lost_maps = self.lost_maps(&write_options, workspace)?;
        let sink = match &start {
            Some(noted) => {
                crate::io::reopen(part, self.format, scratch, &write_options, &noted.sink)
            }
            None => crate::io::create(part, self.format, scratch, &write_options),
        };
        let mut sink = sink.map_err(RepairError::Output)?;
        findings.is_split = sink.corner_form() == CornerForm::OfVertices;
        self.write_into(workspace, findings, (handles, start), &mut *sink, resources)?;
        let written = sink.finish().map_err(RepairError::Output)?;
        self.recording.count(Counter::OutputBytesWritten, written.file.bytes);
        findings.written = written;
        Ok(vec![FileState {
            name: OUTPUT_PART.to_owned(),
            len_bytes: written.file.bytes,
            records: written.triangles,
            root: written.file.digest,
        }])
    }

    /// Hands the surface to a sink, from its start or from where an earlier run was.
    pub(crate) fn write_into<S: MeshSink<Error = IoError> + ?Sized>(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        (handles, start): (&mut Handles, Option<WriteProgress>),
        sink: &mut S,
        resources: &Resources,
    ) -> Result<(), RepairError> {
        if self.attributes(findings).any() {
            self.paint(workspace, findings, sink, resources)?;
        } else {
            let cells = open_bricks(&mut handles.cells, CELLS, workspace, resources)?;
            let surface = open_bricks(&mut handles.surface, SURFACE, workspace, resources)?;
            let placed = (&findings.placed, start);
            let (domain, options) = (findings.domain(), self.contour_options(findings));
            findings.contour =
                write_surface((cells, surface), domain, &options, placed, sink, resources)
                    .map_err(RepairError::from_write)?;
        }
        (handles.cells, handles.surface) = (None, None);
        Ok(())
    }

    /// Reads the written file back and judges it.
    pub(crate) fn prove(
        &self,
        workspace: &Workspace,
        findings: &mut Findings,
        resources: &Resources,
    ) -> Result<Vec<FileState>, RepairError> {
        // A coordinate may change and the surface stay sound: so the bytes are checked as well.
        check_output(workspace.part(), &findings.written.file, resources.scratch)?;
        let share_bytes = resources.share_bytes / 4;
        let options = match self.format {
            // Nodes say what a unit is; numbers are proved as they were written.
            Format::Glb => ReadOptions::by_itself(share_bytes),
            _ => ReadOptions::in_scene(share_bytes),
        };
        let mut open = || {
            crate::io::open(workspace.part(), resources.scratch, &options)
                .map(|source| source as ProvedSource<'static, IoError>)
        };
        self.prove_source(&mut open, workspace, findings, resources)?;
        Ok(Vec::new())
    }

    /// Proves what `open` gives: the whole file, or what it has of one part.
    pub(crate) fn prove_source(
        &self,
        open: &mut dyn FnMut() -> Result<ProvedSource<'static, IoError>, IoError>,
        workspace: &Workspace,
        findings: &mut Findings,
        resources: &Resources,
    ) -> Result<(), RepairError> {
        let outward = match self.settings.fill_rule {
            // What lies behind panes is a hollow.
            FillRule::Solid if !findings.has_panes() => Outward::AllPositive,
            _ => Outward::AlternatesWithNesting,
        };
        let vertices = if findings.is_split { Vertices::Positions } else { Vertices::Numbers };
        let share_bytes = resources.share_bytes / 2;
        let proof_options = ProofOptions { share_bytes, outward, vertices, intersections: true };
        let proof = prove(open, resources.scratch, &proof_options, resources.pool, self.recording)
            .map_err(RepairError::from_verify)?;
        // What other methods do not promise is no bug: the outcome tells it.
        let failures = broken_promises(&proof);
        if failures.is_empty() || self.settings.method.caveat().is_some() {
            findings.proof = Some(proof);
            return Ok(());
        }
        let folder = workspace.folder().to_path_buf();
        Err(RepairError::ProofFailed { failures: failures.join("; "), folder })
    }
}
