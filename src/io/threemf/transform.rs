//! Affine maps as 3MF writes them: four rows of three numbers, points as rows from the left.
//!
//! Memory: 96 bytes each.

use bytemuck::{Pod, Zeroable};

use crate::io::numbers::{parse_number, push_number};
use crate::mesh::Affine;

/// Where an object stands in another one, or in the build.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Transform {
    rows: [[f64; 3]; 4],
}

impl Transform {
    pub(super) const IDENTITY: Self =
        Self { rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]] };

    /// Twelve numbers between blanks, and nothing else.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let mut transform = Self::IDENTITY;
        let mut words = text.split_ascii_whitespace();
        for number in transform.rows.as_flattened_mut() {
            *number = parse_number(words.next()?.as_bytes())?;
        }
        words.next().is_none().then_some(transform)
    }

    /// The same as columns from the right.
    pub(super) fn to_affine(self) -> Affine {
        [0, 1, 2].map(|axis| [0, 1, 2, 3].map(|row| self.rows[row][axis]))
    }

    /// The map that `to_affine` gives.
    pub(super) fn from_affine(map: &Affine) -> Self {
        Self { rows: [0, 1, 2, 3].map(|row| [0, 1, 2].map(|axis| map[axis][row])) }
    }

    /// Appends what [`Transform::parse`] reads.
    pub(super) fn push(&self, text: &mut Vec<u8>) {
        for (at, &number) in self.rows.as_flattened().iter().enumerate() {
            if at > 0 {
                text.push(b' ');
            }
            push_number(text, number);
        }
    }

    /// This one first, then `outer`.
    pub(super) fn then(&self, outer: &Self) -> Self {
        if *self == Self::IDENTITY {
            return *outer;
        }
        if *outer == Self::IDENTITY {
            return *self;
        }
        let mut rows = self.rows;
        for (number, row) in rows.iter_mut().enumerate() {
            let from = *row;
            for (axis, value) in row.iter_mut().enumerate() {
                let column = |i: usize| outer.rows[i][axis];
                let turned = from[0] * column(0) + from[1] * column(1) + from[2] * column(2);
                *value = if number == 3 { turned + column(3) } else { turned };
            }
        }
        Self { rows }
    }

    /// Where a point goes. The identity leaves every bit of it.
    #[inline]
    pub(super) fn apply(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        if *self == Self::IDENTITY {
            return [x, y, z];
        }
        let [a, b, c, d] = &self.rows;
        std::array::from_fn(|axis| x * a[axis] + y * b[axis] + z * c[axis] + d[axis])
    }

    /// Whether it turns left hands into right ones.
    pub(super) fn mirrors(&self) -> bool {
        let [a, b, c, _] = &self.rows;
        let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
        a[0] * minor(1, 2) - a[1] * minor(0, 2) + a[2] * minor(0, 1) < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inner_map_comes_first() {
        let turn = Transform::parse("0 1 0 -1 0 0 0 0 1 0 0 0").expect("twelve numbers");
        let shift = Transform::parse(" 2 0 0\t0 2 0 0 0 2 10 20 30 ").expect("twelve numbers");
        let point = [1.0, 2.0, 3.0];
        assert_eq!(turn.apply(point), [-2.0, 1.0, 3.0]);
        assert_eq!(turn.then(&shift).apply(point), shift.apply(turn.apply(point)));
        assert_eq!(turn.then(&shift).apply(point), [6.0, 22.0, 36.0]);
        assert_eq!(Transform::IDENTITY.then(&shift), shift);
    }

    #[test]
    fn mirrors_are_told_and_bad_texts_refused() {
        assert!(Transform::parse("-1 0 0 0 1 0 0 0 1 0 0 0").expect("numbers").mirrors());
        assert!(!Transform::parse("-1 0 0 0 -1 0 0 0 1 0 0 0").expect("numbers").mirrors());
        assert!(!Transform::IDENTITY.mirrors());
        for text in
            ["", "1 0 0 0 1 0 0 0 1 0 0", "1 0 0 0 1 0 0 0 1 0 0 0 0", "1 0 0 0 1 0 0 0 1 0 0 x"]
        {
            assert_eq!(Transform::parse(text), None, "{text}");
        }
        let point = [-0.0, f64::INFINITY, f64::NAN];
        assert_eq!(Transform::IDENTITY.apply(point).map(f64::to_bits), point.map(f64::to_bits));
    }
}
