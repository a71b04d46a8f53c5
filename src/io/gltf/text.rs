//! The JSON of a file as its parser reads it: byte by byte, never held whole.
//!
//! Base64 in `data:` addresses would be: it is decoded into a scratch file on the way, and the
//! parser sees [`DATA_MARK`] and the number of the segment instead. Of an image that is no base64
//! nothing is kept. What is left of a text is at most [`MOST_TEXT_BYTES`] long. Memory: one block.

use std::io::{ErrorKind, Read};
use std::ops::Range;

use crate::io::error::{IoError, Place};
use crate::io::gltf::base64::Base64;
use crate::io::input::Input;
use crate::store::{Scratch, ScratchFile, Table};

/// In front of the number of a decoded segment.
pub(crate) const DATA_MARK: &str = "data:;base64,";
/// Longer texts are refused: what the parser holds of them is one at a time.
const MOST_TEXT_BYTES: u64 = 8 << 20;
/// Longer numbers and words are refused.
const MOST_WORD_BYTES: u64 = 1024;
/// How far behind `data:` the word `base64` is sought.
const MOST_TYPE_BYTES: usize = 128;
const BLOCK_BYTES: usize = 64 << 10;

/// What was decoded, as segments of one file.
pub(crate) struct Segments {
    scratch: Scratch,
    file: Option<ScratchFile>,
    end: u64,
    block: Vec<u8>,
    /// First byte and length.
    pub(crate) table: Table<[u64; 2]>,
}

impl Segments {
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        let table = Table::new(scratch, share_bytes);
        Self { scratch: scratch.clone(), file: None, end: 0, block: Vec::new(), table }
    }

    /// Where the next byte will be.
    pub(crate) fn end(&self) -> u64 {
        self.end + self.block.len() as u64
    }

    pub(crate) fn push(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        if self.block.len() + bytes.len() > BLOCK_BYTES {
            self.flush()?;
        }
        if bytes.len() > BLOCK_BYTES {
            return self.write(bytes);
        }
        self.block.extend_from_slice(bytes);
        Ok(())
    }

    pub(crate) fn flush(&mut self) -> Result<(), IoError> {
        let mut block = std::mem::take(&mut self.block);
        self.write(&block)?;
        block.clear();
        self.block = block;
        Ok(())
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        let file = match &mut self.file {
            Some(file) => file,
            None => self.file.insert(self.scratch.anonymous("decoded")?),
        };
        file.write_at(bytes, self.end)?;
        self.end += bytes.len() as u64;
        Ok(())
    }

    /// Reads what was flushed.
    pub(crate) fn read_at(&self, bytes: &mut [u8], offset: u64) -> Result<(), IoError> {
        match &self.file {
            Some(file) => Ok(file.read_at(bytes, offset)?),
            None => unreachable_without_file(bytes),
        }
    }
}

/// Nothing was decoded, so nothing but empty ranges can be asked for.
fn unreachable_without_file(bytes: &[u8]) -> Result<(), IoError> {
    assert!(bytes.is_empty(), "only what was decoded is read");
    Ok(())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Outside,
    InText,
    Escaped,
}

/// A stretch of a file as a stream for the parser.
pub(crate) struct Text<'t> {
    input: &'t mut Input,
    left: u64,
    state: State,
    /// Bytes of the text or word that is being read.
    length: u64,
    /// What stands in for base64, last byte first.
    instead: Vec<u8>,
    segments: &'t mut Segments,
    failed: Option<IoError>,
}

impl<'t> Text<'t> {
    pub(crate) fn new(
        input: &'t mut Input,
        range: Range<u64>,
        segments: &'t mut Segments,
    ) -> Result<Self, IoError> {
        input.seek(range.start);
        let mut left = range.end - range.start;
        // Editors put it there, and parsers refuse it.
        let mark = crate::io::words::MARK;
        if left >= mark.len() as u64 && input.look_ahead(mark.len())?.starts_with(mark) {
            input.consume(mark.len());
            left -= mark.len() as u64;
        }
        let (state, instead) = (State::Outside, Vec::new());
        Ok(Self { input, left, state, length: 0, instead, segments, failed: None })
    }

    /// Where the parser is.
    pub(crate) fn offset(&self) -> u64 {
        self.input.offset()
    }

    /// What really failed, where the parser says that reading did.
    pub(crate) fn failed(self) -> Option<IoError> {
        self.failed
    }

    fn unreadable(&self, expected: impl Into<String>, found: &str) -> IoError {
        IoError::unreadable(self.input.path(), Place::Byte(self.offset()), expected, found)
    }

    /// The next byte of the file.
    #[inline]
    fn raw(&mut self) -> Result<Option<u8>, IoError> {
        if self.left == 0 || (self.input.available().is_empty() && !self.input.fill()?) {
            return Ok(None);
        }
        self.left -= 1;
        Ok(Some(self.input.take(1)[0]))
    }

