//! Turns regions into signs and marks, and picks the crossing of every marked edge.

use crate::monitor::{Gauge, Resident};
use crate::octree::{
    AS_HIT, ArchivedHitBrick, Border, CORNER_ROW, CornerBits, Crossing, Domain, EdgeBits,
    FlipRecord, Flips, HitEdge, LINES, PATCH, ROWS, SIDE, SignBrick, SourcePlane, decode_borders,
    decode_hits, edge_position, encode, find_regions,
};
use crate::sign::flooded::{Flooded, OUTSIDE, SEALED_BY_RESOLUTION, UNTOLD, WOUND};
use crate::sign::hit_edges::{HitEdges, PlanePicker};
use crate::sign::load::{LoadItem, LoadItems, Loaded};
use crate::sign::tips::{apart, find_tips};
use crate::sign::walls::find_walls;
use crate::sign::{FillRule, SIGNS, SignError, SignStats};
use crate::store::{BrickFile, BrickPass, Resources, ordered_by_weight};

struct RelabelItem {
    load: LoadItem,
    base_inside: bool,
    /// What is known of each region.
    regions: Vec<u8>,
}

struct Relabelled {
    key: u64,
    flags: u32,
    bytes: rkyv::util::AlignedVec,
    stats: SignStats,
}

/// Writes the signs of all bricks.
///
/// # Errors
/// [`SignError`].
pub fn relabel(
    (hits, borders): (&BrickFile, Option<&BrickFile>),
    flips: &Flips,
    flooded: &Flooded,
    (rule, domain): (FillRule, &Domain),
    resources: &Resources,
) -> Result<(BrickFile, SignStats), SignError> {
    let mut pass = BrickPass::<SignStats>::start(SIGNS, resources)?;
    let mut items = LoadItems::new(hits, flips, resources);
    let mut bricks = flooded.by_brick();
    for _ in 0..pass.items() {
        items.next()?;
        bricks.next()?;
    }
    let resident = Resident::new(Gauge::ResidentBricks, resources.monitor);
    let relabelled = ordered_by_weight(
        resources.pool,
        resources.scales(|item: &RelabelItem| item.load.weight_bytes(hits)),
        || {
            let Some(load) = items.next()? else { return Ok(None) };
            let (brick, regions) = bricks.next_at(load.brick)?;
            Ok(Some(RelabelItem { load, base_inside: brick.base_inside == 1, regions }))
        },
        Workspace::default,
        |space, item| {
            let _brick = resident.hold(1);
            space.relabel((hits, borders), &item, (rule, domain))
        },
        |done: Relabelled| {
            pass.counts.add(&done.stats);
            if done.stats.bricks > 0 {
                pass.append(done.key, done.flags, &done.bytes)?;
            }
            Ok::<(), SignError>(pass.item_done()?)
        },
    );
    let (file, mut stats) = pass.end(relabelled, SignError::is_stop)?;
    stats.regions = flooded.region_count();
    Ok((file, stats))
}

/// The corners of a row by their parity, that of the first corner of the brick first.
fn parts_by_parity(parity: u64, base_inside: bool) -> impl Iterator<Item = (u64, u16)> {
    let inside = parity & CORNER_ROW;
    let outside = !parity & CORNER_ROW;
    let [first, second] = if base_inside { [inside, outside] } else { [outside, inside] };
    [(first, 0), (second, 1)].into_iter()
}

#[derive(Default)]
struct Workspace {
    loaded: Loaded,
    parity: CornerBits,
    signs: CornerBits,
    sealed: CornerBits,
    marks: EdgeBits,
}

