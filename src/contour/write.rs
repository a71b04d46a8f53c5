//! Writes the surface: all vertices, then the triangles of brick after brick.
//!
//! In:         cells of all bricks, and a sink.
//! Out:        the sink has taken everything.
//! Invariant:  what the sink takes does not depend on where an earlier run was stopped.
//! Memory:     4 bytes a brick, and what the [`Maker`] holds.

use serde::{Deserialize, Serialize};

use crate::contour::maker::Maker;
use crate::contour::mdc::{BrickTriangles, FAN_POINT, Layers, VERTICES};
use crate::contour::{ContourError, ContourOptions, ContourStats, Method, mc};
use crate::mesh::{DrawnFrom, MeshSink, SinkState, SinkTriangles};
use crate::monitor::{Gauge, Resident};
use crate::octree::Domain;
use crate::store::{BrickFile, Progress, Resources, StoreError, ordered_by_weight};

/// What can go wrong while the surface is written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError<E: std::error::Error> {
    /// The bricks.
    #[error(transparent)]
    Contour(#[from] ContourError),
    /// The output file.
    #[error(transparent)]
    Sink(E),
}

impl<E: std::error::Error> From<StoreError> for WriteError<E> {
    fn from(error: StoreError) -> Self {
        Self::Contour(ContourError::Store(error))
    }
}

/// How far the surface is written.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WriteProgress {
    /// Bricks whose vertices are written, and behind those of all, bricks whose triangles are.
    pub items: u64,
    /// Counts so far, with those of placing the vertices.
    pub stats: ContourStats,
    /// Where the sink goes on.
    pub sink: SinkState,
}

impl WriteProgress {
    /// What an earlier run noted.
    #[must_use]
    pub fn noted(resources: &Resources) -> Option<Self> {
        let progress = resources.checkpoints.start()?;
        serde_json::from_str(&progress.counts).ok()
    }
}

/// Writes what the vertices in `cells` span into `sink`. `placed` are the counts of placing them;
/// `start` is where the sink was, if it goes on.
///
/// # Errors
/// [`WriteError`].
pub fn write_surface<S: MeshSink + ?Sized>(
    (cells, surface): (&BrickFile, &BrickFile),
    domain: &Domain,
    options: &ContourOptions,
    (placed, start): (&ContourStats, Option<WriteProgress>),
    sink: &mut S,
    resources: &Resources,
) -> Result<ContourStats, WriteError<S::Error>>
where
    S::Error: Send,
{
    let cells = Layers::new(cells, Some(surface));
    let bases = number_vertices(&cells)?;
    let vertices = u64::from(*bases.last().unwrap_or(&0));
    let (items, stats) = match start {
        Some(start) => (start.items, start.stats),
        None => (0, ContourStats { vertices, ..*placed }),
    };
    let saved_bytes = sink.bytes_so_far();
    let method = options.method;
    let mut writing = Writing { method, cells, domain, sink, resources, items, stats, saved_bytes };
    resources.monitor.advance(items);
    writing.vertices()?;
    writing.triangles(&bases)?;
    Ok(writing.stats)
}

/// The number of the first vertex of each brick, and their total.
pub fn number_vertices(cells: &Layers) -> Result<Vec<u32>, StoreError> {
    let limit = u64::from(FAN_POINT) - 1;
    let mut bases = Vec::with_capacity(cells.bricks() + 1);
    let mut total = 0_u64;
    for number in 0..cells.bricks() {
        bases.push(total as u32);
        total += u64::from(cells.flags(number) & VERTICES);
        if total > limit {
            return Err(StoreError::TooMany { what: "Output vertices", limit });
        }
    }
    bases.push(total as u32);
    Ok(bases)
}

/// A surface on its way into the sink.
struct Writing<'w, S: ?Sized> {
    cells: Layers<'w>,
    method: Method,
    domain: &'w Domain,
    sink: &'w mut S,
    resources: &'w Resources<'w>,
    items: u64,
    stats: ContourStats,
    saved_bytes: u64,
}

