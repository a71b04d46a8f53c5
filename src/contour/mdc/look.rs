//! One look at a brick: which of its cells have triangles that may meet, and what is done about it.
//!
//! In:         a brick of cells and the bricks around it.
//! Out:        [`Looked`]: the brick anew if something changes, and clusters to split.
//! Invariant:  what is decided about a cell depends on the bricks as they were before the look.
//! Units:      lattice units from the brick's min corner.
//! Source:     ours; see [`separate`](crate::contour::mdc::separate()).

use std::ops::Range;

use crate::contour::ContourError;
use crate::contour::mdc::around_cell::AroundCell;
use crate::contour::mdc::cell::cell_number;
use crate::contour::mdc::cut_cell::{CutBox, CutCell};
use crate::contour::mdc::neighbourhood::{Neighbourhood, OWN};
use crate::contour::mdc::{HAS_MULTI, INSET_UNITS, flags_of};
use crate::geom::triangle_triangle::{Triangle, meets_improperly};
use crate::octree::{BrickKey, RecordBytes, encode};

/// How cells are looked at.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// For the first time: vertices of flagged leaf cells move to the middle of their crossings.
    First,
    /// The same after splits: what has moved stays.
    FirstAgain,
    /// Again where vertices have moved: flagged leaf cells get what they need.
    Second,
    /// The same after splits, also where nothing has moved.
    SecondAgain,
}

impl Look {
    /// How to look again after splits.
    pub const fn after_splits(self) -> Self {
        match self {
            Self::First | Self::FirstAgain => Self::FirstAgain,
            Self::Second | Self::SecondAgain => Self::SecondAgain,
        }
    }
}

/// What one look does to a brick.
pub struct Looked {
    /// Its number.
    pub number: usize,
    /// The brick.
    pub key: BrickKey,
    /// What the directory will say of it.
    pub flags: u32,
    /// `None` where nothing changes.
    pub bytes: Option<RecordBytes>,
    /// Whether a vertex got another box.
    pub has_grown: bool,
    /// Clusters to split, with the numbers of their bricks.
    pub banned: Vec<(usize, u32)>,
}

/// What a look decides about one cell.
enum Decision {
    /// Its triangles cannot meet.
    Sound,
    /// It is flagged, and its vertices go there.
    Flagged(Vec<(u64, [i32; 3])>),
    /// It is a cluster that must not be.
    Split,
}

/// Looks at one brick; at its cells only if it `is_wanted`.
pub fn look_at(
    nb: &mut Neighbourhood,
    number: usize,
    look: Look,
    is_wanted: bool,
) -> Result<Looked, ContourError> {
    let layers = *nb.layers();
    let key = layers.key(number);
    let mut banned = Vec::new();
    let mut decisions = Vec::new();
    if is_wanted && layers.flags(number) & HAS_MULTI != 0 {
        nb.move_to(number)?;
        let mut rank = 0;
        while let Some(&cell) = nb.own().cells.get(rank) {
            let own = nb.own();
            let cut = own.first_vertex(rank).cut;
            let first = cut.first();
            let last = first + (1 << (3 * cut.level()));
            let cells = &own.cells[rank..];
            let end = rank + cells.partition_point(|cell| cell_number(*cell) < last);
            debug_assert!(first <= cell_number(cell));
            if cut.is_multi() {
                match decide(nb, cut, rank..end, look)? {
                    Decision::Sound => {}
                    Decision::Flagged(vertices) => decisions.push((first as u16, vertices)),
                    Decision::Split => banned.push((number, first as u32 | cut.level() << 15)),
                }
            }
            rank = end;
        }
    }
    let was_anew = layers.is_anew(number);
    if decisions.is_empty() && !was_anew {
        return Ok(Looked { number, key, flags: 0, bytes: None, has_grown: false, banned });
    }
    let mut brick = layers.read(number, |record| Ok(record.to_brick()))?;
    if is_wanted {
        brick.flagged.clear();
    }
    for (first, vertices) in decisions {
        brick.flagged.push(first);
        for (id, position) in vertices {
            brick.positions[(id & 0xff_ffff) as usize] = position;
        }
    }
    let flags = flags_of(&brick);
    Ok(Looked { number, key, flags, bytes: Some(encode(&brick)), has_grown: false, banned })
}

