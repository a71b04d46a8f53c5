//! What the model parts of a package say: resources by number, meshes, components, build items.
//!
//! In: parts, as they are parsed. Out: the same by number, for the walk over the instances.
//! Memory: half of the share for the vertices, an eighth for the triangles, less for everything
//! else; all of it is spilled beyond.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::io::threemf::properties::{Group, NOTHING, Properties};
use crate::io::threemf::transform::Transform;
use crate::io::threemf::xml::Where;
use crate::mesh::LengthUnit;
use crate::store::{Dictionary, Scratch, StoreError, Table};

/// What a resource turned out to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// It was named, and not yet seen.
    Missing,
    Object,
    /// A group of properties that have materials or colours.
    Materials,
    /// A group of properties that have none, but may have texture coordinates.
    Bare,
    /// An image.
    Texture,
    /// None of ours.
    Foreign,
}

/// A resource of a part.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Resource {
    kind: u32,
    /// The row in the table of its kind.
    pub(super) row: u32,
    /// Where it is defined; before that, where it was named first.
    offset: u64,
    part: u32,
    is_component: u32,
}

const KINDS: [Kind; 6] =
    [Kind::Missing, Kind::Object, Kind::Materials, Kind::Bare, Kind::Texture, Kind::Foreign];

impl Resource {
    pub(super) fn kind(&self) -> Kind {
        KINDS[self.kind as usize]
    }

    /// Whether an object is part of another one.
    pub(super) fn is_component(&self) -> bool {
        self.is_component != 0
    }
}

/// Ranges of the tables that make an object.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Object {
    pub(super) first_vertex: u64,
    pub(super) vertices: u64,
    pub(super) first_triangle: u64,
    pub(super) triangles: u64,
    pub(super) first_component: u64,
    pub(super) components: u64,
    /// The number of its name.
    pub(super) name: u32,
    /// Whether it is there for the printer alone.
    pub(super) is_support: u32,
    /// One more than the number of the part that it is, where parts are read by themselves, once
    /// it was read.
    pub(super) part: u32,
    pub(super) padding: u32,
}

/// A triangle of an object, with numbers of vertices in it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Face {
    /// As written; where that is no number of a vertex, the largest, which never is one.
    pub(super) vertices: [u32; 3],
    /// One more than the resource that its property is in; 0 where it has none.
    pub(super) resource: u32,
    /// By corner; the first is the one that its material comes from.
    pub(super) properties: [u32; 3],
}

/// An object in its place: a component, or an item of the build.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Placed {
    pub(super) transform: Transform,
    pub(super) resource: u64,
}

/// A model part.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub(super) name: String,
    pub(super) member: usize,
}

/// All that was read.
pub(super) struct Scene {
    path: PathBuf,
    pub(super) unit: LengthUnit,
    pub(super) parts: Vec<Part>,
    part_numbers: BTreeMap<usize, u32>,
    /// Part and number in it of every resource.
    keys: Dictionary,
    resources: Table<Resource>,
    pub(super) objects: Table<Object>,
    pub(super) names: Dictionary,
    pub(super) vertices: Table<[f64; 3]>,
    pub(super) faces: Table<Face>,
    pub(super) components: Table<Placed>,
    pub(super) items: Table<Placed>,
    pub(super) properties: Properties,
    /// Names of the parts that images are in.
    pub(super) images: Dictionary,
    /// Whether any triangle has colours that differ between its corners.
    pub(super) has_colours: bool,
}

impl Scene {
    pub(super) fn new(path: &Path, scratch: &Scratch, share_bytes: u64) -> Result<Self, IoError> {
        Ok(Self {
            path: path.to_path_buf(),
            unit: LengthUnit::default(),
            parts: Vec::new(),
            part_numbers: BTreeMap::new(),
            keys: Dictionary::new(scratch, share_bytes / 32),
            resources: Table::new(scratch, share_bytes / 32),
            objects: Table::new(scratch, share_bytes / 32),
            names: Dictionary::new(scratch, share_bytes / 32),
            vertices: Table::new(scratch, share_bytes / 2),
            faces: Table::new(scratch, share_bytes / 8),
            components: Table::new(scratch, share_bytes / 32),
            items: Table::new(scratch, share_bytes / 32),
            properties: Properties::new(scratch, share_bytes / 32)?,
            images: Dictionary::new(scratch, share_bytes / 64),
            has_colours: false,
        })
    }

