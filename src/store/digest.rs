//! The hashes by which files of ours are known again: half of blake3 for what stands for a whole file,
//! XXH3 for its parts, which are many, and are guarded against accidents only.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use twox_hash::XxHash3_128;

use crate::store::StoreError;

/// What is read at a time.
const BLOCK_BYTES: usize = 128 << 10;
/// Size of a digest in bytes.
pub const DIGEST_BYTES: usize = 16;

/// The first half of a blake3 hash; of a part of a file its XXH3.
pub type Digest = [u8; DIGEST_BYTES];

/// The digest of `bytes`.
pub(crate) fn digest(bytes: &[u8]) -> Digest {
    first_half(&blake3::hash(bytes))
}

/// The digest of a part of a file: its XXH3 of 128 bits, lowest byte first.
pub(crate) fn part_digest(bytes: &[u8]) -> Digest {
    XxHash3_128::oneshot(bytes).to_le_bytes()
}

/// The digest of many pieces, in order. It may be asked for at any time.
#[derive(Clone, Debug, Default)]
pub struct Digester {
    hasher: blake3::Hasher,
}

impl Digester {
    /// Goes on with `bytes`.
    pub fn update(&mut self, bytes: &[u8]) {
        self.hasher.update(bytes);
    }

    /// The digest of all pieces so far.
    #[must_use]
    pub fn digest(&self) -> Digest {
        first_half(&self.hasher.finalize())
    }
}

fn first_half(hash: &blake3::Hash) -> Digest {
    let mut half = [0; DIGEST_BYTES];
    half.copy_from_slice(&hash.as_bytes()[..DIGEST_BYTES]);
    half
}

/// The digest of the content of a file.
///
/// # Errors
/// It cannot be read, or `cancelled` says to stop ([`StoreError::Cancelled`]).
pub fn digest_file(path: &Path, cancelled: &dyn Fn() -> bool) -> Result<Digest, StoreError> {
    let failed = |doing| move |error| StoreError::io(doing, path, error);
    let mut file = File::open(path).map_err(failed("open"))?;
    let mut digester = Digester::default();
    let mut block = vec![0; BLOCK_BYTES];
    loop {
        if cancelled() {
            return Err(StoreError::Cancelled);
        }
        match file.read(&mut block) {
            Ok(0) => return Ok(digester.digest()),
            Ok(count) => digester.update(&block[..count]),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(failed("read")(error)),
        }
    }
}
