//! A mesh that a page can carry: vertices clustered until few enough triangles are left.
//!
//! In:         a mesh as a stream, and the box that is looked at.
//! Out:        a [`LightMesh`]: whole, where it has few triangles; else its shape on a coarser grid.
//! Invariant:  the same whatever the order of the hash tables: sums are of integers, lists are sorted.
//! Units:      steps of a grid of 2^16 over the longest side of the box.
//! Memory:     the triangles that are asked for at most, 150 bytes each; one batch of the source.
//! Source:     J. Rossignac, P. Borrel, Multi-resolution 3D approximations, 1993 (clustering on a
//!             grid); P. Lindstrom, Out-of-core simplification, 2000 (in one pass over the stream).

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};

use glam::DVec3;

use crate::mesh::{Discarded, LengthUnit, Material, MeshSource, TriangleBatch};
use crate::monitor::Monitor;
use crate::report::preview::{OpenSource, PreviewError, Side};

/// Steps of the grid.
const STEPS: f64 = 65_535.0;
/// Most triangles of a light mesh: with three corners each, numbers of vertices fit in 16 bits.
pub(crate) const MOST_TRIANGLES: usize = 21_000;

/// Triangles for each cell that a surface meets, on average: two where it runs along the grid, and less
/// than this where it is askew.
const TRIANGLES_PER_CELL: f64 = 3.0;

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
        let failed = |source| PreviewError::Source { side, source };
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut source = open().map_err(failed)?;
        let mut batch = TriangleBatch::default();
        while source.next_batch(&mut batch).map_err(failed)? {
            if monitor.cancelled() {
                return Err(PreviewError::Cancelled);
            }
            for corners in &batch.corners {
                let corners = corners.map(DVec3::from_array);
                if corners.iter().all(|corner| corner.is_finite()) {
                    let [a, b, c] = corners;
                    (lo, hi) = (lo.min(a).min(b).min(c), hi.max(a).max(b).max(c));
                }
            }
        }
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

    /// The place of so many steps.
    pub(crate) fn place(&self, steps: [u16; 3]) -> [f64; 3] {
        (self.lo + DVec3::from(steps.map(f64::from)) / STEPS * self.side).into()
    }

    /// The steps of a place; `None` outside of the cube.
    fn steps(&self, place: DVec3) -> Option<[u16; 3]> {
        let share = (place - self.lo) / self.side;
        let is_within = share.cmpge(DVec3::ZERO).all() && share.cmple(DVec3::ONE).all();
        is_within.then(|| (share * STEPS).round().to_array().map(|step| step as u16))
    }
}

/// What is known of a mesh before it is read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    /// How many triangles it has.
    pub(crate) triangles: u64,
    /// Their area, model units squared.
    pub(crate) area: f64,
}

/// A light mesh that comes to be while somebody else reads the mesh.
pub(crate) struct Lightening {
    cube: Cube,
    clusters: Clusters,
    of_triangles: u64,
}

impl Lightening {
    /// Of at most so many triangles; what lies outside of the cube is left out. With what is known of
    /// the mesh the first grid is about right; else it begins with the finest, and is halved.
    pub(crate) fn new(cube: Cube, most_triangles: usize, known: Option<Known>) -> Self {
        let most_triangles = most_triangles.min(MOST_TRIANGLES);
        let width = match known {
            Some(known) if known.triangles > most_triangles as u64 => {
                let cells = most_triangles as f64 / TRIANGLES_PER_CELL;
                let width = (known.area / cells).sqrt() / cube.side * STEPS;
                if width.is_finite() { width.clamp(1.0, STEPS) as u32 } else { 1 }
            }
            _ => 1,
        };
        Self { cube, clusters: Clusters::new(most_triangles, width), of_triangles: 0 }
    }

    /// Takes the next triangles.
    pub(crate) fn hear(&mut self, batch: &TriangleBatch) {
        self.of_triangles += batch.len() as u64;
        for corners in &batch.corners {
            let steps = corners.map(|corner| self.cube.steps(DVec3::from_array(corner)));
            if let [Some(a), Some(b), Some(c)] = steps {
                self.clusters.add([a, b, c]);
            }
        }
    }