    /// The number of a model part; the same for all its spellings.
    pub(super) fn part(&mut self, name: &str, member: usize) -> u32 {
        let next = self.parts.len() as u32;
        *self.part_numbers.entry(member).or_insert_with(|| {
            self.parts.push(Part { name: name.to_owned(), member });
            next
        })
    }

    /// The number of a resource that is named here.
    pub(super) fn resource_number(
        &mut self,
        part: u32,
        id: u32,
        at: &Where,
    ) -> Result<u32, StoreError> {
        let number = self.keys.number(&[part.to_le_bytes(), id.to_le_bytes()].concat())?;
        if u64::from(number) == self.resources.len() {
            let resource = Resource { part, offset: at.offset, ..Resource::zeroed() };
            self.resources.push(resource)?;
        }
        Ok(number)
    }

    /// The image of a resource that was defined before.
    pub(super) fn image(&mut self, part: u32, id: u32) -> Result<Option<u32>, StoreError> {
        let number = self.keys.find(&[part.to_le_bytes(), id.to_le_bytes()].concat())?;
        let Some(number) = number else { return Ok(None) };
        let resource = self.resource(number)?;
        Ok((resource.kind() == Kind::Texture).then_some(resource.row))
    }

    /// The group of properties of a resource that was defined before.
    pub(super) fn group_of(&mut self, resource: u32) -> Result<Option<Group>, StoreError> {
        let Resource { row, .. } = self.resource(resource)?;
        match self.resource(resource)?.kind() {
            Kind::Materials | Kind::Bare => self.properties.group(row).map(Some),
            _ => Ok(None),
        }
    }

    /// Says what a resource is.
    pub(super) fn define(
        &mut self,
        number: u32,
        kind: Kind,
        row: u32,
        at: &Where,
    ) -> Result<(), IoError> {
        let before = self.resource(number)?;
        if before.kind() != Kind::Missing {
            return Err(
                at.unreadable("a resource with an id of its own", "an id for the second time")
            );
        }
        let resource = Resource { kind: kind as u32, row, offset: at.offset, ..before };
        Ok(self.resources.set(number.into(), resource)?)
    }

    pub(super) fn mark_component(&mut self, number: u32) -> Result<(), StoreError> {
        let resource = self.resource(number)?;
        self.resources.set(number.into(), Resource { is_component: 1, ..resource })
    }

    pub(super) fn resource(&mut self, number: u32) -> Result<Resource, StoreError> {
        self.resources.get(number.into())
    }

    pub(super) fn resource_count(&self) -> u64 {
        self.resources.len()
    }

    /// The place of a resource, for messages.
    pub(super) fn place(&mut self, number: u32) -> Result<Where, StoreError> {
        let Resource { offset, part, .. } = self.resource(number)?;
        let part = self.parts[part as usize].name.clone();
        Ok(Where { path: self.path.clone(), part, offset })
    }

    /// Whether everything that was named is there.
    pub(super) fn check(&mut self) -> Result<(), IoError> {
        for number in 0..self.resource_count() {
            let number = number as u32;
            if self.resource(number)?.kind() == Kind::Missing {
                let key = self.keys.name(number)?;
                let id = key[4..].iter().rev().fold(0, |sum, &byte| sum << 8 | u32::from(byte));
                let expected = format!("resource {id}, which is named here");
                return Err(self.place(number)?.unreadable(expected, "no such resource"));
            }
        }
        Ok(())
    }

    /// The definition that a property of a resource has.
    pub(super) fn definition(&mut self, resource: u32, property: u32) -> Result<u32, IoError> {
        let Resource { row, .. } = self.resource(resource)?;
        match self.resource(resource)?.kind() {
            Kind::Materials | Kind::Bare => {
                let group = self.properties.group(row)?;
                let found = self.properties.definition(group, property.into())?;
                found.map_or_else(|| Err(self.no_property(resource, group, property)?), Ok)
            }
            Kind::Texture | Kind::Foreign => Ok(NOTHING),
            Kind::Object | Kind::Missing => {
                let at = self.place(resource)?;
                Err(at
                    .unreadable("a group of properties", "an object that a triangle names as its"))
            }
        }
    }

    fn no_property(
        &mut self,
        resource: u32,
        group: Group,
        property: u32,
    ) -> Result<IoError, StoreError> {
        let expected = format!("a group with the property {property}, which a triangle names");
        let found = format!("{} properties", group.count);
        Ok(self.place(resource)?.unreadable(expected, &found))
    }
}