impl Workspace {
    fn relabel(
        &mut self,
        (hits, borders): (&BrickFile, Option<&BrickFile>),
        item: &RelabelItem,
        (rule, domain): (FillRule, &Domain),
    ) -> Result<Relabelled, SignError> {
        let view = self.loaded.load(hits, &item.load)?;
        let record = view.as_ref().map(|view| decode_hits(view)).transpose()?;
        self.parity.from_marks(&self.loaded.marks, item.base_inside);
        // Of two regions, with a change of parity at every barrier, parity tells which is where.
        if item.regions.len() == 2 && self.loaded.barrier == self.loaded.marks {
            let (parity, base) = (self.parity.clone(), item.base_inside);
            self.set_signs(|row| parts_by_parity(parity.rows[row], base), item, rule)?;
        } else {
            let regions = find_regions(&self.loaded.barrier);
            if usize::from(regions.count) != item.regions.len() {
                return Err(contradiction(item, "as many regions as before"));
            }
            self.set_signs(|row| regions.row(row), item, rule)?;
        }
        let flips = &item.load.flips;
        let cell_units = f64::from(domain.cell_units);
        let (mut brick, mut flags, mut stats) = self.cross(record, flips, cell_units);
        let tips = apart(&self.signs, &find_tips(&self.signs), &brick.walls);
        if !tips.is_empty() {
            for [x, y, z] in &tips {
                self.signs.rows[z * LINES + y] &= !(1 << x);
            }
            (brick, flags, stats) = self.cross(record, flips, cell_units);
        }
        stats.tip_corners = tips.len() as u64;
        if let Some(borders) = borders
            && let Some(number) = borders.find(item.load.brick.0)
        {
            let view = borders.view(number)?;
            brick.borders.extend(decode_borders(&view)?.borders.iter().map(Border::from));
        }
        stats.bricks = u64::from(flags & AS_HIT != 0 || !brick.crossings.is_empty());
        let bytes = encode(&brick);
        Ok(Relabelled { key: item.load.brick.0, flags, bytes, stats })
    }

    /// Signs by the fill rule, from the corners of each row with their regions. What parity calls inside, the
    /// exterior never reaches: checked.
    fn set_signs<P: Iterator<Item = (u64, u16)>>(
        &mut self,
        parts_of: impl Fn(usize) -> P,
        item: &RelabelItem,
        rule: FillRule,
    ) -> Result<(), SignError> {
        for row in 0..ROWS {
            let (mut inside, mut sealed, mut wound, mut untold) = (0, 0, 0, 0);
            for (bits, region) in parts_of(row) {
                let known = item.regions[usize::from(region)];
                inside |= if known & OUTSIDE != 0 { 0 } else { bits };
                wound |= if known & WOUND != 0 { bits } else { 0 };
                untold |= if known & UNTOLD != 0 { bits } else { 0 };
                sealed |= if known & SEALED_BY_RESOLUTION != 0 { bits } else { 0 };
            }
            let parity = self.parity.rows[row];
            if parity & !inside != 0 {
                return Err(contradiction(item, "parity inside to be out of the exterior's reach"));
            }
            self.signs.rows[row] = match rule {
                FillRule::Solid => inside,
                FillRule::Nonzero => wound | untold & parity,
                FillRule::Evenodd => parity,
            };
            self.sealed.rows[row] = sealed;
        }
        Ok(())
    }

    /// Marks, crossings and walled faces of the signs as they are; with the flags of the brick.
    fn cross(
        &mut self,
        record: Option<&ArchivedHitBrick>,
        flips: &[FlipRecord],
        cell_units: f64,
    ) -> (SignBrick, u32, SignStats) {
        self.marks.set_differences(&self.signs);
        let mut stats = self.count();
        if let Some(record) = record.filter(|record| self.is_as_hit(record, flips)) {
            // The record of hits says it all.
            let base_inside = self.signs.get([0; 3]);
            let walls = find_walls(&self.marks, &self.signs, cell_units, |edge| {
                let found = record
                    .edges
                    .binary_search_by_key(&edge, |hit| HitEdge::from(hit).edge())
                    .ok()?;
                Some(SourcePlane::from(&record.planes[record.hits[found].to_native() as usize]))
            });
            stats.crossings = self.marks.count_own();
            stats.walled_faces = walls.len() as u64;
            return (SignBrick { base_inside, walls, ..SignBrick::default() }, AS_HIT, stats);
        }
        let mut brick = self.pick_crossings(record, flips, &mut stats);
        brick.walls = find_walls(&self.marks, &self.signs, cell_units, |edge| {
            let found = brick.crossings.binary_search_by_key(&edge, |one| one.edge).ok()?;
            let plane = brick.crossings[found].plane;
            (plane & PATCH == 0).then(|| brick.planes[plane as usize])
        });
        stats.walled_faces = brick.walls.len() as u64;
        (brick, 0, stats)
    }

