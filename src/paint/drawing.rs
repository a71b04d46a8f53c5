//! The surface on its way into spools.
//!
//! In:         vertices and triangles, with the source triangles that they come from.
//! Out:        [`Drawn`].
//! Memory:     a share for each of two sorts; what one brick hands over.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::mesh::{Attributes, MeshSink, SinkFile, SinkState, SinkStats, SinkTriangles, Surface};
use crate::octree::NO_SOURCE;
use crate::paint::origins::Origins;
use crate::store::{FileState, Record, Resources, Scratch, Sorter, Spool, SpoolWriter, StoreError};

/// Spools of the vertices, of the triangles, of their corners by vertex, and of the places where
/// the attributes of source triangles are asked for, by source number.
pub const DRAWN: [&str; 4] = ["drawn.vertices", "drawn.triangles", "drawn.corners", "drawn.places"];

/// A triangle of the surface. 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DrawnTriangle {
    /// Vertex numbers.
    pub indices: [u32; 3],
    /// What it is ([`Surface`]).
    pub surface: u32,
}

/// A corner of a triangle of the surface. 44 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DrawnCorner {
    /// The vertex.
    pub vertex: u32,
    /// The triangle.
    pub triangle: u32,
    /// Which of its corners.
    pub corner: u32,
    /// Its look.
    pub look: u32,
    /// The vertices at the next corner and the one before.
    pub others: [u32; 2],
    /// Unit normal of the triangle; zero where it has none.
    pub normal: [f32; 3],
    /// The angle at the corner, radians.
    pub angle: f32,
    /// The least height of the triangle, model units.
    pub height: f32,
}

impl Record for DrawnCorner {
    type Key = (u32, u32, u32);
    fn key(&self) -> Self::Key {
        (self.vertex, self.triangle, self.corner)
    }
}

/// A vertex that may take what a source triangle has there. 40 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct AskedPlace {
    /// Where the vertex is.
    pub position: [f64; 3],
    /// Its number.
    pub vertex: u32,
    /// The look that is asked for.
    pub look: u32,
    /// The source triangle.
    pub source: u32,
    /// Zero.
    pub unused: u32,
}

impl Record for AskedPlace {
    type Key = (u32, u32, u32);
    fn key(&self) -> Self::Key {
        (self.source, self.vertex, self.look)
    }
}

/// A surface that was drawn, see [`DRAWN`].
pub struct Drawn {
    /// Positions by number.
    pub(crate) vertices: Spool<[f64; 3]>,
    /// Triangles in order.
    pub(crate) triangles: Spool<DrawnTriangle>,
    /// Corners by vertex.
    pub(crate) corners: Spool<DrawnCorner>,
    /// Places by source triangle.
    pub(crate) places: Spool<AskedPlace>,
}

impl Drawn {
    /// Opens what an earlier run drew.
    ///
    /// # Errors
    /// It is missing or damaged.
    pub fn open(resources: &Resources, files: &[FileState]) -> Result<Self, StoreError> {
        let scratch = resources.scratch;
        Ok(Self {
            vertices: Spool::open(scratch, FileState::find(files, DRAWN[0])?)?,
            triangles: Spool::open(scratch, FileState::find(files, DRAWN[1])?)?,
            corners: Spool::open(scratch, FileState::find(files, DRAWN[2])?)?,
            places: Spool::open(scratch, FileState::find(files, DRAWN[3])?)?,
        })
    }

    /// The files, as they have to be found again.
    #[must_use]
    pub fn files(&self) -> Vec<FileState> {
        vec![
            self.vertices.state().clone(),
            self.triangles.state().clone(),
            self.corners.state().clone(),
            self.places.state().clone(),
        ]
    }
}

/// No surface, as files: where it goes to the output at once.
///
/// # Errors
/// A file cannot be created.
pub fn no_drawing(scratch: &Scratch) -> Result<Drawn, StoreError> {
    Ok(Drawn {
        vertices: SpoolWriter::create(scratch, DRAWN[0])?.finish()?,
        triangles: SpoolWriter::create(scratch, DRAWN[1])?.finish()?,
        corners: SpoolWriter::create(scratch, DRAWN[2])?.finish()?,
        places: SpoolWriter::create(scratch, DRAWN[3])?.finish()?,
    })
}

/// Takes a surface into spools.
pub struct Drawing {
    vertices: SpoolWriter<[f64; 3]>,
    triangles: SpoolWriter<DrawnTriangle>,
    corners: Sorter<DrawnCorner>,
    places: Sorter<AskedPlace>,
    origins: Origins,
    /// Whether looks part vertices.
    has_looks: bool,
    /// Places of one call.
    asked: Vec<AskedPlace>,
    scratch: Scratch,
}

