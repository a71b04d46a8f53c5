//! Base64, character by character (RFC 4648, section 4); blanks are passed over.

/// A decoder.
#[derive(Debug, Default)]
pub(crate) struct Base64 {
    /// Bits that are not whole bytes yet, and how many characters they came from.
    bits: u32,
    count: u32,
    is_padded: bool,
    bytes: [u8; 3],
}

impl Base64 {
    /// What the next character completes; `None` where it is no base64.
    #[inline]
    pub(crate) fn push(&mut self, byte: u8) -> Option<&[u8]> {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            b'=' => {
                self.is_padded = true;
                return Some(&[]);
            }
            b' ' | b'\t' | b'\r' | b'\n' => return Some(&[]),
            _ => return None,
        };
        if self.is_padded {
            return None;
        }
        self.bits = self.bits << 6 | u32::from(value);
        self.count += 1;
        if self.count < 4 {
            return Some(&[]);
        }
        let [_, a, b, c] = self.bits.to_be_bytes();
        (self.bits, self.count, self.bytes) = (0, 0, [a, b, c]);
        Some(&self.bytes)
    }

    /// What the last characters complete; `None` where they are a part of a byte.
    pub(crate) fn finish(&mut self) -> Option<&[u8]> {
        let length = match self.count {
            0 => 0,
            2 => 1,
            3 => 2,
            _ => return None,
        };
        let [_, a, b, c] = (self.bits << (6 * (4 - self.count) % 24)).to_be_bytes();
        self.bytes = [a, b, c];
        Some(&self.bytes[..length])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(text: &str) -> Option<Vec<u8>> {
        let mut base64 = Base64::default();
        let mut bytes = Vec::new();
        for byte in text.bytes() {
            bytes.extend_from_slice(base64.push(byte)?);
        }
        bytes.extend_from_slice(base64.finish()?);
        Some(bytes)
    }

    #[test]
    fn the_examples_of_the_standard_decode() {
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zg", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9v\nYmFy", "foobar"),
        ] {
            assert_eq!(decoded(text).as_deref(), Some(bytes.as_bytes()), "{text}");
        }
        assert_eq!(decoded("+/+/"), Some(vec![0xfb, 0xff, 0xbf]));
        for wrong in ["Z", "Zg=Z", "Zm9v!", "Zm9vY"] {
            assert_eq!(decoded(wrong), None, "{wrong}");
        }
    }
}
