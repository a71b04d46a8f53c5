//! Texts of any length in a spool of bytes, in order or by number.
//!
//! In:         texts. Out: of each its length (4 bytes, the lowest first) and its bytes.
//! Memory:     a block of the spool, and one text; by number 16 bytes a text, spilled beyond a share.
//! Fails:      as spools do; [`StoreError::Damaged`] where the spool ends within a text.

use crate::store::{FileState, Scratch, Spool, SpoolPeek, SpoolWriter, StoreError, Table};

/// Appends texts.
pub struct TextsWriter {
    spool: SpoolWriter<u8>,
}

impl TextsWriter {
    /// Starts the spool `name`, replacing an older one.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create(scratch: &Scratch, name: &str) -> Result<Self, StoreError> {
        Ok(Self { spool: SpoolWriter::create(scratch, name)? })
    }

    /// Appends a text.
    ///
    /// # Errors
    /// The disk is full.
    pub fn push(&mut self, text: &str) -> Result<(), StoreError> {
        let length = u32::try_from(text.len()).expect("texts are far shorter");
        let length = length.to_le_bytes();
        length.iter().chain(text.as_bytes()).try_for_each(|&byte| self.spool.push(byte))
    }

    /// Completes the spool.
    ///
    /// # Errors
    /// The disk is full.
    pub fn finish(self) -> Result<Spool<u8>, StoreError> {
        self.spool.finish()
    }
}

/// Reads texts in order.
pub struct Texts<'s> {
    spool: &'s Spool<u8>,
    bytes: SpoolPeek<'s, u8>,
}

impl<'s> Texts<'s> {
    /// From the first text of a spool on.
    #[must_use]
    pub fn new(spool: &'s Spool<u8>) -> Self {
        Self { spool, bytes: SpoolPeek::new(spool) }
    }

    /// The next text; `None` after the last.
    ///
    /// # Errors
    /// [`StoreError`].
    #[expect(clippy::should_implement_trait, reason = "it can fail")]
    pub fn next(&mut self) -> Result<Option<String>, StoreError> {
        let Some(first) = self.bytes.next()? else { return Ok(None) };
        let mut length = [first, 0, 0, 0];
        for byte in &mut length[1..] {
            *byte = self.byte()?;
        }
        let length = u32::from_le_bytes(length);
        let text = (0..length).map(|_| self.byte()).collect::<Result<Vec<u8>, _>>()?;
        Ok(Some(String::from_utf8_lossy(&text).into_owned()))
    }

    fn byte(&mut self) -> Result<u8, StoreError> {
        self.bytes.next()?.ok_or_else(|| {
            let FileState { name, len_bytes, .. } = self.spool.state();
            StoreError::damaged(name.as_ref(), *len_bytes, "the rest of a text", "the end")
        })
    }
}

/// Texts by their numbers in the spool.
pub struct NumberedTexts {
    spool: Spool<u8>,
    /// Where the bytes of each begin, and how many there are.
    places: Table<[u64; 2]>,
}

impl NumberedTexts {
    /// Opens the spool that `state` tells of, and looks where its texts are.
    ///
    /// # Errors
    /// It is missing or damaged.
    pub fn open(
        scratch: &Scratch,
        state: &FileState,
        share_bytes: u64,
    ) -> Result<Self, StoreError> {
        let spool = Spool::open(scratch, state)?;
        let mut places = Table::new(scratch, share_bytes);
        let mut bytes = SpoolPeek::new(&spool);
        let mut at = 0;
        while at < spool.len() {
            bytes.pass_to(at);
            let mut length = [0; LENGTH_BYTES as usize];
            for byte in &mut length {
                *byte = bytes.next()?.unwrap_or_default();
            }
            let length = u64::from(u32::from_le_bytes(length));
            places.push([at + LENGTH_BYTES, length])?;
            at += LENGTH_BYTES + length;
        }
        Ok(Self { spool, places })
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.places.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The text with this number.
    ///
    /// # Errors
    /// The spool is damaged.
    pub fn get(&mut self, number: u64) -> Result<String, StoreError> {
        let [first, length] = self.places.get(number)?;
        let mut text = Vec::new();
        self.spool.read(first, length as usize, &mut text)?;
        Ok(String::from_utf8_lossy(&text).into_owned())
    }
}

/// In front of each text.
const LENGTH_BYTES: u64 = 4;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_found_by_number() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let mut writer = TextsWriter::create(&scratch, "texts").expect("a spool");
        let text = |number: usize| "ab\u{e9}".repeat(number % 7 * number);
        (0..300).try_for_each(|number| writer.push(&text(number))).expect("pushed");
        let spool = writer.finish().expect("finished");
        let mut texts = NumberedTexts::open(&scratch, spool.state(), 64).expect("opened");
        for number in [299, 0, 7, 1, 150] {
            assert_eq!(texts.get(number as u64).expect("there"), text(number));
        }
    }
}
