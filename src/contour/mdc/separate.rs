//! Keeps surfaces apart that pass through one cell: which cells are flagged, and which split.
//!
//! In:         bricks of cells, and the signs that they were made from.
//! Out:        the bricks that changed, anew: those of clusters above the brick ([`above`]),
//!             flagged cells with their vertices, clusters that were split, and all face points
//!             that are vertices.
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

use std::ops::Range;

use crate::contour::mdc::grants::grant;
use crate::contour::mdc::layers::Layers;
use crate::contour::mdc::look::{Look, Looked, look_at};
use crate::contour::mdc::neighbourhood::{Neighbourhood, brick_around};
use crate::contour::mdc::workspace::Workspace;
use crate::contour::mdc::{HAS_FLAGGED, HAS_MULTI, HAS_REACHES, above, face_points, flags_of};
use crate::contour::{ContourError, ContourOptions, ContourStats};
use crate::octree::{BrickKey, Domain, SignBricks, encode};
use crate::store::{BrickFile, BrickWriter, Resources, directory_name};

/// What a byte of a record takes while it is looked at, with the sides of those around.
const RECORD_FACTOR: u64 = 12;

/// Files of one look, in turns.
pub const LOOKS: [&str; 2] = ["look_odd.bricks", "look_even.bricks"];

/// Finds what must change in the bricks of `cells`, which were made from `signs`.
///
/// # Errors
/// [`ContourError`].
pub fn separate(
    signs: SignBricks,
    cells: &BrickFile,
    domain: &Domain,
    options: &ContourOptions,
    placed: &ContourStats,
    resources: &Resources,
) -> Result<(BrickFile, ContourStats), ContourError> {
    let mut stats = *placed;
    let everywhere = vec![true; cells.len()];
    let above = above::cluster(cells, domain, options, LOOKS[1], &mut stats, resources)?;
    // The next pass reads the file that the one after it will write.
    let mut state = State { anew: above.bricks, turn: 0 };
    let covered = above.covered;
    let separation = Separation { signs, cells, covered, domain, options, resources };
    separation.settle(&mut state, Vec::new(), &mut everywhere.clone(), &mut stats)?;
    for look in [Look::First, Look::Second] {
        let (mut look, mut wanted) = (look, everywhere.clone());
        loop {
            let found = separation.look(&mut state, look, &wanted)?;
            if found.banned.is_empty() {
                break;
            }
            wanted.fill(false);
            separation.settle(&mut state, found.banned, &mut wanted, &mut stats)?;
            look = look.after_splits();
        }
    }
    let layers = Layers::new(cells, state.anew.as_ref());
    let surface = face_points::add(&layers, domain, &mut stats, resources)?;
    drop(state);
    for name in LOOKS {
        resources.scratch.remove(name)?;
        resources.scratch.remove(&directory_name(name))?;
    }
    Ok((surface, stats))
}

/// The bricks that changed so far.
struct State {
    anew: Option<BrickFile>,
    turn: usize,
}

impl State {
    /// The name of the next file, which is not that of the one before.
    fn next_name(&self) -> &'static str {
        LOOKS[self.turn % 2]
    }

    fn put(&mut self, anew: BrickFile) {
        self.anew = Some(anew);
        self.turn += 1;
    }
}

/// What a pass over the bricks found.
#[derive(Default)]
struct Found {
    /// Clusters to split, with the numbers of their bricks.
    banned: Vec<(usize, u32)>,
    /// Bricks in which a vertex reaches beyond its cell that did not before.
    grown: Vec<usize>,
}

struct Separation<'s> {
    signs: SignBricks<'s>,
    cells: &'s BrickFile,
    /// Keys of bricks that clusters above the brick cover.
    covered: Vec<Range<u64>>,
    domain: &'s Domain,
    options: &'s ContourOptions,
    resources: &'s Resources<'s>,
}

