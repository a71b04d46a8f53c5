//! Text as a stream of words with line numbers, however long a line is.
//!
//! In: a file. Out: words between blanks. Memory: the input's buffer, whatever the file: lines are
//! never held, words and names have a longest length. Failures carry the line number.

use crate::io::error::{IoError, Place, shown};
use crate::io::input::Input;
use crate::io::numbers::parse_number;

/// The byte order mark, which some editors put in front of UTF-8.
pub(crate) const MARK: &[u8] = b"\xef\xbb\xbf";
/// Longer words are nothing that any of our formats knows.
const LONGEST_WORD_BYTES: usize = 4096;
/// Longer names are refused.
const LONGEST_NAME_BYTES: usize = 4096;

/// What is special in a text format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dialect {
    /// Words and lines, nothing else.
    Plain,
    /// `#` at the start of a word hides the rest of the line.
    Comments,
    /// As before, and a backslash at the end of a line joins the next one.
    CommentsAndContinuations,
}

/// Reads words.
#[derive(Debug)]
pub(crate) struct Words {
    input: Input,
    dialect: Dialect,
    line: u64,
}

impl Words {
    pub(crate) fn new(input: Input, dialect: Dialect) -> Self {
        Self { input, dialect, line: 1 }
    }

    /// Goes to the first byte of the text.
    pub(crate) fn rewind(&mut self) {
        self.seek(0, 1);
    }

    pub(crate) fn input(&self) -> &Input {
        &self.input
    }

    pub(crate) fn into_input(self) -> Input {
        self.input
    }

    pub(crate) fn line(&self) -> u64 {
        self.line
    }

    /// Goes on at `offset`, which stands in `line`.
    pub(crate) fn seek(&mut self, offset: u64, line: u64) {
        self.line = line;
        self.input.seek(offset);
    }

    /// The error that names this line.
    pub(crate) fn unreadable(&self, expected: &str, found: &str) -> IoError {
        IoError::unreadable(self.input.path(), Place::Line(self.line), expected, found)
    }

    /// The next word, on this line or a later one; `None` at the end of the file.
    #[inline]
    pub(crate) fn word(&mut self) -> Result<Option<&[u8]>, IoError> {
        if self.input.offset() == 0 {
            self.skip_mark()?;
        }
        self.skip_blank_lines();
        while !self.find_word()? {
            if !self.skip_line()? {
                return Ok(None);
            }
            self.skip_blank_lines();
        }
        let length = self.word_length()?;
        Ok(Some(self.input.take(length)))
    }

    #[cold]
    fn skip_mark(&mut self) -> Result<(), IoError> {
        if self.input.look_ahead(MARK.len())?.starts_with(MARK) {
            self.input.consume(MARK.len());
        }
        Ok(())
    }

    /// Passes over what is blank and available, whole lines of it too.
    #[inline]
    fn skip_blank_lines(&mut self) {
        let bytes = self.input.available();
        let length = bytes.iter().position(|&b| !is_blank(b)).unwrap_or(bytes.len());
        if length > 0 {
            self.line += bytes[..length].iter().filter(|&&b| b == b'\n').count() as u64;
            self.input.consume(length);
        }
    }

    /// The next word on this line; the line's end is left where it is.
    #[inline]
    pub(crate) fn word_on_line(&mut self) -> Result<Option<&[u8]>, IoError> {
        if !self.find_word()? {
            return Ok(None);
        }
        let length = self.word_length()?;
        Ok(Some(self.input.take(length)))
    }

    /// The next word as a number, on this line or a later one.
    #[inline]
    pub(crate) fn number(&mut self, expected: &str) -> Result<f64, IoError> {
        let Some(word) = self.word()? else {
            return Err(self.unreadable(expected, "the end of the file"));
        };
        match parse_number(word) {
            Some(number) => Ok(number),
            None => {
                let found = shown(word);
                Err(self.unreadable(expected, &found))
            }
        }
    }

