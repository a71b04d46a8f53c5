//! The nodes of a scene, parents before their children, each with its map into the scene, or into
//! its parent.
//!
//! A node that is reached twice, by two parents or in a circle, is refused: glTF has trees only.
//! Memory: the share for the nodes still to come.

use crate::io::error::IoError;
use crate::io::gltf::accessor::{Demand, Field};
use crate::io::gltf::buffers::Buffers;
use crate::io::gltf::model::{Model, NONE, NodeRecord};
use crate::io::gltf::transform::{from_parts, is_finite};
use crate::mesh::{Affine, IDENTITY, Placement, compose};
use crate::store::{Scratch, Table};

/// What places copies of a mesh in its node.
const SHIFTS: Demand =
    Demand { what: "three numbers in an element", lanes: [3, 3], is_index: false, is_part: false };
const TURNS: Demand = Demand { what: "four numbers in an element", lanes: [4, 4], ..SHIFTS };

/// A node on the way.
pub(crate) struct Visited {
    /// Its number in the file.
    pub(crate) number: u32,
    pub(crate) node: NodeRecord,
    /// The number in the file of its parent, or none.
    pub(crate) parent: u32,
}

/// Walks the nodes.
pub(crate) struct Walk {
    placement: Placement,
    /// Nodes to come with their parents, the next one on top.
    stack: Table<[u32; 2]>,
    height: u64,
    visited: u64,
    is_whole: bool,
}

impl Walk {
    /// Begins at the default scene, else the first, else all nodes without a parent.
    pub(crate) fn new(
        model: &mut Model,
        scratch: &Scratch,
        share_bytes: u64,
        placement: Placement,
    ) -> Result<Self, IoError> {
        let stack = Table::new(scratch, share_bytes);
        let mut walk = Self { placement, stack, height: 0, visited: 0, is_whole: false };
        let scene = match model.scene {
            NONE if model.scenes.is_empty() => {
                walk.begin_everywhere(model)?;
                return Ok(walk);
            }
            NONE => 0,
            scene => u64::from(scene),
        };
        if scene >= model.scenes.len() {
            let found = format!("{} of them", model.scenes.len());
            return Err(model.wrong(("scene", model.scene), "a scene with that number", found));
        }
        let [first, count] = model.scenes.get(scene)?;
        walk.push(model, first, count, NONE)?;
        Ok(walk)
    }

    /// Begins at every node that is nobody's child.
    fn begin_everywhere(&mut self, model: &mut Model) -> Result<(), IoError> {
        self.is_whole = true;
        for at in 0..model.children.len() {
            let child = model.children.get(at)?;
            let node = model.node(child)?;
            model.nodes.set(child.into(), NodeRecord { is_child: 1, ..node })?;
        }
        for number in (0..model.nodes.len()).rev() {
            if model.nodes.get(number)?.is_child == 0 {
                self.put([number as u32, NONE])?;
            }
        }
        Ok(())
    }

    fn push(
        &mut self,
        model: &mut Model,
        first: u64,
        count: u64,
        parent: u32,
    ) -> Result<(), IoError> {
        (first..first + count).rev().try_for_each(|at| {
            let child = model.children.get(at)?;
            self.put([child, parent])
        })
    }

    fn put(&mut self, entry: [u32; 2]) -> Result<(), IoError> {
        if self.height < self.stack.len() {
            self.stack.set(self.height, entry)?;
        } else {
            self.stack.push(entry)?;
        }
        self.height += 1;
        Ok(())
    }

    /// The next node; its map leads into the scene, or into its parent where parts are by
    /// themselves.
    pub(crate) fn next(&mut self, model: &mut Model) -> Result<Option<Visited>, IoError> {
        let Some(top) = self.height.checked_sub(1) else {
            if self.is_whole && self.visited < model.nodes.len() {
                let expected = "nodes that descend from one without a parent";
                let found = format!("{} in circles", model.nodes.len() - self.visited);
                return Err(model.wrong(("scene", 0), expected, found));
            }
            return Ok(None);
        };
        self.height = top;
        let [number, parent] = self.stack.get(top)?;
        let mut node = model.node(number)?;
        if node.visited != 0 {
            let found = "another one, or itself";
            return Err(model.wrong(("node", number), "a node with one parent", found));
        }
        if parent != NONE && self.placement == Placement::InScene {
            node.map = compose(&model.node(parent)?.map, &node.map);
        }
        if !is_finite(&node.map) {
            return Err(model.wrong(("node", number), "a finite transform", "an infinite one"));
        }
        self.visited += 1;
        node.visited = self.visited as u32;
        model.nodes.set(number.into(), node)?;
        self.push(model, node.first_child, node.child_count.into(), number)?;
        Ok(Some(Visited { number, node, parent }))
    }
}

/// The places of a node's mesh: one, or those of its copies.
pub(crate) struct Copies {
    node: u32,
    map: Affine,
    fields: [Option<Field>; 3],
    count: u64,
    next: u64,
}

impl Copies {
    pub(crate) fn new(
        model: &mut Model,
        buffers: &mut Buffers,
        (number, node): (u32, &NodeRecord),
    ) -> Result<Self, IoError> {
        let mut fields = [None; 3];
        let mut count = None;
        for ((field, &accessor), demand) in
            fields.iter_mut().zip(&node.instances).zip([SHIFTS, TURNS, SHIFTS])
        {
            if accessor == NONE {
                continue;
            }
            let opened = Field::open(model, buffers, accessor, &demand)?;
            if count.is_some_and(|count| count != opened.count) {
                let found = format!("{}", opened.count);
                let expected = "as many elements as the other attributes of copies have";
                return Err(model.wrong(("accessor", accessor), expected, found));
            }
            count = Some(opened.count);
            *field = Some(opened);
        }
        let count = count.unwrap_or(1);
        Ok(Self { node: number, map: node.map, fields, count, next: 0 })
    }

    /// One copy, where its mesh is.
    pub(crate) fn one(node: u32) -> Self {
        Self { node, map: IDENTITY, fields: [None; 3], count: 1, next: 0 }
    }

    /// The same copies in the coordinates of their node.
    pub(crate) fn in_node(self) -> Self {
        Self { map: IDENTITY, ..self }
    }

    /// Whether the node says where its copies are.
    pub(crate) fn are_placed(&self) -> bool {
        self.fields.iter().any(Option::is_some)
    }

    /// The map of the next copy into the scene.
    pub(crate) fn next(
        &mut self,
        model: &mut Model,
        buffers: &mut Buffers,
    ) -> Result<Option<Affine>, IoError> {
        if self.next == self.count {
            return Ok(None);
        }
        let mut parts = [[0.0; 4], [0.0, 0.0, 0.0, 1.0], [1.0; 4]];
        for (part, field) in parts.iter_mut().zip(&self.fields) {
            if let Some(field) = field {
                *part = field.get(model, buffers, self.next)?;
            }
        }
        self.next += 1;
        if !self.are_placed() {
            return Ok(Some(self.map));
        }
        let [[x, y, z, _], rotation, [a, b, c, _]] = parts;
        let map = compose(&self.map, &from_parts([x, y, z], rotation, [a, b, c]));
        if is_finite(&map) {
            return Ok(Some(map));
        }
        Err(model.wrong(("node", self.node), "copies with finite transforms", "an infinite one"))
    }
}
