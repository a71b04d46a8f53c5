//! What can be seen from outside, in a grid of 128 cells a side.
//!
//! In:         triangles, one by one; then no more.
//! Out:        whether a straight way leads out from a cell of a triangle.
//! Invariant:  a way is free only if no triangle meets any of its cells but the first, along the 26
//!             directions to the neighbours of a cell. Gaps narrower than a cell are closed.
//! Memory:     1 MiB.

/// Cells along an axis, as many as a row has bits.
const SIDE: usize = 128;
/// Cells that are free on every side of the model.
const MARGIN: f64 = 2.0;
/// Triangles are this much thicker than they are, cells: rounding must not open a wall.
const SLACK: f64 = 1e-6;

type Point = [f64; 3];
/// Both ends included.
type Range = [[usize; 3]; 2];

/// Cells by rows along x: the row at y and z is number `SIDE * z + y`.
struct Rows(Vec<u128>);

impl Rows {
    fn new() -> Self {
        Self(vec![0; SIDE * SIDE])
    }

    fn get(&self, y: usize, z: usize) -> u128 {
        self.0[SIDE * z + y]
    }

    fn holds(&self, [x, y, z]: [usize; 3]) -> bool {
        self.get(y, z) >> x & 1 == 1
    }
}

/// The grid while triangles are entered.
pub(crate) struct Sight {
    middle: Point,
    /// Cells per model unit.
    scale: f64,
    filled: Rows,
    /// Cells from which a straight way leads out.
    seen: Rows,
}

impl Sight {
    /// An empty grid around a model; `None` where the model has no extent.
    pub(crate) fn new([low, high]: [Point; 2]) -> Option<Self> {
        let middle: Point = std::array::from_fn(|axis| low[axis].midpoint(high[axis]));
        let half = (0..3).map(|axis| high[axis] - middle[axis]).fold(0.0, f64::max);
        let scale = (SIDE as f64 / 2.0 - MARGIN) / half;
        let is_sound = half > 0.0 && scale.is_finite() && scale > 0.0;
        is_sound.then(|| Self { middle, scale, filled: Rows::new(), seen: Rows::new() })
    }

    fn in_cells(&self, corners: &[Point; 3]) -> [Point; 3] {
        corners.map(|corner| {
            let at =
                |axis: usize| (corner[axis] - self.middle[axis]) * self.scale + SIDE as f64 / 2.0;
            std::array::from_fn(at)
        })
    }

    /// Enters a triangle that stops the view.
    pub(crate) fn fill(&mut self, corners: &[Point; 3]) {
        let corners = self.in_cells(corners);
        let filled = &mut self.filled;
        each_cell(&corners, |[x, y, z]| {
            filled.0[SIDE * z + y] |= 1 << x;
            true
        });
    }

    /// Ends the input and looks along all directions.
    pub(crate) fn look(&mut self) {
        for direction in 0..27 {
            let step: [i32; 3] = [direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1];
            if step != [0; 3] {
                self.look_along(step);
            }
        }
    }

    /// Notes the cells from which the way along `step` is free, whatever is in them.
    fn look_along(&mut self, step: [i32; 3]) {
        // Those that are free themselves, and their way is.
        let mut free = Rows::new();
        for i in 0..SIDE {
            for j in 0..SIDE {
                let y = if step[1] > 0 { SIDE - 1 - i } else { i };
                let z = if step[2] > 0 { SIDE - 1 - j } else { j };
                let filled = self.filled.get(y, z);
                let way = if step[1] == 0 && step[2] == 0 {
                    // All from the last filled cell on.
                    let all = !0_u128;
                    match step[0] {
                        1 => all << (SIDE as u32 - 1).saturating_sub(filled.leading_zeros()),
                        _ => all >> (SIDE as u32 - 1).saturating_sub(filled.trailing_zeros()),
                    }
                } else {
                    let (next_y, next_z) = (y as i32 + step[1], z as i32 + step[2]);
                    let is_in = |at: i32| (0..SIDE as i32).contains(&at);
                    let next = match is_in(next_y) && is_in(next_z) {
                        true => free.get(next_y as usize, next_z as usize),
                        false => !0,
                    };
                    match step[0] {
                        1 => next >> 1 | 1 << (SIDE - 1),
                        -1 => next << 1 | 1,
                        _ => next,
                    }
                };
                free.0[SIDE * z + y] = way & !filled;
                self.seen.0[SIDE * z + y] |= way;
            }
        }
    }

    /// Whether something of a triangle may be seen.
    pub(crate) fn sees(&self, corners: &[Point; 3]) -> bool {
        let corners = self.in_cells(corners);
        !each_cell(&corners, |cell| !self.seen.holds(cell))
    }
}

