//! Writes 3MF: an object for each part, the objects and items that place them ([`Build`]), and what
//! triangles are painted with ([`Paint`]).
//!
//! In the model all vertices stand before all triangles, and all of it is packed: vertices and
//! triangles wait aside as records until the end, when the archive is written in one go. Every
//! coordinate is the shortest text that gives its `f64` back. Memory: a few buffers, and that of
//! [`Paint`] in the end.

use std::path::Path;

use crate::io::error::IoError;
use crate::io::numbers::{push_count, push_number};
use crate::io::output::{Aside, FACES, Output};
use crate::io::palette::{LookMap, Palette};
use crate::io::parts_written::{Extent, PartsWritten, WrittenPart};
use crate::io::polygon::WHITE;
use crate::io::scene::SceneTree;
use crate::io::threemf::bases::push_escaped;
use crate::io::threemf::build::Build;
use crate::io::threemf::package::{HEAD, content_types, relationships};
use crate::io::threemf::paint::{MOST_INDICES, Paint};
use crate::io::threemf::records::{Record, for_each_record_in};
use crate::io::threemf::vocabulary::{CORE, MATERIALS, MODEL_RELATIONSHIP};
use crate::io::threemf::zip_file::ZipFile;
use crate::io::{Format, WriteOptions};
use crate::mesh::{
    Attributes, CornerForm, LengthUnit, MeshSink, SinkState, SinkStats, SinkTriangles, Surface,
    VertexValues,
};
use crate::store::Scratch;

/// Id of the object of a file with one part.
const ONLY_OBJECT: u32 = 2;
/// No record of a mesh takes more bytes in the model.
const LONGEST_LINE_BYTES: u64 = 160;
/// What may stand in a model besides the mesh before its sizes would have to be large ones.
const OTHER_BYTES: u64 = 1 << 30;

/// Lays records aside, and makes a file of them.
pub(crate) struct ThreeMfWriter {
    output: Output,
    records: Aside,
    scratch: Scratch,
    palette: Option<Palette>,
    looks: LookMap,
    attributes: Attributes,
    /// Vertices whose colours are laid aside.
    coloured: u64,
    unit: LengthUnit,
    parts: PartsWritten,
    scene: Option<SceneTree>,
    record: Vec<u8>,
    vertices: u64,
    triangles: u64,
}

impl ThreeMfWriter {
    pub(crate) fn create(
        path: &Path,
        scratch: &Scratch,
        options: &WriteOptions,
    ) -> Result<Self, IoError> {
        let records = Aside::create(scratch, FACES)?;
        let output = Output::create(path, scratch)?;
        Self::new((output, records), (scratch, options, &SinkState::default()))
    }

    /// Goes on where an earlier writer was.
    pub(crate) fn reopen(
        path: &Path,
        scratch: &Scratch,
        options: &WriteOptions,
        state: &SinkState,
    ) -> Result<Self, IoError> {
        let output = Output::reopen(path, scratch, &state.output)?;
        let records = Aside::reopen(scratch, FACES, &state.aside)?;
        Self::new((output, records), (scratch, options, state))
    }

    fn new(
        (output, records): (Output, Aside),
        (scratch, options, state): (&Scratch, &WriteOptions, &SinkState),
    ) -> Result<Self, IoError> {
        let palette = options.palette.clone();
        Ok(Self {
            output,
            records,
            scratch: scratch.clone(),
            looks: palette.as_ref().map(Palette::looks).transpose()?.unwrap_or_default(),
            palette,
            attributes: options.attributes.and(Format::ThreeMf.attributes()),
            coloured: state.vertices,
            unit: options.unit.unwrap_or_default(),
            parts: PartsWritten::new(scratch),
            scene: options.scene.clone(),
            record: Vec::new(),
            vertices: state.vertices,
            triangles: state.triangles,
        })
    }

    /// Lays colours aside up to the last vertex: white where none came.
    fn fill_colours(&mut self) -> Result<(), IoError> {
        while self.attributes.colours && self.coloured < self.vertices {
            self.push(Record::Colour(WHITE))?;
            self.coloured += 1;
        }
        Ok(())
    }

