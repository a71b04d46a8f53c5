//! Where the parts of a written model stand: objects made of components, and the items of the build.
//!
//! In:         the nodes of a scene, or none; the parts that were written.
//! Out:        an object for each node that holds several things, or has a name of its own; an item
//!             for each node that is in none. Without nodes an item for each part.
//! Invariant:  an object stands behind all that it is made of.
//! Memory:     tables over nodes, spilled beyond a share.

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::io::numbers::push_count;
use crate::io::parts_written::{Extent, PartsWritten};
use crate::io::scene::{Links, NONE, SceneTree};
use crate::io::threemf::transform::Transform;
use crate::io::threemf::writer::push_name;
use crate::io::threemf::zip_file::ZipFile;
use crate::store::{Dictionary, Scratch, Table};

/// Memory for each of the tables.
const SHARE_BYTES: u64 = 64 << 10;

/// A node.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Node {
    transform: Transform,
    /// The id of the object of its part, or none.
    part: u32,
    name: u32,
    /// Whether its name is that of its part.
    is_named_so: u32,
    /// The id of the object that stands for it and for all that is in it, or none.
    object: u32,
}

/// See the module.
pub(super) struct Build {
    nodes: Table<Node>,
    names: Dictionary,
    links: Option<Links>,
    /// Ids of the parts' objects.
    parts: std::ops::Range<u32>,
}

impl Build {
    pub(super) fn new(
        scratch: &Scratch,
        scene: Option<&SceneTree>,
        parts: &mut PartsWritten,
        first_id: u32,
    ) -> Result<Self, IoError> {
        let mut build = Self {
            nodes: Table::new(scratch, SHARE_BYTES),
            names: Dictionary::new(scratch, SHARE_BYTES),
            links: None,
            parts: first_id..first_id + parts.len() as u32,
        };
        let Some(scene) = scene.filter(|scene| !scene.is_empty()) else { return Ok(build) };
        let mut places = parts.places()?;
        scene.for_each(|_, node| {
            let place = match node.part.map(u64::from).filter(|&part| part < places.len()) {
                Some(part) => places.get(part)?,
                None => NONE,
            };
            let (mut part, mut is_named_so) = (NONE, node.name.is_empty());
            if place != NONE {
                part = first_id + place;
                is_named_so |= parts.get(place.into(), Extent::default())?.name == node.name;
            }
            build.nodes.push(Node {
                transform: Transform::from_affine(&node.map),
                part,
                name: build.names.number(node.name.as_bytes())?,
                is_named_so: is_named_so.into(),
                object: NONE,
            })?;
            Ok::<_, IoError>(())
        })?;
        build.links = Some(scene.links()?);
        Ok(build)
    }

    /// Writes objects with ids from `next_id` on, the end of the resources, and the items.
    pub(super) fn write(mut self, zip: &mut ZipFile, next_id: u32) -> Result<(), IoError> {
        let mut next_id = next_id;
        for number in (0..self.nodes.len()).rev() {
            self.write_node(zip, number as u32, &mut next_id)?;
        }
        zip.write(b"</resources>\n<build>\n")?;
        let Self { mut nodes, links, parts, .. } = self;
        let mut text = Vec::new();
        match links {
            Some(mut links) => links.for_each(None, |root| {
                let Node { object, transform, .. } = nodes.get(root.into())?;
                write_placed(zip, "item", (object, transform), &mut text)
            })?,
            None => parts.into_iter().try_for_each(|part| {
                write_placed(zip, "item", (part, Transform::IDENTITY), &mut text)
            })?,
        }
        zip.write(b"</build>\n")
    }

    /// Writes the object of a node whose children have theirs, where it needs one of its own.
    fn write_node(
        &mut self,
        zip: &mut ZipFile,
        number: u32,
        next_id: &mut u32,
    ) -> Result<(), IoError> {
        let node = self.nodes.get(number.into())?;
        let mut components = vec![(node.part, Transform::IDENTITY)];
        let Some(links) = &mut self.links else { return Ok(()) };
        let nodes = &mut self.nodes;
        links.for_each(Some(number), |child| {
            let Node { object, transform, .. } = nodes.get(child.into())?;
            components.push((object, transform));
            Ok::<_, IoError>(())
        })?;
        components.retain(|(object, _)| *object != NONE);
        let is_part = matches!(components.as_slice(), [(object, _)] if *object == node.part);
        let object = match components.is_empty() || is_part && node.is_named_so != 0 {
            true => node.part,
            false => {
                *next_id += 1;
                let id = *next_id - 1;
                let mut text = format!("<object id=\"{id}\" type=\"model\"").into_bytes();
                push_name(&mut text, &String::from_utf8_lossy(&self.names.name(node.name)?));
                text.extend_from_slice(b">\n<components>\n");
                zip.write(&text)?;
                for component in components {
                    write_placed(zip, "component", component, &mut text)?;
                }
                zip.write(b"</components>\n</object>\n")?;
                id
            }
        };
        Ok(self.nodes.set(number.into(), Node { object, ..node })?)
    }
}

/// Writes an object in its place, if there is one.
fn write_placed(
    zip: &mut ZipFile,
    tag: &str,
    (object, transform): (u32, Transform),
    text: &mut Vec<u8>,
) -> Result<(), IoError> {
    if object == NONE {
        return Ok(());
    }
    text.clear();
    text.extend_from_slice(format!("<{tag} objectid=\"").as_bytes());
    push_count(text, object.into());
    text.push(b'"');
    if transform != Transform::IDENTITY {
        text.extend_from_slice(b" transform=\"");
        transform.push(text);
        text.push(b'"');
    }
    text.extend_from_slice(b"/>\n");
    zip.write(text)
}
