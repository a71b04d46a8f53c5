//! Clusters above the brick: cells of the octree that one vertex stands for, of many bricks.
//!
//! In:         bricks of cells; those that are one vertex say what larger cells ask of them.
//! Out:        the bricks of the clusters, anew: each has the vertex of its cluster, the first one
//!             with surface owns it.
//! Invariant:  a cell is a cluster if it is the topmost one of which all children with surface are
//!             one vertex, and that is one disk with one arc per face and a vertex within the
//!             threshold. It has one vertex, so it is never flagged or split. The result depends on
//!             the bricks alone.
//! Units:      lattice units.
//! Memory:     eight summaries a level of the octree; 80 bytes a cluster, 8 a vertex that reaches
//!             into another brick.
//! Fails:      [`ContourError`].
//! Source:     Schaefer, Ju, Warren 2007; algorithm and criterion as within the brick.

use std::ops::Range;

use crate::contour::mdc::cell::place_of;
use crate::contour::mdc::cluster::{ClusterOptions, Part, join};
use crate::contour::mdc::workspace::cluster_options;
use crate::contour::mdc::{HAS_REACHES, HAS_SUMMARY, VERTICES, flags_of};
use crate::contour::{ContourError, ContourOptions, ContourStats};
use crate::geom::morton;
use crate::octree::{Above, BrickKey, Domain, MAX_LEVEL, SIDE, Summary, decode_cells, encode};
use crate::store::{BrickFile, BrickWriter, Resources, StoreError};

/// A cluster above the brick.
struct Cluster {
    /// Its bricks, some of which may have no surface; the first has.
    bricks: Range<usize>,
    level: u32,
    /// Its vertex on the lattice.
    vertex: [i64; 3],
    error: f64,
}

/// A cell on the way up.
enum Cell {
    /// It has no surface.
    Empty,
    /// It is no cluster, and no larger one is.
    Refused,
    /// It may be part of a larger one; if it has several bricks it is a cluster.
    Sole { summary: Summary, bricks: Range<usize>, cluster: Option<Cluster> },
}

/// The clusters above the brick.
#[derive(Default)]
pub struct AboveBricks {
    /// Their bricks, anew; `None` if there are none.
    pub bricks: Option<BrickFile>,
    /// The keys of the bricks that each covers, with surface or without; ascending.
    pub covered: Vec<Range<u64>>,
}

/// Makes the clusters above the brick. `name` is the file.
///
/// # Errors
/// [`ContourError`].
pub fn cluster(
    cells: &BrickFile,
    domain: &Domain,
    options: &ContourOptions,
    name: &str,
    stats: &mut ContourStats,
    resources: &Resources,
) -> Result<AboveBricks, ContourError> {
    if !cells.directory().iter().any(|entry| entry.flags & HAS_SUMMARY != 0) {
        return Ok(AboveBricks::default());
    }
    let options = cluster_options(domain, options);
    let wanted = reached_bricks(cells, resources)?;
    let mut climb = Climb { cells, domain, options, resources, wanted, clusters: Vec::new() };
    if let Cell::Sole { cluster, .. } = climb.visit(0..cells.len(), domain.depth)? {
        climb.clusters.extend(cluster);
    }
    let mut clusters = climb.clusters;
    if clusters.is_empty() {
        return Ok(AboveBricks::default());
    }
    clusters.sort_unstable_by_key(|cluster| cluster.bricks.start);
    let mut writer = BrickWriter::create(resources.scratch, name, resources.backing)?;
    for cluster in &clusters {
        let bricks = write(cells, domain, cluster, &mut writer)?;
        // Each brick was a cluster with a vertex.
        stats.clusters -= bricks - 1;
        stats.cut_vertices -= bricks - 1;
        stats.cluster_error_cells = stats.cluster_error_cells.max(cluster.error);
        if resources.monitor.cancelled() {
            return Err(ContourError::Store(StoreError::Cancelled));
        }
    }
    let covered = clusters.iter().map(|cluster| {
        let shift = 3 * (cluster.level - MAX_LEVEL);
        let number = cells.directory()[cluster.bricks.start].key >> shift;
        number << shift..(number + 1) << shift
    });
    let covered = covered.collect();
    Ok(AboveBricks { bricks: Some(writer.finish(resources.cached_windows)?), covered })
}

/// The keys of the bricks, with surface or without, that vertices of other bricks may reach into;
/// ascending.
fn reached_bricks(cells: &BrickFile, resources: &Resources) -> Result<Vec<u64>, ContourError> {
    let mut keys = Vec::new();
    for (number, entry) in cells.directory().iter().enumerate() {
        if entry.flags & HAS_REACHES == 0 {
            continue;
        }
        if resources.monitor.cancelled() {
            return Err(ContourError::Store(StoreError::Cancelled));
        }
        let key = BrickKey(entry.key);
        for reach in decode_cells(&cells.view(number)?)?.reaches.iter() {
            let (axis, is_max) = (usize::from(reach.face / 2), reach.face % 2 == 1);
            let at = place_of(reach.cell.to_native().into())[axis];
            match (at, is_max) {
                (0, false) => keys.extend(key.lower(1 << axis).map(|key| key.0)),
                (at, true) if at == SIDE - 1 => keys.push(key.upper(axis).0),
                _ => {}
            }
        }
    }
    keys.sort_unstable();
    keys.dedup();
    Ok(keys)
}