    fn extent(&self) -> Extent {
        let Self { vertices, triangles, .. } = *self;
        Extent { vertices, triangles, bytes: self.records.bytes() }
    }

    fn push(&mut self, record: Record) -> Result<(), IoError> {
        self.record.clear();
        record.push(&mut self.record);
        self.records.write(&self.record)
    }
}

impl MeshSink for ThreeMfWriter {
    type Error = IoError;

    fn needs_corners(&self) -> bool {
        false
    }

    fn corner_form(&self) -> CornerForm {
        if self.attributes.any() { CornerForm::OfCorners } else { CornerForm::None }
    }

    fn vertex_values(&mut self, values: &VertexValues) -> Result<(), IoError> {
        if self.attributes.colours {
            let owed = (self.vertices - self.coloured) as usize;
            for &colour in &values.colours[..values.colours.len().min(owed)] {
                self.push(Record::Colour(colour))?;
                self.coloured += 1;
            }
        }
        self.fill_colours()
    }

    fn begin_part(&mut self, number: u32, name: &str) -> Result<(), IoError> {
        self.fill_colours()?;
        Ok(self.parts.begin((number, name), self.extent())?)
    }

    fn list_uvs(&mut self, uvs: &[[f32; 2]]) -> Result<(), IoError> {
        let uvs = if self.attributes.uvs { uvs } else { &[] };
        uvs.iter().try_for_each(|&uv| self.push(Record::Uv(uv)))
    }

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), IoError> {
        self.fill_colours()?;
        self.vertices += positions.len() as u64;
        if self.vertices > MOST_INDICES {
            return Err(too_large(&self.output, "vertices"));
        }
        positions.iter().try_for_each(|&position| self.push(Record::Vertex(position)))
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), IoError> {
        self.triangles += triangles.indices.len() as u64;
        let mut looks = std::mem::take(&mut self.looks);
        let surfaces = looks.materials_of(triangles.surfaces)?;
        for (at, &triangle) in triangles.indices.iter().enumerate() {
            let surface = surfaces.get(at).copied().filter(|_| self.palette.is_some());
            let uvs = triangles.uvs.numbers.get(at).filter(|_| self.attributes.uvs);
            self.push(match (surface, uvs) {
                (Some(surface), Some(&uvs)) => Record::Textured(triangle, surface, uvs),
                (surface, _) => Record::Triangle(triangle, surface),
            })?;
        }
        self.looks = looks;
        Ok(())
    }

    fn bytes_so_far(&self) -> u64 {
        self.records.bytes()
    }

    fn checkpoint(&mut self) -> Result<SinkState, IoError> {
        self.fill_colours()?;
        let (output, aside) = (self.output.state()?, self.records.state()?);
        let Self { vertices, triangles, .. } = *self;
        Ok(SinkState { vertices, triangles, output, aside, ..SinkState::default() })
    }

    fn finish(mut self: Box<Self>) -> Result<SinkStats, IoError> {
        self.fill_colours()?;
        self.parts.begin_only()?;
        let whole = self.extent();
        let Self { output, mut records, palette, unit, mut parts, vertices, triangles, .. } = *self;
        let mut paint = Paint::new(&self.scratch, palette.as_ref(), self.attributes, &mut records)?;
        let mut zip = ZipFile::new(output);
        for (name, content) in [
            ("[Content_Types].xml", content_types(paint.has_textures())),
            ("_rels/.rels", relationships(MODEL_RELATIONSHIP, &["/3D/3dmodel.model".to_owned()])),
        ] {
            zip.start(name, false)?;
            zip.write(content.as_bytes())?;
            zip.end()?;
        }
        let mesh_bytes = LONGEST_LINE_BYTES * (vertices + triangles);
        let paint_bytes = paint.longest_bytes(vertices, triangles);
        let is_large = mesh_bytes + paint_bytes + OTHER_BYTES > u64::from(u32::MAX);
        zip.start("3D/3dmodel.model", is_large)?;
        let unit = unit.name();
        let colours =
            if self.attributes.any() { format!(" xmlns:m=\"{MATERIALS}\"") } else { String::new() };
        let model = format!("{HEAD}<model unit=\"{unit}\" xmlns=\"{CORE}\"{colours}>\n");
        zip.write(model.as_bytes())?;
        zip.write(b"<resources>\n")?;
        paint.write(&mut zip, &mut records)?;
        let first_id = if parts.len() == 1 { ONLY_OBJECT } else { paint.next_id() };
        for part in 0..parts.len() {
            let written = parts.get(part, whole)?;
            let id = first_id + part as u32;
            write_object(&mut zip, (id, &written), &mut records, &mut paint)?;
        }
        let next_id = paint.next_id() + parts.len() as u32;
        let build = Build::new(&self.scratch, self.scene.as_ref(), &mut parts, first_id)?;
        build.write(&mut zip, next_id)?;
        zip.write(b"</model>\n")?;
        zip.end()?;
        paint.write_images(&mut zip)?;
        let file = zip.finish()?.finish()?;
        Ok(SinkStats { vertices, triangles, file })
    }
}

