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

use crate::contour::mdc::layers::Layers;
use crate::contour::mdc::look::{Look, Looked, look_at};
use crate::contour::mdc::neighbourhood::{Neighbourhood, brick_around};
use crate::contour::mdc::vertices::Workspace;
use crate::contour::mdc::{HAS_MULTI, above, face_points, flags_of};
use crate::contour::{ContourError, ContourOptions, ContourStats};
use crate::monitor::{Gauge, Resident};
use crate::octree::{BrickKey, Domain, encode};
use crate::store::{
    BrickFile, BrickWriter, Resources, StoreError, directory_name, ordered_by_weight,
};

/// What a byte of a record takes while it is looked at, with the sides of those around.
const RECORD_FACTOR: u64 = 12;

/// Files of one look, in turns.
pub const LOOKS: [&str; 2] = ["look_odd.bricks", "look_even.bricks"];

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
    // The first look reads the file that the second one will write.
    let mut anew = above::cluster(cells, domain, options, LOOKS[1], &mut stats, resources)?;
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
            let key = BrickKey(self.cells.directory()[*number].key);
            let around = (0..27).filter_map(|slot| brick_around(key, slot));
            for number in around.filter_map(|key| self.cells.find(key.0)) {
                near[number] = true;
            }
        }
        near
    }
}
