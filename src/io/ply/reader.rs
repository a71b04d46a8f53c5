//! Streams the faces and triangle strips of a PLY file.
//!
//! Elements may come in any order: faces in front of the vertices are read in a second pass. Any
//! number types, any further elements, properties and lists. Indices that lead nowhere are counted,
//! numbers that do not parse or are missing end the reading. Texture coordinates stand with the
//! vertices, or in a list `texcoord` of each face, which counts where both do. Memory: half of the
//! share for the positions, an eighth each for colours and texture coordinates, spilled beyond.

use crate::io::error::IoError;
use crate::io::input::Input;
use crate::io::listed::Listing;
use crate::io::ply::body::Body;
use crate::io::ply::header::{Header, Kind, Property, Role, Scalar};
use crate::io::ply::materials::{FaceMaterials, FaceSurface};
use crate::io::ply::plain;
use crate::io::ply::strip::{Step, Strip};
use crate::io::polygon::{
    Columns, Corner, MOST_CORNERS, Owner, PolygonCutter, WHITE, checked_index, polygon_number,
};
use crate::io::words::{Dialect, Words};
use crate::io::{BATCH_TRIANGLES, ReadOptions};
use crate::mesh::{Discarded, Material, MeshSource, TriangleBatch};
use crate::store::{Scratch, Table};

/// Reads a PLY file in batches.
pub(crate) struct PlyReader {
    header: Header,
    body: Body,
    vertices_known: bool,
    positions: Table<[f64; 3]>,
    listing: Listing,
    colours: Option<Table<[u8; 4]>>,
    vertex_uvs: Option<Table<[f32; 2]>>,
    has_uvs: bool,
    /// The texture coordinates of the face under way, as numbers.
    coordinates: Vec<f64>,
    /// Where faces have any, and what the one under way says of its own.
    materials: Option<FaceMaterials>,
    face: FaceSurface,
    /// The element that is being read, how many of it were, and how far the next one is.
    element: usize,
    entry: u64,
    property: usize,
    strip: Strip,
    strip_scalar: Scalar,
    is_wild: bool,
    indices: Vec<f64>,
    polygons: u64,
    polygon: PolygonCutter,
    discarded: Discarded,
}

impl PlyReader {
    pub(crate) fn open(
        input: Input,
        scratch: &Scratch,
        options: &ReadOptions,
    ) -> Result<Self, IoError> {
        let mut words = Words::new(input, Dialect::Plain);
        let mut materials = FaceMaterials::new(scratch, options.share_bytes / 8);
        let header = Header::read(&mut words, &mut materials)?;
        let body = Body::new(words, header.encoding);
        let has_colours = header.has_colours();
        let (has_lists, has_vertex_uvs) =
            (header.face_has(Role::Coordinates), header.has_vertex_uvs());
        let has_uvs = has_lists || has_vertex_uvs;
        let columns = Columns { indices: true, uvs: has_uvs, colours: has_colours };
        let is_by_image = has_uvs && !header.has_materials() && materials.has_images();
        if is_by_image {
            materials.go_by_image();
        }
        let uvs_share = options.share_bytes / 8;
        Ok(Self {
            body,
            vertices_known: false,
            positions: Table::new(scratch, options.share_bytes / 2),
            listing: Listing::default(),
            vertex_uvs: has_vertex_uvs.then(|| Table::new(scratch, uvs_share)),
            has_uvs,
            coordinates: Vec::new(),
            materials: (header.has_materials() || is_by_image).then_some(materials),
            face: FaceSurface::default(),
            colours: has_colours.then(|| Table::new(scratch, options.share_bytes / 8)),
            element: 0,
            entry: 0,
            property: 0,
            strip: Strip::default(),
            strip_scalar: Scalar::I32,
            is_wild: false,
            indices: Vec::new(),
            polygons: 0,
            polygon: PolygonCutter::new(columns),
            discarded: Discarded::default(),
            header,
        })
    }

    /// Reads up to the vertices and through them; then stands where the first face can be.
    fn read_vertices(&mut self) -> Result<(), IoError> {
        self.vertices_known = true;
        let Some(vertices) = self.header.vertex_element() else { return Ok(()) };
        for element in &self.header.elements[..vertices] {
            self.body.skip_element(element)?;
        }
        let mut left = self.header.elements[vertices].count;
        if plain::has_plain_vertices(&self.body, &self.header.elements[vertices]) {
            left = plain::read_vertices(&mut self.body, &mut self.positions, left)?;
        }
        for _ in 0..left {
            self.read_vertex(vertices)?;
        }
        if self.header.first_surface().is_some_and(|surface| surface < vertices) {
            self.body.rewind();
        } else {
            self.element = vertices + 1;
        }
        Ok(())
    }

