//! The lock of a work folder: the system's own, which ends with the process.

use std::fs::{File, TryLockError};
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use crate::repair::RepairError;
use crate::store::StoreError;

/// Name of the file that is locked.
pub const LOCK: &str = "lock";
/// A folder that vanishes this often between two calls is not ours to work in.
const ATTEMPTS: usize = 100;

/// Makes the folder if need be and locks it.
///
/// # Errors
/// [`RepairError::Locked`], or the folder cannot be made.
pub fn lock_folder(folder: &Path) -> Result<File, RepairError> {
    let path = folder.join(LOCK);
    let mut failure = None;
    for _ in 0..ATTEMPTS {
        std::fs::create_dir_all(folder).map_err(|e| StoreError::io("create", folder, e))?;
        let file = match File::options().write(true).create(true).truncate(false).open(&path) {
            Ok(file) => file,
            // A run that just ended took the folder with it.
            Err(e) if e.kind() == ErrorKind::NotFound => {
                failure = Some(e);
                continue;
            }
            Err(e) => return Err(StoreError::io("create", &path, e).into()),
        };
        match file.try_lock() {
            Ok(()) if is_still_there(&file, &path) => return Ok(file),
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(RepairError::Locked { folder: folder.to_path_buf() });
            }
            Err(TryLockError::Error(e)) => return Err(StoreError::io("lock", &path, e).into()),
        }
    }
    let failure = failure.unwrap_or_else(|| ErrorKind::NotFound.into());
    Err(StoreError::io("lock", &path, failure).into())
}

/// Whether the file that was locked is the one under the name: its last holder may have removed it
/// in between, and a third run have made a new one.
fn is_still_there(file: &File, path: &Path) -> bool {
    let identity = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
    match (file.metadata(), std::fs::metadata(path)) {
        (Ok(held), Ok(named)) => identity(held) == identity(named),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_holder_at_a_time_and_a_removed_folder_is_made_again() {
        let outer = tempfile::tempdir().expect("a temporary folder");
        let folder = outer.path().join("work");
        let first = lock_folder(&folder).expect("nobody holds it");
        assert!(matches!(lock_folder(&folder), Err(RepairError::Locked { .. })));
        std::fs::remove_dir_all(&folder).expect("removable");
        let second = lock_folder(&folder).expect("a new folder");
        assert!(!is_still_there(&first, &folder.join(LOCK)));
        assert!(is_still_there(&second, &folder.join(LOCK)));
    }
}
