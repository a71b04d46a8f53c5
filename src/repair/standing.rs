//! Where a run stands, by its manifest: which steps are finished, and which files are of use.

use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::bridge;
use crate::contour::LOOKS;
use crate::hidden;
use crate::ingest::SCATTERED;
use crate::io::{ASIDE, NODES, SEEN_NODES};
use crate::mesh::SinkFile;
use crate::repair::step::{OUTPUT_PART, Step};
use crate::sign;
use crate::store::Manifest;

/// The manifest.
pub const MANIFEST: &str = "manifest";
/// Files that live within one step.
pub const PASSING: [&str; 24] = [
    "facts.spool",
    bridge::PASSING[0],
    bridge::PASSING[1],
    bridge::THICKENED[0],
    bridge::THICKENED[1],
    hidden::SEEN[0],
    hidden::SEEN[1],
    hidden::SEEN[2],
    "faces.spool",
    sign::PASSING[0],
    sign::PASSING[1],
    sign::PASSING[2],
    ASIDE[0],
    ASIDE[1],
    ASIDE[2],
    LOOKS[0],
    LOOKS[1],
    SCATTERED,
    NODES[0],
    NODES[1],
    SEEN_NODES[0],
    SEEN_NODES[1],
    FOUND,
    CONCLUDED,
];
/// What was found out about the parts so far.
pub const FOUND: &str = "found.spool";
/// What came of the parts so far.
pub const CONCLUDED: &str = "concluded.spool";
/// The manifest on its way to its name.
pub const MANIFEST_NEW: &str = "manifest.new";

/// The first step that is not finished.
pub fn next_step(manifest: &Manifest) -> Option<Step> {
    Step::ALL.into_iter().find(|step| !manifest.steps.iter().any(|name| name == step.name()))
}

/// The output as the writing step left it.
pub fn written(manifest: &Manifest) -> Option<SinkFile> {
    let file = manifest.files.iter().find(|file| file.name == OUTPUT_PART)?;
    Some(SinkFile { bytes: file.len_bytes, digest: file.root })
}

/// How many levels of detail were finished before the one under way.
pub fn finished_levels(manifest: &Manifest) -> usize {
    #[derive(Deserialize)]
    struct Finished {
        finished: Vec<IgnoredAny>,
    }
    serde_json::from_str(&manifest.findings).map_or(0, |found: Finished| found.finished.len())
}

/// Forgets `step` and all that came after it.
pub fn go_back(manifest: &mut Manifest, step: Step) {
    let is_kept = |name: &str| Step::ALL.into_iter().any(|s| s < step && s.name() == name);
    manifest.steps.retain(|name| is_kept(name));
    manifest.files.retain(|file| Step::writer_of(&file.name).is_some_and(|writer| writer < step));
    manifest.progress = None;
}

/// Every name that a file of ours may have, besides directories and the lock.
pub fn all_names() -> impl Iterator<Item = &'static str> {
    let files = Step::ALL.into_iter().flat_map(Step::writes).copied();
    files.chain(PASSING).chain([MANIFEST, MANIFEST_NEW])
}

/// Whether the manifest says of a file that it is there.
pub fn is_listed(manifest: &Manifest, name: &str) -> bool {
    let in_progress = manifest.progress.iter().flat_map(|progress| &progress.files);
    if manifest.files.iter().chain(in_progress).any(|file| file.name == name) {
        return true;
    }
    // The sink's files are told of by its own state.
    let is_writing = manifest.progress.is_some() && next_step(manifest) == Some(Step::Write);
    is_writing && (name == OUTPUT_PART || ASIDE.contains(&name))
}
