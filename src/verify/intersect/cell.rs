//! The intersections whose boxes begin to overlap in one cell.
//!
//! In:         the parcels of a cell.
//! Out:        how many pairs of triangles intersect, and the first of them.
//! Memory:     about 230 bytes a triangle, 500 at most.

use crate::defect::Marks;
use crate::geom::signs::{Point, is_tame};
use crate::store::StoreError;
use crate::verify::intersect::arrival::Unpacked;
use crate::verify::intersect::boxes::NearBox;
use crate::verify::intersect::boxes::PLACE_BITS;
use crate::verify::intersect::filters::Normal;
use crate::verify::intersect::flat_fans::{FlatCorners, FlatFans};
use crate::verify::intersect::grid::{Grid, box_of, cell_of_key, extent_of};
use crate::verify::intersect::judge::{Found, Judge, WidePairs};
use crate::verify::intersect::near::NearPairs;
use crate::verify::intersect::pair::{Face, Sharing};
use crate::verify::intersect::parcels::Parcel;
use crate::verify::positions::{PositionKey, key_of};
use crate::verify::slots::{Name, Slots};

/// A cell of a grid, `1 << shift` cells of that grid wide.
#[derive(Clone, Copy)]
pub(crate) struct Cell {
    pub(crate) grid: Grid,
    pub(crate) shift: u32,
    pub(crate) at: [u32; 3],
}

impl Cell {
    /// Along which axes a corner lies in the cell, where the triangle that it belongs to does not
    /// lie before it.
    #[inline]
    fn holds(&self, corner: Point) -> [bool; 3] {
        std::array::from_fn(|i| self.grid.cell(i, corner[i]) >> self.shift == self.at[i])
    }

    /// Where cells were put together, a triangle lies in the parcels of several of them: it is
    /// taken from the first.
    #[inline]
    pub(crate) fn takes(&self, parcel: &Parcel, low: Point) -> bool {
        if self.shift == 0 || parcel.is_final == 1 {
            return true;
        }
        let at = cell_of_key(parcel.key);
        (0..3).all(|i| at[i] == self.grid.cell(i, low[i]).max(self.at[i] << self.shift))
    }

    /// A grid of 2^bits cells a side in this cell.
    pub(crate) fn grid_within(&self, bits: u32) -> Grid {
        self.grid.within(self.at, self.shift, bits)
    }
}

/// Work for one worker.
pub(crate) struct CellTask {
    /// The cell, and behind it those that it lies in.
    pub(crate) cells: Vec<Cell>,
    pub(crate) parcels: Vec<Parcel>,
    pub(crate) words: Vec<u32>,
    /// Whether vertices have numbers.
    pub(crate) named: bool,
    /// If the cell is too crowded for memory: only pairs of a triangle before this parcel and one
    /// from there on.
    pub(crate) border: Option<usize>,
    /// Whether its triangles count as progress.
    pub(crate) counts: bool,
}

/// Pairs that wait until they are tested together.
const MOST_QUEUED: usize = 512;

/// Room for a cell's triangles, used again and again.
#[derive(Default)]
pub(crate) struct Workbench {
    positions: Vec<Point>,
    tame: Vec<bool>,
    faces: Vec<Face>,
    normals: Vec<Normal>,
    flat: FlatFans,
    flat_corners: Vec<FlatCorners>,
    numbers: Vec<u64>,
    near: NearPairs,
    is_wide: Vec<bool>,
    places: Vec<u32>,
    begun: u64,
    /// Pairs to be tested, by the number of corners that they share.
    queues: [Vec<(u32, u32, Sharing)>; 4],
}

