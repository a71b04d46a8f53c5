//! Triangles on their way into cells, as they come and as a parcel gives them back.
//!
//! Invariant:  what is taken from a parcel is what was put into it.

use crate::geom::signs::Point;
use crate::store::StoreError;
use crate::verify::intersect::grid::box_of;
use crate::verify::intersect::parcels::{MOST_VERTICES, POSITION_WORDS, TRIANGLE_WORDS};

/// A triangle on its way into cells.
#[derive(Clone, Copy)]
pub(crate) struct Arrival<'c> {
    /// Its number in the file.
    pub(crate) number: u64,
    /// The numbers of its vertices, in files that have them.
    pub(crate) names: Option<[u32; 3]>,
    /// Its corners.
    pub(crate) corners: &'c [Point; 3],
    /// The box around it.
    pub(crate) bounds: [Point; 2],
}

impl<'c> Arrival<'c> {
    #[inline]
    pub(crate) fn new(number: u64, names: Option<[u32; 3]>, corners: &'c [Point; 3]) -> Self {
        Self { number, names, corners, bounds: box_of(corners) }
    }
}

/// A parcel's content.
pub(crate) struct Unpacked<'w> {
    positions: &'w [u32],
    /// The numbers of its vertices; none in files without.
    pub(crate) names: &'w [u32],
    triangles: &'w [u32],
    first: u64,
}

impl<'w> Unpacked<'w> {
    pub(crate) fn new(
        positions: &'w [u32],
        names: &'w [u32],
        triangles: &'w [u32],
        first: u64,
    ) -> Self {
        Self { positions, names, triangles, first }
    }

    /// The positions of its vertices.
    pub(crate) fn positions(&self) -> impl Iterator<Item = Point> + use<'w> {
        self.positions.chunks_exact(POSITION_WORDS).map(|words| {
            std::array::from_fn(|i| {
                let (low, high) = (u64::from(words[2 * i]), u64::from(words[2 * i + 1]));
                // The words of f64 as they lie in memory.
                if cfg!(target_endian = "little") {
                    f64::from_bits(low | high << 32)
                } else {
                    f64::from_bits(high | low << 32)
                }
            })
        })
    }

    /// The numbers of its triangles and the places of their corners in the lists of vertices.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = (u64, [usize; 3])> + use<'w> {
        let first = self.first;
        self.triangles.chunks_exact(TRIANGLE_WORDS).map(move |words| {
            let corners = [0, 10, 20].map(|bit| (words[0] >> bit) as usize % MOST_VERTICES);
            (first + u64::from(words[1]), corners)
        })
    }

    /// Shows its triangles as they arrived.
    pub(crate) fn try_each_arrival(
        &self,
        mut visit: impl FnMut(&Arrival<'_>) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let positions: Vec<Point> = self.positions().collect();
        let names = self.names;
        self.triangles().try_for_each(|(number, places)| {
            let corners = places.map(|place| positions[place]);
            let names = (!names.is_empty()).then(|| places.map(|place| names[place]));
            visit(&Arrival::new(number, names, &corners))
        })
    }
}
