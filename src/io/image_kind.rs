//! How images are encoded, and which formats can show them.

use crate::io::Format;

/// How an image is encoded, by its first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ImageKind {
    Png,
    Jpeg,
    WebP,
    Ktx2,
    Avif,
    Other,
}

impl ImageKind {
    pub(crate) const ALL: [Self; 6] =
        [Self::Png, Self::Jpeg, Self::WebP, Self::Ktx2, Self::Avif, Self::Other];

    pub(crate) fn of(head: &[u8]) -> Self {
        let is = |at: usize, mark: &[u8]| head.get(at..).is_some_and(|h| h.starts_with(mark));
        match () {
            () if is(0, b"\x89PNG") => Self::Png,
            () if is(0, b"\xff\xd8\xff") => Self::Jpeg,
            () if is(0, b"RIFF") && is(8, b"WEBP") => Self::WebP,
            () if is(0, b"\xabKTX 20\xbb") => Self::Ktx2,
            () if is(4, b"ftypavi") => Self::Avif,
            () => Self::Other,
        }
    }

    pub(crate) fn media_type(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
            Self::WebP => "image/webp",
            Self::Ktx2 => "image/ktx2",
            Self::Avif => "image/avif",
            Self::Other => "application/octet-stream",
        }
    }

    /// How names of files end.
    pub(crate) fn ending(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpg",
            Self::WebP => "webp",
            Self::Ktx2 => "ktx2",
            Self::Avif => "avif",
            Self::Other => "image",
        }
    }

    /// Whether an output of this format can show it.
    pub(crate) fn is_held_by(self, format: Format) -> bool {
        match format {
            Format::ThreeMf => matches!(self, Self::Png | Self::Jpeg),
            Format::Glb => self != Self::Other,
            _ => true,
        }
    }
}