    /// Reads triangles as far as they are plain and the batch has room for them.
    fn read_plain_triangles(&mut self, batch: &mut TriangleBatch) -> Result<(), IoError> {
        let Some(element) = self.header.elements.get(self.element) else { return Ok(()) };
        if self.colours.is_some() || self.has_uvs {
            return Ok(());
        }
        if let Some(bytes) = plain::plain_triangle_bytes(&self.body, element) {
            let range = (element.count - self.entry, self.polygons, bytes);
            let path = self.body.input().path().to_path_buf();
            let materials = &mut self.materials;
            let material = |face| match materials {
                Some(materials) => materials.number(&path, face),
                None => Ok(0),
            };
            let (body, positions) = (&mut self.body, &mut self.positions);
            let read = plain::read_triangles(body, positions, range, material, batch)?;
            self.entry += read;
            self.polygons += read;
        }
        Ok(())
    }

    fn read_vertex(&mut self, element: usize) -> Result<(), IoError> {
        let mut position = [0.0; 3];
        let mut colour = WHITE;
        let mut uv = [0.0; 2];
        for property in &self.header.elements[element].properties {
            if let Some(length) = property.length {
                let count = self.body.length(length, property.scalar)?;
                self.body.skip(property.scalar, count)?;
                continue;
            }
            let number = self.body.number(property.scalar)?;
            match property.role {
                Role::Coordinate(axis) => position[axis] = number,
                Role::Colour(channel) => colour[channel] = property.scalar.channel(number),
                Role::Texture(axis) => uv[axis] = number as f32,
                Role::Indices
                | Role::Normal
                | Role::Coordinates
                | Role::Material
                | Role::Image
                | Role::Patch
                | Role::Other => {}
            }
        }
        if self.positions.len() >= u64::from(u32::MAX) {
            let path = self.body.input().path();
            return Err(IoError::too_many(path, "vertices", u64::from(u32::MAX)));
        }
        self.positions.push(position)?;
        if let Some(colours) = &mut self.colours {
            colours.push(colour)?;
        }
        if let Some(uvs) = &mut self.vertex_uvs {
            uvs.push(uv)?;
        }
        Ok(())
    }

    /// Reads the next face or a step of a strip; `false` behind the last element.
    fn read_on(&mut self) -> Result<bool, IoError> {
        if self.strip.left > 0 {
            return self.read_strip_index().map(|()| true);
        }
        let Some(element) = self.header.elements.get(self.element) else { return Ok(false) };
        let is_surface = matches!(element.kind, Kind::Face | Kind::Strips);
        if !is_surface || !element.has(Role::Indices) {
            self.body.skip_element(element)?;
            self.element += 1;
        } else if self.entry == element.count {
            self.element += 1;
            self.entry = 0;
        } else {
            self.read_entry()?;
        }
        Ok(true)
    }

    /// Reads the rest of a face, or of an entry up to the start of a strip.
    fn read_entry(&mut self) -> Result<(), IoError> {
        let kind = self.header.elements[self.element].kind;
        while let Some(&property) = self.header.elements[self.element].properties.get(self.property)
        {
            self.property += 1;
            let count = match property.length {
                Some(length) => self.body.length(length, property.scalar)?,
                None => 1,
            };
            match (property.role, kind) {
                (Role::Indices, Kind::Strips) => {
                    self.strip = Strip::start(count);
                    self.strip_scalar = property.scalar;
                    return Ok(());
                }
                (Role::Indices, _) => self.read_corners(property.scalar, count)?,
                (Role::Coordinates, Kind::Face) => self.read_coordinates(property.scalar, count)?,
                (Role::Material | Role::Image | Role::Patch | Role::Colour(_), Kind::Face) => {
                    let number = self.body.number(property.scalar)?;
                    self.note(property, number);
                }
                _ => self.body.skip(property.scalar, count)?,
            }
        }
        self.property = 0;
        self.entry += 1;
        if kind == Kind::Face { self.close_face() } else { Ok(()) }
    }

    /// Notes what the face under way says of its material.
    fn note(&mut self, property: Property, number: f64) {
        let face = &mut self.face;
        match property.role {
            Role::Material => face.index = number as u32,
            Role::Image => face.image = Some(number as i64),
            Role::Patch => face.is_patch = number != 0.0,
            Role::Colour(channel) => {
                let colour = face.colour.get_or_insert(WHITE);
                colour[channel] = property.scalar.channel(number);
            }
            Role::Coordinate(_)
            | Role::Texture(_)
            | Role::Normal
            | Role::Coordinates
            | Role::Indices
            | Role::Other => {}
        }
    }

