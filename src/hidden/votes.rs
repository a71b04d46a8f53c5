//! Votes: which bodies are seen, by rays from places on them.
//!
//! In:         places that the outside touches, by body; the corners inside.
//! Out:        [`Verdicts`].
//! Invariant:  a body's verdict follows from its own places in the order of their hashes.
//! Memory:     a byte a triangle, in a table that spills; the places of one body.
//! Source:     Wilson 1927, Probable inference (bounds of a share).

use crate::geom::mix;
use crate::hidden::{Bodies, HiddenStats, SEEN_SHARE};
use crate::octree::{BURIED, ExposedPlace, LOST, Occupancy, Touched};
use crate::store::{Resources, Sorter, StoreError, Table};

/// Places of a body that are looked at.
const MOST_PLACES: usize = 64;

/// Rays of a body.
const MOST_RAYS: u32 = 64 * 64;

/// Standard deviations within which a share is believed to lie.
const DEVIATIONS: f64 = 1.96;

/// What became known of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is seen, or too small to tell.
    Stays,
    /// The outside touches it, and nobody sees it.
    Hidden,
    /// The outside does not touch it.
    Sealed,
}

/// Verdicts by body.
pub struct Verdicts {
    /// 0, or one more than the place in [`Verdict`].
    of_body: Table<u8>,
}

impl Verdicts {
    /// The verdict on a body.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn of(&mut self, body: u32) -> Result<Verdict, StoreError> {
        Ok(match self.of_body.get(body.into())? {
            IS_HIDDEN => Verdict::Hidden,
            IS_SEALED => Verdict::Sealed,
            _ => Verdict::Stays,
        })
    }
}

const IS_HIDDEN: u8 = 1;
const IS_SEALED: u8 = 2;

/// Judges all bodies.
///
/// # Errors
/// The scratch disk fails, or the caller cancels.
pub fn judge(
    places: Sorter<ExposedPlace>,
    touched: Sorter<Touched>,
    mut occupancy: Occupancy,
    bodies: &Bodies,
    resources: &Resources,
) -> Result<(Verdicts, HiddenStats), StoreError> {
    let mut of_body = Table::new(resources.scratch, resources.share_bytes / 16);
    for _ in 0..bodies.triangles() {
        of_body.push(0)?;
    }
    let mut stats = HiddenStats::default();
    let (mut places, mut touched) = (places.finish()?, touched.finish()?);
    let (mut next, mut beside) = (places.next()?, touched.next()?);
    let mut of_one: Vec<ExposedPlace> = Vec::with_capacity(MOST_PLACES);
    while let Some(body) = next.map(|place| place.of).into_iter().chain(beside.map(|t| t.of)).min()
    {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        of_one.clear();
        while let Some(place) = next.filter(|place| place.of == body) {
            if of_one.len() < MOST_PLACES {
                of_one.push(place);
            }
            next = places.next()?;
        }
        let mut how = 0;
        while let Some(touched_so) = beside.filter(|touched| touched.of == body) {
            how |= touched_so.how;
            beside = touched.next()?;
        }
        stats.bodies += 1;
        if of_one.is_empty() && how & (BURIED | LOST) == BURIED {
            stats.sealed_bodies += 1;
            of_body.set(body.into(), IS_SEALED)?;
        } else if !of_one.is_empty() && is_hidden(&of_one, &mut occupancy)? {
            stats.hidden_bodies += 1;
            of_body.set(body.into(), IS_HIDDEN)?;
        }
    }
    Ok((Verdicts { of_body }, stats))
}

/// Whether surely less than [`SEEN_SHARE`] of the rays from these places leave the grid.
fn is_hidden(places: &[ExposedPlace], occupancy: &mut Occupancy) -> Result<bool, StoreError> {
    let mut votes = Votes::default();
    for ray in 0..MOST_RAYS {
        let place = &places[ray as usize % places.len()];
        votes.rays += 1;
        votes.seen += u32::from(occupancy.escapes(place.corner, direction(place, ray))?);
        let [least, most] = votes.bounds();
        if least > SEEN_SHARE {
            return Ok(false);
        }
        if most < SEEN_SHARE {
            return Ok(true);
        }
    }
    Ok(false)
}

/// How many rays went out, and how many left the grid.
#[derive(Clone, Copy, Debug, Default)]
struct Votes {
    rays: u32,
    seen: u32,
}

impl Votes {
    /// Least and most share of rays that leave, by Wilson's score interval.
    fn bounds(self) -> [f64; 2] {
        let (rays, share) = (f64::from(self.rays), f64::from(self.seen) / f64::from(self.rays));
        let square = DEVIATIONS * DEVIATIONS;
        let middle = share + square / (2.0 * rays);
        let spread = share * (1.0 - share) / rays + square / (4.0 * rays * rays);
        let reach = DEVIATIONS * spread.sqrt();
        [middle - reach, middle + reach].map(|bound| bound / (1.0 + square / rays))
    }
}

/// A direction in the half space in front of a place, evenly spread over rays.
fn direction(place: &ExposedPlace, ray: u32) -> [f64; 3] {
    let mut state = u64::from(place.hash) << 32 | u64::from(ray);
    loop {
        let towards = [(); 3].map(|()| {
            state = mix(state);
            // 53 bits make a number from -1 to 1.
            (state >> 11) as f64 * (2.0 / (1_u64 << 53) as f64) - 1.0
        });
        let square: f64 = towards.iter().map(|t| t * t).sum();
        // What lies in the ball is spread evenly over directions.
        if square > 1.0 || square == 0.0 {
            continue;
        }
        let normal = place.normal.map(f64::from);
        let height = towards[0] * normal[0] + towards[1] * normal[1] + towards[2] * normal[2];
        return if height < 0.0 { towards.map(|t| -t) } else { towards };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_hold_the_share_and_close_in_on_it() {
        let bounds = |seen, rays| Votes { rays, seen }.bounds();
        let [least, most] = bounds(0, 1900);
        assert!(least.abs() < 1e-12 && most > SEEN_SHARE, "{most}");
        assert!(bounds(0, 1930)[1] < SEEN_SHARE);
        assert!(bounds(1, 1)[0] > SEEN_SHARE, "one ray that leaves is enough at first");
        let [least, most] = bounds(500, 1000);
        assert!((0.46..0.5).contains(&least) && (0.5..0.54).contains(&most));
    }

    #[test]
    fn directions_are_spread_over_the_half_space_in_front() {
        let normal = [0.6, 0.0, 0.8];
        let place = ExposedPlace { of: 0, hash: 7, corner: [0; 3], normal };
        let mut mean = [0.0; 3];
        for ray in 0..10_000 {
            let towards = direction(&place, ray);
            let length = towards.iter().map(|t| t * t).sum::<f64>().sqrt();
            let unit = towards.map(|t| t / length);
            let height = unit[0] * 0.6 + unit[2] * 0.8;
            assert!(height > -1e-6);
            mean = [0, 1, 2].map(|a| mean[a] + unit[a] / 10_000.0);
        }
        // The mean of a half sphere lies half a radius up its axis.
        for (found, expected) in mean.into_iter().zip([0.3, 0.0, 0.4]) {
            assert!((found - expected).abs() < 0.02, "{mean:?}");
        }
    }
}
