//! The work folder: locked, keyed, and everything of a run in it.
//!
//! `OUT.brickmend/` beside the output, or under the work folder that the user names. It holds the
//! scratch files, the manifest that is replaced after every stage, and the output while it is
//! written. Removed on success and refusal, kept on interruption.

use std::ffi::OsString;
use std::fs::File;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::monitor::Stage;
use crate::repair::RepairError;
use crate::store::{Manifest, ManifestFile, Scratch, StoreError, save_manifest, sync_folder};

/// Ending of work folders.
const ENDING: &str = "brickmend";

/// A locked work folder.
pub struct Workspace {
    folder: PathBuf,
    output: PathBuf,
    part: PathBuf,
    scratch: Scratch,
    manifest: Manifest,
    /// Held until the end of the run.
    _lock: File,
}

impl Workspace {
    /// Creates and locks the work folder for `output`. What an earlier run left is discarded.
    ///
    /// # Errors
    /// [`RepairError::Locked`], or the folder cannot be made.
    pub fn open(
        output: &Path,
        work_dir: Option<&Path>,
        key: [u8; 32],
    ) -> Result<Self, RepairError> {
        let parent = parent_of(output);
        std::fs::metadata(parent).map_err(|e| StoreError::io("find the folder", parent, e))?;
        let mut name = output.file_name().map_or_else(|| OsString::from("out"), OsString::from);
        name.push(".");
        name.push(ENDING);
        let folder = work_dir.unwrap_or(parent).join(&name);
        std::fs::create_dir_all(&folder).map_err(|e| StoreError::io("create", &folder, e))?;
        let lock_path = folder.join("lock");
        let lock = File::create(&lock_path).map_err(|e| StoreError::io("create", &lock_path, e))?;
        if let Err(error) = lock.try_lock() {
            return Err(match error {
                std::fs::TryLockError::WouldBlock => RepairError::Locked { folder },
                std::fs::TryLockError::Error(e) => StoreError::io("lock", &lock_path, e).into(),
            });
        }
        sweep(&folder)?;
        let part = if same_device(&folder, parent)? {
            folder.join("output.part")
        } else {
            // Only a file in the output's own folder can be renamed into place.
            let mut hidden = OsString::from(".");
            hidden.push(&name);
            hidden.push(".part");
            parent.join(hidden)
        };
        let scratch = Scratch::new(&folder);
        let manifest = Manifest { key, ..Manifest::default() };
        Ok(Self { folder, output: output.to_path_buf(), part, scratch, manifest, _lock: lock })
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

    /// Commits a stage: what is on disk is what the next stage starts from.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn checkpoint(&mut self, stage: Stage, findings: String) -> Result<(), StoreError> {
        self.manifest.stages.push(stage.name().to_owned());
        self.manifest.files = self.list_files()?;
        self.manifest.findings = findings;
        save_manifest(&self.folder.join("manifest"), &self.manifest)
    }

    /// What lies in the folder besides lock and manifest, by name.
    fn list_files(&self) -> Result<Vec<ManifestFile>, StoreError> {
        let failed = |e| StoreError::io("list", &self.folder, e);
        let mut files = Vec::new();
        for entry in std::fs::read_dir(&self.folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let name = entry.file_name().to_string_lossy().into_owned();
            if name != "lock" && !name.starts_with("manifest") {
                let len_bytes = entry.metadata().map_err(failed)?.len();
                files.push(ManifestFile { name, len_bytes });
            }
        }
        files.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(files)
    }

    /// Puts the finished output in its place, and removes the folder.
    ///
    /// # Errors
    /// The output cannot be renamed.
    pub fn put_in_place(self) -> Result<(), StoreError> {
        let parent = parent_of(&self.output);
        std::fs::rename(&self.part, &self.output)
            .map_err(|e| StoreError::io("put in place", &self.output, e))?;
        sync_folder(parent)?;
        self.remove();
        Ok(())
    }

    /// Removes the folder and all in it.
    pub fn remove(self) {
        // A leftover folder is ugly, not wrong: the next run sweeps it.
        let _ = std::fs::remove_file(&self.part);
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

fn parent_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn same_device(a: &Path, b: &Path) -> Result<bool, StoreError> {
    let device = |path: &Path| {
        std::fs::metadata(path).map(|m| m.dev()).map_err(|e| StoreError::io("stat", path, e))
    };
    Ok(device(a)? == device(b)?)
}

/// Removes what an earlier run left, except the lock.
fn sweep(folder: &Path) -> Result<(), StoreError> {
    let entries = std::fs::read_dir(folder).map_err(|e| StoreError::io("list", folder, e))?;
    for entry in entries {
        let entry = entry.map_err(|e| StoreError::io("list", folder, e))?;
        if entry.file_name() != "lock" {
            let path = entry.path();
            std::fs::remove_file(&path).map_err(|e| StoreError::io("remove", &path, e))?;
        }
    }
    Ok(())
}
