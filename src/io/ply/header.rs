//! The header of a PLY file: which elements follow, and what each of them consists of.
//!
//! Memory: the elements and properties, at most [`MOST_PROPERTIES`] of each; counts are believed
//! only as they are read.

use crate::io::error::{IoError, shown};
use crate::io::ply::materials::FaceMaterials;
use crate::io::words::Words;

/// The most elements, and the most properties of all elements together.
const MOST_PROPERTIES: usize = 4096;

/// How the elements are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// A number type of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// A colour channel as a byte: whole numbers by their upper bits, fractions of one by scale.
    pub(crate) fn channel(self, number: f64) -> u8 {
        match self {
            Self::F32 | Self::F64 => (number * 255.0).round() as u8,
            Self::I16 | Self::U16 => (number / 256.0) as u8,
            _ => number as u8,
        }
    }

    pub(crate) fn size_bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// What a property means to us.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// x, y or z.
    Coordinate(usize),
    /// Red, green, blue or alpha.
    Colour(usize),
    /// The material of a face.
    Material,
    /// Whether a face closes what was open.
    Patch,
    /// u or v of a vertex.
    Texture(usize),
    /// x of a vertex's normal, which tells that there is one.
    Normal,
    /// The texture coordinates of a face's corners, as a list.
    Coordinates,
    /// The number of a face's image.
    Image,
    /// The corners of a face or a strip.
    Indices,
    /// Passed over.
    Other,
}

/// One property of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Property {
    pub(crate) role: Role,
    /// The type of the length, if this is a list.
    pub(crate) length: Option<Scalar>,
    pub(crate) scalar: Scalar,
}

/// What an element is to us.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Vertex,
    Face,
    Strips,
    Other,
}

/// One kind of element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Element {
    pub(crate) kind: Kind,
    pub(crate) count: u64,
    pub(crate) properties: Vec<Property>,
}

impl Element {
    pub(crate) fn has(&self, role: Role) -> bool {
        self.properties.iter().any(|property| property.role == role)
    }

    /// Bytes of one element in binary; `None` if lists make that differ.
    pub(crate) fn stride_bytes(&self) -> Option<u64> {
        let fixed = self.properties.iter().all(|property| property.length.is_none());
        fixed.then(|| self.properties.iter().map(|p| p.scalar.size_bytes() as u64).sum())
    }
}

/// The whole header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Header {
    pub(crate) encoding: Encoding,
    pub(crate) elements: Vec<Element>,
}

