//! Streams the triangles of a glTF scene, node by node.
//!
//! A part is a node with triangles, also where names repeat; a vertex is numbered anew for every
//! node, since each puts it elsewhere. By themselves parts are meshes, each read at the first node
//! that has it; copies of a mesh within a node are nodes in that one. Meshes are taken as they are stored: skins, morph targets
//! and animations move nothing. Texture coordinates are turned, so that v goes up. Indices that
//! lead nowhere are counted, accessors that leave their buffers end the reading. Memory: half of
//! the share for the objects of the file, a third for blocks of its buffers; see
//! [`crate::io::gltf::draco`] for what is compressed.

use crate::io::error::IoError;
use crate::io::gltf::buffers::Buffers;
use crate::io::gltf::container::find_chunks;
use crate::io::gltf::images;
use crate::io::gltf::listed::Listed;
use crate::io::gltf::load::load;
use crate::io::gltf::materials;
use crate::io::gltf::model::{MeshRecord, Model, NONE};
use crate::io::gltf::nodes::Nodes;
use crate::io::gltf::scene::{Copies, Visited, Walk};
use crate::io::gltf::stream::Stream;
use crate::io::input::Input;
use crate::io::polygon::polygon_number;
use crate::io::{BATCH_TRIANGLES, ReadOptions};
use crate::mesh::{
    Affine, Discarded, LengthUnit, Material, MeshSource, Part, Placement, SceneNode, TriangleBatch,
};
use crate::store::{Scratch, Table};

/// The node whose mesh is being delivered.
struct Visit {
    node: u32,
    mesh: u32,
    /// Its number among the parts, once a triangle was delivered.
    part: Option<u32>,
    copies: Copies,
    map: Affine,
    /// The range of its primitives, and the next one.
    first: u64,
    end: u64,
    next: u64,
    /// Triangles of this copy that were delivered.
    triangles: u64,
}

/// Reads a glTF file in batches.
pub(crate) struct GltfReader {
    model: Model,
    buffers: Buffers,
    placement: Placement,
    walk: Walk,
    nodes: Nodes,
    visit: Option<Visit>,
    stream: Option<Stream>,
    /// By part its node, by material its number in the file.
    parts: Table<u32>,
    materials: Table<u32>,
    unnamed_material: Option<u32>,
    /// Nodes and copies so far: what vertices are numbered in.
    scope: u64,
    vertices: u64,
    listed: Listed,
    polygons: u64,
    discarded: Discarded,
    /// Bytes of the JSON and of accessors in use.
    counted_bytes: u64,
}

impl GltfReader {
    pub(crate) fn open(
        mut input: Input,
        scratch: &Scratch,
        options: &ReadOptions,
    ) -> Result<Self, IoError> {
        let share = options.share_bytes;
        let chunks = find_chunks(&mut input)?;
        let counted_bytes = chunks.json.end - chunks.json.start;
        let mut model = load(&mut input, chunks.json, chunks.is_text, scratch, share / 2)?;
        let buffers = Buffers::new(input, chunks.binary, share / 3);
        let placement = options.placement;
        let walk = Walk::new(&mut model, scratch, share / 64, placement)?;
        Ok(Self {
            placement,
            nodes: Nodes::new(scratch, share / 64),
            model,
            buffers,
            walk,
            visit: None,
            stream: None,
            parts: Table::new(scratch, share / 64),
            materials: Table::new(scratch, share / 64),
            unnamed_material: None,
            scope: 0,
            vertices: 0,
            listed: Listed::new(scratch, share / 64),
            polygons: 0,
            discarded: Discarded::default(),
            counted_bytes,
        })
    }

