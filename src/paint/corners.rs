//! Vertex by vertex: what its corners have, and the vertices and lists that the sink takes.
//!
//! In:         vertices by number, corners by vertex, values by vertex.
//! Out:        vertices and lists in the sink; an answer for every corner, by triangle.
//! Invariant:  a vertex is handed over once for sinks that keep attributes with corners, and once
//!             for each that its corners have for the others.
//! Memory:     a share for the sort; the corners of one vertex; one batch.

use bytemuck::{Pod, Zeroable};

use crate::mesh::{CornerForm, MeshSink, VertexValues};
use crate::paint::drawing::{Drawn, DrawnCorner};
use crate::paint::fans::Fans;
use crate::paint::values::{Value, Values};
use crate::paint::{BATCH, PaintError, PaintOptions, stop_if_asked};
use crate::store::{Record, Resources, Sorted, Sorter, SpoolPeek, StoreError};

/// Colour of a vertex of which nothing is known.
const WHITE: [u8; 4] = [255; 4];

/// What a corner has in the output. 40 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Answer {
    /// The triangle.
    pub triangle: u32,
    /// Which of its corners.
    pub corner: u32,
    /// The vertex in the output.
    pub vertex: u32,
    /// Numbers in the lists.
    pub uv_number: u32,
    /// See `uv_number`.
    pub normal_number: u32,
    /// The texture coordinate.
    pub uv: [f32; 2],
    /// The normal.
    pub normal: [f32; 3],
}

impl Record for Answer {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.triangle, self.corner)
    }
}

/// Vertices and lists on their way into the sink.
#[derive(Default)]
struct Batch {
    positions: Vec<[f64; 3]>,
    colours: Vec<[u8; 4]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
}

/// Room for what is around one vertex.
#[derive(Default)]
struct Room {
    answers: Vec<Answer>,
    looks: Vec<(u32, u32)>,
    parts: Vec<usize>,
}

/// Paints one vertex after another.
pub struct Painter<'p, S: ?Sized> {
    options: &'p PaintOptions,
    sink: &'p mut S,
    resources: &'p Resources<'p>,
    form: CornerForm,
    values: Values,
    fans: Fans,
    answers: Sorter<Answer>,
    batch: Batch,
    room: Room,
    /// Handed over so far, the batch included.
    vertices: u64,
    uvs: u64,
    normals: u64,
}

impl<'p, S: MeshSink + ?Sized> Painter<'p, S> {
    pub fn new(
        values: Values,
        options: &'p PaintOptions,
        sink: &'p mut S,
        resources: &'p Resources<'p>,
    ) -> Self {
        Self {
            options,
            form: sink.corner_form(),
            sink,
            resources,
            values,
            fans: Fans::new(options.crease_deg, options.slack),
            answers: Sorter::new(resources.scratch, resources.share_bytes / 3),
            batch: Batch::default(),
            room: Room::default(),
            vertices: 0,
            uvs: 0,
            normals: 0,
        }
    }

    /// Hands over all vertices; the answers by triangle.
    pub fn vertices(mut self, drawn: &Drawn) -> Result<Sorted<Answer>, PaintError<S::Error>> {
        let mut positions = SpoolPeek::new(&drawn.vertices);
        let mut corners = SpoolPeek::new(&drawn.corners);
        let mut values = Vec::new();
        let mut vertex = 0;
        while let Some(position) = positions.next()? {
            let around = corners.take_while(|corner| corner.vertex == vertex, |corner| corner)?;
            self.values.take(vertex, &mut values)?;
            self.paint(position, &around, &values)?;
            if self.batch.positions.len() >= BATCH {
                stop_if_asked(self.resources)?;
                self.hand_on()?;
            }
            vertex += 1;
        }
        self.hand_on()?;
        Ok(self.answers.finish()?)
    }

