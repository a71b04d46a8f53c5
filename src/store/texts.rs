//! Texts of any length in a spool of bytes, in order.
//!
//! In:         texts. Out: of each its length (4 bytes, the lowest first) and its bytes.
//! Memory:     a block of the spool, and one text.
//! Fails:      as spools do; [`StoreError::Damaged`] where the spool ends within a text.

use crate::store::{FileState, Scratch, Spool, SpoolPeek, SpoolWriter, StoreError};

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