    fn close_face(&mut self) -> Result<(), IoError> {
        let polygon = self.next_polygon()?;
        for (corner, uv) in self.coordinates.as_chunks::<2>().0.iter().enumerate() {
            self.polygon.set_uv(corner, uv.map(|number| number as f32));
        }
        self.coordinates.clear();
        let face = std::mem::take(&mut self.face);
        let material = match &mut self.materials {
            Some(materials) => materials.number(self.body.input().path(), face)?,
            None => 0,
        };
        if std::mem::take(&mut self.is_wild) {
            self.discarded.wild_index_faces += 1;
            self.polygon.clear();
        } else if self.polygon.len() < 3 {
            self.discarded.short_faces += 1;
            self.polygon.clear();
        } else {
            self.polygon.close(Owner { part: 0, material, polygon });
        }
        Ok(())
    }

    fn read_strip_index(&mut self) -> Result<(), IoError> {
        let index = self.body.number(self.strip_scalar)?;
        match self.strip.step(index, self.positions.len()) {
            Step::Nothing => {}
            Step::Wild => {
                self.next_polygon()?;
                self.discarded.wild_index_faces += 1;
            }
            Step::Triangle(triangle) => {
                let polygon = self.next_polygon()?;
                triangle.into_iter().try_for_each(|vertex| self.push_corner(vertex))?;
                self.polygon.close(Owner { part: 0, material: 0, polygon });
            }
        }
        Ok(())
    }

    /// Reads the corners of a face, and remembers whether one of them leads nowhere.
    fn read_corners(&mut self, scalar: Scalar, count: u64) -> Result<(), IoError> {
        let mut left = count;
        while left > 0 {
            let mut indices = std::mem::take(&mut self.indices);
            self.body.numbers(scalar, left, &mut indices)?;
            left -= indices.len() as u64;
            for &index in &indices {
                match checked_index(index, self.positions.len()) {
                    Some(vertex) => self.push_corner(vertex)?,
                    None => self.is_wild = true,
                }
            }
            self.indices = indices;
        }
        Ok(())
    }

    /// Reads the texture coordinates of a face's corners; it has no more corners than these.
    fn read_coordinates(&mut self, scalar: Scalar, count: u64) -> Result<(), IoError> {
        self.coordinates.clear();
        let mut left = count;
        while left > 0 {
            let mut numbers = std::mem::take(&mut self.indices);
            self.body.numbers(scalar, left, &mut numbers)?;
            left -= numbers.len() as u64;
            let room = (2 * MOST_CORNERS).saturating_sub(self.coordinates.len());
            self.coordinates.extend(numbers.iter().take(room));
            self.indices = numbers;
        }
        Ok(())
    }

    #[inline]
    fn push_corner(&mut self, vertex: u32) -> Result<(), IoError> {
        let position = self.positions.get(u64::from(vertex))?;
        let colour = match &mut self.colours {
            Some(colours) => colours.get(u64::from(vertex))?,
            None => WHITE,
        };
        let uv = match &mut self.vertex_uvs {
            Some(uvs) => uvs.get(u64::from(vertex))?,
            None => [0.0; 2],
        };
        let corner = Corner { vertex, uv, colour };
        self.polygon.push(self.body.input().path(), position, corner)
    }

    fn next_polygon(&mut self) -> Result<u32, IoError> {
        let number = polygon_number(self.body.input().path(), self.polygons)?;
        self.polygons += 1;
        Ok(number)
    }
}

impl MeshSource for PlyReader {
    type Error = IoError;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, IoError> {
        batch.clear();
        if !self.vertices_known {
            self.read_vertices()?;
        }
        while self.polygon.deliver(batch) && batch.len() < BATCH_TRIANGLES {
            if self.polygon.len() == 0 && self.property == 0 {
                self.read_plain_triangles(batch)?;
            }
            if batch.len() < BATCH_TRIANGLES && !self.read_on()? {
                break;
            }
        }
        Ok(!batch.is_empty())
    }

    fn material_count(&self) -> u64 {
        self.materials.as_ref().map_or(1, |materials| materials.count().max(1))
    }

    fn material(&mut self, number: u32) -> Result<Material, IoError> {
        match &mut self.materials {
            Some(materials) if u64::from(number) < materials.count() => materials.get(number),
            _ => Ok(Material::default()),
        }
    }

    fn has_normals(&self) -> bool {
        self.header.has_normals()
    }

    fn discarded(&self) -> Discarded {
        self.discarded
    }

    fn bytes_read(&self) -> u64 {
        self.body.input().bytes_read()
    }

    fn vertex_count(&self) -> Option<u64> {
        Some(self.positions.len())
    }

    fn next_vertices(&mut self, positions: &mut Vec<[f64; 3]>) -> Result<bool, IoError> {
        self.listing.next(&mut self.positions, positions)
    }
}