impl<S: MeshSink + ?Sized> Writing<'_, S>
where
    S::Error: Send,
{
    /// Writes the vertices of the bricks that are left.
    fn vertices(&mut self) -> Result<(), WriteError<S::Error>> {
        let mut positions = Vec::new();
        for number in (self.items as usize).min(self.cells.bricks())..self.cells.bricks() {
            if self.resources.monitor.cancelled() {
                self.save()?;
                return Err(StoreError::Cancelled.into());
            }
            match self.method {
                Method::Mdc | Method::Dc | Method::Dmc => {
                    self.read_positions(number, &mut positions)?;
                }
                Method::Mc => {
                    mc::read_positions(self.cells.first(), number, self.domain, &mut positions)?;
                }
            }
            self.resources.monitor.gauge(Gauge::ResidentVertices, positions.len() as u64);
            self.sink.vertices(&positions).map_err(WriteError::Sink)?;
            self.item_done()?;
        }
        Ok(())
    }

    /// The vertices of a brick in model units.
    fn read_positions(
        &self,
        number: usize,
        positions: &mut Vec<[f64; 3]>,
    ) -> Result<(), ContourError> {
        let brick = self.cells.key(number).position();
        let vertices = (self.cells.flags(number) & VERTICES) as usize;
        let base = brick.map(|c| i64::from(c) * self.domain.brick_units());
        self.cells.read_with_points(number, |record, points| {
            if record.positions.len() + points.len() != vertices {
                let expected = "as many vertices as the directory says";
                return Err(ContourError::Contradiction { brick, expected });
            }
            let on_faces = points.iter().map(|point| &point.position);
            positions.clear();
            positions.extend(record.positions.iter().chain(on_faces).map(|position| {
                let at = std::array::from_fn(|a| base[a] + i64::from(position[a].to_native()));
                self.domain.to_model(at)
            }));
            Ok(())
        })
    }

    /// Writes the triangles of the bricks that are left.
    fn triangles(&mut self, bases: &[u32]) -> Result<(), WriteError<S::Error>> {
        let (cells, domain, resources) = (self.cells, self.domain, self.resources);
        let with_corners = self.sink.needs_corners();
        let mut numbers = self.items as usize - cells.bricks()..cells.bricks();
        let resident = Resident::new(Gauge::ResidentBricks, resources.monitor);
        let (method, factors) = (self.method, self.method.factors());
        let factor = if with_corners { factors.with_corners } else { factors.plain };
        let written = ordered_by_weight(
            resources.pool,
            resources.scales(|number: &usize| factor * cells.record_bytes(*number)),
            || {
                if resources.monitor.cancelled() {
                    return Err(StoreError::Cancelled.into());
                }
                Ok(numbers.next())
            },
            || Maker::new(method, cells, bases, domain, with_corners),
            |maker, number| {
                let _brick = resident.hold(1);
                Ok(maker.triangles(number)?)
            },
            |brick| self.take(brick),
        );
        if let Err(WriteError::Contour(ContourError::Store(StoreError::Cancelled))) = written {
            self.save()?;
        }
        written
    }

    fn take(&mut self, mut brick: BrickTriangles) -> Result<(), WriteError<S::Error>> {
        brick.number_fan_points(self.stats.vertices as u32);
        self.sink.vertices(&brick.fan_points).map_err(WriteError::Sink)?;
        let triangles = SinkTriangles {
            indices: &brick.indices,
            corners: &brick.corners,
            surfaces: &brick.surfaces,
            from: DrawnFrom { sources: &brick.sources, inner: &brick.inner },
            ..SinkTriangles::default()
        };
        self.sink.triangles(&triangles).map_err(WriteError::Sink)?;
        self.stats.vertices += brick.fan_points.len() as u64;
        self.stats.triangles += brick.indices.len() as u64;
        self.stats.add(&brick.stats);
        self.item_done()
    }

    fn item_done(&mut self) -> Result<(), WriteError<S::Error>> {
        self.items += 1;
        self.resources.monitor.advance(1);
        let since = self.sink.bytes_so_far() - self.saved_bytes;
        if since >= self.resources.checkpoints.interval_bytes() { self.save() } else { Ok(()) }
    }

    fn save(&mut self) -> Result<(), WriteError<S::Error>> {
        self.saved_bytes = self.sink.bytes_so_far();
        let sink = self.sink.checkpoint().map_err(WriteError::Sink)?;
        let noted = WriteProgress { items: self.items, stats: self.stats, sink };
        let counts = serde_json::to_string(&noted).expect("plain records serialise");
        Ok(self.resources.checkpoints.save(Progress {
            items: self.items,
            files: Vec::new(),
            counts,
        })?)
    }
}
