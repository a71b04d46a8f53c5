//! Numbers as text: read in all their spellings, written so that the same bits come back.

use std::io::Write;

/// A number as C, C++ and Rust programs print them, with their words for NaN and infinity.
#[inline]
pub(crate) fn parse_number(word: &[u8]) -> Option<f64> {
    if let Some(number) = parse_short_natural(word) {
        return Some(f64::from(number));
    }
    let text = std::str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| parse_non_finite(text))
}

/// Up to nine digits and nothing else: most indices, without the general parser.
#[inline]
fn parse_short_natural(word: &[u8]) -> Option<u32> {
    if word.is_empty() || word.len() > 9 {
        return None;
    }
    word.iter()
        .try_fold(0_u32, |sum, &b| b.is_ascii_digit().then(|| sum * 10 + u32::from(b - b'0')))
}

/// What Microsoft's and the GNU library print: `1.#INF`, `-1.#IND00`, `nan(ind)`.
fn parse_non_finite(text: &str) -> Option<f64> {
    let lower = text.to_ascii_lowercase();
    let (sign, body) = match lower.strip_prefix('-') {
        Some(body) => (-1.0, body),
        None => (1.0, lower.strip_prefix('+').unwrap_or(&lower)),
    };
    if body.starts_with("1.#inf") {
        Some(sign * f64::INFINITY)
    } else if ["1.#ind", "1.#qnan", "1.#snan", "nan("].iter().any(|word| body.starts_with(word)) {
        Some(f64::NAN)
    } else {
        None
    }
}

/// Appends the shortest text that gives `value` back, with an exponent where digits would be many.
pub(crate) fn push_number(text: &mut Vec<u8>, value: f64) {
    let size = value.abs();
    let written = if size != 0.0 && !(1e-6..1e17).contains(&size) {
        write!(text, "{value:e}")
    } else {
        write!(text, "{value}")
    };
    written.expect("a vector takes any bytes");
}

/// Appends the shortest text that gives a single back, likewise.
pub(crate) fn push_single(text: &mut Vec<u8>, value: f32) {
    let size = value.abs();
    let written = if size != 0.0 && !(1e-6..1e17).contains(&size) {
        write!(text, "{value:e}")
    } else {
        write!(text, "{value}")
    };
    written.expect("a vector takes any bytes");
}

/// Appends a number in decimal digits.
pub(crate) fn push_count(text: &mut Vec<u8>, mut value: u64) {
    let mut digits = [0; 20];
    let mut start = digits.len();
    loop {
        start -= 1;
        digits[start] = b'0' + (value % 10) as u8;
        value /= 10;
        if value == 0 {
            break;
        }
    }
    text.extend_from_slice(&digits[start..]);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn numbers_come_back_bit_by_bit(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            prop_assume!(!value.is_nan());
            let mut text = Vec::new();
            push_number(&mut text, value);
            let text = String::from_utf8(text).expect("digits");
            prop_assert_eq!(text.parse::<f64>().expect("a number").to_bits(), bits);
            prop_assert!(text.len() <= 25);
        }

        #[test]
        fn singles_come_back_bit_by_bit(bits in any::<u32>()) {
            let value = f32::from_bits(bits);
            prop_assume!(!value.is_nan());
            let mut text = Vec::new();
            push_single(&mut text, value);
            let text = String::from_utf8(text).expect("digits");
            prop_assert_eq!(text.parse::<f32>().expect("a number").to_bits(), bits);
            // Readers that take doubles come to the same single.
            prop_assert_eq!(text.parse::<f64>().expect("a number") as f32, value);
        }

        #[test]
        fn counts_are_written_as_the_standard_library_does(value in any::<u64>()) {
            let mut text = Vec::new();
            push_count(&mut text, value);
            prop_assert_eq!(text, value.to_string().into_bytes());
        }
    }

    #[test]
    fn numbers_in_all_their_spellings() {
        for (word, value) in [("7", 7.0), ("-.5", -0.5), ("+1e3", 1000.0), ("1e999", f64::INFINITY)]
        {
            assert_eq!(parse_number(word.as_bytes()), Some(value));
        }
        assert_eq!(parse_number(b"-1.#INF00"), Some(f64::NEG_INFINITY));
        for word in ["nan", "-1.#IND", "1.#QNAN0", "-nan(ind)"] {
            assert!(parse_number(word.as_bytes()).expect("a number").is_nan(), "{word}");
        }
        assert_eq!(parse_number(b"1,5"), None);
        assert_eq!(parse_number(b""), None);
        assert_eq!(parse_number(b"\xff"), None);
    }
}