    /// The next byte for the parser.
    #[inline]
    fn next(&mut self) -> Result<Option<u8>, IoError> {
        if let Some(byte) = self.instead.pop() {
            return Ok(Some(byte));
        }
        let Some(byte) = self.raw()? else { return Ok(None) };
        self.length += 1;
        match (self.state, byte) {
            (State::Outside, b'"') => {
                (self.state, self.length) = (State::InText, 0);
                self.divert_data()?;
            }
            (State::InText, b'"') => (self.state, self.length) = (State::Outside, 0),
            (State::InText, b'\\') => self.state = State::Escaped,
            (State::Escaped, _) => self.state = State::InText,
            (
                State::Outside,
                b' ' | b'\t' | b'\n' | b'\r' | b'{' | b'}' | b'[' | b']' | b',' | b':',
            ) => {
                self.length = 0;
            }
            _ => {}
        }
        let most = if self.state == State::Outside { MOST_WORD_BYTES } else { MOST_TEXT_BYTES };
        if self.length > most {
            return Err(self.unreadable(format!("a text of at most {most} bytes"), "a longer one"));
        }
        Ok(Some(byte))
    }

    /// Decodes a text that has just begun, if it is base64.
    fn divert_data(&mut self) -> Result<(), IoError> {
        const START: &[u8] = b"data:";
        const BASE64: &[u8] = b";base64,";
        let most = self.left.min((START.len() + MOST_TYPE_BYTES) as u64) as usize;
        let head = self.input.look_ahead(START.len().min(most))?;
        if !head.starts_with(START) {
            return Ok(());
        }
        let head = self.input.look_ahead(most)?;
        let head = &head[..most.min(head.len())];
        let end = head.iter().position(|&b| b == b'"').unwrap_or(head.len());
        let Some(at) = head[..end].windows(BASE64.len()).position(|word| word == BASE64) else {
            return Ok(());
        };
        let is_image = head[START.len()..].starts_with(b"image");
        let length = at + BASE64.len();
        self.input.consume(length);
        self.left -= length as u64;
        let first = self.segments.end();
        let is_whole = self.decode(is_image)?;
        let length = if is_whole { self.segments.end() - first } else { 0 };
        let number = self.segments.table.len();
        self.segments.table.push([first, length])?;
        self.instead = format!("{DATA_MARK}{number}").bytes().rev().collect();
        Ok(())
    }

    /// Decodes up to the end of the text, which is left where it is. An image that is no base64
    /// gives `false`, anything else an error.
    fn decode(&mut self, is_image: bool) -> Result<bool, IoError> {
        let mut base64 = Base64::default();
        let mut is_whole = true;
        loop {
            let next = self.input.look_ahead(1)?.first().copied().filter(|_| self.left > 0);
            let byte = match next {
                None => return Err(self.unreadable("the end of a text", "the end of the JSON")),
                Some(b'"') => break,
                Some(b'\\') => self.escaped()?,
                Some(_) => self.raw()?.unwrap_or_default(),
            };
            if !is_whole {
                continue;
            }
            match base64.push(byte) {
                Some(bytes) => self.segments.push(bytes)?,
                None if is_image => is_whole = false,
                None => return Err(self.unreadable("base64", "another character")),
            }
        }
        match base64.finish() {
            Some(bytes) => self.segments.push(bytes).map(|()| is_whole),
            None if is_image => Ok(false),
            None => Err(self.unreadable("whole bytes in base64", "a part of one")),
        }
    }

    /// A character that is written as an escape; some programs write `+` so.
    fn escaped(&mut self) -> Result<u8, IoError> {
        self.raw()?;
        let byte = match self.raw()? {
            Some(byte @ (b'/' | b'"' | b'\\')) => Some(byte),
            Some(b'n' | b'r' | b't') => Some(b' '),
            Some(b'u') => {
                let mut code = Some(0_u32);
                for _ in 0..4 {
                    let digit = self.raw()?.and_then(|byte| char::from(byte).to_digit(16));
                    code = code.zip(digit).map(|(code, digit)| 16 * code + digit);
                }
                code.and_then(|code| u8::try_from(code).ok())
            }
            _ => None,
        };
        byte.ok_or_else(|| self.unreadable("base64", "an escape"))
    }
}

impl Read for Text<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let Some(room) = bytes.first_mut() else { return Ok(0) };
        match self.next() {
            Ok(Some(byte)) => {
                *room = byte;
                Ok(1)
            }
            Ok(None) => Ok(0),
            Err(error) => {
                self.failed = Some(error);
                Err(ErrorKind::Other.into())
            }
        }
    }
}
