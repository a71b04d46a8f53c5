//! An OBJ file in the words that `tobj` understands, statement by statement.
//!
//! `tobj` renumbers vertices per model, mixes `o` with `g`, and takes lines for faces. So it gets
//! positions with their number in the file as a "colour", a first texture coordinate that stands
//! for missing ones, and an `o` that names all three states for every change of part or material.
//! What cannot be said so, does not parse, or would make `tobj` hold more than [`MOST_HELD_BYTES`]
//! ends the text: the streaming reader's word stands. Memory: one statement, and the names and
//! colours of the file, which count towards that limit.

use std::io::{BufRead, Read};

use crate::io::error::IoError;
use crate::io::input::Input;
use crate::io::numbers::{push_count, push_number};
use crate::io::obj::materials::Library;
use crate::io::obj::statements::{CornerIndices, Statement, Vertex, read_texture, resolve};
use crate::io::polygon::WHITE;
use crate::io::words::{Dialect, Words};

/// The most that `tobj` and this text may hold, by the estimates below.
const MOST_HELD_BYTES: u64 = 24 << 20;
/// A vertex: position and "colour", in a list of all and in a model, and an index.
const VERTEX_BYTES: u64 = 136;
/// A texture coordinate, likewise.
const TEXTURE_BYTES: u64 = 72;
/// A face: a record of up to four corners and its arity.
const FACE_BYTES: u64 = 112;
/// A corner: its indices in a model, and 24 bytes in a record of more than four.
const CORNER_BYTES: u64 = 8;
const MANY_CORNERS_BYTES: u64 = 40;
/// A change of scope: a model with its lists, and the name besides its bytes.
const SCOPE_BYTES: u64 = 1024;

/// The names that hold for the faces that follow; numbers into the lists of [`Normalised`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Scope {
    pub(crate) object: usize,
    pub(crate) group: usize,
    pub(crate) material: usize,
}

impl Scope {
    /// Reads the name of a model that came back from `tobj`.
    pub(crate) fn parse(name: &str) -> Option<Self> {
        let mut fields = name.split(' ').map(|field| field.parse().ok());
        let (object, group, material) = (fields.next()??, fields.next()??, fields.next()??);
        Some(Self { object, group, material })
    }
}

/// What was seen on the way and does not go through `tobj`.
pub(crate) struct Seen {
    pub(crate) objects: Vec<String>,
    pub(crate) groups: Vec<String>,
    pub(crate) materials: Vec<String>,
    pub(crate) library: Library,
    /// Empty if no vertex has a colour.
    pub(crate) colours: Vec<[u8; 4]>,
    pub(crate) vertices: u64,
    pub(crate) textures: u64,
    pub(crate) has_normals: bool,
    pub(crate) is_obj: bool,
    pub(crate) bytes_read: u64,
}

impl Seen {
    pub(crate) fn has_objects(&self) -> bool {
        // The first name is the one that holds before any statement.
        self.objects.len() > 1
    }
}

/// The text for `tobj`, made while it is read.
pub(crate) struct Normalised {
    words: Words,
    scope: Scope,
    seen: Seen,
    held_bytes: u64,
    text: Vec<u8>,
    at: usize,
}

impl Normalised {
    pub(crate) fn new(input: Input, library: Library) -> Self {
        let unnamed = || vec![String::new()];
        Self {
            words: Words::new(input, Dialect::CommentsAndContinuations),
            scope: Scope::default(),
            seen: Seen {
                objects: unnamed(),
                groups: unnamed(),
                materials: unnamed(),
                library,
                colours: Vec::new(),
                vertices: 0,
                textures: 0,
                has_normals: false,
                is_obj: false,
                bytes_read: 0,
            },
            held_bytes: 0,
            text: b"vt 0 0\no 0 0 0\n".to_vec(),
            at: 0,
        }
    }

    /// What was seen, once `tobj` has read to the end; and the input.
    pub(crate) fn into_seen(mut self) -> (Seen, Input) {
        self.seen.bytes_read = self.words.input().bytes_read();
        (self.seen, self.words.into_input())
    }

    /// Counts what `tobj` will hold.
    fn hold(&mut self, bytes: u64) -> Result<(), IoError> {
        self.held_bytes += bytes;
        if self.held_bytes > MOST_HELD_BYTES {
            let path = self.words.input().path();
            return Err(IoError::too_many(path, "bytes in the hands of tobj", MOST_HELD_BYTES));
        }
        Ok(())
    }