impl Separation<'_> {
    /// Splits clusters and lets vertices reach beyond their cells, until that splits no more. What
    /// must be looked at because of it becomes `wanted`.
    fn settle(
        &self,
        state: &mut State,
        mut banned: Vec<(usize, u32)>,
        wanted: &mut [bool],
        stats: &mut ContourStats,
    ) -> Result<(), ContourError> {
        loop {
            banned.sort_unstable();
            banned.dedup();
            stats.split_clusters += banned.len() as u64;
            if !banned.is_empty() {
                self.split(state, &banned)?;
                self.add_near(banned.iter().map(|(number, _)| *number), wanted);
            }
            let layers = Layers::new(self.cells, state.anew.as_ref());
            if !(0..layers.bricks()).any(|number| has_reaches(&layers, number)) {
                return Ok(());
            }
            let found = self
                .pass(state, has_reaches, |nb, number| grant(nb.layers(), &self.covered, number))?;
            self.add_near(found.grown.into_iter(), wanted);
            if found.banned.is_empty() {
                return Ok(());
            }
            banned = found.banned;
        }
    }

    /// Looks at all bricks of `wanted` that have cells with several vertices.
    fn look(&self, state: &mut State, look: Look, wanted: &[bool]) -> Result<Found, ContourError> {
        let mut wanted = wanted.to_vec();
        if look == Look::Second {
            // Vertices have moved in flagged cells only.
            let layers = Layers::new(self.cells, state.anew.as_ref());
            let is_flagged = |number: &usize| layers.flags(*number) & HAS_FLAGGED != 0;
            let mut is_near = vec![false; wanted.len()];
            self.add_near((0..layers.bricks()).filter(is_flagged), &mut is_near);
            wanted.iter_mut().zip(is_near).for_each(|(wanted, is_near)| *wanted &= is_near);
        }
        if !wanted.contains(&true) {
            return Ok(Found::default());
        }
        self.pass(
            state,
            |layers, number| wanted[number] && layers.flags(number) & HAS_MULTI != 0,
            |nb, number| look_at(nb, number, look, wanted[number]),
        )
    }

    /// Visits the bricks that are `wanted`, as they are in `state`, and writes what changed so far.
    fn pass(
        &self,
        state: &mut State,
        is_wanted: impl Fn(&Layers, usize) -> bool,
        visit: impl Fn(&mut Neighbourhood, usize) -> Result<Looked, ContourError> + Sync,
    ) -> Result<Found, ContourError> {
        let layers = Layers::new(self.cells, state.anew.as_ref());
        let resources = self.resources;
        let name = state.next_name();
        let mut writer = BrickWriter::create(resources.scratch, name, resources.backing)?;
        let mut found = Found::default();
        layers.each(
            RECORD_FACTOR,
            |number| layers.is_anew(number) || is_wanted(&layers, number),
            || Neighbourhood::new(layers, self.domain),
            visit,
            |looked: Looked| {
                if let Some(bytes) = &looked.bytes {
                    writer.append(looked.key.0, looked.flags, bytes)?;
                }
                if looked.has_grown {
                    found.grown.push(looked.number);
                }
                found.banned.extend(looked.banned);
                Ok(())
            },
            resources,
        )?;
        state.put(writer.finish(resources.cached_windows)?);
        Ok(found)
    }

    /// Makes the bricks that have clusters to split again, which are sorted.
    fn split(&self, state: &mut State, banned: &[(usize, u32)]) -> Result<(), ContourError> {
        let before = state.anew.as_ref();
        let layers = Layers::new(self.cells, before);
        let resources = self.resources;
        let name = state.next_name();
        let mut writer = BrickWriter::create(resources.scratch, name, resources.backing)?;
        let mut workspace = Workspace::new(self.domain, self.options);
        for number in 0..layers.bricks() {
            let key = layers.key(number);
            let start = banned.partition_point(|(other, _)| *other < number);
            let more = &banned[start..];
            let more = &more[..more.partition_point(|(other, _)| *other == number)];
            if more.is_empty() {
                if let Some((before, known)) = before.and_then(|b| Some((b, b.find(key.0)?))) {
                    let flags = before.directory()[known].flags;
                    writer.append(key.0, flags, &before.view(known)?)?;
                }
                continue;
            }
            let mut all = layers.read(number, |record| {
                Ok(record.banned.iter().map(|cell| cell.to_native()).collect::<Vec<u32>>())
            })?;
            all.extend(more.iter().map(|(_, cluster)| cluster));
            all.sort_unstable();
            let (brick, _) = workspace.place(self.signs, number, all)?;
            writer.append(key.0, flags_of(&brick), &encode(&brick))?;
        }
        state.put(writer.finish(resources.cached_windows)?);
        Ok(())
    }

    /// Adds these bricks and those that touch them to `wanted`.
    fn add_near(&self, numbers: impl Iterator<Item = usize>, wanted: &mut [bool]) {
        for number in numbers {
            let key = BrickKey(self.cells.directory()[number].key);
            let around = (0..27).filter_map(|slot| brick_around(key, slot));
            for number in around.filter_map(|key| self.cells.find(key.0)) {
                wanted[number] = true;
            }
        }
    }
}

/// Whether vertices of a brick may reach beyond their cells.
fn has_reaches(layers: &Layers, number: usize) -> bool {
    layers.flags(number) & HAS_REACHES != 0
}
