//! The nodes that were visited, for those who read parts by themselves.
//!
//! In: nodes, parents first. Out: the same by number, and one in its node for each copy of a mesh
//! that the node places. Memory: a share; more is spilled.

use bytemuck::{Pod, Zeroable};

use crate::io::error::IoError;
use crate::io::gltf::buffers::Buffers;
use crate::io::gltf::model::{Model, NONE};
use crate::io::gltf::scene::{Copies, Visited};
use crate::mesh::{Affine, SceneNode};
use crate::store::{Scratch, Table};

/// A node: its map, the numbers of its parent here, its name and its mesh.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Entry {
    map: Affine,
    parent: u32,
    name: u32,
    mesh: u32,
    padding: u32,
}

/// See the module.
pub(crate) struct Nodes {
    entries: Table<Entry>,
}

impl Nodes {
    pub(crate) fn new(scratch: &Scratch, share_bytes: u64) -> Self {
        Self { entries: Table::new(scratch, share_bytes) }
    }

    pub(crate) fn len(&self) -> u64 {
        self.entries.len()
    }

    /// Appends a node, and the copies that it places.
    pub(crate) fn enter(
        &mut self,
        model: &mut Model,
        buffers: &mut Buffers,
        visited: &Visited,
    ) -> Result<(), IoError> {
        let Visited { number, mut node, parent } = *visited;
        let parent = match parent {
            NONE => NONE,
            parent => model.node(parent)?.visited - 1,
        };
        let mut copies = Copies::new(model, buffers, (number, &node))?.in_node();
        let own = self.entries.len() as u32;
        // Copies take numbers as well.
        node.visited = own + 1;
        model.nodes.set(number.into(), node)?;
        let are_placed = copies.are_placed() && node.mesh != NONE;
        let mesh = if are_placed { NONE } else { node.mesh };
        let entry = Entry { map: node.map, parent, name: node.name, mesh, padding: 0 };
        self.entries.push(entry)?;
        if are_placed {
            while let Some(map) = copies.next(model, buffers)? {
                self.entries.push(Entry { map, parent: own, mesh: node.mesh, ..entry })?;
            }
        }
        if self.entries.len() >= u64::from(NONE) {
            return Err(IoError::too_many(&model.path, "nodes", NONE.into()));
        }
        Ok(())
    }

    /// A node, once all parts were read.
    pub(crate) fn get(&mut self, model: &mut Model, number: u32) -> Result<SceneNode, IoError> {
        let Entry { map, parent, name, mesh, .. } = self.entries.get(number.into())?;
        let part = match mesh {
            NONE => NONE,
            mesh => model.mesh(mesh)?.part,
        };
        let some = |number| (number != NONE).then_some(number);
        let name = model.text_of(name)?.unwrap_or_default();
        Ok(SceneNode { name, parent: some(parent), map, part: some(part) })
    }
}