/// Decides about the cell `cut`, whose leaf cells have these ranks.
fn decide(
    nb: &mut Neighbourhood,
    cut: CutCell,
    ranks: Range<usize>,
    look: Look,
) -> Result<Decision, ContourError> {
    let cut_box = CutBox::new(OWN, cut);
    let around = AroundCell::gather(nb, cut, ranks)?;
    if look == Look::Second && !around.is_near_flagged {
        // Nothing has changed where no vertex moved.
        return Ok(Decision::Sound);
    }
    if cut.level() > 0 {
        // The middle of a few crossings is no place for a vertex that stands for many.
        let is_clash = around.is_torn || clash(&around, AroundCell::variants);
        return Ok(if is_clash { Decision::Split } else { Decision::Sound });
    }
    let was_flagged = cut.is_flagged();
    let keeps_flag = was_flagged && look != Look::Second;
    if !keeps_flag && !clash(&around, AroundCell::variants) {
        return Ok(Decision::Sound);
    }
    match look {
        Look::FirstAgain if was_flagged => return Ok(Decision::Flagged(around.vertices)),
        Look::First | Look::FirstAgain => {
            return Ok(Decision::Flagged(middles(&around, cut_box, nb.cell_units())));
        }
        Look::Second | Look::SecondAgain => {}
    }
    if !clash(&around, AroundCell::cone) {
        return Ok(Decision::Flagged(around.vertices));
    }
    let mut moved = around;
    moved.vertices = middles(&moved, cut_box, nb.cell_units());
    if clash(&moved, AroundCell::cone) {
        moved.vertices = between_face_points(&moved);
    }
    Ok(Decision::Flagged(moved.vertices))
}

/// Whether triangles at different vertices of the cell meet.
fn clash(
    around: &AroundCell,
    triangles: impl Fn(&AroundCell, (u64, [i32; 3])) -> Vec<Triangle>,
) -> bool {
    let all: Vec<_> = around.vertices.iter().map(|vertex| triangles(around, *vertex)).collect();
    all.iter().enumerate().any(|(i, some)| {
        all[i + 1..].iter().any(|others| {
            some.iter().any(|one| others.iter().any(|other| meets_improperly(one, other)))
        })
    })
}

/// The vertices in the middle of the crossings around them.
fn middles(around: &AroundCell, cut: CutBox, cell_units: i32) -> Vec<(u64, [i32; 3])> {
    let inset = INSET_UNITS as i32;
    let [low, high] = [cut.low, cut.high].map(|end| end.map(|c| c * cell_units));
    let middle = |id: u64| {
        let corners = around.corners.iter().filter(|corner| corner.vertex == id);
        let (mut sum, mut count) = ([0_i64; 3], 0);
        for corner in corners {
            sum = std::array::from_fn(|a| sum[a] + i64::from(corner.crossing.0[a]));
            count += 1;
        }
        std::array::from_fn(|a| {
            let mean = (2 * sum[a] + count).div_euclid(2 * count.max(1)) as i32;
            mean.clamp(low[a] + inset, high[a] - inset)
        })
    };
    around.vertices.iter().map(|(id, _)| (*id, middle(*id))).collect()
}

/// The vertices between two face points on different faces of a leaf cell: what spans them lies in
/// the hull of their curve, and those of one leaf cell never meet.
fn between_face_points(around: &AroundCell) -> Vec<(u64, [i32; 3])> {
    let place = |id: u64| {
        let mut arcs = around.arcs.iter().filter(|arc| arc.mine == id);
        let one = arcs.next().expect("a curve passes faces");
        let other = arcs.find(|arc| arc.face != one.face).expect("a curve passes two faces");
        std::array::from_fn(|a| (one.point[a] + other.point[a]) / 2)
    };
    around.vertices.iter().map(|(id, _)| (*id, place(*id))).collect()
}
