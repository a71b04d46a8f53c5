//! Places the vertices of every brick: one per component in every leaf cell, then per cluster.
//!
//! In:         [`crate::octree::SignBrick`]s.
//! Out:        [`CellBrick`]s: cells with their masks, clusters, vertices on the lattice, offsets
//!             of crossings.
//! Invariant:  a vertex lies strictly inside its cell, and no two share a position.

use crate::contour::mdc::cell::{JOINED_FACES, ONE_VERTEX_BIT, components_of, place_of};
use crate::contour::mdc::cluster::{BLOCK_LEVEL, BlockPlace};
use crate::contour::mdc::features::Place;
use crate::contour::mdc::flags_of;
use crate::contour::mdc::plain::later;
use crate::contour::mdc::workspace::{EdgeCrossing, Workspace};
use crate::contour::{CELLS, ContourError, ContourOptions, ContourStats, Method, SurfaceDetail};
use crate::monitor::{Gauge, Resident};
use crate::octree::{CellBrick, Domain, RecordBytes, SignBricks, encode};
use crate::store::{BrickFile, BrickPass, Resources, StoreError, ordered_by_weight};

/// What a byte of a record of signs takes while vertices are placed, with the record of cells.
const RECORD_FACTOR: u64 = 3;
/// The same with the pieces that clusters are made of.
const RECORD_FACTOR_WITH_CLUSTERS: u64 = 12;

struct Placed {
    key: u64,
    flags: u32,
    bytes: RecordBytes,
    stats: ContourStats,
}

/// Places the vertices of all bricks.
///
/// # Errors
/// [`ContourError`].
pub fn place_vertices(
    signs: SignBricks,
    domain: &Domain,
    options: &ContourOptions,
    resources: &Resources,
) -> Result<(BrickFile, ContourStats), ContourError> {
    let mut pass = BrickPass::<ContourStats>::start(CELLS, resources)?;
    let mut numbers = pass.items() as usize..signs.len();
    let resident = Resident::new(Gauge::ResidentBricks, resources.monitor);
    let factor = if options.has_clusters() { RECORD_FACTOR_WITH_CLUSTERS } else { RECORD_FACTOR };
    let placed = ordered_by_weight(
        resources.pool,
        resources.scales(|number: &usize| factor * signs.record_bytes(*number)),
        || {
            if resources.monitor.cancelled() {
                return Err(ContourError::Store(StoreError::Cancelled));
            }
            Ok(numbers.next())
        },
        || Workspace::new(domain, options),
        |space, number| {
            let _brick = resident.hold(1);
            let (brick, stats) = space.place(signs, number, Vec::new())?;
            let key = signs.key(number).0;
            Ok(Placed { key, flags: flags_of(&brick), bytes: encode(&brick), stats })
        },
        |placed: Placed| {
            pass.counts.add(&placed.stats);
            pass.append(placed.key, placed.flags, &placed.bytes)?;
            Ok(pass.item_done()?)
        },
    );
    pass.end(placed, ContourError::is_stop)
}

impl Workspace {
    /// The cells of brick `number` with their vertices; none of the `banned` cells is a cluster.
    ///
    /// # Errors
    /// [`ContourError`].
    pub fn place(
        &mut self,
        signs: SignBricks,
        number: usize,
        banned: Vec<u32>,
    ) -> Result<(CellBrick, ContourStats), ContourError> {
        let key = signs.key(number);
        let view = signs.view(number)?;
        self.load(view.record()?);
        self.beyond.clear();
        self.halo.clear();
        self.touched.find(&self.marks);
        let mut stats = ContourStats::default();
        let mut brick = CellBrick { banned, ..CellBrick::default() };
        let place = Place { signs, key };
        for word in 0..self.touched.0.len() {
            let bits = self.touched.0[word];
            if bits != 0 {
                self.place_in_word(place, word, bits, &mut brick, &mut stats)?;
            }
        }
        self.place_waiting(&mut brick, &mut stats);
        if let Some(mut clustering) = self.clustering.take() {
            self.leaves.components.push(brick.positions.len() as u32);
            self.leaves.hit_starts.push(self.leaves.hits.len() as u32);
            clustering.cut(&mut brick, &self.leaves);
            stats.refused_by_error += clustering.refusals.by_error;
            stats.refused_by_shape += clustering.refusals.by_shape;
            stats.cluster_error_cells = clustering.refusals.largest_error;
            self.place_remaining(&mut brick, &mut stats);
            brick.drop_covered_reaches();
            brick.summary = clustering.summary(&brick, &self.leaves);
            self.clustering = Some(clustering);
        }
        for list in [&mut brick.surfaces, &mut brick.sources] {
            if list.iter().all(|one| *one == list[0]) {
                list.truncate(1);
            }
        }
        stats.crossed_edges += brick.offsets.len() as u64;
        stats.clusters += brick.clusters.len() as u64;
        stats.cut_vertices += brick.positions.len() as u64;
        Ok((brick, stats))
    }

