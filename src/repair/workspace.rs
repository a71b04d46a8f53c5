//! The work folder: locked, keyed, and everything of a run in it.
//!
//! `OUT.brickmend/` beside the output, or under the work folder that the user names. It holds the
//! scratch files, the manifest that says what is finished, and the output while it is written.
//! Removed on success and refusal, kept on interruption and when the disk fails.
//!
//! Invariant:  what the manifest lists is there and checked by digest when it is touched; what it
//!             does not list is swept. Files that are not ours are never touched.

use std::ffi::OsString;
use std::fs::File;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::io::{ASIDE, IoError, check_output};
use crate::mesh::SinkFile;
use crate::monitor::Monitor;
use crate::repair::RepairError;
use crate::repair::lock::{LOCK, lock_folder};
use crate::repair::settings::Limits;
use crate::repair::standing::{
    MANIFEST, PASSING, all_names, finished_levels, go_back, is_listed, next_step, written,
};
use crate::repair::step::{OUTPUT_PART, Step};
use crate::store::{
    Backing, Checkpoints, FileState, Manifest, Progress, Scratch, StoreError, directory_name,
    load_manifest, save_manifest, sync_folder,
};

/// What names of the folders of parts begin with.
const PART_FOLDER: &str = "part-";
/// Ending of work folders.
const ENDING: &str = "brickmend";

/// A locked work folder.
pub struct Workspace {
    folder: PathBuf,
    /// The files of the levels of detail.
    outputs: Vec<PathBuf>,
    part: PathBuf,
    scratch: Scratch,
    interval_bytes: u64,
    /// Brick files in memory do not outlive the run.
    is_kept: bool,
    manifest: Mutex<Manifest>,
    /// Held until the end of the run.
    _lock: File,
}

impl Workspace {
    /// Creates and locks the work folder named after `output`, for `outputs` in the same folder. What an earlier run of the same `key` has
    /// finished is kept; all else is discarded.
    ///
    /// # Errors
    /// [`RepairError::Locked`], or the folder cannot be made.
    pub fn open(
        input: &Path,
        output: &Path,
        outputs: Vec<PathBuf>,
        limits: &Limits,
        key: [u8; 32],
    ) -> Result<Self, RepairError> {
        let parent = parent_of(output);
        std::fs::metadata(parent).map_err(|e| StoreError::io("find the folder", parent, e))?;
        let mut name = output.file_name().map_or_else(|| OsString::from("out"), OsString::from);
        name.push(".");
        name.push(ENDING);
        let folder = limits.work_dir.as_deref().unwrap_or(parent).join(&name);
        keep_input(input, &folder)?;
        let lock = lock_folder(&folder)?;
        let part = if same_device(&folder, parent)? {
            folder.join(OUTPUT_PART)
        } else {
            // Only a file in the output's own folder can be renamed into place.
            let mut hidden = OsString::from(".");
            hidden.push(&name);
            hidden.push(".part");
            parent.join(hidden)
        };
        if is_same_file(input, &part) {
            return Err(RepairError::InputInWorkFolder { path: input.to_path_buf(), folder });
        }
        let scratch = Scratch::limited(&folder, limits.max_disk_bytes.unwrap_or(u64::MAX));
        Self::begin((folder, lock), outputs, part, scratch, (limits, key))
    }

    /// The work folder of a part of the model, inside of this one. Its disk counts with that of this
    /// one.
    ///
    /// # Errors
    /// As [`Workspace::open`].
    pub fn open_part(
        &self,
        number: u32,
        limits: &Limits,
        key: [u8; 32],
    ) -> Result<Self, RepairError> {
        let folder = self.folder.join(part_folder(number));
        let lock = lock_folder(&folder)?;
        let (part, scratch) = (folder.join(OUTPUT_PART), self.scratch.beside(&folder));
        Self::begin((folder, lock), self.outputs.clone(), part, scratch, (limits, key))
    }

    fn begin(
        (folder, lock): (PathBuf, File),
        outputs: Vec<PathBuf>,
        part: PathBuf,
        scratch: Scratch,
        (limits, key): (&Limits, [u8; 32]),
    ) -> Result<Self, RepairError> {
        let workspace = Self {
            folder,
            outputs,
            part,
            scratch,
            interval_bytes: limits.checkpoint_bytes,
            is_kept: limits.backing == Backing::Mapped,
            manifest: Mutex::new(Manifest { key, ..Manifest::default() }),
            _lock: lock,
        };
        workspace.take_over(limits.fresh)?;
        Ok(workspace)
    }

