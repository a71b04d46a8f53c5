//! The parts of a file that was read: each for itself, or all of them in their places.
//!
//! In:         triangles in the order of their parts.
//! Out:        sources of them.
//! Invariant:  a part is delivered in file order, with the numbers of materials of the whole.
//! Memory:     a block of triangles; maps of nodes spill.

use bytemuck::{Pod, Zeroable};

use crate::ingest::soup::SoupStats;
use crate::io::{BATCH_TRIANGLES, IoError, MATERIALS, SceneTree};
use crate::mesh::{
    Affine, Attributes, Discarded, LengthUnit, Material, MeshSource, Part, TriangleBatch, apply,
    compose, mirrors,
};
use crate::octree::SnapBox;
use crate::store::{
    FileState, NumberedTexts, Record, Resources, Spool, SpoolReader, StoreError, Table,
};

/// A triangle of a part, with all that its file says of it.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct PartTriangle {
    pub(super) corners: [[f64; 3]; 3],
    pub(super) part: u32,
    /// In the file.
    pub(super) number: u32,
    pub(super) material: u32,
    pub(super) polygon: u32,
    pub(super) uvs: [[f32; 2]; 3],
    pub(super) colours: [[u8; 4]; 3],
    pub(super) unused: u32,
}

impl Record for PartTriangle {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.part, self.number)
    }
}

/// What is known of a part. Model units, its own coordinates.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PartRecord {
    pub(super) first: u64,
    pub(super) triangles: u64,
    pub(super) lo: [f64; 3],
    pub(super) hi: [f64; 3],
}

/// The triangles of a file, part by part.
pub struct Scattered {
    pub(super) triangles: Spool<PartTriangle>,
    pub(super) parts: Table<PartRecord>,
    pub(super) names: NumberedTexts,
    /// Where parts stand: every part has a node at least.
    pub scene: SceneTree,
    /// Spools of the materials and of the images.
    pub palette: [FileState; 2],
    /// What a model unit is, where the file says so.
    pub unit: Option<LengthUnit>,
    /// Counts of the whole file.
    pub stats: SoupStats,
    pub(super) materials: Materials,
    pub(super) has: Has,
}

/// What the whole file has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Has {
    pub(super) uvs: bool,
    pub(super) colours: bool,
    pub(super) normals: bool,
    pub(super) materials: bool,
}

/// Triangles may change their material each time, so some are held as read.
const HELD_MATERIALS: usize = 64;

/// The materials of the file, by number.
pub(super) struct Materials {
    /// Those asked for last, each at its number modulo their count.
    pub(super) held: Vec<Option<(u32, Material)>>,
    pub(super) texts: NumberedTexts,
}

impl Materials {
    pub(super) fn new(texts: NumberedTexts) -> Self {
        Self { held: vec![None; HELD_MATERIALS], texts }
    }

    fn get(&mut self, number: u32) -> Result<Material, StoreError> {
        let slot = number as usize % HELD_MATERIALS;
        if let Some((held, material)) = &self.held[slot]
            && *held == number
        {
            return Ok(material.clone());
        }
        let text = self.texts.get(number.into())?;
        let material: Material = serde_json::from_str(&text).map_err(|error| {
            let found = format!("{text}: {error}");
            StoreError::damaged(MATERIALS.as_ref(), number.into(), "a material", found)
        })?;
        self.held[slot] = Some((number, material.clone()));
        Ok(material)
    }
}

impl Scattered {
    /// How many parts there are.
    #[must_use]
    pub fn part_count(&self) -> u32 {
        self.parts.len() as u32
    }

    /// The box of a part in its own coordinates; empty where no corner is finite.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn bounds(&mut self, part: u32) -> Result<SnapBox, StoreError> {
        let PartRecord { lo, hi, .. } = self.parts.get(part.into())?;
        Ok(SnapBox { lo, hi })
    }

    /// The name of a part.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn name(&mut self, part: u32) -> Result<String, StoreError> {
        self.names.get(part.into())
    }

    /// What a file with all parts has to tell its triangles by, besides their parts.
    #[must_use]
    pub fn attributes(&self) -> Attributes {
        let Has { uvs, colours, normals, .. } = self.has;
        Attributes { uvs, colours, normals }
    }

    /// Whether there are several materials, or the file says anything of the one.
    #[must_use]
    pub fn has_materials(&self) -> bool {
        self.has.materials
    }

    /// The triangles of a part, as a file of its own would give them.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn part(&mut self, part: u32, name: &str) -> Result<PartSource<'_>, StoreError> {
        let record = self.parts.get(part.into())?;
        Ok(PartSource {
            triangles: self.triangles.reader(record.first, record.triangles),
            pending: Vec::new(),
            next: 0,
            name: name.to_owned(),
            materials: &mut self.materials,
            used: 1,
            unit: self.unit,
            has: self.has,
            // What became no triangle is of no part, and told with the first.
            discarded: if part == 0 { self.stats.discarded } else { Discarded::default() },
        })
    }
}

