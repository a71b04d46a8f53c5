//! Signs of determinants in whole numbers of any length, for coordinates that floating point
//! arithmetic, also an adaptive one, would underflow or overflow on.
//!
//! In:         finite f64.
//! Invariant:  exact for all of them. Slow: microseconds.
//! Memory:     some hundred bytes per number.

use std::cmp::Ordering;

/// A whole number: sign and magnitude, lowest digit first, no zero at the end.
#[derive(Clone, Debug, Default)]
struct Whole {
    negative: bool,
    digits: Vec<u32>,
}

/// -1074: every finite f64 is a multiple of two to this power.
const LEAST_EXPONENT: i32 = -1074;

/// Mantissa and exponent; the exponent of zero is the highest.
fn parts(x: f64) -> (u64, i32) {
    let bits = x.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i32;
    let mantissa = bits & ((1 << 52) - 1);
    match (exponent, mantissa) {
        (0, 0) => (0, i32::MAX),
        (0, _) => (mantissa, LEAST_EXPONENT),
        _ => (mantissa | 1 << 52, exponent - 1 + LEAST_EXPONENT),
    }
}

impl Whole {
    /// `x` in units of two to the power of `unit`, which divides it.
    fn of(x: f64, unit: i32) -> Self {
        let (mantissa, exponent) = parts(x);
        if mantissa == 0 {
            return Self::default();
        }
        let shift = (exponent - unit) as usize;
        let mut digits = vec![0; shift / 32];
        let shifted = u128::from(mantissa) << (shift % 32);
        digits.extend([shifted as u32, (shifted >> 32) as u32, (shifted >> 64) as u32]);
        Self { negative: x < 0.0, digits }.trimmed()
    }

    fn trimmed(mut self) -> Self {
        while self.digits.last() == Some(&0) {
            self.digits.pop();
        }
        self
    }

    fn compare_magnitude(&self, other: &Self) -> Ordering {
        let lengths = self.digits.len().cmp(&other.digits.len());
        lengths.then_with(|| self.digits.iter().rev().cmp(other.digits.iter().rev()))
    }

    fn minus(&self, other: &Self) -> Self {
        let opposite = Self { negative: !other.negative, digits: other.digits.clone() };
        self.plus(&opposite)
    }

    fn plus(&self, other: &Self) -> Self {
        let (large, small) = match self.compare_magnitude(other) {
            Ordering::Less => (other, self),
            _ => (self, other),
        };
        let sign = if large.negative == small.negative { 1 } else { -1 };
        let mut carry = 0_i64;
        let mut digits = Vec::with_capacity(large.digits.len() + 1);
        for (at, &digit) in large.digits.iter().enumerate() {
            let other = small.digits.get(at).copied().unwrap_or(0);
            carry += i64::from(digit) + sign * i64::from(other);
            digits.push(carry as u32);
            carry >>= 32;
        }
        digits.push(carry as u32);
        Self { negative: large.negative, digits }.trimmed()
    }

    fn times(&self, other: &Self) -> Self {
        let mut digits = vec![0_u32; self.digits.len() + other.digits.len()];
        for (at, &a) in self.digits.iter().enumerate() {
            let mut carry = 0_u64;
            for (step, &b) in other.digits.iter().enumerate() {
                let place = &mut digits[at + step];
                carry += u64::from(*place) + u64::from(a) * u64::from(b);
                *place = carry as u32;
                carry >>= 32;
            }
            digits[at + other.digits.len()] = carry as u32;
        }
        Self { negative: self.negative != other.negative, digits }.trimmed()
    }

    fn sign(&self) -> i32 {
        match (self.digits.is_empty(), self.negative) {
            (true, _) => 0,
            (_, true) => -1,
            (_, false) => 1,
        }
    }
}

/// The differences `p - origin`, in one unit.
fn differences<const N: usize, const M: usize>(
    points: [[f64; N]; M],
    origin: [f64; N],
) -> [[Whole; N]; M] {
    let all = points.iter().flatten().chain(&origin);
    let unit = all.map(|&x| parts(x).1).min().unwrap_or(0);
    points
        .map(|p| std::array::from_fn(|i| Whole::of(p[i], unit).minus(&Whole::of(origin[i], unit))))
}

fn minor(a: &Whole, b: &Whole, c: &Whole, d: &Whole) -> Whole {
    a.times(d).minus(&b.times(c))
}

/// The sign of the determinant of `a - c` and `b - c`.
pub(crate) fn wide_orient2d(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> i32 {
    let [[ax, ay], [bx, by]] = differences([a, b], c);
    minor(&ax, &ay, &bx, &by).sign()
}

/// The sign of the determinant of `a - d`, `b - d` and `c - d`.
pub(crate) fn wide_orient3d(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> i32 {
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = differences([a, b, c], d);
    let first = az.times(&minor(&bx, &by, &cx, &cy));
    let second = bz.times(&minor(&cx, &cy, &ax, &ay));
    let third = cz.times(&minor(&ax, &ay, &bx, &by));
    first.plus(&second).plus(&third).sign()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn signs_survive_where_products_underflow_and_overflow() {
        for scale in [1e-320, 1e-200, 1.0, 1e150, 1e300] {
            let at = |x: f64, y: f64, z: f64| [x * scale, y * scale, z * scale];
            let [o, x, y] = [at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(0.0, 1.0, 0.0)];
            assert_eq!(wide_orient3d(x, y, at(0.0, 0.0, 1.0), o), 1, "{scale}");
            assert_eq!(wide_orient3d(x, y, at(3.0, 2.0, 0.0), o), 0, "{scale}");
            assert_eq!(wide_orient3d(y, x, [0.0, 0.0, 5e-324], o), -1, "{scale}");
            assert_eq!(wide_orient2d([scale, 0.0], [0.0, 5e-324], [0.0; 2]), 1, "{scale}");
        }
    }

    proptest! {
        #[test]
        fn signs_are_those_of_integers(p in prop::array::uniform4(prop::array::uniform3(-4..5_i64))) {
            let [a, b, c, d] = p;
            let [u, v, w]: [[i64; 3]; 3] =
                [a, b, c].map(|q| std::array::from_fn(|i| q[i] - d[i]));
            let sign = u[0] * (v[1] * w[2] - v[2] * w[1])
                + u[1] * (v[2] * w[0] - v[0] * w[2])
                + u[2] * (v[0] * w[1] - v[1] * w[0]);
            let [a, b, c, d] = p.map(|q| q.map(|x| x as f64 * 0.375));
            prop_assert_eq!(i64::from(wide_orient3d(a, b, c, d)), sign.signum());
            let flat = |q: [f64; 3]| [q[0], q[1]];
            let turn = (u[0] * v[1] - u[1] * v[0]).signum();
            prop_assert_eq!(i64::from(wide_orient2d(flat(a), flat(b), flat(d))), turn);
        }
    }
}