    /// The scratch of a part.
    #[must_use]
    pub fn scratch_of(&self, number: u32) -> Scratch {
        self.scratch.beside(&self.folder.join(part_folder(number)))
    }

    /// The part whose work folder has the file at `path`.
    #[must_use]
    pub fn part_with(&self, path: &Path) -> Option<u32> {
        let folder = path.parent().filter(|folder| folder.parent() == Some(&self.folder))?;
        part_number(folder)
    }

    /// The folders of parts in this one, with their numbers.
    fn part_folders(&self) -> Result<Vec<(u32, PathBuf)>, StoreError> {
        let failed = |e| StoreError::io("list", &self.folder, e);
        let mut found = Vec::new();
        for entry in std::fs::read_dir(&self.folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            if let Some(number) = part_number(&path).filter(|_| path.is_dir()) {
                found.push((number, path));
            }
        }
        Ok(found)
    }

    /// Removes what is ours in the folders of parts, from a number on.
    fn remove_parts(&self, first: u32) -> Result<(), StoreError> {
        for (number, folder) in self.part_folders()? {
            if number >= first {
                for name in all_names() {
                    self.scratch.remove_at(&folder.join(name))?;
                    self.scratch.remove_at(&folder.join(directory_name(name)))?;
                }
                let _ = std::fs::remove_file(folder.join(LOCK));
                let _ = std::fs::remove_dir(&folder);
            }
        }
        Ok(())
    }

    /// Forgets parts of an earlier run beyond those that there are.
    ///
    /// # Errors
    /// The folder cannot be read or written.
    pub fn keep_parts(&self, count: u32) -> Result<(), StoreError> {
        self.remove_parts(count)
    }

    /// Takes over what an earlier run left, as far as it is of use.
    fn take_over(&self, fresh: bool) -> Result<(), StoreError> {
        let mut manifest = self.manifest();
        let usable = |left: &Manifest| !fresh && self.is_kept && left.key == manifest.key;
        if let Some(mut left) = load_manifest(&self.folder.join(MANIFEST))?.filter(usable) {
            left.resumptions += 1;
            *manifest = left;
            if !self.is_in_place_by(&manifest) {
                self.forget_lost_files(&mut manifest);
            }
        }
        self.sweep_nameless()?;
        let listed: Vec<&str> = all_names().filter(|name| is_listed(&manifest, name)).collect();
        for name in all_names().filter(|name| !listed.contains(name) && *name != MANIFEST) {
            self.remove_file(name)?;
        }
        for name in listed {
            self.scratch.adopt(&self.path_of(name));
            self.scratch.adopt(&self.folder.join(directory_name(name)));
        }
        let in_place = finished_levels(&manifest) + usize::from(self.is_in_place_by(&manifest));
        self.outputs.iter().take(in_place).for_each(|output| self.scratch.adopt(output));
        Ok(())
    }

    /// Goes back to a step whose inputs are all there.
    fn forget_lost_files(&self, manifest: &mut Manifest) {
        manifest.files.retain(|file| {
            std::fs::metadata(self.path_of(&file.name)).is_ok_and(|m| m.len() >= file.len_bytes)
        });
        let next = next_step(manifest).unwrap_or(Step::Prove);
        let step = next.with_inputs(|name| manifest.files.iter().any(|file| file.name == name));
        if step < next || next_step(manifest).is_none() {
            go_back(manifest, step);
        }
    }

    /// Files that a run lost its life over before they had lost their names.
    fn sweep_nameless(&self) -> Result<(), StoreError> {
        let failed = |e| StoreError::io("list", &self.folder, e);
        for entry in std::fs::read_dir(&self.folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            if is_nameless(&path) {
                self.scratch.remove_at(&path)?;
            }
        }
        Ok(())
    }

    fn manifest(&self) -> MutexGuard<'_, Manifest> {
        self.manifest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The scratch of the run.
    #[must_use]
    pub fn scratch(&self) -> &Scratch {
        &self.scratch
    }

    /// Where the output is written before it is put in place.
    #[must_use]
    pub fn part(&self) -> &Path {
        &self.part
    }

    fn path_of(&self, name: &str) -> PathBuf {
        if name == OUTPUT_PART { self.part.clone() } else { self.folder.join(name) }
    }

