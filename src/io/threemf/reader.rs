//! Reads a 3MF package: all of its model first, then every object in every place where it stands.
//!
//! Each object in its place is a part; by itself each object is one, and its places are nodes. Vertices are numbered on from object to object. Numbers are
//! in the unit of the file. Without an item to build, all objects of the root are delivered.
//! Colours are those of vertices where any triangle has several; else they are materials.
//! Memory: that of [`Scene`], and an eighth of the share for the names of parts; while the model is
//! parsed a tag and a block besides.

use std::io::Read;
use std::path::PathBuf;

use bytemuck::{Pod, Zeroable};

use crate::io::error::{IoError, Place, shown};
use crate::io::input::Input;
use crate::io::listed::LISTED_POSITIONS;
use crate::io::polygon::WHITE;
use crate::io::threemf::archive::{Archive, Members};
use crate::io::threemf::instances::{Instance, Totals, Walk};
use crate::io::threemf::model::ModelParser;
use crate::io::threemf::part_name::part_key;
use crate::io::threemf::properties::NOTHING;
use crate::io::threemf::scene::{Face, Object, Scene};
use crate::io::threemf::transform::Transform;
use crate::io::threemf::vocabulary::{MODEL_RELATIONSHIP, Space};
use crate::io::threemf::xml::{Markup, read_xml};
use crate::io::{BATCH_TRIANGLES, ReadOptions};
use crate::mesh::{
    Discarded, LengthUnit, Material, MeshSource, Part, Placement, SceneNode, TriangleBatch,
};
use crate::store::{Scratch, ScratchFile, Table};

/// Where a package says what it is.
const RELATIONSHIPS_PART: &str = "_rels/.rels";
/// What is handed on of an image at a time.
const IMAGE_BLOCK_BYTES: u64 = 64 << 10;

/// Reads a 3MF file in batches.
pub(crate) struct ThreeMfReader {
    path: PathBuf,
    scratch: Scratch,
    /// Until the model is parsed, and longer where it has images.
    archive: Option<Box<Archive>>,
    is_parsed: bool,
    /// The image that was asked for last, unpacked, and its size.
    unpacked: Option<(u32, ScratchFile, u64)>,
    scene: Scene,
    placement: Placement,
    walk: Walk,
    /// A second walk, over the vertices alone.
    listing: Listing,
    /// What was walked over, where parts are by themselves.
    nodes: Table<Node>,
    totals: Totals,
    current: Option<Current>,
    /// Vertices and faces of the instances before the current one.
    vertices: u64,
    faces: u64,
    /// By part: the number of its name.
    part_names: Table<u32>,
    /// The last property, and the number of its material.
    last: Option<([u32; 2], u32)>,
    discarded: Discarded,
    bytes_read: u64,
}

/// An object in its place: the map into its parent, the number of that, and its row.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Node {
    local: Transform,
    parent: u32,
    row: u32,
}

/// No parent.
const NONE: u32 = u32::MAX;

/// How far vertices have been listed.
#[derive(Default)]
struct Listing {
    walk: Walk,
    /// The object in its place, and the next of its vertices.
    instance: Option<(Instance, u64)>,
}

/// The instance that is being delivered.
struct Current {
    instance: Instance,
    mirrors: bool,
    next: u64,
    part: Option<u32>,
}

impl ThreeMfReader {
    pub(crate) fn open(
        input: Input,
        scratch: &Scratch,
        options: &ReadOptions,
    ) -> Result<Self, IoError> {
        let path = input.path().to_path_buf();
        let mut scene = Scene::new(&path, scratch, options.share_bytes)?;
        let mut archive = Archive::open(input)?;
        let (name, member) = root_model(&mut archive)?;
        scene.part(&name, member);
        Ok(Self {
            path,
            scratch: scratch.clone(),
            archive: Some(Box::new(archive)),
            is_parsed: false,
            unpacked: None,
            scene,
            placement: options.placement,
            walk: Walk::default(),
            listing: Listing::default(),
            nodes: Table::new(scratch, options.share_bytes / 32),
            totals: Totals::default(),
            current: None,
            vertices: 0,
            faces: 0,
            part_names: Table::new(scratch, options.share_bytes / 8),
            last: None,
            discarded: Discarded::default(),
            bytes_read: 0,
        })
    }