    /// Goes to the next primitive; `false` behind the last.
    fn next_stream(&mut self) -> Result<bool, IoError> {
        let Some(visit) = &mut self.visit else { return self.next_visit() };
        if visit.next < visit.end {
            let number = visit.next;
            visit.next += 1;
            let map = visit.map;
            let stream = Stream::open(&mut self.model, &mut self.buffers, number, map)?;
            match stream {
                Some(stream) => self.begin(stream, (number, &map))?,
                // The vertices of points and lines are in the file too.
                None => match self.model.primitives.get(number)?.position {
                    NONE => {}
                    position => drop(self.number_vertices(position, (number, &map))?),
                },
            }
            return Ok(true);
        }
        if visit.triangles == 0 {
            // Nothing stays nothing, wherever it is put: it is looked at once.
            let mesh = self.model.mesh(visit.mesh)?;
            self.model.meshes.set(visit.mesh.into(), MeshRecord { count: 0, ..mesh })?;
            self.visit = None;
            return Ok(true);
        }
        match visit.copies.next(&mut self.model, &mut self.buffers)? {
            Some(map) => {
                self.scope += 1;
                (visit.map, visit.next, visit.triangles) = (map, visit.first, 0);
            }
            None => self.visit = None,
        }
        Ok(true)
    }

    /// Goes to the next node with a mesh.
    fn next_visit(&mut self) -> Result<bool, IoError> {
        let Some(visited) = self.walk.next(&mut self.model)? else { return Ok(false) };
        let is_alone = self.placement == Placement::ByItself;
        if is_alone {
            self.nodes.enter(&mut self.model, &mut self.buffers, &visited)?;
        }
        let Visited { number, node, .. } = visited;
        if node.mesh == NONE {
            return Ok(true);
        }
        let mesh = self.model.mesh(node.mesh)?;
        if mesh.part != NONE {
            return Ok(true);
        }
        let (first, end) = (mesh.first, mesh.first + u64::from(mesh.count));
        let mut copies = match is_alone {
            true => Copies::one(number),
            false => Copies::new(&mut self.model, &mut self.buffers, (number, &node))?,
        };
        if let Some(map) = copies.next(&mut self.model, &mut self.buffers)? {
            self.scope += 1;
            let visit = Visit {
                node: number,
                mesh: node.mesh,
                part: None,
                copies,
                map,
                first,
                end,
                next: first,
                triangles: 0,
            };
            self.visit = Some(visit);
        }
        Ok(true)
    }

    /// The number in the file of the first vertex of an accessor, that a primitive has in this place.
    fn number_vertices(
        &mut self,
        accessor: u32,
        (primitive, map): (u64, &Affine),
    ) -> Result<u32, IoError> {
        let mut record = self.model.accessor(accessor)?;
        if record.scope != self.scope {
            record.scope = self.scope;
            record.first_vertex = self.vertices as u32;
            self.vertices = self.vertices.saturating_add(record.count);
            if self.vertices > u64::from(u32::MAX) {
                return Err(IoError::too_many(&self.model.path, "vertices", u32::MAX.into()));
            }
            self.model.accessors.set(accessor.into(), record)?;
            self.listed.enter(primitive, map)?;
        }
        Ok(record.first_vertex)
    }

    /// Numbers the vertices of a primitive and counts its bytes.
    fn begin(&mut self, mut stream: Stream, placed: (u64, &Affine)) -> Result<(), IoError> {
        stream.first_vertex = self.number_vertices(stream.accessors[0], placed)?;
        for (accessor, field) in stream.accessors.into_iter().zip(stream.fields()) {
            let Some(field) = field.filter(|_| accessor != NONE && !stream.is_packed) else {
                continue;
            };
            let mut record = self.model.accessor(accessor)?;
            if std::mem::replace(&mut record.is_counted, 1) == 0 {
                self.model.accessors.set(accessor.into(), record)?;
                stream.pending_bytes = stream.pending_bytes.saturating_add(field.size_bytes());
            }
        }
        if stream.has_rest {
            self.discarded.short_faces += 1;
        }
        self.stream = Some(stream);
        Ok(())
    }

    /// Delivers triangles of the present primitive until the batch is full or none is left.
    fn deliver(&mut self, batch: &mut TriangleBatch) -> Result<(), IoError> {
        let Some(mut stream) = self.stream.take() else { return Ok(()) };
        while stream.next < stream.count && batch.len() < BATCH_TRIANGLES {
            let polygon = polygon_number(&self.model.path, self.polygons)?;
            self.polygons += 1;
            let Some(corners) = stream.next_triangle(&mut self.model, &mut self.buffers)? else {
                self.discarded.wild_index_faces += 1;
                continue;
            };
            let part = self.next_part()?;
            let material = self.material_number(stream.material)?;
            stream.push(&mut self.model, &mut self.buffers, corners, batch)?;
            batch.parts.push(part);
            batch.materials.push(material);
            batch.polygons.push(polygon);
        }
        if stream.next < stream.count {
            self.stream = Some(stream);
        } else {
            self.counted_bytes = self.counted_bytes.saturating_add(stream.pending_bytes);
        }
        Ok(())
    }

