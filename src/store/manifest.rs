//! The manifest of a work folder: what is finished, replaced in one go after every step.
//!
//! A manifest that is missing, cut short, changed or of another version is no manifest: the run
//! starts anew. It is not handed to the disk at once: after a power cut it may be an older one, or
//! none, and what it lists is checked by digest anyway. See docs/format.md.

use std::path::Path;

use rkyv::rancor::BoxedError;
use rkyv::{Archive, Deserialize, Serialize};

use crate::store::{FORMAT_VERSION, FileState, Progress, StoreError};

const MAGIC: [u8; 8] = *b"BRMDMANI";
const HEADER_BYTES: usize = 48;

/// What a work folder holds.
#[derive(Clone, Debug, Default, PartialEq, Archive, Serialize, Deserialize)]
pub struct Manifest {
    /// blake3 of input bytes, settings that change the result, version and format.
    pub key: [u8; 32],
    /// Names of the finished steps, in running order.
    pub steps: Vec<String>,
    /// Files that the finished steps left, and that are still needed.
    pub files: Vec<FileState>,
    /// How far the step after those has come, if it said so.
    pub progress: Option<Progress>,
    /// What the steps found out, as the caller's own text (JSON).
    pub findings: String,
    /// How often the run was gone on with.
    pub resumptions: u32,
}

/// Replaces the manifest at `path`: written beside it, then renamed.
///
/// # Errors
/// The folder cannot be written.
pub fn save_manifest(path: &Path, manifest: &Manifest) -> Result<(), StoreError> {
    let body = rkyv::to_bytes::<BoxedError>(manifest).expect("plain records serialise");
    let mut bytes = Vec::with_capacity(HEADER_BYTES + body.len());
    bytes.extend_from_slice(&MAGIC);
    bytes.extend_from_slice(&FORMAT_VERSION.to_le_bytes());
    bytes.extend_from_slice(&(body.len() as u32).to_le_bytes());
    bytes.extend_from_slice(blake3::hash(&body).as_bytes());
    bytes.extend_from_slice(&body);
    let beside = path.with_extension("new");
    std::fs::write(&beside, &bytes).map_err(|e| StoreError::io("write", &beside, e))?;
    std::fs::rename(&beside, path).map_err(|e| StoreError::io("replace", path, e))
}

/// The manifest at `path`, or `None` when there is none that can be trusted.
///
/// # Errors
/// The file exists and cannot be read.
pub fn load_manifest(path: &Path) -> Result<Option<Manifest>, StoreError> {
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(StoreError::io("read", path, e)),
    };
    let header = [&MAGIC[..], &FORMAT_VERSION.to_le_bytes()].concat();
    if bytes.len() < HEADER_BYTES || bytes[..12] != header[..] {
        return Ok(None);
    }
    let body = &bytes[HEADER_BYTES..];
    if blake3::hash(body).as_bytes()[..] != bytes[16..HEADER_BYTES] {
        return Ok(None);
    }
    let mut aligned = rkyv::util::AlignedVec::<16>::with_capacity(body.len());
    aligned.extend_from_slice(body);
    Ok(rkyv::from_bytes::<Manifest, BoxedError>(&aligned).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manifest_reads_back_and_a_changed_one_does_not() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("manifest");
        assert_eq!(load_manifest(&path).expect("no file is no error"), None);
        let manifest = Manifest {
            key: [7; 32],
            steps: vec!["read".to_owned(), "bin".to_owned()],
            files: vec![FileState {
                name: "bins".to_owned(),
                len_bytes: 96,
                ..FileState::default()
            }],
            progress: Some(Progress { items: 7, ..Progress::default() }),
            findings: "{}".to_owned(),
            resumptions: 1,
        };
        save_manifest(&path, &manifest).expect("save works");
        assert_eq!(load_manifest(&path).expect("load works"), Some(manifest));
        let whole = std::fs::read(&path).expect("the file is there");
        for at in 0..whole.len() {
            let mut changed = whole.clone();
            changed[at] ^= 1;
            std::fs::write(&path, &changed).expect("write works");
            let found = load_manifest(&path).expect("a lie is no error");
            // The length field in the header is informative only; all else is covered.
            assert!(found.is_none() || (12..16).contains(&at), "byte {at} was not missed");
        }
    }
}