    /// Parses all parts of the model and looks at every instance once.
    fn parse(&mut self, mut archive: Box<Archive>) -> Result<(), IoError> {
        let members = Members::clone(archive.members());
        let mut number = 0;
        // The root names the others.
        while let Some(part) = self.scene.parts.get(number).cloned() {
            let mut parser = ModelParser::new(&mut self.scene, &members, number as u32);
            let content = archive.member(part.member)?;
            read_xml(content, &self.path, &part.name, |markup| parser.take(&markup))?;
            number += 1;
        }
        self.bytes_read = archive.bytes_read();
        self.archive = Some(archive).filter(|_| !self.scene.images.is_empty());
        self.scene.check()?;
        self.totals = Totals::of(&mut self.scene, &self.path)?;
        Ok(())
    }

    /// Goes on to the next instance; `false` behind the last one.
    fn advance(&mut self) -> Result<bool, IoError> {
        if let Some(Current { instance, .. }) = self.current.take() {
            self.vertices += instance.object.vertices;
            self.faces += instance.object.triangles;
        }
        while let Some(mut instance) = self.walk.next(&mut self.scene, &self.path)? {
            if self.placement == Placement::ByItself {
                let parent = instance.parent.unwrap_or(NONE);
                self.nodes.push(Node { local: instance.local, parent, row: instance.row })?;
                instance.transform = Transform::IDENTITY;
            }
            if instance.has_mesh() && instance.object.part == 0 {
                let mirrors = instance.transform.mirrors();
                self.current = Some(Current { instance, mirrors, next: 0, part: None });
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Delivers the next face of the current instance.
    fn deliver(&mut self, batch: &mut TriangleBatch) -> Result<(), IoError> {
        let Some(current) = &mut self.current else { return Ok(()) };
        let object = current.instance.object;
        let polygon = (self.faces + current.next) as u32;
        let face = self.scene.faces.get(object.first_triangle + current.next)?;
        current.next += 1;
        if face.vertices.iter().any(|&vertex| u64::from(vertex) >= object.vertices) {
            self.discarded.wild_index_faces += 1;
            return Ok(());
        }
        let mut vertices = face.vertices.map(u64::from);
        if current.mirrors {
            vertices.swap(1, 2);
        }
        let mut corners = [[0.0; 3]; 3];
        for (corner, vertex) in corners.iter_mut().zip(vertices) {
            let position = self.scene.vertices.get(object.first_vertex + vertex)?;
            *corner = current.instance.transform.apply(position);
        }
        let part = match current.part {
            Some(part) => part,
            None => {
                let part = self.part_names.len() as u32;
                self.part_names.push(object.name)?;
                current.part = Some(part);
                if self.placement == Placement::ByItself {
                    let row = current.instance.row.into();
                    self.scene.objects.set(row, Object { part: part + 1, ..object })?;
                }
                part
            }
        };
        let mirrors = self.current.as_ref().is_some_and(|current| current.mirrors);
        let material = self.paint(&face, mirrors, batch)?;
        batch.push(corners, part, material, polygon);
        batch.indices.push(vertices.map(|vertex| (self.vertices + vertex) as u32));
        Ok(())
    }

    /// The material of a face; its texture coordinates and colours go to the batch, if the file has
    /// any.
    fn paint(
        &mut self,
        face: &Face,
        mirrors: bool,
        batch: &mut TriangleBatch,
    ) -> Result<u32, IoError> {
        let (has_uvs, has_colours) = (self.scene.properties.has_uvs, self.scene.has_colours);
        if !has_uvs && !has_colours {
            return self.material_of(face);
        }
        let group = match face.resource.checked_sub(1) {
            Some(resource) => self.scene.group_of(resource)?,
            None => None,
        };
        let mut corners = face.properties;
        if mirrors {
            corners.swap(1, 2);
        }
        let (mut uvs, mut colours) = ([[0.0; 2]; 3], [WHITE; 3]);
        if let Some(group) = group {
            for (at, &property) in corners.iter().enumerate() {
                uvs[at] = self.scene.properties.uv(group, property.into())?;
                if group.is_colours() {
                    let colour = self.scene.properties.colour(group, property.into())?;
                    colours[at] = colour.unwrap_or(WHITE);
                }
            }
        }
        if has_uvs {
            batch.uvs.push(uvs);
        }
        if has_colours {
            batch.colours.push(colours);
        }
        // Colours of vertices are no materials, unless light passes.
        let is_plain = colours[1..] == [colours[0]; 2];
        let is_opaque = !(is_plain && (1..255).contains(&colours[0][3]));
        match group.filter(|group| has_colours && group.is_colours() && is_opaque) {
            Some(_) => self.material_of(&Face { resource: 0, properties: [0; 3], ..*face }),
            None => self.material_of(face),
        }
    }

    /// Unpacks an image; what is missing or broken is none.
    fn unpack_image(&mut self, number: u32) -> Result<Option<(u32, ScratchFile, u64)>, IoError> {
        let name = self.scene.images.name(number)?;
        let key = part_key(&String::from_utf8_lossy(&name));
        let Some(archive) = &mut self.archive else { return Ok(None) };
        let Some(&member) = archive.members().get(&key) else { return Ok(None) };
        let Ok(mut content) = archive.member(member) else { return Ok(None) };
        let file = self.scratch.anonymous("image")?;
        let (mut block, mut size_bytes) = (vec![0; IMAGE_BLOCK_BYTES as usize], 0);
        loop {
            match content.read(&mut block) {
                Ok(0) => return Ok(Some((number, file, size_bytes))),
                Ok(count) => {
                    file.write_at(&block[..count], size_bytes)?;
                    size_bytes += count as u64;
                }
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(_) => return Ok(None),
            }
        }
    }

    fn material_of(&mut self, face: &Face) -> Result<u32, IoError> {
        let property = [face.resource, face.properties[0]];
        if let Some((last, material)) = self.last
            && last == property
        {
            return Ok(material);
        }
        let definition = match face.resource.checked_sub(1) {
            Some(resource) => self.scene.definition(resource, face.properties[0])?,
            None => NOTHING,
        };
        let material = self.scene.properties.material(definition)?;
        self.last = Some((property, material));
        Ok(material)
    }
}

impl MeshSource for ThreeMfReader {
    type Error = IoError;

    fn unit(&self) -> Option<LengthUnit> {
        Some(self.scene.unit)
    }

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, IoError> {
        batch.clear();
        if !std::mem::replace(&mut self.is_parsed, true)
            && let Some(archive) = self.archive.take()
        {
            self.parse(archive)?;
        }
        while batch.len() < BATCH_TRIANGLES {
            let is_open = |c: &Current| c.next < c.instance.object.triangles;
            if self.current.as_ref().is_some_and(is_open) {
                self.deliver(batch)?;
            } else if !self.advance()? {
                break;
            }
        }
        Ok(!batch.is_empty())
    }

    fn part_count(&self) -> u64 {
        self.part_names.len()
    }

    fn material_count(&self) -> u64 {
        self.scene.properties.material_count()
    }

    fn part(&mut self, number: u32) -> Result<Part, IoError> {
        let name = self.part_names.get(number.into())?;
        let name = self.scene.names.name(name)?;
        Ok(Part { name: String::from_utf8_lossy(&name).into_owned() })
    }

    fn node_count(&self) -> u64 {
        self.nodes.len()
    }

    fn node(&mut self, number: u32) -> Result<Option<SceneNode>, IoError> {
        let Node { local, parent, row } = self.nodes.get(number.into())?;
        let object = self.scene.objects.get(row.into())?;
        let name = self.scene.names.name(object.name)?;
        Ok(Some(SceneNode {
            name: String::from_utf8_lossy(&name).into_owned(),
            parent: (parent != NONE).then_some(parent),
            map: local.to_affine(),
            part: object.part.checked_sub(1),
        }))
    }

    fn material(&mut self, number: u32) -> Result<Material, IoError> {
        self.scene.properties.describe(number)
    }

    fn image_block(
        &mut self,
        number: u32,
        offset: u64,
        bytes: &mut Vec<u8>,
    ) -> Result<(), IoError> {
        bytes.clear();
        if self.unpacked.as_ref().is_none_or(|(unpacked, ..)| *unpacked != number) {
            self.unpacked = self.unpack_image(number)?;
        }
        if let Some((_, file, size_bytes)) = &self.unpacked {
            bytes.resize(size_bytes.saturating_sub(offset).min(IMAGE_BLOCK_BYTES) as usize, 0);
            file.read_at(bytes, offset)?;
        }
        Ok(())
    }

    fn discarded(&self) -> Discarded {
        self.discarded
    }

    fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    fn vertex_count(&self) -> Option<u64> {
        Some(match self.placement {
            Placement::InScene => self.totals.vertices,
            Placement::ByItself => self.vertices,
        })
    }

    fn next_vertices(&mut self, positions: &mut Vec<[f64; 3]>) -> Result<bool, IoError> {
        positions.clear();
        // By themselves objects are numbered once, which a walk does not tell.
        if self.placement == Placement::ByItself {
            return Ok(false);
        }
        let Listing { walk, instance } = &mut self.listing;
        while (positions.len() as u64) < LISTED_POSITIONS {
            match instance {
                Some((placed, next)) if *next < placed.object.vertices => {
                    let vertex = placed.object.first_vertex + *next;
                    let position = self.scene.vertices.get(vertex)?;
                    positions.push(placed.transform.apply(position));
                    *next += 1;
                }
                _ => match walk.next(&mut self.scene, &self.path)? {
                    Some(placed) => *instance = Some((placed, 0)),
                    None => break,
                },
            }
        }
        Ok(!positions.is_empty())
    }
}

/// Name and member of the model that the package is there for.
fn root_model(archive: &mut Archive) -> Result<(String, usize), IoError> {
    const EXPECTED: &str = "a 3MF package, whose _rels/.rels leads to a model";
    let (path, members) = (archive.path().to_path_buf(), Members::clone(archive.members()));
    let refused = |found: String| IoError::unreadable(&path, Place::Byte(0), EXPECTED, found);
    let Some(&relationships) = members.get(RELATIONSHIPS_PART) else {
        return Err(refused("a zip archive without one".to_owned()));
    };
    let mut model = None;
    let content = archive.member(relationships)?;
    read_xml(content, &path, RELATIONSHIPS_PART, |markup| {
        let Markup::Start(tag) = markup else { return Ok(()) };
        if tag.name() != (Space::Relationships, "Relationship") {
            return Ok(());
        }
        let (mut is_model, mut target) = (false, None);
        tag.attributes(|_, name, value| {
            match name {
                "Type" => is_model = value == MODEL_RELATIONSHIP,
                "Target" => target = Some(value.to_owned()),
                _ => {}
            }
            Ok(())
        })?;
        if is_model && model.is_none() {
            model = target;
        }
        Ok(())
    })?;
    let Some(name) = model else {
        return Err(refused("a zip archive of something else".to_owned()));
    };
    match members.get(&part_key(&name)) {
        Some(&member) => Ok((name, member)),
        None => Err(refused(format!("a way to {}, which is not there", shown(name.as_bytes())))),
    }
}