    fn remove_file(&self, name: &str) -> Result<(), StoreError> {
        self.scratch.remove_at(&self.path_of(name))?;
        self.scratch.remove(&directory_name(name))
    }

    /// The step to be done next; `None` when all are finished.
    #[must_use]
    pub fn next_step(&self) -> Option<Step> {
        next_step(&self.manifest())
    }

    /// How often the run was gone on with.
    #[must_use]
    pub fn resumptions(&self) -> u32 {
        self.manifest().resumptions
    }

    /// What the finished steps found out.
    #[must_use]
    pub fn findings(&self) -> String {
        self.manifest().findings.clone()
    }

    /// The files that finished steps left.
    #[must_use]
    pub fn files(&self) -> Vec<FileState> {
        self.manifest().files.clone()
    }

    /// Commits a step: what is on disk is what the following one starts from. Files that are no
    /// longer of use are removed, unless a step that comes `again` for another level reads them.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn finish_step(
        &self,
        step: Step,
        again: Option<Step>,
        files: Vec<FileState>,
        findings: String,
    ) -> Result<(), StoreError> {
        let mut manifest = self.manifest();
        manifest.steps.push(step.name().to_owned());
        // A step may make a file of an earlier one anew.
        manifest.files.retain(|known| files.iter().all(|file| file.name != known.name));
        manifest.files.extend(files);
        let (kept, spent) =
            std::mem::take(&mut manifest.files).into_iter().partition::<Vec<_>, _>(|file| {
                let name = file.name.as_str();
                step.still_needs(name) || again.is_some_and(|step| step.reads().contains(&name))
            });
        manifest.files = kept;
        manifest.progress = None;
        manifest.findings = findings;
        if self.is_kept {
            save_manifest(&self.folder.join(MANIFEST), &manifest)?;
        }
        drop(manifest);
        let spent = spent.iter().map(|file| file.name.as_str());
        spent.chain(PASSING).try_for_each(|name| self.remove_file(name))
    }

    /// Where the running step begins and notes its progress.
    #[must_use]
    pub fn checkpoints<'w>(&'w self, step: Step, monitor: &'w dyn Monitor) -> StepCheckpoints<'w> {
        StepCheckpoints { workspace: self, step, monitor }
    }

    /// Goes back to the step from which the file at `path` can be made again; `None` when it is
    /// not one of the work folder.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn go_back_for(&self, path: &Path) -> Result<Option<Step>, StoreError> {
        let name = match path.file_name().and_then(|name| name.to_str()) {
            _ if path == self.part => OUTPUT_PART,
            Some(name) if ASIDE.contains(&name) => OUTPUT_PART,
            Some(name) => name.strip_suffix(".directory").unwrap_or(name),
            None => return Ok(None),
        };
        let Some(writer) = Step::writer_of(name) else { return Ok(None) };
        let mut manifest = self.manifest();
        let is_there = |file: &str| manifest.files.iter().any(|known| known.name == file);
        let step = writer.with_inputs(is_there);
        go_back(&mut manifest, step);
        if self.is_kept {
            save_manifest(&self.folder.join(MANIFEST), &manifest)?;
        }
        Ok(Some(step))
    }

    /// Goes back to `step` for another level of detail, or to one before it whose inputs are there.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn go_back_to(&self, step: Step, findings: String) -> Result<(), StoreError> {
        let mut manifest = self.manifest();
        manifest.findings = findings;
        if !self.is_kept {
            go_back(&mut manifest, step);
            return Ok(());
        }
        let step = step.with_inputs(|name| manifest.files.iter().any(|file| file.name == name));
        go_back(&mut manifest, step);
        save_manifest(&self.folder.join(MANIFEST), &manifest)
    }

    /// Forgets all that was done.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn start_again(&self) -> Result<(), StoreError> {
        let mut manifest = self.manifest();
        go_back(&mut manifest, Step::Read);
        manifest.findings.clear();
        save_manifest(&self.folder.join(MANIFEST), &manifest)
    }

    /// The output as the writing step left it.
    #[must_use]
    pub fn written(&self) -> Option<SinkFile> {
        written(&self.manifest())
    }

    /// Whether an earlier run put the proved output in its place and could not tidy up any more.
    #[must_use]
    pub fn is_in_place(&self) -> bool {
        self.is_in_place_by(&self.manifest())
    }

    fn is_in_place_by(&self, manifest: &Manifest) -> bool {
        next_step(manifest).is_none()
            && !self.part.exists()
            && written(manifest).is_some_and(|file| {
                check_output(self.output(manifest), &file, &self.scratch).is_ok()
            })
    }

    /// Where the file of the level under way goes.
    #[must_use]
    pub fn output_path(&self) -> PathBuf {
        self.output(&self.manifest()).to_path_buf()
    }

    /// Where the file of the level under way goes.
    fn output(&self, manifest: &Manifest) -> &Path {
        &self.outputs[finished_levels(manifest).min(self.outputs.len() - 1)]
    }

    /// Puts a file beside the output, before the output itself: `write` makes it under another name.
    ///
    /// # Errors
    /// As `write`, or the file cannot be renamed.
    pub fn put_beside(
        &self,
        path: &Path,
        write: impl FnOnce(&Path) -> Result<(), IoError>,
    ) -> Result<(), RepairError> {
        let mut hidden = OsString::from(".");
        hidden.push(path.file_name().unwrap_or_default());
        hidden.push(".part");
        let part = path.with_file_name(hidden);
        write(&part).map_err(RepairError::Output)?;
        let renamed = std::fs::rename(&part, path);
        Ok(renamed.map_err(|e| StoreError::io("put in place", path, e))?)
    }

    /// Puts the finished output in its place.
    ///
    /// # Errors
    /// The output cannot be renamed.
    pub fn put_in_place(&self) -> Result<(), StoreError> {
        let manifest = self.manifest();
        let output = self.output(&manifest);
        std::fs::rename(&self.part, output)
            .map_err(|e| StoreError::io("put in place", output, e))?;
        sync_folder(parent_of(output))
    }

    /// Removes the folder and all that is ours in it.
    pub fn remove(self) {
        // A leftover folder is ugly, not wrong: the next run sweeps it.
        let _ = self.remove_parts(0);
        for name in all_names() {
            let _ = self.remove_file(name);
        }
        let _ = std::fs::remove_file(self.folder.join(LOCK));
        let _ = std::fs::remove_dir(&self.folder);
    }
}

