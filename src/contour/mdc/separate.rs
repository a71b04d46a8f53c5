//! Keeps surfaces apart that pass through one cell: which cells are flagged, and which split.
//!
//! In:         bricks of cells, and the signs that they were made from.
//! Out:        the bricks that changed, anew: flagged cells with their vertices, clusters that were
//!             split, and all face points that are vertices.
//! Invariant:  no two triangles of the surface that is drawn from these bricks meet anywhere but
//!             in shared vertices and edges. A cell with one vertex cannot meet itself: its piece
//!             is a cone over a simple curve. One with several is flagged if triangles that it may
//!             have, whatever its neighbours decide, meet; then its face points become vertices,
//!             which confines it to itself. So no decision depends on another, and all are made at
//!             once. A cluster is split in place of being flagged.
//! Units:      lattice units from the brick's min corner.
//! Memory:     per worker what [`Neighbourhood`] holds.
//! Fails:      [`ContourError`].
//! Source:     ours. That the pieces of a leaf cell are apart by planes, wherever they cross its
//!             edges, was found by going through all cells; the face points after Ju and Udeshi
//!             2006.

use crate::contour::mdc::around_cell::AroundCell;
use crate::contour::mdc::cell::{cell_number, place_of};
use crate::contour::mdc::layers::Layers;
use crate::contour::mdc::neighbourhood::{CutBox, Neighbourhood};
use crate::contour::mdc::vertices::Workspace;
use crate::contour::mdc::{HAS_MULTI, INSET_UNITS, face_points, flags_of};
use crate::contour::{ContourError, ContourOptions, ContourStats};
use crate::geom::triangle_triangle::{Triangle, meets_improperly};
use crate::monitor::{Gauge, Resident};
use crate::octree::{BrickKey, Domain, RecordBytes, encode};
use crate::store::{
    BrickFile, BrickWriter, Resources, StoreError, directory_name, ordered_by_weight,
};

/// What a byte of a record takes while it is looked at, with the sides of those around.
const RECORD_FACTOR: u64 = 12;

/// Files of one look, in turns.
pub const LOOKS: [&str; 2] = ["look_odd.bricks", "look_even.bricks"];

/// How cells are looked at.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Look {
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
    const fn after_splits(self) -> Self {
        match self {
            Self::First | Self::FirstAgain => Self::FirstAgain,
            Self::Second | Self::SecondAgain => Self::SecondAgain,
        }
    }
}

/// What one look does to a brick.
struct Looked {
    key: BrickKey,
    flags: u32,
    /// `None` where nothing changes.
    bytes: Option<RecordBytes>,
    /// Clusters to split.
    banned: Vec<u32>,
}

/// Finds what must change in the bricks of `cells`, which were made from `signs`.
///
/// # Errors
/// [`ContourError`].
pub fn separate(
    signs: &BrickFile,
    cells: &BrickFile,
    domain: &Domain,
    options: &ContourOptions,
    placed: &ContourStats,
    resources: &Resources,
) -> Result<(BrickFile, ContourStats), ContourError> {
    let mut stats = *placed;
    let separation = Separation { signs, cells, domain, options, resources };
    let everywhere = vec![true; cells.len()];
    let mut anew = None;
    let mut turn = 0;
    for look in [Look::First, Look::Second] {
        let (mut look, mut wanted) = (look, everywhere.clone());
        loop {
            let (looked, banned) = separation.look(anew.as_ref(), look, &wanted, turn)?;
            anew = Some(looked);
            turn += 1;
            if banned.is_empty() {
                break;
            }
            stats.split_clusters += banned.iter().map(|(_, cells)| cells.len() as u64).sum::<u64>();
            anew = Some(separation.split(anew.as_ref(), &banned, turn)?);
            turn += 1;
            (look, wanted) = (look.after_splits(), separation.near(&banned));
        }
    }
    let surface =
        face_points::add(&Layers::new(cells, anew.as_ref()), domain, &mut stats, resources)?;
    drop(anew);
    for name in LOOKS {
        resources.scratch.remove(name)?;
        resources.scratch.remove(&directory_name(name))?;
    }
    Ok((surface, stats))
}