impl Header {
    /// Reads the lines from `ply` to `end_header`; comments go to `materials`.
    pub(crate) fn read(words: &mut Words, materials: &mut FaceMaterials) -> Result<Self, IoError> {
        if words.word_on_line()? != Some(b"ply") {
            return Err(words.unreadable("ply", "something else"));
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut properties = 0;
        loop {
            if !words.skip_line()? {
                return Err(words.unreadable("end_header", "the end of the file"));
            }
            match words.word_on_line()? {
                None | Some(b"obj_info") => {}
                Some(b"comment") => {
                    if let Some(comment) = words.short_rest()? {
                        materials.declare(&comment)?;
                    }
                }
                Some(b"format") => encoding = Some(read_encoding(words)?),
                Some(b"element") => {
                    elements.push(read_element(words)?);
                    check_count(words, "elements", elements.len())?;
                }
                Some(b"property") => {
                    let Some(element) = elements.last_mut() else {
                        return Err(words.unreadable("an element first", "a property"));
                    };
                    properties += 1;
                    check_count(words, "properties", properties)?;
                    element.properties.push(read_property(words, element.kind)?);
                }
                Some(b"end_header") => break,
                // Remarks without their keyword, as Blender 2.4 wrote them.
                Some(_) if encoding.is_some() && elements.is_empty() => {}
                Some(other) => {
                    let found = shown(other);
                    let expected = "format, comment, element, property or end_header";
                    return Err(words.unreadable(expected, &found));
                }
            }
        }
        let Some(encoding) = encoding else {
            return Err(words.unreadable("a line with the format", "end_header"));
        };
        let header = Self { encoding, elements };
        header.check(words)?;
        Ok(header)
    }

    /// The place of the vertices among the elements, if there are any.
    pub(crate) fn vertex_element(&self) -> Option<usize> {
        self.elements.iter().position(|element| element.kind == Kind::Vertex)
    }

    /// The place of the first element with faces or strips.
    pub(crate) fn first_surface(&self) -> Option<usize> {
        self.elements.iter().position(|element| matches!(element.kind, Kind::Face | Kind::Strips))
    }

    pub(crate) fn has_materials(&self) -> bool {
        self.face_has(Role::Material)
    }

    /// Whether faces have a property of this role.
    pub(crate) fn face_has(&self, role: Role) -> bool {
        self.elements.iter().any(|e| e.kind == Kind::Face && e.has(role))
    }

    /// Whether vertices have texture coordinates.
    pub(crate) fn has_vertex_uvs(&self) -> bool {
        let vertices = self.vertex_element().map(|at| &self.elements[at]);
        vertices.is_some_and(|e| e.has(Role::Texture(0)) && e.has(Role::Texture(1)))
    }

    pub(crate) fn has_normals(&self) -> bool {
        self.vertex_element().is_some_and(|at| self.elements[at].has(Role::Normal))
    }

    pub(crate) fn has_colours(&self) -> bool {
        self.vertex_element().is_some_and(|at| self.elements[at].has(Role::Colour(0)))
    }

    /// Vertices come once and have coordinates; the line that ends the header is consumed.
    fn check(&self, words: &mut Words) -> Result<(), IoError> {
        let vertices = self.elements.iter().filter(|element| element.kind == Kind::Vertex);
        for (number, element) in vertices.enumerate() {
            if number > 0 {
                return Err(words.unreadable("one vertex element", "two of them"));
            }
            for (axis, name) in ["x", "y", "z"].iter().enumerate() {
                if !element.has(Role::Coordinate(axis)) {
                    let expected = format!("a property {name} of the vertices");
                    return Err(words.unreadable(&expected, "none"));
                }
            }
        }
        if let Some(word) = words.word_on_line()? {
            let found = shown(word);
            return Err(words.unreadable("the end of the line after end_header", &found));
        }
        let ended = !words.skip_line()?;
        if ended && self.elements.iter().any(|element| element.count > 0) {
            return Err(words.unreadable("elements after end_header", "the end of the file"));
        }
        Ok(())
    }
}

fn check_count(words: &Words, what: &'static str, count: usize) -> Result<(), IoError> {
    if count <= MOST_PROPERTIES {
        return Ok(());
    }
    Err(IoError::too_many(words.input().path(), what, MOST_PROPERTIES as u64))
}

fn read_encoding(words: &mut Words) -> Result<Encoding, IoError> {
    let word = words.word_on_line()?.unwrap_or_default();
    Ok(match word {
        b"ascii" => Encoding::Text,
        b"binary_little_endian" => Encoding::LittleEndian,
        b"binary_big_endian" => Encoding::BigEndian,
        _ => {
            let found = shown(word);
            let expected = "ascii, binary_little_endian or binary_big_endian";
            return Err(words.unreadable(expected, &found));
        }
    })
}

fn read_element(words: &mut Words) -> Result<Element, IoError> {
    let kind = match words.word_on_line()? {
        Some(b"vertex") => Kind::Vertex,
        Some(b"face") => Kind::Face,
        Some(b"tristrips") => Kind::Strips,
        Some(_) => Kind::Other,
        None => return Err(words.unreadable("the name of an element", "the end of the line")),
    };
    let word = words.word_on_line()?.unwrap_or_default();
    let count = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
    let Some(count) = count else {
        let found = shown(word);
        return Err(words.unreadable("the number of elements", &found));
    };
    Ok(Element { kind, count, properties: Vec::new() })
}

fn read_property(words: &mut Words, kind: Kind) -> Result<Property, IoError> {
    let (length, scalar) = match read_type(words)? {
        Some(scalar) => (None, scalar),
        None => match (read_type(words)?, read_type(words)?) {
            (Some(Scalar::F32 | Scalar::F64) | None, _) | (_, None) => {
                return Err(words.unreadable("a list of numbers with a whole length", "another"));
            }
            (length, Some(scalar)) => (length, scalar),
        },
    };
    let Some(name) = words.word_on_line()? else {
        return Err(words.unreadable("the name of a property", "the end of the line"));
    };
    Ok(Property { role: role(kind, length.is_some(), name), length, scalar })
}

/// A number type, or `None` for the word `list`.
fn read_type(words: &mut Words) -> Result<Option<Scalar>, IoError> {
    let word = words.word_on_line()?.unwrap_or_default();
    match Scalar::named(word) {
        Some(scalar) => Ok(Some(scalar)),
        None if word == b"list" => Ok(None),
        None => {
            let found = shown(word);
            Err(words.unreadable("the type of a property", &found))
        }
    }
}

fn role(kind: Kind, is_list: bool, name: &[u8]) -> Role {
    match (kind, is_list, name) {
        (Kind::Vertex, false, b"x") => Role::Coordinate(0),
        (Kind::Vertex, false, b"y") => Role::Coordinate(1),
        (Kind::Vertex, false, b"z") => Role::Coordinate(2),
        (Kind::Vertex | Kind::Face, false, b"red" | b"diffuse_red") => Role::Colour(0),
        (Kind::Vertex | Kind::Face, false, b"green" | b"diffuse_green") => Role::Colour(1),
        (Kind::Vertex | Kind::Face, false, b"blue" | b"diffuse_blue") => Role::Colour(2),
        (Kind::Vertex | Kind::Face, false, b"alpha" | b"diffuse_alpha") => Role::Colour(3),
        (Kind::Vertex, false, b"s" | b"u" | b"texture_u" | b"texture_s") => Role::Texture(0),
        (Kind::Vertex, false, b"t" | b"v" | b"texture_v" | b"texture_t") => Role::Texture(1),
        (Kind::Vertex, false, b"nx") => Role::Normal,
        (Kind::Face, true, b"texcoord") => Role::Coordinates,
        (Kind::Face, false, b"texnumber") => Role::Image,
        (Kind::Face, false, b"material_index") => Role::Material,
        (Kind::Face, false, b"patch") => Role::Patch,
        (Kind::Face | Kind::Strips, true, b"vertex_indices" | b"vertex_index") => Role::Indices,
        _ => Role::Other,
    }
}
