//! A surface whose vertices have colours for how far it lies from another one, for tools of modellers.
//!
//! In:         both surfaces of a [`Scene`], one [`Side`], the largest distance that the colours reach.
//! Out:        a PLY file: the triangles of the side, cut where they are large, as coloured corners.
//! Invariant:  the file depends on the surfaces and that distance alone. What was there before stays
//!             until it is complete.
//! Units:      model units; the colours are those of the map of a preview, a step for half a decade.
//! Memory:     the share: a quarter for the other surface, an eighth while points are measured; a batch.
//! Fails:      [`ReportError`].

use std::path::Path;

use glam::DVec3;

use crate::io::{ASIDE, Format, IoError, Sink, WriteOptions, create};
use crate::mesh::{Attributes, MeshSource, SinkTriangles, TriangleBatch, VertexValues};
use crate::report::ReportError;
use crate::report::image_staged::StagedFile;
use crate::report::preview::measuring::Ruler;
use crate::report::preview::scale::Scale;
use crate::report::preview::{PreviewError, Scene, Side};

/// Edges longer than this share of the diagonal are halved: a face has more colours than its corners.
const LONGEST_EDGE_SHARE: f64 = 1.0 / 128.0;

/// Vertices are numbered by 32 bits.
const MOST_VERTICES: u64 = 1 << 32;

/// Corners that are measured at a time.
const MOST_CORNERS: usize = 3 << 12;

/// Writes the `side` of a scene to `path`, each vertex in the colour of its distance from the other
/// side; the colours reach `largest`. False, and no file, where the scene has no other side or no means
/// to measure, or that side has no area.
///
/// # Errors
/// A file cannot be read or written, there are too many corners, or the monitor asks to stop.
pub fn write_coloured(
    path: &Path,
    scene: &Scene<'_, '_, IoError>,
    side: Side,
    (largest, share_bytes): (f64, u64),
) -> Result<bool, ReportError> {
    let Some(measuring) = scene.measuring else { return Ok(false) };
    let ruler = Ruler::read(scene, (scene.measuring, scene.monitor), &[side], share_bytes)?;
    let (Some(ruler), Some(mut source)) = (ruler, scene.open(side)?) else { return Ok(false) };
    let staged = StagedFile::create::<IoError>(path)?;
    let attributes = Attributes { colours: true, ..Attributes::default() };
    let options = WriteOptions { attributes, ..WriteOptions::default() };
    let sink = create(staged.partial(), Format::Ply, measuring.scratch, &options);
    let mut colouring = Colouring {
        sink: sink.map_err(of_output)?,
        partial: staged.partial(),
        scale: Scale::reaching(largest, ruler.diagonal()),
        longest_squared: (ruler.diagonal() * LONGEST_EDGE_SHARE).powi(2),
        ruler,
        side,
        corners: Vec::with_capacity(MOST_CORNERS),
        written: 0,
    };
    let written = colouring.write_all(&mut *source, scene);
    let finished = written.and_then(|()| colouring.sink.finish().map_err(of_output));
    // What waited until the header was known has a name.
    for name in ASIDE {
        measuring.scratch.remove(name).map_err(PreviewError::measure)?;
    }
    finished?;
    staged.put_in_place::<IoError>()?;
    Ok(true)
}

/// The reader of one side and the writer have the same kind of error; this one is the writer's.
fn of_output(error: IoError) -> ReportError {
    ReportError::Export(error)
}

/// A file under way.
struct Colouring<'m> {
    sink: Sink,
    partial: &'m Path,
    ruler: Ruler<'m>,
    scale: Scale,
    side: Side,
    /// Square of the longest edge that is not cut.
    longest_squared: f64,
    /// Of triangles that are not written yet, three by three.
    corners: Vec<[f64; 3]>,
    /// How many vertices the file has.
    written: u64,
}

impl Colouring<'_> {
    fn write_all(
        &mut self,
        source: &mut dyn MeshSource<Error = IoError>,
        scene: &Scene<'_, '_, IoError>,
    ) -> Result<(), ReportError> {
        let mut batch = TriangleBatch::default();
        let side = self.side;
        let read = |source| PreviewError::Source { side, source };
        while source.next_batch(&mut batch).map_err(read)? {
            if scene.monitor.cancelled() {
                return Err(PreviewError::Cancelled.into());
            }
            for corners in &batch.corners {
                if corners.as_flattened().iter().all(|x| x.is_finite()) {
                    self.push(*corners)?;
                }
            }
        }
        self.write_corners()
    }

    /// Takes a triangle, in pieces where it is large: those of its longest edge, halved.
    fn push(&mut self, corners: [[f64; 3]; 3]) -> Result<(), ReportError> {
        let mut pieces = vec![corners.map(DVec3::from)];
        while let Some(piece) = pieces.pop() {
            let length = |i: usize| piece[i].distance_squared(piece[(i + 1) % 3]);
            let longest = (0..3).max_by(|&i, &j| length(i).total_cmp(&length(j))).unwrap_or(0);
            if length(longest) > self.longest_squared {
                let [p, q, r] = [0, 1, 2].map(|i| piece[(longest + i) % 3]);
                let middle = p.midpoint(q);
                pieces.extend([[p, middle, r], [middle, q, r]]);
                continue;
            }
            self.corners.extend(piece.map(|corner| corner.to_array()));
            if self.corners.len() >= MOST_CORNERS {
                self.write_corners()?;
            }
        }
        Ok(())
    }

    fn write_corners(&mut self) -> Result<(), ReportError> {
        let distances = self.ruler.distances::<IoError>(self.side, &self.corners)?;
        let colour = |distance: f64| {
            let [red, green, blue] = self.scale.colour(distance);
            [red, green, blue, u8::MAX]
        };
        let colours: Vec<_> = distances.into_iter().map(colour).collect();
        self.sink.vertices(&self.corners).map_err(of_output)?;
        let values = VertexValues { colours: &colours, ..VertexValues::default() };
        self.sink.vertex_values(&values).map_err(of_output)?;
        let end = self.written + self.corners.len() as u64;
        if end > MOST_VERTICES {
            let told = IoError::too_many(self.partial, "coloured corners", MOST_VERTICES);
            return Err(of_output(told));
        }
        let indices: Vec<_> = (self.written..end)
            .step_by(3)
            .map(|first| [first, first + 1, first + 2].map(|corner| corner as u32))
            .collect();
        let triangles = SinkTriangles { indices: &indices, ..SinkTriangles::default() };
        self.sink.triangles(&triangles).map_err(of_output)?;
        self.written = end;
        self.corners.clear();
        Ok(())
    }
}
