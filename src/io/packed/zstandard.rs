//! Zstandard: any number of frames, one after the other. The only home of zstd.

use zstd::stream::read::Decoder;

use crate::io::packed::{PackedBytes, Stream};

/// Windows take at most 2 to this power: 8 MiB, what RFC 8878 asks of every decoder.
const LARGEST_WINDOW_LOG: u32 = 23;

impl Stream for Decoder<'static, PackedBytes> {
    fn packed(&mut self) -> &mut PackedBytes {
        self.get_mut()
    }
}

/// The content of all frames.
pub(super) fn decode(packed: PackedBytes) -> std::io::Result<Box<dyn Stream>> {
    let mut decoder = Decoder::with_buffer(packed)?;
    decoder.window_log_max(LARGEST_WINDOW_LOG)?;
    Ok(Box::new(decoder))
}
