//! A mesh that a page can carry: vertices clustered until few enough triangles are left.
//!
//! In:         a mesh as a stream, and the box that is looked at.
//! Out:        a [`LightMesh`]: whole, where it has few triangles; else its shape on a coarser grid.
//!             The grid is halved until that does, and then made as fine as seems possible.
//! Invariant:  the same whatever the order of the hash tables: sums are of integers, lists are sorted.
//! Units:      steps of a grid of 2^16 over the longest side of the box.
//! Memory:     the triangles that are asked for at most, 150 bytes each; one batch of the source.
//! Source:     J. Rossignac, P. Borrel, Multi-resolution 3D approximations, 1993 (clustering on a
//!             grid); P. Lindstrom, Out-of-core simplification, 2000 (in one pass over the stream).

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use crate::mesh::TriangleBatch;
use crate::monitor::Monitor;
use crate::report::preview::{OpenSource, PreviewError, Side};

/// Steps of the grid.
const STEPS: f64 = 65_535.0;
/// Most triangles of a light mesh: with three corners each, numbers of vertices fit in 16 bits.
pub(crate) const MOST_TRIANGLES: usize = 21_000;

/// With this share of the triangles that there may be, a mesh is as fine as can be expected.
const WELL_FILLED: f64 = 0.7;
/// The finer grid is coarser than it might be by this factor: surfaces are not all alike.
const FINER_MARGIN: f64 = 1.06;

/// A cube that light meshes lie in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cube {
    lo: DVec3,
    side: f64,
}

/// A mesh of at most [`MOST_TRIANGLES`].
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LightMesh {
    /// Places of vertices, in steps from the cube's lowest corner.
    pub(crate) vertices: Vec<[u16; 3]>,
    /// Their numbers, three by three.
    pub(crate) triangles: Vec<[u16; 3]>,
    /// Triangles that the stream had.
    pub(crate) of_triangles: u64,
}

impl Cube {
    /// Around the finite corners of a mesh; `None` where there are none.
    ///
    /// # Errors
    /// The source fails, or the caller asks to stop.
    pub(crate) fn around<E: std::error::Error>(
        side: Side,
        open: &OpenSource<'_, E>,
        monitor: &dyn Monitor,
    ) -> Result<Option<Self>, PreviewError<E>> {
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        each_triangle(side, open, monitor, |corners| {
            for corner in corners {
                (lo, hi) = (lo.min(corner), hi.max(corner));
            }
        })?;
        Ok(Self::of(lo, hi))
    }

    /// Around a box; `None` where it holds nothing.
    pub(crate) fn of(lo: DVec3, hi: DVec3) -> Option<Self> {
        let length = (hi - lo).max_element();
        if !length.is_finite() {
            return None;
        }
        let length = if length > 0.0 { length } else { 1.0 };
        // A mesh of the same box may reach out of it by walls that became thicker.
        let middle = lo * 0.5 + hi * 0.5;
        let side = 1.25 * length;
        Some(Self { lo: middle - DVec3::splat(0.5 * side), side })
    }

    /// The steps of a place; `None` outside of the cube.
    fn steps(&self, place: DVec3) -> Option<[u16; 3]> {
        let share = (place - self.lo) / self.side;
        let is_within = share.cmpge(DVec3::ZERO).all() && share.cmple(DVec3::ONE).all();
        is_within.then(|| (share * STEPS).round().to_array().map(|step| step as u16))
    }
}

/// Reads a mesh into a light one. What lies outside of the cube is left out.
///
/// # Errors
/// The source fails, or the caller asks to stop.
pub(crate) fn lighten<E: std::error::Error>(
    side: Side,
    open: &OpenSource<'_, E>,
    cube: &Cube,
    most_triangles: usize,
    monitor: &dyn Monitor,
) -> Result<LightMesh, PreviewError<E>> {
    let most_triangles = most_triangles.min(MOST_TRIANGLES);
    let cluster = |width| {
        let mut clusters = Clusters::new(most_triangles, width);
        let of_triangles = each_triangle(side, open, monitor, |corners| {
            if let [Some(a), Some(b), Some(c)] = corners.map(|corner| cube.steps(corner)) {
                clusters.add([a, b, c]);
            }
        })?;
        Ok::<_, PreviewError<E>>((clusters.finish(of_triangles), clusters.width))
    };
    let (halved, width) = cluster(1)?;
    let room = halved.triangles.len() as f64 / most_triangles.max(1) as f64;
    if width == 1 || room > WELL_FILLED {
        return Ok(halved);
    }
    // A surface has as many cells as the square of their number along an axis.
    let finer = (f64::from(width) * room.sqrt() * FINER_MARGIN).ceil() as u32;
    let (fine, _) = cluster(finer.max(1))?;
    // Where that was too fine it was made coarser, and may have fewer triangles than before.
    Ok(if fine.triangles.len() > halved.triangles.len() { fine } else { halved })
}

/// Calls `take` for the finite triangles; how many there are in all.
fn each_triangle<E: std::error::Error>(
    side: Side,
    open: &OpenSource<'_, E>,
    monitor: &dyn Monitor,
    mut take: impl FnMut([DVec3; 3]),
) -> Result<u64, PreviewError<E>> {
    let failed = |source| PreviewError::Source { side, source };
    let mut source = open().map_err(failed)?;
    let mut batch = TriangleBatch::default();
    let mut triangles = 0;
    while source.next_batch(&mut batch).map_err(failed)? {
        if monitor.cancelled() {
            return Err(PreviewError::Cancelled);
        }
        triangles += batch.len() as u64;
        for corners in &batch.corners {
            let corners = corners.map(DVec3::from_array);
            if corners.iter().all(|corner| corner.is_finite()) {
                take(corners);
            }
        }
    }
    Ok(triangles)
}