    /// What came of it.
    pub(crate) fn finish(self) -> LightMesh {
        self.clusters.finish(self.of_triangles)
    }
}

/// A mesh of which a light one is made as it is read.
pub(crate) struct Overheard<'h, E> {
    /// The mesh.
    pub(crate) source: Box<dyn MeshSource<Error = E> + 'h>,
    /// Who hears it.
    pub(crate) lightening: &'h RefCell<Lightening>,
}

impl<E: std::error::Error> MeshSource for Overheard<'_, E> {
    type Error = E;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, E> {
        let is_more = self.source.next_batch(batch)?;
        if is_more {
            self.lightening.borrow_mut().hear(batch);
        }
        Ok(is_more)
    }
    fn material(&mut self, number: u32) -> Result<Material, E> {
        self.source.material(number)
    }
    fn unit(&self) -> Option<LengthUnit> {
        self.source.unit()
    }
    fn discarded(&self) -> Discarded {
        self.source.discarded()
    }
    fn bytes_read(&self) -> u64 {
        self.source.bytes_read()
    }
    fn vertex_count(&self) -> Option<u64> {
        self.source.vertex_count()
    }
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

    fn finish(self, of_triangles: u64) -> LightMesh {
        let mut triangles: Vec<[Cell; 3]> = self.triangles.into_iter().collect();
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
        fn discarded(&self) -> Discarded {
            Discarded::default()
        }
        fn bytes_read(&self) -> u64 {
            0
        }
        fn vertex_count(&self) -> Option<u64> {
            None
        }
    }

    fn open(triangles: &[Corners]) -> Box<dyn MeshSource<Error = std::io::Error>> {
        Box::new(Listed(triangles.to_vec()))
    }

    fn light(triangles: &[Corners], most: usize, known: Option<Known>) -> LightMesh {
        let cube = Cube::around(Side::Output, &|| Ok(open(triangles)), &Void);
        let cube = cube.expect("no error").expect("a box");
        let lightening = RefCell::new(Lightening::new(cube, most, known));
        let mut overheard = Overheard { source: open(triangles), lightening: &lightening };
        let mut batch = TriangleBatch::default();
        while overheard.next_batch(&mut batch).expect("no error") {}
        drop(overheard);
        lightening.into_inner().finish()
    }

    #[test]
    fn a_small_mesh_is_whole_and_a_large_one_is_as_small_as_asked_for() {
        let ball = sphere([1.0, 2.0, 3.0], 4.0, 24);
        let whole = light(&ball, MOST_TRIANGLES, None);
        assert_eq!(whole.triangles.len(), ball.len());
        assert_eq!(2 * whole.vertices.len(), ball.len() + 4, "closed, without handles");
        let few = light(&ball, 200, None);
        assert!((50..=200).contains(&few.triangles.len()), "{}", few.triangles.len());
        assert_eq!(few.of_triangles, ball.len() as u64);
        assert_eq!(few, light(&ball, 200, None), "no order of a hash table shows");
    }

    #[test]
    fn what_is_known_before_makes_the_grid_about_right() {
        for rings in [24, 40] {
            let ball = sphere([0.0; 3], 1.0, rings);
            let known = Known { triangles: ball.len() as u64, area: 4.0 * std::f64::consts::PI };
            for most in [300, 900] {
                let found = light(&ball, most, Some(known)).triangles.len();
                assert!((most / 3..=most).contains(&found), "{found} of {most}");
            }
            let whole = light(&ball, MOST_TRIANGLES, Some(known));
            assert_eq!(whole.triangles.len(), ball.len());
        }
    }

    #[test]
    fn broken_corners_are_left_out() {
        let mut triangles = sphere([0.0; 3], 1.0, 6);
        let sound = light(&triangles, 1000, None);
        triangles.push([[f64::NAN; 3], [0.0; 3], [1.0; 3]]);
        assert_eq!(light(&triangles, 1000, None).triangles, sound.triangles);
        let nothing = Cube::around(Side::Output, &|| Ok(open(&[])), &Void);
        assert_eq!(nothing.expect("no error"), None);
    }
}
