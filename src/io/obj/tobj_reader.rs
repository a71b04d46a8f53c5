//! Small OBJ files, parsed by `tobj`; the only home of that crate besides the materials.
//!
//! Declines whatever `tobj` does not read to the end without an error. Memory: about six times the
//! size of the file, and at most what [`Normalised`] lets through; names in their share. A list of
//! vertices is the streaming reader's.

use std::path::PathBuf;

use tobj::{LoadOptions, Mesh, Model};

use crate::io::error::IoError;
use crate::io::input::Input;
use crate::io::names::{Materials, Parts};
use crate::io::obj::materials::Library;
use crate::io::obj::normalised::{Normalised, Scope, Seen};
use crate::io::obj::stream_reader::ObjStreamReader;
use crate::io::polygon::{Columns, Corner, Owner, PolygonCutter, WHITE, polygon_number};
use crate::io::{BATCH_TRIANGLES, ReadOptions};
use crate::mesh::{Discarded, Material, MeshSource, Part, TriangleBatch};
use crate::store::Scratch;

/// A file that `tobj` has read, delivered in batches.
pub(crate) struct TobjReader {
    path: PathBuf,
    seen: Seen,
    models: std::vec::IntoIter<Model>,
    mesh: Mesh,
    scope: Scope,
    /// Faces and corners of the mesh that were delivered.
    face: usize,
    corner: usize,
    faces: u64,
    polygon: PolygonCutter,
    discarded: Discarded,
    parts: Parts,
    materials: Materials,
    lister: Lister,
}

/// Who lists the vertices, those that no face has as well, once that is asked.
enum Lister {
    /// Nobody so far.
    Asleep(Option<Input>, Scratch, ReadOptions),
    Awake(Box<ObjStreamReader>),
}

/// What became of a file.
pub(crate) enum Attempt {
    /// It is read.
    Read(Box<TobjReader>),
    /// It is too large or not for `tobj`; the input may have been consumed.
    Declined(Input),
}

impl TobjReader {
    /// Reads the whole file, if it is not larger than allowed.
    pub(crate) fn open(
        input: Input,
        largest_bytes: u64,
        scratch: &Scratch,
        options: &ReadOptions,
    ) -> Result<Attempt, IoError> {
        if input.size_bytes() > largest_bytes {
            return Ok(Attempt::Declined(input));
        }
        let path = input.path().to_path_buf();
        let names_share = options.share_bytes / 32;
        let mut text = Normalised::new(input, Library::new(&path, scratch, names_share));
        let loaded =
            tobj::load_obj_buf(&mut text, &LoadOptions::default(), |_| Ok(Default::default()));
        let (seen, input) = text.into_seen();
        let Ok((models, _)) = loaded else { return Ok(Attempt::Declined(input)) };
        let known = models.iter().all(|model| {
            Scope::parse(&model.name).is_some()
                && model.mesh.vertex_color.len() == model.mesh.positions.len()
                && model.mesh.texcoord_indices.len() == model.mesh.indices.len()
        });
        if !known || !seen.is_obj {
            return Ok(Attempt::Declined(input));
        }
        let columns =
            Columns { indices: true, uvs: seen.textures > 0, colours: !seen.colours.is_empty() };
        Ok(Attempt::Read(Box::new(Self {
            path,
            seen,
            models: models.into_iter(),
            mesh: Mesh::default(),
            scope: Scope::default(),
            face: 0,
            corner: 0,
            faces: 0,
            polygon: PolygonCutter::new(columns),
            discarded: Discarded::default(),
            parts: Parts::new(scratch, names_share),
            materials: Materials::new(scratch, names_share),
            lister: Lister::Asleep(Some(input), scratch.clone(), *options),
        })))
    }

    /// Takes the next face, of this model or of a later one; `false` behind the last.
    fn read_face(&mut self) -> Result<bool, IoError> {
        while self.corner == self.mesh.indices.len() && self.face >= self.mesh.face_arities.len() {
            let Some(model) = self.models.next() else { return Ok(false) };
            self.mesh = model.mesh;
            self.scope = Scope::parse(&model.name).expect("checked when the file was opened");
            (self.face, self.corner) = (0, 0);
        }
        // A mesh of triangles only has no list of arities.
        let arity = self.mesh.face_arities.get(self.face).map_or(3, |&arity| arity as usize);
        let polygon = polygon_number(&self.path, self.faces)?;
        self.faces += 1;
        self.face += 1;
        for corner in self.corner..self.corner + arity {
            self.push_corner(corner)?;
        }
        self.corner += arity;
        if arity < 3 {
            self.discarded.short_faces += 1;
            self.polygon.clear();
        } else {
            let (part, material) = self.owner()?;
            self.polygon.close(Owner { part, material, polygon });
        }
        Ok(true)
    }

    fn push_corner(&mut self, corner: usize) -> Result<(), IoError> {
        let at = 3 * self.mesh.indices[corner] as usize;
        let position = [0, 1, 2].map(|axis| self.mesh.positions[at + axis]);
        let vertex = self.mesh.vertex_color[at] as u32;
        let texture = 2 * self.mesh.texcoord_indices[corner] as usize;
        let uv = [0, 1].map(|axis| self.mesh.texcoords[texture + axis] as f32);
        let colour = self.seen.colours.get(vertex as usize).copied().unwrap_or(WHITE);
        self.polygon.push(&self.path, position, Corner { vertex, uv, colour })
    }

    fn owner(&mut self) -> Result<(u32, u32), IoError> {
        let Scope { object, group, material } = self.scope;
        let has_objects = self.seen.has_objects();
        let name = if has_objects { &self.seen.objects[object] } else { &self.seen.groups[group] };
        let part = self.parts.number(&self.path, name)?;
        let name = &self.seen.materials[material];
        let material = self.seen.library.number(&mut self.materials, &self.path, name)?;
        Ok((part, material))
    }
}

impl MeshSource for TobjReader {
    type Error = IoError;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, IoError> {
        batch.clear();
        while self.polygon.deliver(batch) && batch.len() < BATCH_TRIANGLES && self.read_face()? {}
        Ok(!batch.is_empty())
    }

    fn part_count(&self) -> u64 {
        self.parts.count()
    }

    fn material_count(&self) -> u64 {
        self.materials.count()
    }

    fn part(&mut self, number: u32) -> Result<Part, IoError> {
        self.parts.get(number)
    }

    fn material(&mut self, number: u32) -> Result<Material, IoError> {
        self.materials.get(number)
    }

    fn has_normals(&self) -> bool {
        self.seen.has_normals
    }

    fn discarded(&self) -> Discarded {
        self.discarded
    }

    fn bytes_read(&self) -> u64 {
        self.seen.bytes_read
    }

    fn vertex_count(&self) -> Option<u64> {
        Some(self.seen.vertices)
    }

    fn next_vertices(&mut self, positions: &mut Vec<[f64; 3]>) -> Result<bool, IoError> {
        if let Lister::Asleep(input, scratch, options) = &mut self.lister
            && let Some(input) = input.take()
        {
            let reader = ObjStreamReader::new(input, scratch, options);
            self.lister = Lister::Awake(Box::new(reader));
        }
        match &mut self.lister {
            Lister::Awake(reader) => reader.next_vertices(positions),
            Lister::Asleep(..) => Ok(false),
        }
    }
}
