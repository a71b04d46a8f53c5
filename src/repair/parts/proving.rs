//! Reads the file of all parts back: each is proved, and measured against what it was made of.
//!
//! Memory: that of a proof and of a comparison, one after the other.

use crate::io::{IoError, ReadOptions, Source, check_output};
use crate::mesh::SinkFile;
use crate::monitor::{Monitor, Stage};
use crate::repair::RepairError;
use crate::repair::finish::conclude;
use crate::repair::outcome::Verdict;
use crate::repair::parts::outcome::PartsOutcome;
use crate::repair::parts::slices::Slices;
use crate::repair::parts::{Assembly, Done, Model};
use crate::repair::run::Feed;
use crate::repair::stages::Findings;
use crate::repair::standing::{CONCLUDED, FOUND};
use crate::store::{FileState, Resources, Spool, StoreError, Texts, TextsWriter};
use crate::verify::ProvedSource;

impl Assembly<'_> {
    /// Reads the file back, and proves each of its parts; the spool of what came of them.
    pub(super) fn prove(
        &self,
        model: &mut Model,
        (found, file): (&Spool<u8>, &SinkFile),
        rebuilt: &[String],
        outcome: &mut PartsOutcome,
        resources: &Resources,
    ) -> Result<FileState, RepairError> {
        let (part, scratch) = (self.workspace.part().to_path_buf(), resources.scratch.clone());
        check_output(&part, file, &scratch)?;
        let share_bytes = resources.share_bytes / 4;
        let options = match self.format.has_scenes() {
            true => ReadOptions::by_itself(share_bytes),
            false => ReadOptions::in_scene(share_bytes),
        };
        let open_file =
            || -> Result<Source, IoError> { crate::io::open(&part, &scratch, &options) };
        // Each goes through the file once.
        let (mut proved, mut measured) = (Slices::new(open_file), Slices::new(open_file));
        let mut concluded = TextsWriter::create(resources.scratch, CONCLUDED)?;
        let mut texts = Texts::new(found);
        while let Some(text) = texts.next()? {
            let (done, mut findings): (Done, Findings) =
                serde_json::from_str(&text).map_err(|error| {
                    StoreError::damaged(FOUND.as_ref(), 0, "findings", error.to_string())
                })?;
            let Done { report, before, after, soup, resumptions } = done;
            let (of, number, name) = (&model.scattered, report.number, report.name.clone());
            let run = self.run_of(Feed::Part { of, number, name }, 0.0);
            let triangles = after.triangles - before.triangles;
            self.recording.begin(Stage::Verify, 2 * triangles);
            let mut open =
                || proved.part(before, after).map(|part| Box::new(part) as ProvedSource<'_, _>);
            run.prove_source(&mut open, self.workspace, &mut findings, resources)?;
            self.recording.end(Stage::Verify);
            if self.settings.deviation {
                self.recording.begin(Stage::Deviate, triangles);
                let mut file = measured.part(before, after).map_err(RepairError::ReadBack)?;
                let scratch = self.workspace.scratch_of(report.number);
                let inner = Resources { scratch: &scratch, ..*resources };
                findings.deviation = run.deviation((&soup, &mut file), &findings, &inner)?;
                self.recording.end(Stage::Deviate);
            }
            findings.written.vertices = after.vertices - before.vertices;
            findings.written.triangles = triangles;
            findings.written.file = *file;
            run.count_scratch(self.workspace);
            let mut concluded_part = conclude(&run, self.workspace, &findings, rebuilt);
            concluded_part.resume.resumptions = resumptions;
            outcome.add(concluded_part.verdict, report.places, triangles);
            concluded_part.part = Some(report);
            concluded
                .push(&serde_json::to_string(&concluded_part).expect("plain records serialise"))?;
        }
        if outcome.empty_parts + outcome.hidden_places > 0 {
            outcome.verdict = outcome.verdict.max(Verdict::Review);
        }
        Ok(concluded.finish()?.state().clone())
    }
}