/// Checkpoints of the running step in the manifest.
pub struct StepCheckpoints<'w> {
    workspace: &'w Workspace,
    step: Step,
    monitor: &'w dyn Monitor,
}

impl Checkpoints for StepCheckpoints<'_> {
    fn start(&self) -> Option<Progress> {
        self.workspace.manifest().progress.clone()
    }

    fn interval_bytes(&self) -> u64 {
        self.workspace.interval_bytes
    }

    fn save(&self, progress: Progress) -> Result<(), StoreError> {
        if !self.workspace.is_kept {
            return Ok(());
        }
        let items = progress.items;
        let mut manifest = self.workspace.manifest();
        manifest.progress = Some(progress);
        save_manifest(&self.workspace.folder.join(MANIFEST), &manifest)?;
        self.monitor.checkpoint(self.step.name(), items);
        Ok(())
    }
}

/// Whether the name is one that a scratch file has for a moment: purpose, number, `tmp`.
fn is_nameless(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let mut words = name.rsplit('.');
    words.next() == Some("tmp") && words.next().is_some_and(|number| number.parse::<u64>().is_ok())
}

fn part_folder(number: u32) -> String {
    format!("{PART_FOLDER}{number}")
}

/// The number of the part that a folder has the name of.
fn part_number(folder: &Path) -> Option<u32> {
    folder.file_name()?.to_str()?.strip_prefix(PART_FOLDER)?.parse().ok()
}

fn parent_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Refuses an input in the work folder, under any name: what lies there is swept.
fn keep_input(input: &Path, folder: &Path) -> Result<(), RepairError> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
    for entry in entries {
        let entry = entry.map_err(|e| StoreError::io("list", folder, e))?;
        if is_same_file(input, &entry.path()) {
            let (path, folder) = (input.to_path_buf(), folder.to_path_buf());
            return Err(RepairError::InputInWorkFolder { path, folder });
        }
    }
    Ok(())
}

fn is_same_file(a: &Path, b: &Path) -> bool {
    let identity = |path: &Path| std::fs::metadata(path).map(|m| (m.dev(), m.ino()));
    matches!((identity(a), identity(b)), (Ok(a), Ok(b)) if a == b)
}

fn same_device(a: &Path, b: &Path) -> Result<bool, StoreError> {
    let device = |path: &Path| {
        std::fs::metadata(path).map(|m| m.dev()).map_err(|e| StoreError::io("stat", path, e))
    };
    Ok(device(a)? == device(b)?)
}
