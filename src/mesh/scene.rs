//! Where parts stand: the nodes of a scene, and affine maps between them.

/// An affine map: rows of three columns and a shift.
pub type Affine = [[f64; 4]; 3];

/// The map that moves nothing.
pub const IDENTITY: Affine = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// What a reader makes of the places of parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Placement {
    /// Every part as often as it stands in the scene, where it stands.
    #[default]
    InScene,
    /// Every part once, in its own coordinates; the nodes of [`crate::mesh::MeshSource::node`] tell
    /// where it stands. Formats without scenes have no nodes: their parts stand where they are.
    ByItself,
}

/// A place in a scene: of a part, of other nodes, or of both.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneNode {
    /// As written in the file; may be empty.
    pub name: String,
    /// The node that it is in, which has a lower number.
    pub parent: Option<u32>,
    /// From its coordinates into those of its parent, or of the scene. Model units.
    pub map: Affine,
    /// What stands here, by its number.
    pub part: Option<u32>,
}

/// First `inner`, then `outer`.
#[must_use]
pub fn compose(outer: &Affine, inner: &Affine) -> Affine {
    if *outer == IDENTITY {
        return *inner;
    }
    outer.map(|[a, b, c, shift]| {
        let row = [0, 1, 2, 3].map(|k| a * inner[0][k] + b * inner[1][k] + c * inner[2][k]);
        [row[0], row[1], row[2], row[3] + shift]
    })
}

/// Where a point goes.
#[inline]
#[must_use]
pub fn apply(map: &Affine, [x, y, z]: [f64; 3]) -> [f64; 3] {
    map.map(|[a, b, c, shift]| a * x + b * y + c * z + shift)
}

/// Whether the map turns left into right.
#[must_use]
pub fn mirrors(map: &Affine) -> bool {
    let [[a, b, c, _], [d, e, f, _], [g, h, i, _]] = *map;
    a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0.0
}

/// The largest factor by which the map makes a length along an axis longer.
#[must_use]
pub fn stretch(map: &Affine) -> f64 {
    let column = |k: usize| map.iter().map(|row| row[k] * row[k]).sum::<f64>().sqrt();
    [0, 1, 2].map(column).into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stretch_is_that_of_the_longest_axis() {
        let map = [[0.0, -2.0, 0.0, 5.0], [3.0, 0.0, 0.0, 7.0], [0.0, 0.0, 0.5, 9.0]];
        assert_eq!(stretch(&map), 3.0);
        assert_eq!(apply(&map, [1.0, 1.0, 2.0]), [3.0, 10.0, 10.0]);
        assert_eq!(compose(&map, &IDENTITY), map);
    }
}
