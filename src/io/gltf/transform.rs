//! Affine maps: where a node puts its mesh.

use crate::mesh::Affine;

/// The map of a matrix by columns; its last row says nothing.
pub(crate) fn from_columns(columns: &[f64; 16]) -> Affine {
    [0, 1, 2].map(|row| [0, 4, 8, 12].map(|column| columns[column + row]))
}

/// The map that scales, turns (x, y, z, w) and shifts, in this order.
pub(crate) fn from_parts(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> Affine {
    let length = rotation.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [x, y, z, w] =
        if length > 0.0 { rotation.map(|r| r / length) } else { [0.0, 0.0, 0.0, 1.0] };
    let turned = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    [0, 1, 2].map(|row| {
        let [a, b, c] = [0, 1, 2].map(|column| turned[row][column] * scale[column]);
        [a, b, c, translation[row]]
    })
}

pub(crate) fn is_finite(map: &Affine) -> bool {
    map.as_flattened().iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{apply, compose, mirrors};

    #[test]
    fn parts_apply_from_the_right() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        // A quarter turn about z takes x to y.
        let map = from_parts([10.0, 0.0, 0.0], [0.0, 0.0, half, half], [2.0, 3.0, 4.0]);
        let moved = apply(&map, [1.0, 1.0, 1.0]);
        for (found, expected) in moved.iter().zip([7.0, 2.0, 4.0]) {
            assert!((found - expected).abs() < 1e-12, "{moved:?}");
        }
        assert!(!mirrors(&map));
        assert!(mirrors(&from_parts([0.0; 3], [0.0, 0.0, 0.0, 1.0], [1.0, -1.0, 1.0])));
    }

    #[test]
    fn composition_is_application_one_after_the_other() {
        let outer = from_parts([1.0, 2.0, 3.0], [0.1, 0.2, 0.3, 0.9], [1.0, 2.0, 0.5]);
        let columns: [f64; 16] = std::array::from_fn(|i| (i * i % 7) as f64);
        let inner = from_columns(&columns);
        assert_eq!(inner[0], [columns[0], columns[4], columns[8], columns[12]]);
        let point = [0.3, -2.0, 5.0];
        let direct = apply(&compose(&outer, &inner), point);
        let in_steps = apply(&outer, apply(&inner, point));
        assert!(direct.iter().zip(in_steps).all(|(a, b)| (a - b).abs() < 1e-9));
    }
}