    /// The number of the present node among the parts, for one more triangle of it.
    #[inline]
    fn next_part(&mut self) -> Result<u32, IoError> {
        let visit = self.visit.as_mut().expect("triangles come from a node");
        visit.triangles += 1;
        if let Some(part) = visit.part {
            return Ok(part);
        }
        let part = self.parts.len() as u32;
        visit.part = Some(part);
        self.parts.push(visit.node)?;
        if self.placement == Placement::ByItself {
            let mesh = self.model.mesh(visit.mesh)?;
            self.model.meshes.set(visit.mesh.into(), MeshRecord { part, ..mesh })?;
        }
        Ok(part)
    }

    /// The number of a material of the file among those in use.
    #[inline]
    fn material_number(&mut self, material: u32) -> Result<u32, IoError> {
        let next = self.materials.len() as u32;
        if material == NONE {
            let number = *self.unnamed_material.get_or_insert(next);
            if number == next {
                self.materials.push(NONE)?;
            }
            return Ok(number);
        }
        let mut record = self.model.material(material)?;
        if let Some(number) = record.used.checked_sub(1) {
            return Ok(number);
        }
        record.used = next + 1;
        self.model.materials.set(material.into(), record)?;
        self.materials.push(material)?;
        Ok(next)
    }
}

impl MeshSource for GltfReader {
    type Error = IoError;

    fn unit(&self) -> Option<LengthUnit> {
        Some(LengthUnit::Meter)
    }

    fn has_normals(&self) -> bool {
        self.model.has_normals
    }

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, IoError> {
        batch.clear();
        while batch.len() < BATCH_TRIANGLES {
            if self.stream.is_some() {
                self.deliver(batch)?;
            } else if !self.next_stream()? {
                break;
            }
        }
        Ok(!batch.is_empty())
    }

    fn part_count(&self) -> u64 {
        self.parts.len().max(1)
    }

    fn material_count(&self) -> u64 {
        self.materials.len().max(1)
    }

    fn part(&mut self, number: u32) -> Result<Part, IoError> {
        if self.parts.is_empty() {
            return Ok(Part::default());
        }
        let node = self.parts.get(number.into())?;
        let node = self.model.node(node)?;
        let mut names = [node.name, self.model.mesh(node.mesh)?.name];
        if self.placement == Placement::ByItself {
            names.reverse();
        }
        let name = if names[0] == NONE { names[1] } else { names[0] };
        Ok(Part { name: self.model.text_of(name)?.unwrap_or_default() })
    }

    fn node_count(&self) -> u64 {
        self.nodes.len()
    }

    fn node(&mut self, number: u32) -> Result<Option<SceneNode>, IoError> {
        self.nodes.get(&mut self.model, number).map(Some)
    }

    fn material(&mut self, number: u32) -> Result<Material, IoError> {
        if self.materials.is_empty() {
            return Ok(Material::default());
        }
        let material = self.materials.get(number.into())?;
        materials::material(&mut self.model, material)
    }

    fn image_block(
        &mut self,
        number: u32,
        offset: u64,
        bytes: &mut Vec<u8>,
    ) -> Result<(), IoError> {
        images::read_block(&mut self.model, &mut self.buffers, (number, offset), bytes)
    }

    fn discarded(&self) -> Discarded {
        self.discarded
    }

    fn bytes_read(&self) -> u64 {
        let input = self.buffers.input();
        if input.is_unpacked() {
            return input.bytes_read();
        }
        self.counted_bytes + self.stream.as_ref().map_or(0, Stream::bytes_read)
    }

    fn vertex_count(&self) -> Option<u64> {
        Some(self.vertices)
    }

    fn next_vertices(&mut self, positions: &mut Vec<[f64; 3]>) -> Result<bool, IoError> {
        self.listed.next(&mut self.model, &mut self.buffers, positions)
    }
}
