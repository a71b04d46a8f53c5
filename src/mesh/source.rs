//! The reading end: any file as a stream of triangle batches.

use serde::{Deserialize, Serialize};

use crate::mesh::{LengthUnit, Material, Part, SceneNode, TriangleBatch};

/// Faces that a reader had to leave out because they lead nowhere. Defects, not errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Discarded {
    /// Faces with an index outside of the vertex list.
    pub wild_index_faces: u64,
    /// Faces with fewer than three corners.
    pub short_faces: u64,
}

/// A stream of triangles in file order.
///
/// Parts and materials are numbered in the order in which triangles use them. Both counts may grow
/// while the file is read; a number in a batch is valid once that batch has been delivered. Formats
/// without names have one of each, without a name.
pub trait MeshSource {
    /// What can go wrong in the world of this source.
    type Error: std::error::Error;

    /// Replaces `batch` by the next triangles; `false` when there were none left.
    ///
    /// # Errors
    /// The file cannot be read or ends too early; what was delivered before stays valid.
    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, Self::Error>;

    /// How many parts were seen so far; at least one once a batch was delivered.
    fn part_count(&self) -> u64 {
        1
    }

    /// How many materials were seen so far; at least one once a batch was delivered.
    fn material_count(&self) -> u64 {
        1
    }

    /// A part by its number, which is below [`MeshSource::part_count`].
    ///
    /// # Errors
    /// Names that did not fit in memory cannot be read back.
    fn part(&mut self, _number: u32) -> Result<Part, Self::Error> {
        Ok(Part::default())
    }

    /// A material by its number, which is below [`MeshSource::material_count`].
    ///
    /// # Errors
    /// As for [`MeshSource::part`].
    fn material(&mut self, _number: u32) -> Result<Material, Self::Error> {
        Ok(Material::default())
    }

    /// Replaces `bytes` by the next of an image's from `offset` on, at most a few 100 KiB; by none
    /// at its end, or where it cannot be read. Images are numbered as [`crate::mesh::Image`] says,
    /// and are there once the last batch was delivered.
    ///
    /// # Errors
    /// The file or the scratch folder fails.
    fn image_block(
        &mut self,
        _number: u32,
        _offset: u64,
        bytes: &mut Vec<u8>,
    ) -> Result<(), Self::Error> {
        bytes.clear();
        Ok(())
    }

    /// How many nodes there are; known once the last batch was delivered. None where the format has
    /// no scenes, or where parts are read in their places.
    fn node_count(&self) -> u64 {
        0
    }

    /// A node by its number, which is below [`MeshSource::node_count`]; `None` where there is none.
    ///
    /// # Errors
    /// As for [`MeshSource::part`].
    fn node(&mut self, _number: u32) -> Result<Option<SceneNode>, Self::Error> {
        Ok(None)
    }

    /// What a model unit is, where the file says so; known once a batch was delivered.
    fn unit(&self) -> Option<LengthUnit> {
        None
    }

    /// Whether the file has normals; known once the last batch was delivered.
    fn has_normals(&self) -> bool {
        false
    }

    /// What was left out so far.
    fn discarded(&self) -> Discarded;

    /// Bytes of the input consumed so far.
    fn bytes_read(&self) -> u64;

    /// The number of vertices that the file lists, in formats that have indices (after the end).
    fn vertex_count(&self) -> Option<u64>;

    /// Replaces `positions` by those of the next vertices that the file lists, in the order of their
    /// numbers, whether triangles name them or not; `false` when there were none left. To be asked
    /// once the last batch was delivered; none where the format has no numbers.
    ///
    /// # Errors
    /// As for [`MeshSource::next_batch`].
    fn next_vertices(&mut self, positions: &mut Vec<[f64; 3]>) -> Result<bool, Self::Error> {
        positions.clear();
        Ok(false)
    }
}