    /// Places the vertices of 64 cells, those with bits, as blocks where that can be.
    fn place_in_word(
        &mut self,
        place: Place,
        word: usize,
        bits: u64,
        brick: &mut CellBrick,
        stats: &mut ContourStats,
    ) -> Result<(), ContourError> {
        let block = BlockPlace { level: BLOCK_LEVEL, number: word };
        if self.take_block(place, block, bits, brick, stats)? {
            return Ok(());
        }
        for octant in 0..8 {
            let mut bits = bits >> (8 * octant) & 0xff;
            let block = BlockPlace { level: BLOCK_LEVEL - 1, number: 8 * word + octant };
            if bits == 0 || self.take_block(place, block, bits, brick, stats)? {
                continue;
            }
            while bits != 0 {
                let number = block.first() | bits.trailing_zeros() as usize;
                bits &= bits - 1;
                self.place_in_cell(place, number, brick, stats)?;
            }
        }
        Ok(())
    }

    fn place_in_cell(
        &mut self,
        place: Place,
        number: usize,
        brick: &mut CellBrick,
        stats: &mut ContourStats,
    ) -> Result<(), ContourError> {
        let at = place_of(number);
        let mask = self.signs.cell_mask(at);
        let mut cell = number as u32 | u32::from(mask) << 15;
        if self.method == Method::Dc {
            cell |= ONE_VERTEX_BIT;
        } else {
            let (joined, turned) = self.joined_faces(place.signs, place.key, at, mask)?;
            cell |= u32::from(joined) << JOINED_FACES;
            stats.flipped_faces += u64::from(turned);
        }
        let components = components_of(cell);
        let masks = &components.edge_masks[..usize::from(components.count)];
        let is_clustering = self.clustering.is_some();
        if is_clustering {
            self.leaves.components.push(brick.positions.len() as u32);
        }
        if self.method == Method::Dmc {
            self.place_in_middle(at, masks, brick);
        } else if components.count == 1 && is_clustering && self.surfaces == SurfaceDetail::None {
            let own = self.add_borderless_leaf(at, mask, masks[0]);
            if self.is_plain(place, at, own.all())? {
                brick.positions.push(later(brick.cells.len()));
            } else {
                let around = self.around(at, masks[0]);
                self.place_alone(place, at, &around, brick, stats)?;
            }
        } else if components.count == 1 {
            let around = self.around(at, masks[0]);
            let border = self.border_planes(at, &around);
            if is_clustering {
                self.add_leaf(at, mask, &around, &border);
            }
            if !border.is_none() {
                self.place_on_border(at, &around, &border, brick, stats);
            } else if is_clustering && self.is_plain(place, at, around.own_normals())? {
                brick.positions.push(later(brick.cells.len()));
            } else {
                self.place_alone(place, at, &around, brick, stats)?;
            }
        } else {
            if is_clustering {
                for &edges in masks {
                    let around = self.around(at, edges);
                    let border = self.border_planes(at, &around);
                    self.add_leaf(at, mask, &around, &border);
                }
            }
            self.place_apart(at, masks, brick, stats);
        }
        self.add_own_edges(at, mask, brick);
        brick.cells.push(cell);
        stats.cells += 1;
        stats.multi_cells += u64::from(components.count > 1);
        stats.cell_vertices += u64::from(components.count);
        Ok(())
    }

    /// Adds the crossings of the edges from the min corner of a cell.
    #[inline]
    pub(super) fn add_own_edges(&self, at: [usize; 3], mask: u8, brick: &mut CellBrick) {
        for axis in 0..3 {
            if (mask ^ mask >> (1 << axis)) & 1 == 1 {
                let EdgeCrossing { offset, surface, source, .. } = self.crossing(axis, at);
                brick.offsets.push((offset * 65536.0).clamp(1.0, 65535.0) as u16);
                if self.surfaces != SurfaceDetail::None {
                    brick.surfaces.push(self.surfaces.of(surface));
                }
                if self.sources {
                    brick.sources.push(source);
                }
            }
        }
    }
}