/// Clusters to split, by the number of their brick.
type Banned = Vec<(usize, Vec<u32>)>;

struct Separation<'s> {
    signs: &'s BrickFile,
    cells: &'s BrickFile,
    domain: &'s Domain,
    options: &'s ContourOptions,
    resources: &'s Resources<'s>,
}

impl Separation<'_> {
    /// Looks at all bricks of `wanted` that have cells with several vertices, as they are in
    /// `before`; what changed so far, and what must be split.
    fn look(
        &self,
        before: Option<&BrickFile>,
        look: Look,
        wanted: &[bool],
        turn: usize,
    ) -> Result<(BrickFile, Banned), ContourError> {
        let layers = Layers::new(self.cells, before);
        let name = LOOKS[turn % 2];
        let resources = self.resources;
        let mut writer = BrickWriter::create(resources.scratch, name, resources.backing)?;
        let mut banned = Vec::new();
        let mut numbers = (0..layers.bricks()).filter(|number| {
            let is_anew = before.is_some_and(|anew| anew.find(layers.key(*number).0).is_some());
            is_anew || (wanted[*number] && layers.flags(*number) & HAS_MULTI != 0)
        });
        let resident = Resident::new(Gauge::ResidentBricks, resources.monitor);
        ordered_by_weight(
            resources.pool,
            resources.scales(|number: &usize| RECORD_FACTOR * layers.record_bytes(*number)),
            || {
                if resources.monitor.cancelled() {
                    return Err(ContourError::Store(StoreError::Cancelled));
                }
                Ok(numbers.next())
            },
            || Neighbourhood::new(layers, self.domain),
            |nb, number| {
                let _brick = resident.hold(1);
                let looked = look_at(nb, &layers, number, look, wanted[number])?;
                Ok((number, looked))
            },
            |(number, looked): (usize, Looked)| {
                if let Some(bytes) = &looked.bytes {
                    writer.append(looked.key.0, looked.flags, bytes)?;
                }
                if !looked.banned.is_empty() {
                    banned.push((number, looked.banned));
                }
                Ok(())
            },
        )?;
        Ok((writer.finish(resources.cached_windows)?, banned))
    }

    /// The bricks of `before`, with those that have clusters to split made again.
    fn split(
        &self,
        before: Option<&BrickFile>,
        banned: &Banned,
        turn: usize,
    ) -> Result<BrickFile, ContourError> {
        let layers = Layers::new(self.cells, before);
        let resources = self.resources;
        let name = LOOKS[turn % 2];
        let mut writer = BrickWriter::create(resources.scratch, name, resources.backing)?;
        let mut workspace = Workspace::new(self.domain, self.options);
        for number in 0..layers.bricks() {
            let key = layers.key(number);
            let more = banned.binary_search_by_key(&number, |(number, _)| *number).ok();
            let Some(more) = more.map(|at| &banned[at].1) else {
                if let Some((before, known)) = before.and_then(|b| Some((b, b.find(key.0)?))) {
                    let flags = before.directory()[known].flags;
                    writer.append(key.0, flags, &before.view(known)?)?;
                }
                continue;
            };
            let mut all = layers.read(number, |record| {
                Ok(record.banned.iter().map(|cell| cell.to_native()).collect::<Vec<u32>>())
            })?;
            all.extend(more);
            all.sort_unstable();
            let (brick, _) = workspace.place(self.signs, number, all)?;
            writer.append(key.0, flags_of(&brick), &encode(&brick))?;
        }
        Ok(writer.finish(resources.cached_windows)?)
    }

    /// Whether each brick is one of `banned`, or touches one.
    fn near(&self, banned: &Banned) -> Vec<bool> {
        let mut near = vec![false; self.cells.len()];
        for (number, _) in banned {
            let position = BrickKey(self.cells.directory()[*number].key).position();
            for slot in 0..27 {
                let steps = crate::contour::mdc::neighbourhood::steps_of(slot);
                let around: [i64; 3] =
                    std::array::from_fn(|a| i64::from(position[a]) + i64::from(steps[a]));
                if around.iter().any(|c| *c < 0) {
                    continue;
                }
                let key = BrickKey::new(around.map(|c| c as u32));
                if let Some(number) = self.cells.find(key.0) {
                    near[number] = true;
                }
            }
        }
        near
    }
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
fn look_at(
    nb: &mut Neighbourhood,
    layers: &Layers,
    number: usize,
    look: Look,
    is_wanted: bool,
) -> Result<Looked, ContourError> {
    let key = layers.key(number);
    let mut banned = Vec::new();
    let mut decisions = Vec::new();
    if is_wanted && layers.flags(number) & HAS_MULTI != 0 {
        nb.move_to(number)?;
        let mut rank = 0;
        while let Some(&cell) = nb.own().cells.get(rank) {
            let own = nb.own();
            let cut = own.vertices[own.firsts[rank] as usize].cut;
            let first = cut.first();
            let last = first + (1 << (3 * cut.level()));
            let cells = &own.cells[rank..];
            let end = rank + cells.partition_point(|cell| cell_number(*cell) < last);
            debug_assert!(first <= cell_number(cell));
            if cut.is_multi() {
                let low = place_of(first).map(|c| c as i32);
                let cut_box = CutBox { low, side: 1 << cut.level() };
                match decide(nb, cut_box, rank..end, look, cut.is_flagged())? {
                    Decision::Sound => {}
                    Decision::Flagged(vertices) => decisions.push((first as u16, vertices)),
                    Decision::Split => banned.push(first as u32 | cut.level() << 15),
                }
            }
            rank = end;
        }
    }
    let was_anew = layers.is_anew(number);
    if decisions.is_empty() && !was_anew {
        return Ok(Looked { key, flags: 0, bytes: None, banned });
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
    Ok(Looked { key, flags, bytes: Some(encode(&brick)), banned })
}

fn decide(
    nb: &mut Neighbourhood,
    cut: CutBox,
    ranks: std::ops::Range<usize>,
    look: Look,
    was_flagged: bool,
) -> Result<Decision, ContourError> {
    let around = AroundCell::gather(nb, cut, ranks)?;
    if cut.side > 1 {
        // The middle of a few crossings is no place for a vertex that stands for many.
        let is_clash = around.is_torn || clash(&around, AroundCell::variants);
        return Ok(if is_clash { Decision::Split } else { Decision::Sound });
    }
    let may_clash = match look {
        Look::First => true,
        Look::FirstAgain | Look::SecondAgain => !was_flagged,
        // Nothing has changed where no vertex moved.
        Look::Second => around.is_near_flagged,
    };
    let keeps_flag = was_flagged && look != Look::Second;
    let is_clash = keeps_flag || (may_clash && clash(&around, AroundCell::variants));
    if !is_clash {
        return Ok(Decision::Sound);
    }
    match look {
        Look::FirstAgain if was_flagged => return Ok(Decision::Flagged(around.vertices)),
        Look::First | Look::FirstAgain => {
            return Ok(Decision::Flagged(middles(&around, cut, nb.cell_units())));
        }
        Look::Second | Look::SecondAgain => {}
    }
    if !clash(&around, AroundCell::cone) {
        return Ok(Decision::Flagged(around.vertices));
    }
    let mut moved = around;
    moved.vertices = middles(&moved, cut, nb.cell_units());
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
    let low = cut.low.map(|c| c * cell_units);
    let side = cut.side * cell_units;
    let middle = |id: u64| {
        let corners = around.corners.iter().filter(|corner| corner.vertex == id);
        let (mut sum, mut count) = ([0_i64; 3], 0);
        for corner in corners {
            sum = std::array::from_fn(|a| sum[a] + i64::from(corner.crossing.0[a]));
            count += 1;
        }
        std::array::from_fn(|a| {
            let mean = (2 * sum[a] + count).div_euclid(2 * count.max(1)) as i32;
            mean.clamp(low[a] + inset, low[a] + side - inset)
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
