//! The colour scale of distances: grey where there is none to speak of, then hotter by decades.
//!
//! In:         the largest distance that is shown, and the size of the model.
//! Out:        colours (sRGB), and the numbers that stand beside them.
//! Invariant:  three decades, the highest ends at a round number: 1, 2 or 5 times a power of ten.
//! Units:      model units.

/// Decades of the scale.
const DECADES: f64 = 3.0;
/// The scale ends at this share of the model's diagonal or above: what is smaller is rounding.
const LEAST_TOP_SHARE: f64 = 1e-5;
/// Colours at even steps, the first for everything below the scale.
const STOPS: [[u8; 3]; 7] = [
    [214, 219, 225],
    [142, 190, 222],
    [66, 158, 166],
    [232, 205, 84],
    [236, 128, 46],
    [190, 30, 45],
    [86, 12, 72],
];

/// A colour scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    /// First digit of its end, and the power of ten.
    end: (u8, i32),
}

impl Scale {
    /// The scale that reaches `largest`, of a model with this `diagonal`.
    pub(crate) fn reaching(largest: f64, diagonal: f64) -> Self {
        let least = (diagonal * LEAST_TOP_SHARE).max(f64::MIN_POSITIVE);
        let largest = if largest.is_finite() { largest.max(least) } else { diagonal.max(least) };
        let power = largest.log10().floor() as i32;
        let round = [(1, power), (2, power), (5, power), (1, power + 1)];
        let end = round.into_iter().find(|&end| number(end) >= largest);
        Self { end: end.unwrap_or((2, power + 1)) }
    }

    /// Where it ends.
    pub(crate) fn end(&self) -> f64 {
        number(self.end)
    }

    /// Where its decades end, the highest first, with how far up that is, 1 to 0.
    pub(crate) fn marks(&self) -> impl Iterator<Item = (f64, String)> {
        let (digit, power) = self.end;
        (0..=DECADES as i32)
            .map(move |down| (1.0 - f64::from(down) / DECADES, written((digit, power - down))))
    }

    /// How far up a distance is, 0 to 1.
    pub(crate) fn share(&self, distance: f64) -> f64 {
        let share = 1.0 + (distance / self.end()).log10() / DECADES;
        // Below zero, and of zero: minus infinity.
        if share > 0.0 { share.min(1.0) } else { 0.0 }
    }

    /// The colour of a distance.
    pub(crate) fn colour(&self, distance: f64) -> [u8; 3] {
        colour_at(self.share(distance))
    }
}

/// The colour so far up a scale, 0 to 1.
pub(crate) fn colour_at(share: f64) -> [u8; 3] {
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let below = (place as usize).min(STOPS.len() - 2);
    let part = place - below as f64;
    std::array::from_fn(|channel| {
        let [low, high] = [STOPS[below], STOPS[below + 1]].map(|stop| f64::from(stop[channel]));
        (low + (high - low) * part).round() as u8
    })
}

/// Colours at even steps of every scale, from its lower end to its upper.
pub(crate) const fn stops() -> &'static [[u8; 3]] {
    &STOPS
}

fn number((digit, power): (u8, i32)) -> f64 {
    // As the text is read: a power that is multiplied out would not be round.
    format!("{digit}e{power}").parse().unwrap_or(f64::MAX)
}

fn written(end: (u8, i32)) -> String {
    if (-4..6).contains(&end.1) { number(end).to_string() } else { format!("{}e{}", end.0, end.1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_ends_at_a_round_number_and_has_three_decades() {
        for (largest, marks) in [
            (3.2, ["5", "0.5", "0.05", "0.005"]),
            (1.0, ["1", "0.1", "0.01", "0.001"]),
            (0.000_17, ["0.0002", "2e-5", "2e-6", "2e-7"]),
            (7.1e8, ["1e9", "1e8", "1e7", "1e6"]),
        ] {
            let scale = Scale::reaching(largest, 1e-3);
            let found: Vec<_> = scale.marks().map(|(_, text)| text).collect();
            assert_eq!(found, marks);
            assert_eq!(scale.share(scale.end()), 1.0);
            assert!((scale.share(scale.end() / 1000.0)).abs() < 1e-9);
            assert_eq!(scale.share(0.0), 0.0);
        }
    }

    #[test]
    fn rounding_is_not_spread_over_all_colours() {
        let scale = Scale::reaching(1e-13, 100.0);
        assert_eq!(scale.end(), 1e-3);
        assert_eq!(scale.colour(1e-13), STOPS[0]);
        assert_eq!(Scale::reaching(0.0, 0.0).colour(0.0), STOPS[0]);
        assert!(Scale::reaching(f64::INFINITY, 2.0).end().is_finite());
    }

    #[test]
    fn colours_run_through_all_stops() {
        for (i, stop) in STOPS.iter().enumerate() {
            assert_eq!(colour_at(i as f64 / 6.0), *stop);
        }
    }
}
