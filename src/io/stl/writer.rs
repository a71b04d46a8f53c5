//! Writes binary STL: corners rounded to `f32`, normals computed from what is written.
//!
//! The facet count is patched at the end. Memory: one buffer.

use std::path::Path;

use crate::io::error::IoError;
use crate::io::output::Output;
use crate::io::stl::binary::{FACET_BYTES, HEADER_BYTES};
use crate::mesh::{MeshSink, SinkState, SinkStats, SinkTriangles};
use crate::store::Scratch;

/// Must not begin with `solid`, or readers take the file for text.
const TITLE: &[u8] = b"brickmend: binary STL, little endian";

/// Writes facets; vertices are counted only, since the format has none.
#[derive(Debug)]
pub(crate) struct StlWriter {
    output: Output,
    vertices: u64,
    facets: u64,
}

impl StlWriter {
    pub(crate) fn create(path: &Path, scratch: &Scratch) -> Result<Self, IoError> {
        let mut output = Output::create(path, scratch)?;
        let mut header = [0; HEADER_BYTES];
        header[..TITLE.len()].copy_from_slice(TITLE);
        output.write(&header)?;
        Ok(Self { output, vertices: 0, facets: 0 })
    }

    /// Goes on where an earlier writer was.
    pub(crate) fn reopen(
        path: &Path,
        scratch: &Scratch,
        state: &SinkState,
    ) -> Result<Self, IoError> {
        let output = Output::reopen(path, scratch, &state.output)?;
        Ok(Self { output, vertices: state.vertices, facets: state.triangles })
    }
}

impl MeshSink for StlWriter {
    type Error = IoError;

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), IoError> {
        self.vertices += positions.len() as u64;
        Ok(())
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), IoError> {
        let SinkTriangles { corners, .. } = *triangles;
        self.facets += corners.len() as u64;
        if self.facets > u64::from(u32::MAX) {
            let path = self.output.path().to_path_buf();
            return Err(IoError::TooLarge { path, what: "facets", limit: u64::from(u32::MAX) });
        }
        corners.iter().try_for_each(|corners| self.output.write(&facet(corners)))
    }

    fn bytes_so_far(&self) -> u64 {
        self.output.bytes()
    }

    fn checkpoint(&mut self) -> Result<SinkState, IoError> {
        let output = self.output.state()?;
        let Self { vertices, facets: triangles, .. } = *self;
        Ok(SinkState { vertices, triangles, output, ..SinkState::default() })
    }

    fn finish(mut self: Box<Self>) -> Result<SinkStats, IoError> {
        let count = u32::try_from(self.facets).expect("checked when they were added");
        self.output.patch(&count.to_le_bytes(), 80)?;
        let file = self.output.finish()?;
        Ok(SinkStats { vertices: self.vertices, triangles: self.facets, file })
    }
}

#[inline]
fn facet(corners: &[[f64; 3]; 3]) -> [u8; FACET_BYTES] {
    let corners = corners.map(|corner| corner.map(|x| x as f32));
    let normal = normal(corners);
    let mut facet = [0; FACET_BYTES];
    for (row, numbers) in [normal, corners[0], corners[1], corners[2]].iter().enumerate() {
        for (axis, number) in numbers.iter().enumerate() {
            let at = 12 * row + 4 * axis;
            facet[at..at + 4].copy_from_slice(&number.to_le_bytes());
        }
    }
    facet
}

/// The unit normal; zero for facets without area.
#[inline]
fn normal([a, b, c]: [[f32; 3]; 3]) -> [f32; 3] {
    let from_a = |p: [f32; 3]| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(a[k]));
    let (u, v) = (from_a(b), from_a(c));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]).sqrt();
    if length > 0.0 && length.is_finite() { cross.map(|x| (x / length) as f32) } else { [0.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_follow_the_corners_and_vanish_without_area() {
        let corners = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
        assert_eq!(normal(corners), [0.0, 0.0, 1.0]);
        assert_eq!(normal([corners[0], corners[1], corners[1]]), [0.0; 3]);
    }

    #[test]
    fn more_facets_than_the_count_can_hold_are_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut writer =
            StlWriter::create(&folder.path().join("a.stl"), &Scratch::new(folder.path()))
                .expect("creates");
        writer.facets = u64::from(u32::MAX) - 1;
        let (indices, corners) = ([[0; 3]], [[[0.0; 3]; 3]]);
        let facet = SinkTriangles {
            indices: &indices,
            corners: &corners,
            surfaces: &[],
            ..SinkTriangles::default()
        };
        writer.triangles(&facet).expect("the last one fits");
        let refused = writer.triangles(&facet);
        assert!(matches!(refused, Err(IoError::TooLarge { .. })));
    }
}
