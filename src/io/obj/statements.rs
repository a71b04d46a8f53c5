//! What the words of an OBJ file mean; shared by both readers.

use std::num::IntErrorKind;

use crate::io::error::{IoError, shown};
use crate::io::words::Words;

/// The statements that lead somewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Statement {
    Vertex,
    Texture,
    Normal,
    Face,
    Object,
    Group,
    UseMaterial,
    Library,
    /// Known and passed over.
    Known,
    /// Anything else, passed over.
    Unknown,
}

impl Statement {
    /// The next statement; the rest of the one before is passed over. `None` at the file's end.
    pub(crate) fn next(words: &mut Words) -> Result<Option<Self>, IoError> {
        Ok(words.word()?.map(|keyword| match keyword {
            b"v" => Self::Vertex,
            b"vt" => Self::Texture,
            b"vn" => Self::Normal,
            b"f" => Self::Face,
            b"o" => Self::Object,
            b"g" => Self::Group,
            b"usemtl" => Self::UseMaterial,
            b"mtllib" => Self::Library,
            b"vp" | b"l" | b"p" | b"s" | b"fo" | b"mg" | b"curv" | b"surf" => Self::Known,
            _ => Self::Unknown,
        }))
    }
}

/// A vertex: position and, in files that have them, a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Vertex {
    pub(crate) position: [f64; 3],
    pub(crate) colour: Option<[u8; 4]>,
}

impl Vertex {
    /// Reads `x y z`, `x y z w` (divided by `w`) or `x y z r g b`.
    pub(crate) fn read(words: &mut Words) -> Result<Self, IoError> {
        let mut numbers = [0.0; 6];
        let mut count = 0;
        while count < numbers.len() {
            match words.number_on_line("a coordinate")? {
                Some(number) => numbers[count] = number,
                None => break,
            }
            count += 1;
        }
        if count < 3 {
            return Err(words.unreadable("three coordinates", "the end of the line"));
        }
        let [x, y, z, fourth, ..] = numbers;
        let w = if count == 4 && fourth != 0.0 { fourth } else { 1.0 };
        let channel = |value: f64| (value * 255.0).round() as u8;
        let colour = (count >= 6)
            .then(|| [channel(numbers[3]), channel(numbers[4]), channel(numbers[5]), 255]);
        Ok(Self { position: [x / w, y / w, z / w], colour })
    }
}

/// Reads `u`, `u v` or `u v w`; the third is ignored.
pub(crate) fn read_texture(words: &mut Words) -> Result<[f64; 2], IoError> {
    let Some(u) = words.number_on_line("a texture coordinate")? else {
        return Err(words.unreadable("a texture coordinate", "the end of the line"));
    };
    let v = words.number_on_line("a texture coordinate")?.unwrap_or(0.0);
    Ok([u, v])
}

/// A corner of a face as written: `v`, `v/vt`, `v/vt/vn` or `v//vn`; indices from 1, or negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CornerIndices {
    pub(crate) vertex: i64,
    pub(crate) texture: Option<i64>,
}

impl CornerIndices {
    /// The next corner on this line.
    pub(crate) fn read(words: &mut Words) -> Result<Option<Self>, IoError> {
        let Some(word) = words.word_on_line()? else { return Ok(None) };
        match Self::parse(word) {
            Some(corner) => Ok(Some(corner)),
            None => {
                let found = shown(word);
                Err(words.unreadable("a corner such as 1, 1/1, 1//1 or 1/1/1", &found))
            }
        }
    }

    fn parse(word: &[u8]) -> Option<Self> {
        let mut fields = word.split(|&b| b == b'/');
        let vertex = parse_index(fields.next()?)?;
        let texture = match fields.next() {
            None | Some(b"") => None,
            Some(field) => Some(parse_index(field)?),
        };
        Some(Self { vertex, texture })
    }
}

/// A whole number; what exceeds all counts stays far beyond them.
#[inline]
fn parse_index(field: &[u8]) -> Option<i64> {
    let short = field.len() <= 18 && !field.is_empty();
    if short && field.iter().all(u8::is_ascii_digit) {
        return Some(field.iter().fold(0, |sum, &b| sum * 10 + i64::from(b - b'0')));
    }
    match std::str::from_utf8(field).ok()?.parse::<i64>() {
        Ok(index) => Some(index),
        Err(e) if *e.kind() == IntErrorKind::PosOverflow => Some(i64::MAX),
        Err(e) if *e.kind() == IntErrorKind::NegOverflow => Some(i64::MIN),
        Err(_) => None,
    }
}

/// The place in a list of `total` that an index means where `so_far` entries were listed.
#[inline]
pub(crate) fn resolve(index: i64, so_far: u64, total: u64) -> Option<u64> {
    let place = match index {
        1.. => index.unsigned_abs() - 1,
        0 => return None,
        _ => so_far.checked_sub(index.unsigned_abs())?,
    };
    (place < total).then_some(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_count_from_one_or_backwards() {
        assert_eq!(resolve(1, 3, 5), Some(0));
        assert_eq!(resolve(5, 3, 5), Some(4));
        assert_eq!(resolve(6, 3, 5), None);
        assert_eq!(resolve(0, 3, 5), None);
        assert_eq!(resolve(-1, 3, 5), Some(2));
        assert_eq!(resolve(-3, 3, 5), Some(0));
        assert_eq!(resolve(-4, 3, 5), None);
        assert_eq!(resolve(i64::MIN, 3, 5), None);
    }

    #[test]
    fn corners_are_read_in_all_their_forms() {
        let corner = |word: &str| CornerIndices::parse(word.as_bytes());
        for (word, texture) in [("7", None), ("7/2", Some(2)), ("7//3", None), ("7/2/3", Some(2))] {
            assert_eq!(corner(word), Some(CornerIndices { vertex: 7, texture }), "{word}");
        }
        assert_eq!(corner("99999999999999999999").map(|c| c.vertex), Some(i64::MAX));
        for word in ["", "/", "a", "1.0", "1/x", "-"] {
            assert_eq!(corner(word), None, "{word}");
        }
    }
}
