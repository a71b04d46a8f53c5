//! Gzip: any number of members, one after the other. The only home of flate2.

use flate2::bufread::MultiGzDecoder;

use crate::io::packed::{PackedBytes, Stream};

impl Stream for MultiGzDecoder<PackedBytes> {
    fn packed(&mut self) -> &mut PackedBytes {
        self.get_mut()
    }
}

/// The content of all members.
pub(super) fn decode(packed: PackedBytes) -> Box<dyn Stream> {
    Box::new(MultiGzDecoder::new(packed))
}
