//! Writes 3MF: one object, one item, base materials where triangles name materials.
//!
//! In the model all vertices stand before all triangles, and all of it is packed: vertices and
//! triangles wait aside as records until the end, when the archive is written in one go. Every
//! coordinate is the shortest text that gives its `f64` back. Memory: a few buffers.

use std::path::Path;

use crate::io::WriteOptions;
use crate::io::error::IoError;
use crate::io::numbers::{push_count, push_number};
use crate::io::output::{Aside, FACES, Output};
use crate::io::palette::Palette;
use crate::io::threemf::records::{Record, for_each_record};
use crate::io::threemf::vocabulary::{CORE, MODEL_RELATIONSHIP, RELATIONSHIPS};
use crate::io::threemf::zip_file::ZipFile;
use crate::mesh::{LengthUnit, Material, MeshSink, SinkState, SinkStats, SinkTriangles, Surface};
use crate::store::Scratch;

/// The largest number of a vertex or a material that 3MF allows, and one.
const MOST_INDICES: u64 = 1 << 31;
/// No record of a mesh takes more bytes in the model.
const LONGEST_LINE_BYTES: u64 = 128;
/// What may stand in a model besides the mesh before its sizes would have to be large ones.
const OTHER_BYTES: u64 = 1 << 30;

const CONTENT_TYPES: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\
    <Default Extension=\"rels\" \
    ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\
    <Default Extension=\"model\" \
    ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>\n";

/// Lays records aside, and makes a file of them.
#[derive(Debug)]
pub(crate) struct ThreeMfWriter {
    output: Output,
    records: Aside,
    palette: Option<Palette>,
    unit: LengthUnit,
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
        Ok(Self::new((output, records), options, &SinkState::default()))
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
        Ok(Self::new((output, records), options, state))
    }

    fn new((output, records): (Output, Aside), options: &WriteOptions, state: &SinkState) -> Self {
        let SinkState { vertices, triangles, .. } = *state;
        let palette = options.palette.clone();
        let unit = options.unit.unwrap_or_default();
        Self { output, records, palette, unit, record: Vec::new(), vertices, triangles }
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

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), IoError> {
        self.vertices += positions.len() as u64;
        if self.vertices > MOST_INDICES {
            return Err(too_large(&self.output, "vertices"));
        }
        positions.iter().try_for_each(|&position| self.push(Record::Vertex(position)))
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), IoError> {
        let SinkTriangles { indices, surfaces, .. } = *triangles;
        self.triangles += indices.len() as u64;
        for (at, &triangle) in indices.iter().enumerate() {
            let surface = surfaces.get(at).copied().filter(|_| self.palette.is_some());
            self.push(Record::Triangle(triangle, surface))?;
        }
        Ok(())
    }

    fn bytes_so_far(&self) -> u64 {
        self.records.bytes()
    }

    fn checkpoint(&mut self) -> Result<SinkState, IoError> {
        let (output, aside) = (self.output.state()?, self.records.state()?);
        let Self { vertices, triangles, .. } = *self;
        Ok(SinkState { vertices, triangles, output, aside, ..SinkState::default() })
    }

    fn finish(self: Box<Self>) -> Result<SinkStats, IoError> {
        let Self { output, mut records, palette, unit, vertices, triangles, .. } = *self;
        let too_many = too_large(&output, "materials");
        let mut zip = ZipFile::new(output);
        for (name, content) in
            [("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", &relationships())]
        {
            zip.start(name, false)?;
            zip.write(content.as_bytes())?;
            zip.end()?;
        }
        let mesh_bytes = LONGEST_LINE_BYTES * (vertices + triangles);
        zip.start("3D/3dmodel.model", mesh_bytes + OTHER_BYTES > u64::from(u32::MAX))?;
        let unit = unit.name();
        zip.write(format!("{HEAD}<model unit=\"{unit}\" xmlns=\"{CORE}\">\n").as_bytes())?;
        zip.write(b"<resources>\n")?;
        let materials = match &palette {
            Some(palette) => Materials::write(&mut zip, palette, &mut records, too_many)?,
            None => Materials::default(),
        };
        write_object(&mut zip, &mut records, materials)?;
        zip.write(b"</resources>\n<build>\n<item objectid=\"2\"/>\n</build>\n</model>\n")?;
        zip.end()?;
        let file = zip.finish()?.finish()?;
        Ok(SinkStats { vertices, triangles, file })
    }
}

const HEAD: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";

fn relationships() -> String {
    format!(
        "{HEAD}<Relationships xmlns=\"{RELATIONSHIPS}\"><Relationship Id=\"rel0\" \
         Type=\"{MODEL_RELATIONSHIP}\" Target=\"/3D/3dmodel.model\"/></Relationships>\n"
    )
}

