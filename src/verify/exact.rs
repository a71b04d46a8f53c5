//! The sign of a closed surface's volume, exactly.
//!
//! In:         corners, scaled by a power of two into (-2, 2).
//! Invariant:  the sum of all triple products is held as an expansion of f64 that do not overlap;
//!             its sign is that of its largest member.
//! Memory:     some forty f64 per sum.
//! Source:     Dekker 1971 (two-product), Shewchuk 1997 (grow-expansion).

/// Below this, products of three coordinates might lose bits: the sum is then not trusted.
const LEAST_MAGNITUDE: f64 = 1.0e-60;

/// An exact sum of triple products.
#[derive(Clone, Debug)]
pub(crate) struct ExactVolume {
    expansion: Vec<f64>,
    trusted: bool,
}

impl ExactVolume {
    /// Nothing.
    pub(crate) fn new() -> Self {
        Self { expansion: Vec::new(), trusted: true }
    }

    /// Adds a triangle: six times the volume of its cone from the origin.
    pub(crate) fn add(&mut self, &[a, b, c]: &[[f64; 3]; 3]) {
        let in_range = |x: &f64| *x == 0.0 || (LEAST_MAGNITUDE..2.0).contains(&x.abs());
        self.trusted &= [a, b, c].iter().flatten().all(in_range);
        if self.trusted {
            for (u, v, w) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
                self.add_product(a[u], b[v], c[w]);
                self.add_product(-a[u], b[w], c[v]);
            }
        }
    }

    /// -1, 0 or 1; `None` when coordinates were too far apart in magnitude.
    pub(crate) fn sign(&self) -> Option<i32> {
        let largest = self.expansion.last().copied().unwrap_or(0.0);
        self.trusted.then_some(i32::from(largest > 0.0) - i32::from(largest < 0.0))
    }

    fn add_product(&mut self, x: f64, y: f64, z: f64) {
        let (high, low) = two_product(x, y);
        for part in [low, high] {
            let (high, low) = two_product(part, z);
            self.grow(low);
            self.grow(high);
        }
    }

    fn grow(&mut self, term: f64) {
        if term == 0.0 {
            return;
        }
        let mut sum = term;
        let mut kept = 0;
        for at in 0..self.expansion.len() {
            let (high, low) = two_sum(sum, self.expansion[at]);
            sum = high;
            if low != 0.0 {
                self.expansion[kept] = low;
                kept += 1;
            }
        }
        self.expansion.truncate(kept);
        if sum != 0.0 {
            self.expansion.push(sum);
        }
    }
}

/// Sum and rounding error.
#[inline]
pub(crate) fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

/// Product and rounding error.
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let ((a_high, a_low), (b_high, b_low)) = (split(a), split(b));
    let rest = product - a_high * b_high - a_low * b_high - a_high * b_low;
    (product, a_low * b_low - rest)
}

/// The upper and the lower half of the bits.
fn split(a: f64) -> (f64, f64) {
    let scaled = 134_217_729.0 * a;
    let high = scaled - (scaled - a);
    (high, a - high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_volume_far_below_rounding_keeps_its_sign() {
        // A cone over a sliver that one unit in the last place opens.
        let tip = 1.0_f64.next_up();
        let thin = [[1.0, 0.1, 0.3], [0.1, 1.0, 0.3], [0.1 * tip, tip, 0.3]];
        let mut volume = ExactVolume::new();
        volume.add(&thin);
        let sign = volume.sign().expect("all coordinates are near one");
        assert_ne!(sign, 0);
        let [a, b, c] = thin;
        volume.add(&[a, c, b]);
        assert_eq!(volume.sign(), Some(0));
        volume.add(&[a, c, b]);
        assert_eq!(volume.sign(), Some(-sign));
        volume.add(&[[1.0e-70, 1.0, 1.0], b, c]);
        assert_eq!(volume.sign(), None);
    }
}
