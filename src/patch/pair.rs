//! Pairs the odd faces of one cut, nearest together.
//!
//! A cut may have millions of them. They come along a Hilbert curve, and are paired in windows of
//! [`WINDOW_FACES`]: on the curve near ones are together, so a larger window would hardly help.

/// Most faces that are paired at one time. Even, so that windows of an even number are even.
pub const WINDOW_FACES: usize = 4096;
/// Up to this many faces the pairing is the best there is.
const EXACT_FACES: usize = 16;
/// Rounds of local improvement on larger sets, and how far along the curve they look.
const IMPROVEMENT_ROUNDS: usize = 4;
const IMPROVEMENT_REACH: usize = 16;

/// A pierced place in a plane, in 1/256 cells.
pub type Place = [i64; 2];

fn distance(a: Place, b: Place) -> u64 {
    a[0].abs_diff(b[0]) + a[1].abs_diff(b[1])
}

/// Pairs an even number of places, which come along the curve: index pairs, each place in exactly
/// one.
pub fn pair(places: &[Place]) -> Vec<(usize, usize)> {
    assert!(places.len().is_multiple_of(2), "an even number of faces meets a cut");
    match places.len() {
        0 => Vec::new(),
        2 => vec![(0, 1)],
        n if n <= EXACT_FACES => pair_exactly(places),
        _ => pair_along_curve(places),
    }
}

/// Least total distance by dynamic programming over subsets.
fn pair_exactly(places: &[Place]) -> Vec<(usize, usize)> {
    let n = places.len();
    let full = (1_usize << n) - 1;
    let mut cost = vec![u64::MAX; full + 1];
    let mut choice = vec![0_u8; full + 1];
    cost[0] = 0;
    for mask in 1..=full {
        if mask.count_ones() % 2 == 1 {
            continue;
        }
        let first = mask.trailing_zeros() as usize;
        for second in first + 1..n {
            let rest = mask & !(1 << first) & !(1 << second);
            if mask >> second & 1 == 1 {
                let total = cost[rest] + distance(places[first], places[second]);
                if total < cost[mask] {
                    cost[mask] = total;
                    choice[mask] = second as u8;
                }
            }
        }
    }
    let mut pairs = Vec::with_capacity(n / 2);
    let mut mask = full;
    while mask != 0 {
        let (first, second) = (mask.trailing_zeros() as usize, choice[mask] as usize);
        pairs.push((first, second));
        mask &= !(1 << first) & !(1 << second);
    }
    pairs
}

/// Neighbours along the curve, then exchanges between pairs that are close on it.
fn pair_along_curve(places: &[Place]) -> Vec<(usize, usize)> {
    let mut pairs: Vec<_> = (0..places.len()).step_by(2).map(|first| (first, first + 1)).collect();
    for _ in 0..IMPROVEMENT_ROUNDS {
        let mut changed = false;
        for i in 0..pairs.len() {
            for j in i + 1..(i + 1 + IMPROVEMENT_REACH).min(pairs.len()) {
                changed |= exchange(places, &mut pairs, i, j);
            }
        }
        if !changed {
            break;
        }
    }
    pairs
}

/// Exchanges partners between two pairs where that is shorter.
fn exchange(places: &[Place], pairs: &mut [(usize, usize)], i: usize, j: usize) -> bool {
    let ((a, b), (c, d)) = (pairs[i], pairs[j]);
    let length = |p: usize, q: usize| distance(places[p], places[q]);
    let now = length(a, b) + length(c, d);
    let (one, other) = (length(a, c) + length(b, d), length(a, d) + length(b, c));
    if one.min(other) >= now {
        return false;
    }
    (pairs[i], pairs[j]) = if one <= other { ((a, c), (b, d)) } else { ((a, d), (b, c)) };
    true
}

/// Number of a cell on a Hilbert curve over 2^levels cells a side (Hilbert 1891).
///
/// Places in different cells come along the curve in the order of their cells, however fine the
/// curve is drawn.
pub fn along_curve(cell: [u32; 2], levels: u32) -> u32 {
    let [mut x, mut y] = cell;
    let mut number = 0;
    for level in (0..levels).rev() {
        let (rx, ry) = (x >> level & 1, y >> level & 1);
        number = number << 2 | ((3 * rx) ^ ry);
        if ry == 0 {
            if rx == 1 {
                (x, y) = (!x, !y);
            }
            (x, y) = (y, x);
        }
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn total(places: &[Place], pairs: &[(usize, usize)]) -> u64 {
        pairs.iter().map(|&(a, b)| distance(places[a], places[b])).sum()
    }

    fn check_is_pairing(places: &[Place], pairs: &[(usize, usize)]) {
        let mut seen = vec![0; places.len()];
        pairs.iter().for_each(|&(a, b)| {
            seen[a] += 1;
            seen[b] += 1;
        });
        assert!(seen.iter().all(|&count| count == 1));
    }

    /// The order in which places come.
    fn order(places: &mut Vec<Place>) {
        places.truncate(places.len() / 2 * 2);
        places.sort_by_key(|place| along_curve(place.map(|c| c as u32), 24));
    }

    fn places(count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Place>> {
        proptest::collection::vec(proptest::array::uniform2(0..5000_i64), count).prop_map(
            |mut places| {
                order(&mut places);
                places
            },
        )
    }

    #[test]
    fn the_curve_goes_from_cell_to_neighbour_through_all_of_them() {
        for levels in 1..7 {
            let side = 1_u32 << levels;
            let mut cells = vec![None; (side * side) as usize];
            for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
                cells[along_curve([x, y], levels) as usize] = Some([x, y]);
            }
            let cells: Vec<[u32; 2]> = cells.into_iter().map(|c| c.expect("each once")).collect();
            for pair in cells.windows(2) {
                let apart: u32 = (0..2).map(|a| pair[0][a].abs_diff(pair[1][a])).sum();
                assert_eq!(apart, 1);
            }
        }
    }

    proptest! {
        #[test]
        fn every_place_has_one_partner(places in places(0..200)) {
            check_is_pairing(&places, &pair(&places));
        }

        #[test]
        fn few_places_are_paired_no_worse_than_along_the_curve(places in places(4..12)) {
            let exact = pair_exactly(&places);
            check_is_pairing(&places, &exact);
            prop_assert!(total(&places, &exact) <= total(&places, &pair_along_curve(&places)));
        }
    }
}