fn too_large(output: &Output, what: &'static str) -> IoError {
    IoError::TooLarge { path: output.path().to_path_buf(), what, limit: MOST_INDICES }
}

fn write_object(
    zip: &mut ZipFile,
    (id, part): (u32, &WrittenPart),
    records: &mut Aside,
    paint: &mut Paint,
) -> Result<(), IoError> {
    let property = if paint.has_bases() { " pid=\"1\" pindex=\"0\"" } else { "" };
    let mut text = format!("<object id=\"{id}\" type=\"model\"{property}").into_bytes();
    push_name(&mut text, &part.name);
    text.extend_from_slice(b">\n<mesh>\n");
    zip.write(&text)?;
    let (bytes, first_vertex) = (part.bytes.clone(), part.vertices.start as u32);
    zip.write(b"<vertices>\n")?;
    for_each_record_in(records, bytes.clone(), |record| {
        let Record::Vertex(position) = record else { return Ok(()) };
        text.clear();
        text.extend_from_slice(b"<vertex");
        for (name, coordinate) in [b" x=\"", b" y=\"", b" z=\""].into_iter().zip(position) {
            text.extend_from_slice(name);
            push_number(&mut text, coordinate);
            text.push(b'"');
        }
        text.extend_from_slice(b"/>\n");
        zip.write(&text)
    })?;
    zip.write(b"</vertices>\n<triangles>\n")?;
    for_each_record_in(records, bytes, |record| {
        let (indices, surface, has_uvs) = match record {
            Record::Triangle(indices, surface) => (indices, surface, false),
            Record::Textured(indices, surface, _) => (indices, Some(surface), true),
            _ => return Ok(()),
        };
        text.clear();
        text.extend_from_slice(b"<triangle");
        push_numbers(&mut text, [" v1", " v2", " v3"], indices.map(|index| index - first_vertex));
        push_property(&mut text, paint, (indices, surface, has_uvs))?;
        text.extend_from_slice(b"/>\n");
        zip.write(&text)
    })?;
    zip.write(b"</triangles>\n</mesh>\n</object>\n")
}

/// Appends the name of an object, if it has one.
pub(super) fn push_name(text: &mut Vec<u8>, name: &str) {
    if !name.is_empty() {
        text.extend_from_slice(b" name=\"");
        push_escaped(text, name);
        text.push(b'"');
    }
}

/// Appends what a triangle is painted with.
fn push_property(
    text: &mut Vec<u8>,
    paint: &mut Paint,
    triangle: ([u32; 3], Option<Surface>, bool),
) -> Result<(), IoError> {
    let Some((group, properties)) = paint.property(triangle)? else { return Ok(()) };
    push_numbers(text, [" pid"], [group]);
    if properties[1..] == [properties[0]; 2] {
        push_numbers(text, [" p1"], [properties[0]]);
    } else {
        push_numbers(text, [" p1", " p2", " p3"], properties);
    }
    Ok(())
}

fn push_numbers<const N: usize>(text: &mut Vec<u8>, names: [&str; N], numbers: [u32; N]) {
    for (name, number) in names.into_iter().zip(numbers) {
        text.extend_from_slice(name.as_bytes());
        text.extend_from_slice(b"=\"");
        push_count(text, number.into());
        text.push(b'"');
    }
}
