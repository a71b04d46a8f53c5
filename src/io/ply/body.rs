//! The numbers behind a PLY header, the same way for text and for binary.

use crate::io::error::{IoError, Place};
use crate::io::input::Input;
use crate::io::ply::header::{Element, Encoding, Scalar};
use crate::io::words::Words;

/// The most numbers that are decoded at a time; they fit the smallest buffer.
const MOST_NUMBERS: u64 = 256;

/// The elements of a PLY file as a stream of numbers.
#[derive(Debug)]
pub(crate) enum Body {
    Text { words: Words, start: (u64, u64) },
    Binary { input: Input, start_offset: u64, big_endian: bool },
}

impl Body {
    /// Goes on where the header ended.
    pub(crate) fn new(words: Words, encoding: Encoding) -> Self {
        let start_offset = words.input().offset();
        if encoding == Encoding::Text {
            let start = (start_offset, words.line());
            return Self::Text { words, start };
        }
        let big_endian = encoding == Encoding::BigEndian;
        Self::Binary { input: words.into_input(), start_offset, big_endian }
    }

    pub(crate) fn input(&self) -> &Input {
        match self {
            Self::Text { words, .. } => words.input(),
            Self::Binary { input, .. } => input,
        }
    }

    /// What is buffered of a binary file, at least `count` bytes of it unless the file ends.
    pub(crate) fn look_ahead(&mut self, count: usize) -> Result<&[u8], IoError> {
        match self {
            Self::Text { .. } => Ok(&[]),
            Self::Binary { input, .. } => input.look_ahead(count),
        }
    }

    /// Passes over what was looked at.
    #[inline]
    pub(crate) fn consume(&mut self, count: usize) {
        if let Self::Binary { input, .. } = self {
            input.consume(count);
        }
    }

    pub(crate) fn unreadable(&self, expected: &str, found: &str) -> IoError {
        match self {
            Self::Text { words, .. } => words.unreadable(expected, found),
            Self::Binary { input, .. } => {
                IoError::unreadable(input.path(), Place::Byte(input.offset()), expected, found)
            }
        }
    }

    /// Goes back to the first element.
    pub(crate) fn rewind(&mut self) {
        match self {
            Self::Text { words, start: (offset, line) } => words.seek(*offset, *line),
            Self::Binary { input, start_offset, .. } => input.seek(*start_offset),
        }
    }

    /// The next number; every type fits a double.
    #[inline]
    pub(crate) fn number(&mut self, scalar: Scalar) -> Result<f64, IoError> {
        match self {
            Self::Text { words, .. } => words.number("a number"),
            Self::Binary { input, big_endian, .. } => {
                let bytes = input.bytes(scalar.size_bytes(), "a number")?;
                Ok(decode(bytes, scalar, *big_endian))
            }
        }
    }

    /// Replaces `numbers` by the next `count`, or by the first part of them.
    #[inline]
    pub(crate) fn numbers(
        &mut self,
        scalar: Scalar,
        count: u64,
        numbers: &mut Vec<f64>,
    ) -> Result<(), IoError> {
        let count = count.min(MOST_NUMBERS) as usize;
        numbers.clear();
        match self {
            Self::Text { words, .. } => {
                for _ in 0..count {
                    numbers.push(words.number("a number")?);
                }
            }
            Self::Binary { input, big_endian, .. } => {
                let size_bytes = scalar.size_bytes();
                let bytes = input.bytes(count * size_bytes, "a list of numbers")?;
                let decoded = bytes.chunks_exact(size_bytes);
                numbers.extend(decoded.map(|bytes| decode(bytes, scalar, *big_endian)));
            }
        }
        Ok(())
    }

    /// The length of a list whose entries are still in the file.
    pub(crate) fn length(&mut self, length: Scalar, entry: Scalar) -> Result<u64, IoError> {
        let number = self.number(length)?;
        if f64::from(number as u32) != number {
            return Err(self.unreadable("the length of a list", &number.to_string()));
        }
        let count = u64::from(number as u32);
        if let Self::Binary { input, .. } = self {
            let needed_bytes = count * entry.size_bytes() as u64;
            if needed_bytes > input.size_bytes().saturating_sub(input.offset()) {
                return Err(input.ended(&format!("a list of {count} numbers")));
            }
        }
        Ok(count)
    }

    /// Passes over `count` numbers.
    pub(crate) fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), IoError> {
        match self {
            Self::Text { words, .. } => (0..count).try_for_each(|_| match words.word()? {
                Some(_) => Ok(()),
                None => Err(words.unreadable("a number", "the end of the file")),
            }),
            Self::Binary { input, .. } => {
                input.skip(count.saturating_mul(scalar.size_bytes() as u64), "more numbers")
            }
        }
    }

    /// Passes over all of an element's entries.
    pub(crate) fn skip_element(&mut self, element: &Element) -> Result<(), IoError> {
        if element.properties.is_empty() {
            return Ok(());
        }
        if let (Self::Binary { input, .. }, Some(stride_bytes)) =
            (&mut *self, element.stride_bytes())
        {
            return input.skip(element.count.saturating_mul(stride_bytes), "more elements");
        }
        for _ in 0..element.count {
            for property in &element.properties {
                let count = match property.length {
                    Some(length) => self.length(length, property.scalar)?,
                    None => 1,
                };
                self.skip(property.scalar, count)?;
            }
        }
        Ok(())
    }
}

#[inline]
fn decode(bytes: &[u8], scalar: Scalar, big_endian: bool) -> f64 {
    macro_rules! number {
        ($type:ty) => {{
            let bytes = bytes.try_into().expect("as many bytes as the type has");
            let big = <$type>::from_be_bytes(bytes);
            f64::from(if big_endian { big } else { <$type>::from_le_bytes(bytes) })
        }};
    }
    match scalar {
        Scalar::I8 => number!(i8),
        Scalar::U8 => number!(u8),
        Scalar::I16 => number!(i16),
        Scalar::U16 => number!(u16),
        Scalar::I32 => number!(i32),
        Scalar::U32 => number!(u32),
        Scalar::F32 => number!(f32),
        Scalar::F64 => number!(f64),
    }
}