impl Workbench {
    /// Tests all pairs of a cell.
    pub(crate) fn join(
        &mut self,
        task: &CellTask,
        wide: &WidePairs,
        marks: Option<&Marks>,
    ) -> Result<Found, StoreError> {
        let border = if task.named {
            self.unpack(task, |unpacked, at, _| unpacked.names[at])
        } else {
            self.unpack(task, |_, _, position| -> PositionKey { key_of(position) })
        };
        let crosses = task.border.is_some();
        let Self {
            positions,
            faces,
            normals,
            flat,
            flat_corners,
            numbers,
            near,
            is_wide,
            queues,
            begun,
            ..
        } = self;
        flat.find(faces, normals, positions);
        flat_corners.clear();
        flat_corners
            .extend((0..).zip(&*faces).map(|(at, face)| FlatCorners::of(at, face, &flat.is_flat)));
        let mut judge = Judge {
            positions,
            faces,
            numbers,
            is_wide,
            found: Found::new(),
            kept: Vec::new(),
            wide,
            marks,
            failure: None,
        };
        let leaves_out = |a: u32, b: u32| {
            flat_corners[a as usize].share(&flat_corners[b as usize])
                || crosses && ((a as usize) < border) == ((b as usize) < border)
        };
        near.each(&mut |a, b| {
            if leaves_out(a, b) {
                return;
            }
            let sharing = Sharing::of(&faces[a as usize], &faces[b as usize]);
            let queue = &mut queues[sharing.count()];
            queue.push((a, b, sharing));
            if queue.len() == MOST_QUEUED {
                judge.judge(queue);
            }
        });
        queues.iter_mut().for_each(|queue| judge.judge(queue));
        judge.hand_on();
        let Judge { mut found, failure, .. } = judge;
        found.triangles = if task.counts { *begun } else { 0 };
        failure.map_or(Ok(found), Err)
    }

    /// Lists the triangles, with one number for each vertex; how many lie before the border.
    fn unpack<N: Name>(
        &mut self,
        task: &CellTask,
        name_of: impl Fn(&Unpacked<'_>, usize, Point) -> N,
    ) -> usize {
        let Self { positions, tame, faces, normals, numbers, near, is_wide, places, begun, .. } =
            self;
        positions.clear();
        tame.clear();
        faces.clear();
        normals.clear();
        numbers.clear();
        near.boxes.clear();
        is_wide.clear();
        *begun = 0;
        let mut slots = Slots::<N>::with_room(task.parcels.iter().map(Parcel::vertices).sum());
        let grid = task.cells[0].grid_within(PLACE_BITS);
        let mut words = &task.words[..];
        let mut before_border = usize::MAX;
        for (at, parcel) in task.parcels.iter().enumerate() {
            if task.border == Some(at) {
                before_border = faces.len();
            }
            let (own, others) = words.split_at(parcel.words(task.named));
            words = others;
            let unpacked = parcel.unpack(task.named, own);
            places.clear();
            for (at, position) in unpacked.positions().enumerate() {
                let next = positions.len() as u32;
                let place = slots.find_or_enter(name_of(&unpacked, at, position), next);
                if place == next {
                    positions.push(position);
                    tame.push(is_tame(&position));
                }
                places.push(place);
            }
            for (number, corners) in unpacked.triangles() {
                let vertices = corners.map(|corner| places[corner]);
                let corners = vertices.map(|vertex| positions[vertex as usize]);
                let [low, high] = box_of(&corners);
                if !task.cells[0].takes(parcel, low) {
                    continue;
                }
                let mut starts = [true; 3];
                for cell in &task.cells {
                    let within = cell.holds(low);
                    starts = std::array::from_fn(|i| starts[i] && within[i]);
                }
                *begun += u64::from(starts == [true; 3]);
                let wide = task.cells[0].grid.is_wide(extent_of(&[low, high]));
                if wide {
                    // It may be missing in the cell where an overlap starts, so every cell counts.
                    starts = [true; 3];
                }
                is_wide.push(wide);
                let range = grid.range(low, high);
                near.boxes.push(NearBox::new(range.low, range.high, starts));
                let is_tame = vertices.iter().all(|&vertex| tame[vertex as usize]);
                let normal = Normal::of(corners);
                faces.push(Face::of(vertices, &normal, is_tame));
                normals.push(normal);
                numbers.push(number);
            }
        }
        before_border.min(faces.len())
    }
}
