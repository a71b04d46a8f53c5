//! Letters in a picture: what a legend says, in dots.
//!
//! Units: pixels.

use std::ops::Range;

/// Columns and rows of dots of a letter.
const DOTS: (usize, usize) = (5, 7);
/// Pixels of a dot, each way.
const DOT_PX: usize = 2;
/// From letter to letter.
pub(crate) const ADVANCE_PX: usize = (DOTS.0 + 1) * DOT_PX;
/// Height of a letter.
pub(crate) const HEIGHT_PX: usize = DOTS.1 * DOT_PX;

/// The dots of a letter, row by row, the leftmost in the highest of five bits; `None` of those that no
/// legend has.
fn dots_of(letter: char) -> Option<[u8; 7]> {
    Some(match letter {
        '0' => [0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110],
        '1' => [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110],
        '2' => [0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111],
        '3' => [0b11110, 0b00001, 0b00001, 0b01110, 0b00001, 0b00001, 0b11110],
        '4' => [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010],
        '5' => [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110],
        '6' => [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110],
        '7' => [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000],
        '8' => [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110],
        '9' => [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100],
        '.' => [0, 0, 0, 0, 0, 0b01100, 0b01100],
        '-' => [0, 0, 0, 0b11111, 0, 0, 0],
        'a' => [0, 0, 0b01110, 0b00001, 0b01111, 0b10001, 0b01111],
        'c' => [0, 0, 0b01110, 0b10000, 0b10000, 0b10001, 0b01110],
        'd' => [0b00001, 0b00001, 0b01111, 0b10001, 0b10001, 0b10001, 0b01111],
        'e' => [0, 0, 0b01110, 0b10001, 0b11111, 0b10000, 0b01110],
        'f' => [0b00110, 0b01001, 0b01000, 0b11100, 0b01000, 0b01000, 0b01000],
        'h' => [0b10000, 0b10000, 0b10110, 0b11001, 0b10001, 0b10001, 0b10001],
        'i' => [0b00100, 0, 0b01100, 0b00100, 0b00100, 0b00100, 0b01110],
        'm' => [0, 0, 0b11010, 0b10101, 0b10101, 0b10101, 0b10101],
        'n' => [0, 0, 0b10110, 0b11001, 0b10001, 0b10001, 0b10001],
        'o' => [0, 0, 0b01110, 0b10001, 0b10001, 0b10001, 0b01110],
        's' => [0, 0, 0b01111, 0b10000, 0b01110, 0b00001, 0b11110],
        't' => [0b01000, 0b01000, 0b11100, 0b01000, 0b01000, 0b01001, 0b00110],
        'u' => [0, 0, 0b10001, 0b10001, 0b10001, 0b10011, 0b01101],
        'v' => [0, 0, 0b10001, 0b10001, 0b10001, 0b01010, 0b00100],
        _ => return None,
    })
}

/// Calls `put` for each pixel of a text whose upper left corner is at `(x, y)`; letters that it does
/// not know are gaps.
pub(crate) fn write_text(text: &str, (x, y): (usize, usize), mut put: impl FnMut(usize, usize)) {
    for (number, letter) in text.chars().enumerate() {
        let Some(rows) = dots_of(letter) else { continue };
        for (row, bits) in rows.into_iter().enumerate() {
            for column in (0..DOTS.0).filter(|column| bits >> (DOTS.0 - 1 - column) & 1 == 1) {
                let left = x + number * ADVANCE_PX + column * DOT_PX;
                for (dx, dy) in square() {
                    put(left + dx, y + row * DOT_PX + dy);
                }
            }
        }
    }
}

fn square() -> impl Iterator<Item = (usize, usize)> {
    let side: Range<usize> = 0..DOT_PX;
    side.clone().flat_map(move |dy| side.clone().map(move |dx| (dx, dy)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_a_legend_says_can_be_written() {
        for text in
            ["0123456789.e-", "deviation", "units", "um", "mm", "cm", "inch", "ft", "m", "in"]
        {
            assert!(text.chars().all(|letter| dots_of(letter).is_some()), "{text}");
        }
    }

    #[test]
    fn a_one_is_a_line_with_a_foot() {
        let mut pixels = Vec::new();
        write_text("1", (10, 20), |x, y| pixels.push((x, y)));
        assert_eq!(pixels.len(), 10 * DOT_PX * DOT_PX);
        assert!(pixels.iter().all(|&(x, y)| (10..20).contains(&x) && (20..34).contains(&y)));
    }
}