fn too_large(output: &Output, what: &'static str) -> IoError {
    IoError::TooLarge { path: output.path().to_path_buf(), what, limit: MOST_INDICES }
}

/// How surfaces are numbered among the base materials.
#[derive(Clone, Copy, Debug, Default)]
struct Materials {
    count: u64,
    /// Whether each material is followed by one for its patches.
    has_patches: bool,
}

impl Materials {
    /// Writes all materials of the palette.
    fn write(
        zip: &mut ZipFile,
        palette: &Palette,
        records: &mut Aside,
        too_many: IoError,
    ) -> Result<Self, IoError> {
        let mut has_patches = false;
        for_each_record(records, |record| {
            if let Record::Triangle(_, Some(surface)) = record {
                has_patches |= surface.is_patch();
            }
            Ok(())
        })?;
        let (mut count, mut text) = (0, Vec::new());
        palette.for_each(|_, material| {
            if count == 0 {
                zip.write(b"<basematerials id=\"1\">\n")?;
            }
            for ending in ["", Surface::PATCH_ENDING].into_iter().take(1 + usize::from(has_patches))
            {
                text.clear();
                push_base(&mut text, &material, ending);
                zip.write(&text)?;
                count += 1;
            }
            Ok(())
        })?;
        if count > MOST_INDICES {
            return Err(too_many);
        }
        if count > 0 {
            zip.write(b"</basematerials>\n")?;
        }
        Ok(Self { count, has_patches })
    }

    /// The base material of a surface, if there is one.
    fn index(&self, surface: Surface) -> Option<u64> {
        let material = u64::from(surface.material());
        let index =
            if self.has_patches { 2 * material + u64::from(surface.is_patch()) } else { material };
        (index < self.count).then_some(index)
    }
}

fn push_base(text: &mut Vec<u8>, material: &Material, ending: &str) {
    text.extend_from_slice(b"<base name=\"");
    push_escaped(text, &material.name);
    text.extend_from_slice(ending.as_bytes());
    let [r, g, b, alpha] = material.rgba();
    // Readers take no alpha for an alpha of 0, and light passes or it does not.
    let alpha = if material.transparent { alpha.clamp(1, 254) } else { 255 };
    let colour = format!("\" displaycolor=\"#{r:02X}{g:02X}{b:02X}{alpha:02X}\"/>\n");
    text.extend_from_slice(colour.as_bytes());
}

/// Appends a name as the value of an attribute; what XML cannot say is replaced.
fn push_escaped(text: &mut Vec<u8>, name: &str) {
    for c in name.chars() {
        match c {
            '&' => text.extend_from_slice(b"&amp;"),
            '<' => text.extend_from_slice(b"&lt;"),
            '>' => text.extend_from_slice(b"&gt;"),
            '"' => text.extend_from_slice(b"&quot;"),
            // Numbers of characters are XML too, but not to every reader of 3MF.
            '\t' | '\n' | '\r' => text.push(b' '),
            '\0'..' ' | '\u{fffe}' | '\u{ffff}' => text.extend_from_slice("\u{fffd}".as_bytes()),
            c => text.extend_from_slice(c.encode_utf8(&mut [0; 4]).as_bytes()),
        }
    }
}

fn write_object(
    zip: &mut ZipFile,
    records: &mut Aside,
    materials: Materials,
) -> Result<(), IoError> {
    let property = if materials.count > 0 { " pid=\"1\" pindex=\"0\"" } else { "" };
    zip.write(format!("<object id=\"2\" type=\"model\"{property}>\n<mesh>\n").as_bytes())?;
    let mut text = Vec::new();
    zip.write(b"<vertices>\n")?;
    for_each_record(records, |record| {
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
    for_each_record(records, |record| {
        let Record::Triangle(indices, surface) = record else { return Ok(()) };
        text.clear();
        text.extend_from_slice(b"<triangle");
        for (name, index) in [b" v1=\"", b" v2=\"", b" v3=\""].into_iter().zip(indices) {
            text.extend_from_slice(name);
            push_count(&mut text, u64::from(index));
            text.push(b'"');
        }
        if let Some(index) = surface.and_then(|surface| materials.index(surface)) {
            text.extend_from_slice(b" pid=\"1\" p1=\"");
            push_count(&mut text, index);
            text.push(b'"');
        }
        text.extend_from_slice(b"/>\n");
        zip.write(&text)
    })?;
    zip.write(b"</triangles>\n</mesh>\n</object>\n")
}
