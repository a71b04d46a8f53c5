//! A source whose numbers are turned from one unit into another on their way.
//!
//! Lengths that the user gives without a unit are in the new one. Where neither the file nor the
//! user says what a unit is, numbers stay as they are, and [`crate::mesh::MeshSource::unit`] says
//! that there is none. Memory: none.

use crate::mesh::{Discarded, LengthUnit, Material, MeshSource, Part, SceneNode, TriangleBatch};

/// See the module.
pub struct Converted<'s, S: ?Sized> {
    source: &'s mut S,
    /// What the user says of files that say nothing.
    said: Option<LengthUnit>,
    to: Option<LengthUnit>,
}

impl<'s, S: MeshSource + ?Sized> Converted<'s, S> {
    /// Turns numbers into those of `to`; leaves them where that is `None`.
    pub fn new(source: &'s mut S, said: Option<LengthUnit>, to: Option<LengthUnit>) -> Self {
        Self { source, said, to }
    }

    /// What numbers are multiplied by, if they change.
    fn factor(&self) -> Option<f64> {
        let from = self.source.unit().or(self.said)?;
        self.to.filter(|to| *to != from).map(|to| from.metres() / to.metres())
    }
}

impl<S: MeshSource + ?Sized> MeshSource for Converted<'_, S> {
    type Error = S::Error;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, S::Error> {
        let is_any = self.source.next_batch(batch)?;
        if let Some(factor) = self.factor() {
            let numbers = batch.corners.as_flattened_mut().as_flattened_mut();
            numbers.iter_mut().for_each(|number| *number *= factor);
        }
        Ok(is_any)
    }

    fn part_count(&self) -> u64 {
        self.source.part_count()
    }

    fn material_count(&self) -> u64 {
        self.source.material_count()
    }

    fn part(&mut self, number: u32) -> Result<Part, S::Error> {
        self.source.part(number)
    }

    fn material(&mut self, number: u32) -> Result<Material, S::Error> {
        self.source.material(number)
    }

    fn image_block(
        &mut self,
        number: u32,
        offset: u64,
        bytes: &mut Vec<u8>,
    ) -> Result<(), S::Error> {
        self.source.image_block(number, offset, bytes)
    }

    fn node_count(&self) -> u64 {
        self.source.node_count()
    }

    fn node(&mut self, number: u32) -> Result<Option<SceneNode>, S::Error> {
        let factor = self.factor();
        let node = self.source.node(number)?;
        Ok(node.map(|mut node| {
            // Turns and scales have no unit.
            node.map.iter_mut().for_each(|row| row[3] *= factor.unwrap_or(1.0));
            node
        }))
    }

    fn unit(&self) -> Option<LengthUnit> {
        let from = self.source.unit();
        match self.to {
            Some(to) if from.or(self.said).is_some() => Some(to),
            _ => from,
        }
    }

    fn has_normals(&self) -> bool {
        self.source.has_normals()
    }

    fn discarded(&self) -> Discarded {
        self.source.discarded()
    }

    fn bytes_read(&self) -> u64 {
        self.source.bytes_read()
    }

    fn vertex_count(&self) -> Option<u64> {
        self.source.vertex_count()
    }

    fn next_vertices(&mut self, positions: &mut Vec<[f64; 3]>) -> Result<bool, S::Error> {
        let is_any = self.source.next_vertices(positions)?;
        if let Some(factor) = self.factor() {
            positions.as_flattened_mut().iter_mut().for_each(|number| *number *= factor);
        }
        Ok(is_any)
    }
}