    /// The next word on this line as a number; `None` where the line ends.
    #[inline]
    pub(crate) fn number_on_line(&mut self, expected: &str) -> Result<Option<f64>, IoError> {
        let Some(word) = self.word_on_line()? else { return Ok(None) };
        match parse_number(word) {
            Some(number) => Ok(Some(number)),
            None => {
                let found = shown(word);
                Err(self.unreadable(expected, &found))
            }
        }
    }

    /// The rest of the line, trimmed; bytes that are no UTF-8 are replaced.
    pub(crate) fn name(&mut self) -> Result<String, IoError> {
        Ok(String::from_utf8_lossy(&self.raw_name()?).into_owned())
    }

    /// The rest of the line, trimmed, as it stands.
    pub(crate) fn raw_name(&mut self) -> Result<Vec<u8>, IoError> {
        let mut name = Vec::new();
        loop {
            let bytes = self.input.look_ahead(1)?;
            let length = bytes.iter().position(|&b| b == b'\n').unwrap_or(bytes.len());
            if length == 0 {
                break;
            }
            if name.len() + length > LONGEST_NAME_BYTES {
                let limit = format!("a name of at most {LONGEST_NAME_BYTES} bytes");
                return Err(self.unreadable(&limit, "a longer one"));
            }
            name.extend_from_slice(self.input.take(length));
        }
        Ok(name.trim_ascii().to_vec())
    }

    /// The rest of the line, left where it is; `None` if it is longer than a name may be.
    pub(crate) fn short_rest(&mut self) -> Result<Option<String>, IoError> {
        let bytes = self.input.look_ahead(LONGEST_NAME_BYTES)?;
        let bytes = &bytes[..bytes.len().min(LONGEST_NAME_BYTES)];
        let length = bytes.iter().position(|&b| b == b'\n');
        let line = length.map(|length| &bytes[..length]);
        Ok(line.map(|line| String::from_utf8_lossy(line.trim_ascii()).into_owned()))
    }

    /// Goes to the start of the next line; `false` when there is none.
    pub(crate) fn skip_line(&mut self) -> Result<bool, IoError> {
        self.skip_to_line_end()?;
        if self.input.available().is_empty() {
            return Ok(false);
        }
        self.input.consume(1);
        self.line += 1;
        Ok(true)
    }

    fn skip_to_line_end(&mut self) -> Result<(), IoError> {
        loop {
            let bytes = self.input.available();
            if let Some(length) = bytes.iter().position(|&b| b == b'\n') {
                self.input.consume(length);
                return Ok(());
            }
            let length = bytes.len();
            self.input.consume(length);
            if !self.input.fill()? {
                return Ok(());
            }
        }
    }

    /// Goes to the next word on this line; `false` at the end of the line or of the file.
    #[inline]
    fn find_word(&mut self) -> Result<bool, IoError> {
        loop {
            let bytes = self.input.available();
            let Some(blanks) = bytes.iter().position(|&b| !is_blank(b) || b == b'\n') else {
                let length = bytes.len();
                self.input.consume(length);
                if !self.input.fill()? {
                    return Ok(false);
                }
                continue;
            };
            let first = bytes[blanks];
            self.input.consume(blanks);
            match first {
                b'\n' => return Ok(false),
                b'#' if self.dialect != Dialect::Plain => {
                    self.skip_to_line_end()?;
                    return Ok(false);
                }
                b'\\' if self.dialect == Dialect::CommentsAndContinuations => {
                    let length = match self.input.look_ahead(3)? {
                        [_, b'\n', ..] => 2,
                        [_, b'\r', b'\n', ..] => 3,
                        _ => return Ok(true),
                    };
                    self.input.consume(length);
                    self.line += 1;
                }
                _ => return Ok(true),
            }
        }
    }

