//! The nodes of a scene, from the reader of a model to the writer of its output.
//!
//! In:         nodes in the order of their numbers, parents before what is in them.
//! Out:        the same, one after another; what is in which.
//! Memory:     one node; tables over nodes, spilled beyond a share.

use bytemuck::{Pod, Zeroable};

use crate::mesh::{Affine, SceneNode};
use crate::store::{FileState, Scratch, Spool, SpoolPeek, SpoolWriter, StoreError, Table};
use crate::store::{Texts, TextsWriter};

/// Spools of the nodes, and of their names.
pub const NODES: [&str; 2] = ["nodes.spool", "node-names.spool"];
/// The same of nodes without what nobody sees.
pub const SEEN_NODES: [&str; 2] = ["seen-nodes.spool", "seen-node-names.spool"];
/// Memory for what is in which.
const SHARE_BYTES: u64 = 64 << 10;
/// No node, no part.
pub(crate) const NONE: u32 = u32::MAX;

/// A node but for its name.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct NodeRecord {
    map: Affine,
    parent: u32,
    part: u32,
}

/// Appends nodes to their spools.
pub struct SceneWriter {
    scratch: Scratch,
    nodes: SpoolWriter<NodeRecord>,
    names: TextsWriter,
}

impl SceneWriter {
    /// Starts the spools with these names: [`NODES`] or [`SEEN_NODES`].
    ///
    /// # Errors
    /// A file cannot be created.
    pub fn create(scratch: &Scratch, names: [&str; 2]) -> Result<Self, StoreError> {
        Ok(Self {
            scratch: scratch.clone(),
            nodes: SpoolWriter::create(scratch, names[0])?,
            names: TextsWriter::create(scratch, names[1])?,
        })
    }

    /// Appends the next node.
    ///
    /// # Errors
    /// The disk is full.
    pub fn push(&mut self, node: &SceneNode) -> Result<(), StoreError> {
        let (parent, part) = (node.parent.unwrap_or(NONE), node.part.unwrap_or(NONE));
        self.nodes.push(NodeRecord { map: node.map, parent, part })?;
        self.names.push(&node.name)
    }

    /// Completes the spools.
    ///
    /// # Errors
    /// The disk is full.
    pub fn finish(self) -> Result<SceneTree, StoreError> {
        let nodes = self.nodes.finish()?.state().clone();
        let names = self.names.finish()?.state().clone();
        Ok(SceneTree { scratch: self.scratch, nodes, names })
    }
}

/// The nodes of a scene.
#[derive(Clone, Debug)]
pub struct SceneTree {
    scratch: Scratch,
    nodes: FileState,
    names: FileState,
}

impl SceneTree {
    /// Shows every node with its number, in order.
    ///
    /// # Errors
    /// A spool is missing or damaged, or what `visit` says.
    pub fn for_each<E: From<StoreError>>(
        &self,
        mut visit: impl FnMut(u32, SceneNode) -> Result<(), E>,
    ) -> Result<(), E> {
        let nodes = Spool::<NodeRecord>::open(&self.scratch, &self.nodes)?;
        let names = Spool::open(&self.scratch, &self.names)?;
        let (mut nodes, mut names) = (SpoolPeek::new(&nodes), Texts::new(&names));
        let mut number = 0;
        let some = |number| (number != NONE).then_some(number);
        while let Some(NodeRecord { map, parent, part }) = nodes.next()? {
            let name = names.next()?.unwrap_or_default();
            visit(number, SceneNode { name, parent: some(parent), map, part: some(part) })?;
            number += 1;
        }
        Ok(())
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.nodes.records
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What is in which.
    pub(crate) fn links(&self) -> Result<Links, StoreError> {
        let mut links = Links {
            first: NONE,
            last: NONE,
            children: Table::new(&self.scratch, SHARE_BYTES),
            next: Table::new(&self.scratch, SHARE_BYTES),
        };
        self.for_each(|number, node| links.add(number, node.parent))?;
        Ok(links)
    }
}

/// Of nodes: the first and the last in them, and the one that follows in the same.
pub(crate) struct Links {
    first: u32,
    last: u32,
    children: Table<[u32; 2]>,
    next: Table<u32>,
}

impl Links {
    fn add(&mut self, number: u32, parent: Option<u32>) -> Result<(), StoreError> {
        self.children.push([NONE; 2])?;
        self.next.push(NONE)?;
        let [first, last] = match parent {
            Some(parent) => self.children.get(parent.into())?,
            None => [self.first, self.last],
        };
        if last != NONE {
            self.next.set(last.into(), number)?;
        }
        let ends = [if first == NONE { number } else { first }, number];
        match parent {
            Some(parent) => self.children.set(parent.into(), ends),
            None => {
                [self.first, self.last] = ends;
                Ok(())
            }
        }
    }

    /// Shows the nodes in `parent`, or those that are in none, in order.
    pub(crate) fn for_each<E: From<StoreError>>(
        &mut self,
        parent: Option<u32>,
        mut visit: impl FnMut(u32) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut child = match parent {
            Some(parent) => self.children.get(parent.into())?[0],
            None => self.first,
        };
        while child != NONE {
            visit(child)?;
            child = self.next.get(child.into())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::IDENTITY;

    #[test]
    fn nodes_come_back_and_are_linked_in_order() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut writer = SceneWriter::create(&Scratch::new(folder.path()), NODES).expect("spools");
        let parents = [None, Some(0), Some(1), Some(0), None, Some(4)];
        let node = |number: usize| SceneNode {
            name: format!("node {number}"),
            parent: parents[number],
            map: IDENTITY.map(|row| row.map(|x| x * number as f64)),
            part: (number % 2 == 1).then_some(number as u32 / 2),
        };
        (0..6).try_for_each(|number| writer.push(&node(number))).expect("pushed");
        let tree = writer.finish().expect("finished");
        assert_eq!(tree.len(), 6);
        tree.for_each(|number, found| {
            assert_eq!(found, node(number as usize));
            Ok::<_, StoreError>(())
        })
        .expect("read");
        let mut links = tree.links().expect("linked");
        for (parent, expected) in
            [(None, vec![0, 4]), (Some(0), vec![1, 3]), (Some(1), vec![2]), (Some(5), vec![])]
        {
            let mut found = Vec::new();
            let shown = links.for_each(parent, |number| {
                found.push(number);
                Ok::<_, StoreError>(())
            });
            shown.expect("shown");
            assert_eq!(found, expected);
        }
    }
}
