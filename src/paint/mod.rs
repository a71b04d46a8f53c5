//! Gives the surface what the soup has besides its shape: texture coordinates, colours, normals.
//!
//! The surface is drawn into spools first. Then each vertex takes, for every look of the triangles
//! around it, the texture coordinate and colour that the nearest of their source triangles has
//! there; and the triangles around it are divided along creases, and have one normal each.
//!
//! In:         the surface from `contour` with the source triangles of its crossings, and the
//!             attributes of the soup by source number.
//! Out:        vertices, lists and triangles into a [`crate::mesh::MeshSink`] that takes them.
//! Invariant:  all corners at a vertex that have one look have one texture coordinate and colour,
//!             so a triangle spans no seam; what is written depends on the surface and the soup
//!             alone.
//! Units:      model units.
//! Memory:     the share; the triangles around one vertex.
//! Fails:      [`PaintError`]: the scratch disk, or the sink.
//! Source:     ours; normals weighted by angles after Thürmer, Wüthrich 1998, Computing vertex
//!             normals from polygonal facets.

mod corners;
mod drawing;
mod fans;
mod mapping;
mod origins;
mod values;

#[cfg(test)]
mod tests;

use crate::mesh::{Attributes, CornerForm, CornerValues, MeshSink, SinkTriangles, Surface};
use crate::octree::AttributeRecord;
use crate::paint::corners::{Answer, Painter};
use crate::paint::values::pick_values;
use crate::store::{Resources, Sorted, Spool, SpoolPeek, StoreError};

pub use drawing::{AskedPlace, DRAWN, Drawing, Drawn, DrawnCorner, DrawnTriangle, no_drawing};
pub use origins::Origins;

/// Vertices or triangles that are handed on at one time.
const BATCH: usize = 4096;

/// What the surface gets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaintOptions {
    /// Which attributes.
    pub wanted: Attributes,
    /// Whether triangles tell the sink what they are.
    pub surfaces: bool,
    /// Side of a cell: texture coordinates go on so far beyond their triangle.
    pub cell: f64,
    /// Normals differ across edges with a larger dihedral angle, degrees.
    pub crease_deg: f64,
    /// How far the vertices of round surfaces may lie off them: that bends small triangles.
    pub slack: f64,
}

/// What can go wrong.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PaintError<E: std::error::Error> {
    /// The scratch disk fails.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The output file.
    #[error(transparent)]
    Sink(E),
}

/// Writes a drawn surface into `sink` with what `sources` have.
///
/// # Errors
/// [`PaintError`].
pub fn paint<S: MeshSink + ?Sized>(
    drawn: &Drawn,
    sources: &Spool<AttributeRecord>,
    options: &PaintOptions,
    sink: &mut S,
    resources: &Resources,
) -> Result<(), PaintError<S::Error>> {
    let values = pick_values(drawn, sources, options, resources)?;
    let answers = Painter::new(values, options, sink, resources).vertices(drawn)?;
    write_triangles(drawn, answers, options, sink, resources)
}

/// Triangles on their way into the sink.
#[derive(Default)]
struct Batch {
    indices: Vec<[u32; 3]>,
    surfaces: Vec<Surface>,
    uv_numbers: Vec<[u32; 3]>,
    uvs: Vec<[[f32; 2]; 3]>,
    normal_numbers: Vec<[u32; 3]>,
    normals: Vec<[[f32; 3]; 3]>,
}

impl Batch {
    fn push(&mut self, surface: Surface, corners: [Answer; 3], options: &PaintOptions) {
        self.indices.push(corners.map(|corner| corner.vertex));
        if options.surfaces {
            self.surfaces.push(surface);
        }
        if options.wanted.uvs {
            self.uv_numbers.push(corners.map(|corner| corner.uv_number));
            self.uvs.push(corners.map(|corner| corner.uv));
        }
        if options.wanted.normals {
            self.normal_numbers.push(corners.map(|corner| corner.normal_number));
            self.normals.push(corners.map(|corner| corner.normal));
        }
    }

    fn hand_on<S: MeshSink + ?Sized>(&mut self, sink: &mut S) -> Result<(), S::Error> {
        let mut triangles = SinkTriangles {
            indices: &self.indices,
            surfaces: &self.surfaces,
            ..SinkTriangles::default()
        };
        if sink.corner_form() == CornerForm::OfCorners {
            triangles.uvs = CornerValues { numbers: &self.uv_numbers, values: &self.uvs };
            triangles.normals =
                CornerValues { numbers: &self.normal_numbers, values: &self.normals };
        }
        sink.triangles(&triangles)?;
        *self = Self::default();
        Ok(())
    }
}

fn write_triangles<S: MeshSink + ?Sized>(
    drawn: &Drawn,
    mut answers: Sorted<Answer>,
    options: &PaintOptions,
    sink: &mut S,
    resources: &Resources,
) -> Result<(), PaintError<S::Error>> {
    let mut batch = Batch::default();
    let mut triangles = SpoolPeek::<DrawnTriangle>::new(&drawn.triangles);
    while let Some(triangle) = triangles.next()? {
        let mut corners = [Answer::default(); 3];
        for corner in &mut corners {
            *corner = answers.next()?.expect("every corner has an answer");
        }
        batch.push(Surface::from_bits(triangle.surface), corners, options);
        if batch.indices.len() == BATCH {
            stop_if_asked(resources)?;
            resources.monitor.advance(BATCH as u64);
            batch.hand_on(sink).map_err(PaintError::Sink)?;
        }
    }
    batch.hand_on(sink).map_err(PaintError::Sink)
}

fn stop_if_asked(resources: &Resources) -> Result<(), StoreError> {
    if resources.monitor.cancelled() { Err(StoreError::Cancelled) } else { Ok(()) }
}
