//! Writes all parts into one file, one after the other.
//!
//! A part whose surface is there is handed on at once; of others what is left is done first. Memory:
//! that of one part, and of the writer.

use crate::ingest::{LOOK_MATERIALS, SOUP};
use crate::io::{LookMap, MATERIALS, Palette, Sink, WriteOptions, lost_of_materials};
use crate::mesh::CornerForm;
use crate::monitor::{Counter, Monitor, Stage};
use crate::repair::RepairError;
use crate::repair::parts::outcome::{PartReport, PartsOutcome};
use crate::repair::parts::part_sink::{Numbered, PartSink};
use crate::repair::parts::{Assembly, Done, Model};
use crate::repair::run::{Feed, Run};
use crate::repair::stages::{Findings, Handles};
use crate::repair::standing::FOUND;
use crate::repair::step::Step;
use crate::repair::workspace::Workspace;
use crate::store::{FileState, Resources, TextsWriter};

impl Assembly<'_> {
    /// Writes all parts into one file, and proves each; what came of them, and the spool of their
    /// outcomes.
    pub(super) fn assemble(
        &self,
        model: &mut Model,
        options: &WriteOptions,
        (whole, rebuilt): (&PartsOutcome, &[String]),
        resources: &Resources,
    ) -> Result<(PartsOutcome, FileState), RepairError> {
        let mut outcome = whole.clone();
        let scratch = resources.scratch;
        let lost = match &options.palette {
            Some(palette) => lost_of_materials(palette, self.format, options, scratch),
            None => Ok(Vec::new()),
        };
        let mut lost = lost.map_err(RepairError::Output)?;
        if !self.format.has_parts() {
            lost.push("names of parts".to_owned());
        }
        let sink = crate::io::create(self.workspace.part(), self.format, scratch, options);
        let mut sink = sink.map_err(RepairError::Output)?;
        let is_split = sink.corner_form() == CornerForm::OfVertices;
        let mut found = TextsWriter::create(scratch, FOUND)?;
        let mut there = Numbered::default();
        let mut nothing = None;
        for turn in 0..model.places.len() {
            let (number, at) = model.places.get(turn)?;
            let name = model.scattered_mut().name(number)?;
            self.recording.note(&format!("part {} of {}: {name}", turn + 1, model.places.len()));
            let feed = Feed::Part { of: &model.scattered, number, name: name.clone() };
            let run = self.run_of(feed, model.finest / at.stretch);
            let workspace = self.open_part(number, !rebuilt.is_empty())?;
            let before = there;
            let written = self.write_part(&run, &workspace, (&mut sink, &name), &mut there);
            let mut findings = match written {
                Ok(findings) => findings,
                Err(error @ (RepairError::EmptyResult { .. } | RepairError::NoTriangle { .. })) => {
                    outcome.empty_parts += 1;
                    outcome.leave_out(number, &name, error.to_string());
                    nothing.get_or_insert(error);
                    continue;
                }
                Err(error) => return Err(error),
            };
            findings.is_split = is_split;
            findings.lost_maps.clone_from(&lost);
            let report = PartReport { number, name, places: at.count };
            let files = workspace.files();
            let soup = FileState::find(&files, SOUP)?.clone();
            let resumptions = workspace.resumptions();
            let done = Done { report, before, after: there, soup, resumptions };
            let text = serde_json::to_string(&(&done, &findings)).expect("plain records serialise");
            found.push(&text)?;
        }
        let written = sink.finish().map_err(RepairError::Output)?;
        if let (0, Some(error)) = (there.triangles, nothing) {
            return Err(error);
        }
        self.recording.count(Counter::OutputBytesWritten, written.file.bytes);
        outcome.bytes = written.file.bytes;
        let found = found.finish()?;
        let concluded =
            self.prove(model, (&found, &written.file), rebuilt, &mut outcome, resources)?;
        Ok((outcome, concluded))
    }

    /// Does what is left of a part up to its surface, and hands that to the sink.
    fn write_part(
        &self,
        run: &Run,
        workspace: &Workspace,
        (sink, name): (&mut Sink, &str),
        there: &mut Numbered,
    ) -> Result<Findings, RepairError> {
        let Feed::Part { number, .. } = run.feed else { unreachable!("parts have numbers") };
        let mut findings = run.earlier_findings(workspace)?;
        let mut handles = Handles::default();
        run.steps(workspace, self.pool, &mut findings, &mut handles, Step::Draw)?;
        let resources = Resources { scratch: workspace.scratch(), ..self.resources() };
        let looks = match run.has_sources(&findings) {
            true => {
                let files = workspace.files();
                let materials = FileState::find(&files, MATERIALS)?;
                let looks = FileState::find(&files, LOOK_MATERIALS)?;
                Palette::new(workspace.scratch(), materials).with_looks(looks).looks()?
            }
            false => LookMap::default(),
        };
        self.recording.begin(Stage::Contour, findings.contour.triangles);
        sink.begin_part(number, name).map_err(RepairError::Output)?;
        let mut part = PartSink::new(&mut **sink, looks, *there);
        run.write_into(workspace, &mut findings, (&mut handles, None), &mut part, &resources)?;
        *there = part.after;
        self.recording.end(Stage::Contour);
        Ok(findings)
    }
}