impl Drawing {
    /// Of a surface that is to have these attributes; `origins` of the source triangles.
    ///
    /// # Errors
    /// A spool cannot be created.
    pub fn new(
        wanted: Attributes,
        origins: Origins,
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        let Resources { scratch, share_bytes, .. } = *resources;
        Ok(Self {
            vertices: SpoolWriter::create(scratch, DRAWN[0])?,
            triangles: SpoolWriter::create(scratch, DRAWN[1])?,
            corners: Sorter::new(scratch, share_bytes / 4),
            places: Sorter::new(scratch, share_bytes / 4),
            origins,
            has_looks: wanted.uvs || wanted.colours,
            asked: Vec::new(),
            scratch: scratch.clone(),
        })
    }

    /// What was drawn.
    ///
    /// # Errors
    /// The disk is full.
    pub fn end(self) -> Result<Drawn, StoreError> {
        let corners = spool_sorted(self.corners, &self.scratch, DRAWN[2])?;
        let places = spool_sorted(self.places, &self.scratch, DRAWN[3])?;
        let (vertices, triangles) = (self.vertices.finish()?, self.triangles.finish()?);
        Ok(Drawn { vertices, triangles, corners, places })
    }

    fn add_corners(
        &mut self,
        indices: [u32; 3],
        corners: [[f64; 3]; 3],
        surface: Surface,
    ) -> Result<(), StoreError> {
        let triangle = self.triangles.len();
        let limit = u64::from(u32::MAX);
        if triangle >= limit {
            return Err(StoreError::TooMany { what: "Output triangles", limit });
        }
        let look = if self.has_looks { surface.material() } else { 0 };
        let [a, b, c] = corners.map(DVec3::from);
        let (normal, height) = normal_and_height([a, b, c]);
        let (normal, height) = (normal.as_vec3().to_array(), height as f32);
        for (corner, (at, next, last)) in [(a, b, c), (b, c, a), (c, a, b)].into_iter().enumerate()
        {
            let (to_next, to_last) = (next - at, last - at);
            let angle = to_next.cross(to_last).length().atan2(to_next.dot(to_last));
            self.corners.push(DrawnCorner {
                vertex: indices[corner],
                triangle: triangle as u32,
                corner: corner as u32,
                look,
                others: [indices[(corner + 1) % 3], indices[(corner + 2) % 3]],
                normal,
                angle: angle as f32,
                height,
            })?;
        }
        self.triangles.push(DrawnTriangle { indices, surface: surface.bits() })
    }

    /// Asks for what `source` has at a vertex.
    fn ask(&mut self, vertex: u32, position: [f64; 3], surface: Surface, source: u32) {
        if source != NO_SOURCE {
            let look = surface.material();
            self.asked.push(AskedPlace { position, vertex, look, source, unused: 0 });
        }
    }

    /// Passes on what was asked, each question once.
    fn pass_on(&mut self) -> Result<(), StoreError> {
        self.asked.sort_unstable_by_key(|place| (place.source, place.vertex, place.look));
        self.asked.dedup_by_key(|place| (place.source, place.vertex, place.look));
        for place in self.asked.drain(..) {
            if let Some(source) = self.origins.of(place.source)? {
                self.places.push(AskedPlace { source, ..place })?;
            }
        }
        Ok(())
    }
}

/// The unit normal, zero where there is none; and the least height.
fn normal_and_height([a, b, c]: [DVec3; 3]) -> (DVec3, f64) {
    let cross = (b - a).cross(c - a);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    (cross.normalize_or_zero(), cross.length() / longest.max(f64::MIN_POSITIVE))
}

fn spool_sorted<R: Record>(
    sorter: Sorter<R>,
    scratch: &Scratch,
    name: &str,
) -> Result<Spool<R>, StoreError> {
    let mut writer = SpoolWriter::create(scratch, name)?;
    let mut sorted = sorter.finish()?;
    while let Some(record) = sorted.next()? {
        writer.push(record)?;
    }
    writer.finish()
}

impl MeshSink for Drawing {
    type Error = StoreError;

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), StoreError> {
        positions.iter().try_for_each(|position| self.vertices.push(*position))
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), StoreError> {
        for (at, (indices, corners)) in triangles.indices.iter().zip(triangles.corners).enumerate()
        {
            let surface = triangles.surfaces.get(at).copied().unwrap_or_default();
            self.add_corners(*indices, *corners, surface)?;
            if let Some(&source) = triangles.from.sources.get(at) {
                for (vertex, position) in indices.iter().zip(corners) {
                    self.ask(*vertex, *position, surface, source);
                }
            }
        }
        for crossing in triangles.from.inner {
            self.ask(crossing.vertex, crossing.position, crossing.surface, crossing.source);
        }
        self.pass_on()
    }

    fn bytes_so_far(&self) -> u64 {
        0
    }

    /// Drawing begins anew where it was stopped.
    fn checkpoint(&mut self) -> Result<SinkState, StoreError> {
        Ok(SinkState::default())
    }

    fn finish(self: Box<Self>) -> Result<SinkStats, StoreError> {
        let (vertices, triangles) = (self.vertices.len(), self.triangles.len());
        self.end()?;
        Ok(SinkStats { vertices, triangles, file: SinkFile::default() })
    }
}