/// Writes the bricks of a cluster; how many.
fn write(
    cells: &BrickFile,
    domain: &Domain,
    cluster: &Cluster,
    writer: &mut BrickWriter,
) -> Result<u64, ContourError> {
    let owner = cluster.bricks.start;
    let mut written = 0;
    for number in cluster.bricks.clone() {
        let entry = &cells.directory()[number];
        if entry.flags & VERTICES == 0 {
            continue;
        }
        let place = BrickKey(entry.key).position();
        let position = [0, 1, 2]
            .map(|a| (cluster.vertex[a] - i64::from(place[a]) * domain.brick_units()) as i32);
        let mut brick = decode_cells(&cells.view(number)?)?.to_brick();
        brick.positions = if number == owner { vec![position] } else { Vec::new() };
        brick.summary = None;
        brick.above = Some(Above { level: cluster.level, owner: owner as u32, position });
        writer.append(entry.key, flags_of(&brick), &encode(&brick))?;
        written += 1;
    }
    Ok(written)
}

/// The way up from the bricks, in Morton order: the siblings under way are those on the call stack.
struct Climb<'c> {
    cells: &'c BrickFile,
    domain: &'c Domain,
    options: ClusterOptions,
    resources: &'c Resources<'c>,
    /// Bricks that no cluster may cover.
    wanted: Vec<u64>,
    clusters: Vec<Cluster>,
}

impl Climb<'_> {
    /// The cell at `level` that has these bricks.
    fn visit(&mut self, bricks: Range<usize>, level: u32) -> Result<Cell, ContourError> {
        if bricks.is_empty() {
            return Ok(Cell::Empty);
        }
        if level <= MAX_LEVEL {
            return self.brick(bricks.start);
        }
        let cells = self.cells;
        let shift = 3 * (level - 1 - MAX_LEVEL);
        let mut children = Vec::with_capacity(8);
        let mut is_refused = false;
        let mut start = bricks.start;
        while start < bricks.end {
            let number = cells.directory()[start].key >> shift;
            let more = &cells.directory()[start..bricks.end];
            let end = start + more.partition_point(|entry| entry.key >> shift == number);
            match self.visit(start..end, level - 1)? {
                Cell::Empty => {}
                Cell::Refused => is_refused = true,
                Cell::Sole { summary, bricks, cluster } => {
                    children.push(((number & 7) as usize, summary, bricks, cluster));
                }
            }
            start = end;
        }
        let cell = cells.directory()[bricks.start].key >> (shift + 3);
        let is_wanted = {
            let first = self.wanted.partition_point(|key| key >> (shift + 3) < cell);
            self.wanted.get(first).is_some_and(|key| key >> (shift + 3) == cell)
        };
        let whole = if is_refused || is_wanted || children.is_empty() {
            None
        } else {
            let parts: Vec<Part> = children
                .iter()
                .map(|(octant, summary, ..)| Part { octant: *octant, summary })
                .collect();
            join(&parts, level, &self.options)
        };
        let Some(whole) = whole else {
            let is_empty = !is_refused && !is_wanted && children.is_empty();
            self.clusters.extend(children.into_iter().filter_map(|(.., cluster)| cluster));
            return Ok(if is_empty { Cell::Empty } else { Cell::Refused });
        };
        let first = children[0].2.start;
        let last = children[children.len() - 1].2.end;
        let cluster = if children.len() == 1 {
            // The same bricks: the smaller cell will do.
            children.pop().and_then(|(.., cluster)| cluster)
        } else {
            let low = morton::decode(cells.directory()[first].key >> (shift + 3))
                .map(|c| (i64::from(c) << level) * i64::from(self.domain.cell_units));
            let vertex = [0, 1, 2].map(|a| low[a] + whole.vertex[a]);
            Some(Cluster { bricks: first..last, level, vertex, error: whole.error })
        };
        Ok(Cell::Sole { summary: whole.summary, bricks: first..last, cluster })
    }

    fn brick(&self, number: usize) -> Result<Cell, ContourError> {
        if self.resources.monitor.cancelled() {
            return Err(ContourError::Store(StoreError::Cancelled));
        }
        let flags = self.cells.directory()[number].flags;
        if flags & VERTICES == 0 {
            return Ok(Cell::Empty);
        }
        if flags & HAS_SUMMARY == 0 {
            return Ok(Cell::Refused);
        }
        let summary = decode_cells(&self.cells.view(number)?)?.to_summary();
        Ok(match summary {
            Some(summary) => Cell::Sole { summary, bricks: number..number + 1, cluster: None },
            None => Cell::Refused,
        })
    }
}