    /// The length of the word that stands here; all of it is available afterwards.
    #[inline]
    fn word_length(&mut self) -> Result<usize, IoError> {
        let mut length = 0;
        loop {
            let bytes = self.input.available();
            if let Some(more) = bytes[length..].iter().position(|&b| is_blank(b)) {
                length += more;
                break;
            }
            length = bytes.len();
            if length > LONGEST_WORD_BYTES || !self.input.fill()? {
                break;
            }
        }
        if length > LONGEST_WORD_BYTES {
            let limit = format!("a word of at most {LONGEST_WORD_BYTES} bytes");
            let found = shown(self.input.available());
            return Err(self.unreadable(&limit, &found));
        }
        let bytes = self.input.available();
        let joins = length > 1
            && bytes[length - 1] == b'\\'
            && self.dialect == Dialect::CommentsAndContinuations
            && matches!(bytes.get(length), Some(b'\n' | b'\r'));
        Ok(length - usize::from(joins))
    }
}

#[inline]
fn is_blank(byte: u8) -> bool {
    byte <= b' ' && matches!(byte, 9..=13 | b' ')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &[u8], dialect: Dialect) -> (tempfile::TempDir, Words) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("text");
        std::fs::write(&path, text).expect("a file");
        let input = Input::open(&path, 0).expect("opens");
        (folder, Words::new(input, dialect))
    }

    fn text(word: Option<&[u8]>) -> Option<String> {
        word.map(|word| String::from_utf8_lossy(word).into_owned())
    }

    #[test]
    fn words_carry_their_line_and_comments_vanish() {
        let (_folder, mut words) =
            words(b"a b # x\r\n\r\n# all\n c#d\n", Dialect::CommentsAndContinuations);
        assert_eq!(text(words.word_on_line().expect("reads")).as_deref(), Some("a"));
        assert_eq!(text(words.word_on_line().expect("reads")).as_deref(), Some("b"));
        assert_eq!(text(words.word_on_line().expect("reads")), None);
        assert_eq!(text(words.word().expect("reads")).as_deref(), Some("c#d"));
        assert_eq!(words.line(), 4);
        assert_eq!(text(words.word().expect("reads")), None);
    }

    #[test]
    fn blank_lines_are_counted_wherever_the_buffer_ends() {
        let mut content = vec![b'\n'; 40_000];
        content.extend_from_slice(b" \r\n\x0b\nx\n\n");
        let (_folder, mut words) = words(&content, Dialect::Comments);
        assert_eq!(text(words.word().expect("reads")).as_deref(), Some("x"));
        assert_eq!(words.line(), 40_003);
        assert_eq!(text(words.word().expect("reads")), None);
    }

    #[test]
    fn a_backslash_joins_lines_with_and_without_a_blank_before_it() {
        let (_folder, mut words) =
            words(b"f 1 \\\n2\\\r\n3 a\\b\nv", Dialect::CommentsAndContinuations);
        for expected in ["f", "1", "2", "3", "a\\b"] {
            assert_eq!(text(words.word_on_line().expect("reads")).as_deref(), Some(expected));
        }
        assert_eq!(text(words.word_on_line().expect("reads")), None);
        assert_eq!(words.line(), 3);
    }

    #[test]
    fn words_survive_the_border_of_the_buffer_at_any_place() {
        for shift in 0..12 {
            let mut content = vec![b' '; (16 << 10) - shift];
            content.extend_from_slice(b"12345 \\\r\n67890\n");
            let (_folder, mut words) = words(&content, Dialect::CommentsAndContinuations);
            assert_eq!(words.number("a number").expect("reads"), 12345.0);
            assert_eq!(words.number_on_line("a number").expect("reads"), Some(67890.0));
        }
    }

    #[test]
    fn a_word_without_end_is_refused() {
        let (_folder, mut words) = words(&[b'x'; 100_000], Dialect::Plain);
        assert!(matches!(words.word(), Err(IoError::Unreadable { .. })));
    }
}