/// Shows the cells that a triangle meets until one says `false`; whether all were shown.
fn each_cell(corners: &[Point; 3], mut visit: impl FnMut([usize; 3]) -> bool) -> bool {
    // The conversion itself stops at zero.
    let cell = |x: f64| (x as usize).min(SIDE - 1);
    let least = |axis: usize| corners.iter().map(|p| p[axis]).fold(f64::MAX, f64::min) - SLACK;
    let most = |axis: usize| corners.iter().map(|p| p[axis]).fold(f64::MIN, f64::max) + SLACK;
    let whole: Range =
        [[0, 1, 2].map(|axis| cell(least(axis))), [0, 1, 2].map(|axis| cell(most(axis)))];
    let mut ranges = vec![whole];
    while let Some([low, high]) = ranges.pop() {
        if low == high {
            if (low == whole[0] && high == whole[1] || meets(corners, [low, high])) && !visit(low) {
                return false;
            }
            continue;
        }
        if !meets(corners, [low, high]) {
            continue;
        }
        let axis = (0..3).max_by_key(|&axis| high[axis] - low[axis]).unwrap_or(0);
        let middle = low[axis].midpoint(high[axis]);
        let (mut first, mut second) = (high, low);
        first[axis] = middle;
        second[axis] = middle + 1;
        ranges.push([second, high]);
        ranges.push([low, first]);
    }
    true
}

/// Whether a triangle may meet a box of cells: no plane that is along its sides and theirs parts
/// them.
fn meets(corners: &[Point; 3], [low, high]: Range) -> bool {
    let half: Point = std::array::from_fn(|i| (high[i] - low[i] + 1) as f64 / 2.0);
    let centre: Point = std::array::from_fn(|i| low[i] as f64 + half[i]);
    let [a, b, c] = corners.map(|p| glam::DVec3::from(p) - glam::DVec3::from(centre));
    let half = glam::DVec3::from(half) + glam::DVec3::splat(SLACK);
    let parts = |axis: glam::DVec3| {
        let reach = half.dot(axis.abs());
        let heights = [a.dot(axis), b.dot(axis), c.dot(axis)];
        heights.iter().all(|&h| h > reach) || heights.iter().all(|&h| h < -reach)
    };
    let edges = [b - a, c - b, a - c];
    let axes = [glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z];
    let crosses = edges.iter().flat_map(|edge| axes.iter().map(move |axis| edge.cross(*axis)));
    !(axes.iter().any(|&axis| parts(axis))
        || parts(edges[0].cross(edges[1]))
        || crosses.into_iter().any(parts))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::{Random, bounds, cuboid, rotation, sphere, transform};

    fn sees(shells: &[Vec<[Point; 3]>], at: usize) -> bool {
        let all: Vec<_> = shells.iter().flatten().copied().collect();
        let mut sight = Sight::new(bounds(&all)).expect("it has an extent");
        all.iter().for_each(|corners| sight.fill(corners));
        sight.look();
        shells[at].iter().any(|corners| sight.sees(corners))
    }

    #[test]
    fn what_lies_in_a_closed_box_is_not_seen_in_any_pose() {
        let mut random = Random::new(3);
        let outer = cuboid([-1.0; 3], [1.0; 3]);
        let inner = sphere([0.1, 0.0, 0.2], 0.5, 4);
        let open: Vec<_> = outer[2..].to_vec();
        for _ in 0..20 {
            let turn = rotation(&mut random);
            let pose = |shape: &[_]| transform(shape, turn, glam::DVec3::new(5.0, -3.0, 8.0));
            let closed = [pose(&outer), pose(&inner)];
            assert!(sees(&closed, 0) && !sees(&closed, 1));
            assert!(sees(&[pose(&open), pose(&inner)], 1), "a side is missing");
        }
    }

    #[test]
    fn cells_of_a_triangle_hold_all_its_points() {
        let mut random = Random::new(8);
        for _ in 0..200 {
            let corners: [Point; 3] =
                std::array::from_fn(|_| std::array::from_fn(|_| random.within(2.0, 126.0)));
            let mut cells = std::collections::HashSet::new();
            assert!(each_cell(&corners, |cell| cells.insert(cell)), "no cell comes twice");
            for _ in 0..200 {
                let (u, v) = (random.share(), random.share());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let [a, b, c] = corners;
                let cell = std::array::from_fn(|i| {
                    (a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i])) as usize
                });
                assert!(cells.contains(&cell));
            }
        }
    }
}
