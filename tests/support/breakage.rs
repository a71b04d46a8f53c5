//! Ways to break a soup.

use brickmend::mesh::shapes::{Corners, Random};

use crate::support::soups::extent;

/// A way to break a soup.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Breakage {
    Drop,
    Flip,
    Duplicate,
    Jitter,
    Split,
    Fin,
    NotANumber,
    Far,
    Tiny,
}

impl Breakage {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Drop,
        Self::Flip,
        Self::Duplicate,
        Self::Jitter,
        Self::Split,
        Self::Fin,
        Self::NotANumber,
        Self::Far,
        Self::Tiny,
    ];

    /// Breaks about `share` of the triangles.
    pub fn apply(self, soup: &mut Vec<Corners>, share: f64, random: &mut Random) {
        match self {
            Self::Drop => soup.retain(|_| random.share() >= share),
            Self::Flip => flip(soup, share, random),
            Self::Duplicate => duplicate(soup, share, random),
            Self::Jitter => {
                let amount = share * 0.05 * extent(soup);
                jitter(soup, amount, random);
            }
            Self::Split => split(soup, share, random),
            Self::Fin => add_fins(soup, share, random),
            Self::NotANumber => add_not_a_number(soup, share, random),
            Self::Far => move_all(soup, 1.0, 1e6),
            Self::Tiny => move_all(soup, 1e-6, 0.0),
        }
    }
}

/// Turns triangles inside out.
pub fn flip(soup: &mut [Corners], share: f64, random: &mut Random) {
    for corners in soup {
        if random.share() < share {
            corners.swap(1, 2);
        }
    }
}

/// Adds copies, every other one turned inside out.
pub fn duplicate(soup: &mut Vec<Corners>, share: f64, random: &mut Random) {
    for number in 0..soup.len() {
        if random.share() < share {
            let [p, q, r] = soup[number];
            soup.push(if number % 2 == 0 { [q, r, p] } else { [p, r, q] });
        }
    }
}

/// Moves every corner of every triangle on its own.
pub fn jitter(soup: &mut [Corners], amount: f64, random: &mut Random) {
    for corner in soup.iter_mut().flatten() {
        let by = random.point();
        *corner = std::array::from_fn(|a| corner[a] + amount * by[a]);
    }
}

/// Cuts triangles in two at a side, whose neighbour stays whole: T-junctions.
pub fn split(soup: &mut Vec<Corners>, share: f64, random: &mut Random) {
    for number in 0..soup.len() {
        if random.share() < share {
            let [p, q, r] = soup[number];
            let t = random.within(0.2, 0.8);
            let cut = std::array::from_fn(|a| p[a] + t * (q[a] - p[a]));
            soup[number] = [p, cut, r];
            soup.push([cut, q, r]);
        }
    }
}

/// Hangs a triangle on a side.
pub fn add_fins(soup: &mut Vec<Corners>, share: f64, random: &mut Random) {
    let size = 0.2 * extent(soup);
    for number in 0..soup.len() {
        if random.share() < share {
            let [p, q, _] = soup[number];
            let by = random.point();
            soup.push([q, p, std::array::from_fn(|a| p[a] + size * by[a])]);
        }
    }
}

/// Adds triangles with a corner that is no number.
pub fn add_not_a_number(soup: &mut Vec<Corners>, share: f64, random: &mut Random) {
    for number in 0..soup.len() {
        if random.share() < share {
            let mut corners = soup[number];
            corners[random.below(3)][random.below(3)] =
                [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][random.below(3)];
            soup.push(corners);
        }
    }
}

/// Scales, then moves along all axes.
pub fn move_all(soup: &mut [Corners], scale: f64, by: f64) {
    for coordinate in soup.iter_mut().flatten().flatten() {
        *coordinate = *coordinate * scale + by;
    }
}
