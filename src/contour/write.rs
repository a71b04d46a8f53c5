//! Writes the surface: all vertices, then the triangles of brick after brick.

use crate::contour::mdc::{BrickTriangles, Polygons};
use crate::contour::{ContourError, ContourOptions, ContourStats, Method};
use crate::mesh::MeshSink;
use crate::monitor::{Gauge, Resident};
use crate::octree::{BrickKey, Domain, decode_cells};
use crate::store::{BrickFile, Resources, StoreError, ordered};

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

/// Writes what the vertices in `cells` span into `sink`, and adds to `stats`.
///
/// # Errors
/// [`WriteError`].
pub fn write_surface<S: MeshSink + ?Sized>(
    cells: &BrickFile,
    domain: &Domain,
    options: &ContourOptions,
    sink: &mut S,
    stats: &mut ContourStats,
    resources: &Resources,
) -> Result<(), WriteError<S::Error>>
where
    S::Error: Send,
{
    let Method::Mdc = options.method;
    let bases = write_vertices(cells, domain, sink, resources)?;
    stats.vertices = u64::from(*bases.last().unwrap_or(&0));
    write_triangles(cells, domain, &bases, sink, stats, resources)
}

/// Writes the vertices of all bricks; the number of the first of each, and their total.
fn write_vertices<S: MeshSink + ?Sized>(
    cells: &BrickFile,
    domain: &Domain,
    sink: &mut S,
    resources: &Resources,
) -> Result<Vec<u32>, WriteError<S::Error>> {
    let mut bases = Vec::with_capacity(cells.len() + 1);
    let mut total = 0_u64;
    let mut positions = Vec::new();
    for number in 0..cells.len() {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled.into());
        }
        bases.push(total as u32);
        let view = cells.view(number)?;
        let record = decode_cells(&view).map_err(ContourError::Brick)?;
        let brick = BrickKey(cells.directory()[number].key).position();
        let side = domain.brick_units();
        let base = brick.map(|c| i64::from(c) * side);
        positions.clear();
        positions.extend(record.positions.iter().map(|position| {
            domain.to_model(std::array::from_fn(|a| base[a] + i64::from(position[a].to_native())))
        }));
        resources.monitor.gauge(Gauge::ResidentVertices, positions.len() as u64);
        total += positions.len() as u64;
        let limit = u64::from(crate::contour::mdc::FAN_POINT) - 1;
        if total > limit {
            return Err(StoreError::TooMany { what: "Output vertices", limit }.into());
        }
        sink.vertices(&positions).map_err(WriteError::Sink)?;
    }
    bases.push(total as u32);
    Ok(bases)
}

fn write_triangles<S: MeshSink + ?Sized>(
    cells: &BrickFile,
    domain: &Domain,
    bases: &[u32],
    sink: &mut S,
    stats: &mut ContourStats,
    resources: &Resources,
) -> Result<(), WriteError<S::Error>>
where
    S::Error: Send,
{
    let with_corners = sink.needs_corners();
    let mut numbers = 0..cells.len();
    let resident = Resident::new(Gauge::ResidentBricks, resources.monitor);
    ordered(
        resources.pool,
        || {
            if resources.monitor.cancelled() {
                return Err(StoreError::Cancelled.into());
            }
            Ok(numbers.next())
        },
        || Polygons::new(cells, bases, domain, with_corners),
        |polygons, number| {
            let _brick = resident.hold(1);
            Ok(polygons.triangles(number)?)
        },
        |mut brick: BrickTriangles| {
            brick.number_fan_points(stats.vertices as u32);
            sink.vertices(&brick.fan_points).map_err(WriteError::Sink)?;
            sink.triangles(&brick.indices, &brick.corners).map_err(WriteError::Sink)?;
            stats.vertices += brick.fan_points.len() as u64;
            stats.triangles += brick.indices.len() as u64;
            stats.polygons += brick.stats.polygons;
            stats.fans += brick.stats.fans;
            resources.monitor.advance(1);
            Ok(())
        },
    )
}