    /// Counts corners that the brick owns, and leaf cells.
    fn count(&self) -> SignStats {
        let mut stats = SignStats::default();
        let own = (1_u64 << SIDE) - 1;
        for z in 0..SIDE {
            for y in 0..SIDE {
                let row = z * LINES + y;
                let (signs, parity) = (self.signs.rows[row], self.parity.rows[row]);
                let filled = signs & !parity & own;
                stats.inside_corners += u64::from((signs & own).count_ones());
                stats.filled_cells += u64::from(filled.count_ones());
                let sealed = filled & self.sealed.rows[row];
                stats.sealed_by_resolution_cells += u64::from(sealed.count_ones());
                stats.leaf_cells += u64::from(self.marks.cells_touched(z, y).count_ones());
            }
        }
        stats
    }

    /// Whether just those edges are marked that were hit, each once, and no patch is there.
    fn is_as_hit(&self, record: &ArchivedHitBrick, flips: &[FlipRecord]) -> bool {
        flips.is_empty()
            && !record.edges.is_empty()
            && record.hits.len() == record.edges.len()
            && self.loaded.barrier == self.marks
    }

    /// One crossing for every marked edge: the one nearest to the outside.
    fn pick_crossings(
        &self,
        record: Option<&ArchivedHitBrick>,
        flips: &[FlipRecord],
        stats: &mut SignStats,
    ) -> SignBrick {
        let mut planes = PlanePicker::new(record);
        let mut brick = SignBrick { base_inside: self.signs.get([0; 3]), ..Default::default() };
        let mut hit_edges = HitEdges::new(record);
        let mut flips = flips.iter().peekable();
        let owned = |edge: u32| edge_position(edge).1.iter().all(|&c| c < SIDE);
        self.marks.for_each(|edge| {
            while let Some((passed, _)) = hit_edges.next_below(edge) {
                self.count_unmarked(passed, owned(passed), stats);
            }
            while flips.next_if(|flip| flip.edge < edge).is_some() {}
            let patch = flips.next_if(|flip| flip.edge == edge).map(|flip| flip.offset);
            let hits = hit_edges.next_at(edge);
            let (_, at) = edge_position(edge);
            let up = self.signs.get(at);
            let plane = match (hits, patch) {
                // Seen from outside: the last hit when the lower end is inside, else the first.
                (Some(hits), _) => planes.pick(if up { hits[hits.len() - 1] } else { hits[0] }),
                (None, Some(offset)) => PATCH | u32::from(offset),
                // The far side of a plate that was a sheet.
                (None, None) => PATCH | 1 << 15,
            };
            if owned(edge) {
                stats.crossings += 1;
                stats.patch_crossings += u64::from(plane & PATCH != 0);
            }
            brick.crossings.push(Crossing { edge, plane });
        });
        while let Some((passed, _)) = hit_edges.next_below(u32::MAX) {
            self.count_unmarked(passed, owned(passed), stats);
        }
        brick.planes = planes.finish(&mut brick.crossings);
        brick
    }

    /// Counts an edge with hits whose two ends ended up alike.
    fn count_unmarked(&self, edge: u32, owned: bool, stats: &mut SignStats) {
        if owned {
            let inside = self.signs.get(edge_position(edge).1);
            stats.buried_edges += u64::from(inside);
            stats.thin_edges += u64::from(!inside);
        }
    }
}

fn contradiction(item: &RelabelItem, expected: &'static str) -> SignError {
    SignError::Contradiction { brick: item.load.brick.position(), expected }
}
