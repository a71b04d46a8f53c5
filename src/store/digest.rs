//! The hash by which a file of ours is known again: half of blake3.

/// Size of a digest in bytes.
pub const DIGEST_BYTES: usize = 16;

/// The first half of a blake3 hash.
pub type Digest = [u8; DIGEST_BYTES];

/// The digest of `bytes`.
pub(crate) fn digest(bytes: &[u8]) -> Digest {
    first_half(&blake3::hash(bytes))
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
