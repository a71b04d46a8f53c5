//! The legend beside a map: a bar of colours, and what they mean.
//!
//! Memory: at most [`WIDTH_PX`] by [`TALLEST_PX`] pixels.

use crate::mesh::LengthUnit;
use crate::report::preview::lettering::{ADVANCE_PX, HEIGHT_PX, write_text};
use crate::report::preview::scale::{Scale, colour_at};
use crate::report::preview::shade::{BACKGROUND, to_srgb};

/// Width of the legend.
pub(crate) const WIDTH_PX: u32 = 124;
/// It is no higher, however high the picture is.
const TALLEST_PX: u32 = 420;
/// Space to the left of everything.
const MARGIN_PX: usize = 8;
/// Width of the bar.
const BAR_PX: usize = 18;
/// Between bar, marks and words.
const GAP_PX: usize = 6;
const INK: [u8; 3] = [27, 31, 36];

/// A legend, in the middle of rows of its picture.
pub(crate) struct Legend {
    first_row: u32,
    rows: u32,
    pixels: Vec<[u8; 3]>,
    blank: Vec<[u8; 3]>,
}

impl Legend {
    /// For a picture of so many rows.
    pub(crate) fn new(scale: &Scale, unit: Option<LengthUnit>, height_px: u32) -> Self {
        let rows = height_px.min(TALLEST_PX);
        let blank = vec![to_srgb(BACKGROUND); WIDTH_PX as usize];
        let mut legend = Self {
            first_row: (height_px - rows) / 2,
            rows,
            pixels: blank.repeat(rows as usize),
            blank,
        };
        legend.write((MARGIN_PX, 0), "deviation");
        legend.write((MARGIN_PX, HEIGHT_PX + GAP_PX), &format!("in {}", word(unit)));
        let top = 2 * (HEIGHT_PX + GAP_PX) + HEIGHT_PX;
        let bottom = (rows as usize).saturating_sub(HEIGHT_PX);
        if top < bottom {
            legend.draw_bar(scale, top, bottom);
        }
        legend
    }

    /// The pixels of a row of the picture.
    pub(crate) fn row(&self, row: u32) -> &[[u8; 3]] {
        if !(self.first_row..self.first_row + self.rows).contains(&row) {
            return &self.blank;
        }
        let start = (row - self.first_row) as usize * WIDTH_PX as usize;
        &self.pixels[start..start + WIDTH_PX as usize]
    }

    fn draw_bar(&mut self, scale: &Scale, top: usize, bottom: usize) {
        let height = (bottom - top) as f64;
        for y in top..=bottom {
            let colour = colour_at((bottom - y) as f64 / height);
            for x in MARGIN_PX..MARGIN_PX + BAR_PX {
                self.put((x, y), colour);
            }
        }
        let mut free = 0;
        for (share, text) in scale.marks() {
            let y = bottom - (share * height).round() as usize;
            let left = MARGIN_PX + BAR_PX;
            // Where marks are nearer than letters are high, some go without.
            if y < free {
                continue;
            }
            (left..left + GAP_PX).for_each(|x| self.put((x, y), INK));
            let room = (WIDTH_PX as usize - left - 2 * GAP_PX) / ADVANCE_PX;
            let text: String = text.chars().take(room).collect();
            self.write((left + GAP_PX + GAP_PX / 2, y - HEIGHT_PX / 2), &text);
            free = y + HEIGHT_PX + GAP_PX;
        }
    }

    fn write(&mut self, at: (usize, usize), text: &str) {
        let mut dots = Vec::new();
        write_text(text, at, |x, y| dots.push((x, y)));
        dots.into_iter().for_each(|dot| self.put(dot, INK));
    }

    fn put(&mut self, (x, y): (usize, usize), colour: [u8; 3]) {
        if x < WIDTH_PX as usize && y < self.rows as usize {
            self.pixels[y * WIDTH_PX as usize + x] = colour;
        }
    }
}

/// A short word for the unit of the numbers.
pub(crate) fn word(unit: Option<LengthUnit>) -> &'static str {
    match unit {
        None => "units",
        Some(LengthUnit::Micron) => "um",
        Some(LengthUnit::Millimeter) => "mm",
        Some(LengthUnit::Centimeter) => "cm",
        Some(LengthUnit::Inch) => "inch",
        Some(LengthUnit::Foot) => "ft",
        Some(LengthUnit::Meter) => "m",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_has_all_colours_of_the_scale_in_order() {
        let scale = Scale::reaching(4.0, 10.0);
        let legend = Legend::new(&scale, None, 500);
        assert_eq!(legend.row(0), legend.row(499), "nothing is drawn above and below");
        let colours: Vec<_> = (0..500).map(|row| legend.row(row)[MARGIN_PX + 2]).collect();
        let all: Vec<_> = colours.iter().filter(|colour| **colour == colour_at(1.0)).collect();
        assert!(!all.is_empty());
        let [hot, cold] = [1.0, 0.0].map(|share| {
            colours.iter().rposition(|colour| *colour == colour_at(share)).unwrap_or(0)
        });
        assert!(hot + 200 < cold, "{hot} {cold}");
    }

    #[test]
    fn a_picture_of_few_rows_has_what_fits() {
        let scale = Scale::reaching(4.0, 10.0);
        for height_px in 1..140 {
            let legend = Legend::new(&scale, Some(LengthUnit::Inch), height_px);
            let rows = (0..height_px).map(|row| legend.row(row));
            assert!(rows.clone().all(|row| row.len() == WIDTH_PX as usize));
            assert!(height_px < 20 || rows.flatten().any(|pixel| *pixel == INK));
        }
    }
}