    /// Replaces the text by the next statement that means something; empty at the file's end.
    fn advance(&mut self) -> Result<(), IoError> {
        self.text.clear();
        self.at = 0;
        while self.text.is_empty() {
            let Some(statement) = Statement::next(&mut self.words)? else { break };
            self.seen.is_obj |= statement != Statement::Unknown;
            match statement {
                Statement::Vertex => self.vertex()?,
                Statement::Texture => self.texture()?,
                Statement::Face => self.face()?,
                Statement::Object => {
                    self.scope.object = add_name(&mut self.seen.objects, &mut self.words)?;
                    self.scope(self.seen.objects[self.scope.object].len())?;
                }
                Statement::Group => {
                    self.scope.group = add_name(&mut self.seen.groups, &mut self.words)?;
                    self.scope(self.seen.groups[self.scope.group].len())?;
                }
                Statement::UseMaterial => {
                    self.scope.material = add_name(&mut self.seen.materials, &mut self.words)?;
                    self.scope(self.seen.materials[self.scope.material].len())?;
                }
                Statement::Library => {
                    let names = self.words.raw_name()?;
                    self.seen.library.load(&names)?;
                }
                Statement::Normal => self.seen.has_normals = true,
                Statement::Known | Statement::Unknown => {}
            }
            self.words.skip_line()?;
        }
        Ok(())
    }

    /// Tells `tobj` of a new scope, after a name of so many bytes.
    fn scope(&mut self, name_bytes: usize) -> Result<(), IoError> {
        self.hold(SCOPE_BYTES + name_bytes as u64)?;
        let Scope { object, group, material } = self.scope;
        self.text = format!("o {object} {group} {material}\n").into_bytes();
        Ok(())
    }

    fn vertex(&mut self) -> Result<(), IoError> {
        self.hold(VERTEX_BYTES)?;
        let vertex = Vertex::read(&mut self.words)?;
        if vertex.colour.is_some() && self.seen.colours.is_empty() {
            self.seen.colours.resize(self.seen.vertices as usize, WHITE);
        }
        if vertex.colour.is_some() || !self.seen.colours.is_empty() {
            self.seen.colours.push(vertex.colour.unwrap_or(WHITE));
        }
        self.text.push(b'v');
        for coordinate in vertex.position {
            self.text.push(b' ');
            push_number(&mut self.text, coordinate);
        }
        self.text.push(b' ');
        push_count(&mut self.text, self.seen.vertices);
        self.text.extend_from_slice(b" 0 0\n");
        self.seen.vertices += 1;
        Ok(())
    }

    fn texture(&mut self) -> Result<(), IoError> {
        self.hold(TEXTURE_BYTES)?;
        self.text.extend_from_slice(b"vt");
        for coordinate in read_texture(&mut self.words)? {
            self.text.push(b' ');
            push_number(&mut self.text, coordinate);
        }
        self.text.push(b'\n');
        self.seen.textures += 1;
        Ok(())
    }

    fn face(&mut self) -> Result<(), IoError> {
        self.hold(FACE_BYTES)?;
        let mut corners = 0;
        self.text.push(b'f');
        while let Some(CornerIndices { vertex, texture }) = CornerIndices::read(&mut self.words)? {
            corners += 1;
            self.hold(if corners > 4 { MANY_CORNERS_BYTES } else { CORNER_BYTES })?;
            // Number 1 is the coordinate that stands for missing ones, so all others move up.
            let textures = self.seen.textures;
            let texture = match texture {
                Some(index) if index > 0 && index.unsigned_abs() > textures => {
                    let found = "one that comes later, or never";
                    return Err(self.words.unreadable("a known texture coordinate", found));
                }
                Some(index) => resolve(index, textures, textures).map_or(1, |place| place + 2),
                None => 1,
            };
            self.text.extend_from_slice(if vertex < 0 { b" -" } else { b" " });
            push_count(&mut self.text, vertex.unsigned_abs());
            self.text.push(b'/');
            push_count(&mut self.text, texture);
        }
        self.text.push(b'\n');
        Ok(())
    }
}

fn add_name(names: &mut Vec<String>, words: &mut Words) -> Result<usize, IoError> {
    names.push(words.name()?);
    Ok(names.len() - 1)
}

impl Read for Normalised {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let text = self.fill_buf()?;
        let count = text.len().min(buffer.len());
        buffer[..count].copy_from_slice(&text[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Normalised {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.at == self.text.len() {
            self.advance().map_err(std::io::Error::other)?;
        }
        Ok(&self.text[self.at..])
    }

    fn consume(&mut self, count: usize) {
        self.at += count;
    }
}