/// A cell of the grid: its steps over the width of a cell.
type Cell = [u16; 3];

/// What lies in a cell.
#[derive(Clone, Copy, Default)]
struct Place {
    sum: [u64; 3],
    count: u64,
}

/// Triangles between cells. Where they are too many, cells become eightfold.
struct Clusters {
    most_triangles: usize,
    /// Steps along a side of a cell.
    width: u32,
    places: HashMap<Cell, Place>,
    triangles: HashSet<[Cell; 3]>,
}

impl Clusters {
    fn new(most_triangles: usize, width: u32) -> Self {
        Self { most_triangles, width, places: HashMap::new(), triangles: HashSet::new() }
    }

    fn add(&mut self, corners: [[u16; 3]; 3]) {
        let cells = corners.map(|corner| corner.map(|step| (u32::from(step) / self.width) as u16));
        let Some(triangle) = in_order(cells) else { return };
        for (cell, corner) in cells.into_iter().zip(corners) {
            let place = self.places.entry(cell).or_default();
            place.count += 1;
            place.sum = std::array::from_fn(|axis| place.sum[axis] + u64::from(corner[axis]));
        }
        self.triangles.insert(triangle);
        while self.triangles.len() > self.most_triangles {
            self.coarsen();
        }
    }

    fn coarsen(&mut self) {
        self.width *= 2;
        let up = |cell: Cell| cell.map(|step| step >> 1);
        let triangles = std::mem::take(&mut self.triangles);
        self.triangles = triangles.into_iter().filter_map(|t| in_order(t.map(up))).collect();
        for (cell, place) in std::mem::take(&mut self.places) {
            let sum = self.places.entry(up(cell)).or_default();
            sum.count += place.count;
            sum.sum = std::array::from_fn(|axis| sum.sum[axis] + place.sum[axis]);
        }
    }

    fn finish(&self, of_triangles: u64) -> LightMesh {
        let mut triangles: Vec<[Cell; 3]> = self.triangles.iter().copied().collect();
        triangles.sort_unstable();
        let mut cells: Vec<Cell> = triangles.iter().flatten().copied().collect();
        cells.sort_unstable();
        cells.dedup();
        let number = |cell: &Cell| cells.binary_search(cell).expect("it is in the list") as u16;
        let triangles = triangles.iter().map(|triangle| triangle.each_ref().map(number)).collect();
        let mean = |cell: &Cell| {
            let place = self.places.get(cell).copied().unwrap_or_default();
            place.sum.map(|sum| (sum / place.count.max(1)) as u16)
        };
        LightMesh { vertices: cells.iter().map(mean).collect(), triangles, of_triangles }
    }
}

/// The triangle with its least cell first, as it runs; `None` where two of its cells are one.
fn in_order([a, b, c]: [Cell; 3]) -> Option<[Cell; 3]> {
    if a == b || b == c || c == a {
        None
    } else if a < b && a < c {
        Some([a, b, c])
    } else if b < c {
        Some([b, c, a])
    } else {
        Some([c, a, b])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::MeshSource;
    use crate::mesh::shapes::{Corners, sphere};
    use crate::monitor::Void;

    struct Listed(Vec<Corners>);

    impl MeshSource for Listed {
        type Error = std::io::Error;

        fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, std::io::Error> {
            batch.clear();
            for corners in self.0.drain(..self.0.len().min(64)) {
                batch.push(corners, 0, 0, 0);
            }
            Ok(!batch.is_empty())
        }
        fn discarded(&self) -> crate::mesh::Discarded {
            crate::mesh::Discarded::default()
        }
        fn bytes_read(&self) -> u64 {
            0
        }
        fn vertex_count(&self) -> Option<u64> {
            None
        }
    }

    fn light(triangles: &[Corners], most: usize) -> LightMesh {
        let open = || Ok(Box::new(Listed(triangles.to_vec())) as Box<dyn MeshSource<Error = _>>);
        let cube = Cube::around(Side::Output, &open, &Void).expect("no error").expect("a box");
        lighten(Side::Output, &open, &cube, most, &Void).expect("no error")
    }

    #[test]
    fn a_small_mesh_is_whole_and_a_large_one_is_as_small_as_asked_for() {
        let ball = sphere([1.0, 2.0, 3.0], 4.0, 24);
        let whole = light(&ball, MOST_TRIANGLES);
        assert_eq!(whole.triangles.len(), ball.len());
        assert_eq!(2 * whole.vertices.len(), ball.len() + 4, "closed, without handles");
        let few = light(&ball, 200);
        assert!((100..=200).contains(&few.triangles.len()), "{}", few.triangles.len());
        assert_eq!(few.of_triangles, ball.len() as u64);
        assert_eq!(few, light(&ball, 200), "no order of a hash table shows");
    }

    #[test]
    fn broken_corners_are_left_out() {
        let mut triangles = sphere([0.0; 3], 1.0, 6);
        let sound = light(&triangles, 1000);
        triangles.push([[f64::NAN; 3], [0.0; 3], [1.0; 3]]);
        assert_eq!(light(&triangles, 1000).triangles, sound.triangles);
        let nothing =
            || Ok(Box::new(Listed(Vec::new())) as Box<dyn MeshSource<Error = std::io::Error>>);
        assert_eq!(Cube::around(Side::Output, &nothing, &Void).expect("no error"), None);
    }
}