    fn paint(
        &mut self,
        position: [f64; 3],
        around: &[DrawnCorner],
        values: &[Value],
    ) -> Result<(), StoreError> {
        let is_split = self.form == CornerForm::OfVertices;
        let wanted = self.options.wanted;
        if !is_split {
            let nearest = values.iter().min_by_key(|value| value.nearness());
            self.add_vertex(position, nearest.map_or(WHITE, |value| value.colour))?;
        }
        let mut room = std::mem::take(&mut self.room);
        let Room { answers, looks, parts } = &mut room;
        answers.clear();
        answers.extend(around.iter().map(|corner| Answer {
            triangle: corner.triangle,
            corner: corner.corner,
            vertex: (self.vertices.max(1) - 1) as u32,
            ..Answer::default()
        }));
        // Looks and parts of the fan, in the order of the corners that have them first.
        looks.clear();
        for (answer, corner) in answers.iter_mut().zip(around) {
            let value = values.iter().find(|value| value.look == corner.look);
            answer.uv = value.map_or([0.0; 2], |value| value.uv);
            if is_split || !wanted.uvs {
                continue;
            }
            let known = looks.iter().find(|(look, _)| *look == corner.look);
            answer.uv_number = match known {
                Some((_, number)) => *number,
                None => {
                    let number = number(&mut self.uvs, "Texture coordinates")?;
                    self.batch.uvs.push(answer.uv);
                    looks.push((corner.look, number));
                    number
                }
            };
        }
        parts.clear();
        if wanted.normals {
            parts.extend_from_slice(self.fans.divide(around));
        } else {
            parts.resize(around.len(), 0);
        }
        if wanted.normals {
            for at in 0..around.len() {
                if parts[at] < at {
                    (answers[at].normal, answers[at].normal_number) =
                        (answers[parts[at]].normal, answers[parts[at]].normal_number);
                    continue;
                }
                answers[at].normal = self.fans.normal(around, at);
                if !is_split {
                    answers[at].normal_number = number(&mut self.normals, "Normals")?;
                    self.batch.normals.push(answers[at].normal);
                }
            }
        }
        if is_split {
            self.split(position, (around, parts), answers, values)?;
        }
        answers.iter().try_for_each(|answer| self.answers.push(*answer))?;
        self.room = room;
        Ok(())
    }

    /// Adds the vertex once for each look and part of its corners.
    fn split(
        &mut self,
        position: [f64; 3],
        (around, parts): (&[DrawnCorner], &[usize]),
        answers: &mut [Answer],
        values: &[Value],
    ) -> Result<(), StoreError> {
        let mut added: Vec<((u32, usize), u32)> = Vec::new();
        for (at, corner) in around.iter().enumerate() {
            let kind = (corner.look, parts[at]);
            if let Some((_, vertex)) = added.iter().find(|(known, _)| *known == kind) {
                answers[at].vertex = *vertex;
                continue;
            }
            let value = values.iter().find(|value| value.look == corner.look);
            self.batch.uvs.push(answers[at].uv);
            self.batch.normals.push(answers[at].normal);
            let vertex = self.add_vertex(position, value.map_or(WHITE, |value| value.colour))?;
            answers[at].vertex = vertex;
            added.push((kind, vertex));
        }
        Ok(())
    }

    fn add_vertex(&mut self, position: [f64; 3], colour: [u8; 4]) -> Result<u32, StoreError> {
        self.batch.positions.push(position);
        self.batch.colours.push(colour);
        number(&mut self.vertices, "Output vertices")
    }

    /// Passes the batch on to the sink.
    fn hand_on(&mut self) -> Result<(), PaintError<S::Error>> {
        let Batch { positions, colours, uvs, normals } = &self.batch;
        let wanted = self.options.wanted;
        let is_split = self.form == CornerForm::OfVertices;
        self.sink.vertices(positions).map_err(PaintError::Sink)?;
        let values = VertexValues {
            colours: if wanted.colours { colours } else { &[] },
            uvs: if wanted.uvs && is_split { uvs } else { &[] },
            normals: if wanted.normals && is_split { normals } else { &[] },
        };
        self.sink.vertex_values(&values).map_err(PaintError::Sink)?;
        if !is_split {
            self.sink.list_uvs(uvs).map_err(PaintError::Sink)?;
            self.sink.list_normals(normals).map_err(PaintError::Sink)?;
        }
        self.resources.monitor.advance(positions.len() as u64);
        self.batch = Batch::default();
        Ok(())
    }
}

/// The next number of a list.
fn number(count: &mut u64, what: &'static str) -> Result<u32, StoreError> {
    let limit = u64::from(u32::MAX);
    if *count >= limit {
        return Err(StoreError::TooMany { what, limit });
    }
    *count += 1;
    Ok((*count - 1) as u32)
}