impl Scattered {
    /// All parts in all their places; the number of a node stands for that of a part.
    ///
    /// # Errors
    /// The scratch disk fails.
    pub fn placed(&mut self, resources: &Resources) -> Result<PlacedSource<'_>, StoreError> {
        let share_bytes = resources.share_bytes / 16;
        let mut maps = Table::<Affine>::new(resources.scratch, share_bytes);
        let mut places = Table::new(resources.scratch, share_bytes);
        self.scene.for_each(|number, node| {
            let map = match node.parent {
                Some(parent) => compose(&maps.get(parent.into())?, &node.map),
                None => node.map,
            };
            maps.push(map)?;
            match node.part {
                Some(part) => places.push(Place { map, part, node: number }),
                None => Ok(()),
            }
        })?;
        Ok(PlacedSource {
            triangles: &self.triangles,
            parts: &mut self.parts,
            materials: &mut self.materials,
            nodes: self.scene.len(),
            unit: self.unit,
            places,
            next_place: 0,
            current: None,
        })
    }
}

/// A part in its place.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Place {
    map: Affine,
    part: u32,
    node: u32,
}

/// Reads all parts in their places, for what does not ask how they look.
pub struct PlacedSource<'s> {
    triangles: &'s Spool<PartTriangle>,
    parts: &'s mut Table<PartRecord>,
    materials: &'s mut Materials,
    nodes: u64,
    unit: Option<LengthUnit>,
    places: Table<Place>,
    next_place: u64,
    current: Option<(Place, SpoolReader<'s, PartTriangle>)>,
}

impl MeshSource for PlacedSource<'_> {
    type Error = IoError;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, IoError> {
        batch.clear();
        while batch.is_empty() {
            let Some((place, reader)) = &mut self.current else {
                if self.next_place == self.places.len() {
                    return Ok(false);
                }
                let place = self.places.get(self.next_place)?;
                self.next_place += 1;
                let record = self.parts.get(place.part.into())?;
                let reader = self.triangles.reader(record.first, record.triangles);
                self.current = Some((place, reader));
                continue;
            };
            let Some(block) = reader.next_block()? else {
                self.current = None;
                continue;
            };
            for triangle in block {
                let mut corners = triangle.corners.map(|corner| apply(&place.map, corner));
                if mirrors(&place.map) {
                    corners.swap(1, 2);
                }
                batch.push(corners, place.node, triangle.material, triangle.polygon);
            }
        }
        Ok(true)
    }

    fn part_count(&self) -> u64 {
        self.nodes
    }

    fn material_count(&self) -> u64 {
        self.materials.texts.len()
    }

    fn material(&mut self, number: u32) -> Result<Material, IoError> {
        Ok(self.materials.get(number)?)
    }

    fn unit(&self) -> Option<LengthUnit> {
        self.unit
    }

    fn discarded(&self) -> Discarded {
        Discarded::default()
    }

    fn bytes_read(&self) -> u64 {
        0
    }

    fn vertex_count(&self) -> Option<u64> {
        None
    }
}

/// Reads one part.
pub struct PartSource<'s> {
    triangles: SpoolReader<'s, PartTriangle>,
    pending: Vec<PartTriangle>,
    next: usize,
    name: String,
    materials: &'s mut Materials,
    /// One more than the largest number of a material so far.
    used: u64,
    unit: Option<LengthUnit>,
    has: Has,
    discarded: Discarded,
}

impl PartSource<'_> {
    fn push(&mut self, triangle: &PartTriangle, batch: &mut TriangleBatch) {
        batch.push(triangle.corners, 0, triangle.material, triangle.polygon);
        if self.has.uvs {
            batch.uvs.push(triangle.uvs);
        }
        if self.has.colours {
            batch.colours.push(triangle.colours);
        }
        self.used = self.used.max(u64::from(triangle.material) + 1);
    }
}

impl MeshSource for PartSource<'_> {
    type Error = IoError;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, IoError> {
        batch.clear();
        while batch.len() < BATCH_TRIANGLES {
            if self.next == self.pending.len() {
                let Some(block) = self.triangles.next_block()? else { break };
                self.pending.clear();
                self.pending.extend_from_slice(block);
                self.next = 0;
            }
            let triangle = self.pending[self.next];
            self.next += 1;
            self.push(&triangle, batch);
        }
        Ok(!batch.is_empty())
    }

    fn material_count(&self) -> u64 {
        self.used
    }

    fn part(&mut self, _number: u32) -> Result<Part, IoError> {
        Ok(Part { name: self.name.clone() })
    }

    fn material(&mut self, number: u32) -> Result<Material, IoError> {
        Ok(self.materials.get(number)?)
    }

    fn unit(&self) -> Option<LengthUnit> {
        self.unit
    }

    fn has_normals(&self) -> bool {
        self.has.normals
    }

    fn discarded(&self) -> Discarded {
        self.discarded
    }

    fn bytes_read(&self) -> u64 {
        0
    }

    fn vertex_count(&self) -> Option<u64> {
        None
    }
}
