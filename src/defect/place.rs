//! Where an edge or a vertex is: its position, and its number where the format has numbers.

use std::fmt;

use serde::{Deserialize, Serialize};

/// An edge of the file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EdgePlace {
    /// Both end points, in model units.
    pub ends: [[f64; 3]; 2],
    /// Their numbers in the file, from 0.
    pub vertices: Option<[u32; 2]>,
}

impl EdgePlace {
    /// The point half-way.
    #[must_use]
    pub fn middle(&self) -> [f64; 3] {
        let [a, b] = self.ends;
        std::array::from_fn(|axis| a[axis].midpoint(b[axis]))
    }
}

impl fmt::Display for EdgePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some([a, b]) = self.vertices {
            write!(f, "{a}-{b} ")?;
        }
        write!(f, "from {} to {}", Point(self.ends[0]), Point(self.ends[1]))
    }
}

/// A vertex of the file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct VertexPlace {
    /// Where it is, in model units.
    pub position: [f64; 3],
    /// Its number in the file, from 0.
    pub vertex: Option<u32>,
}

impl fmt::Display for VertexPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(vertex) = self.vertex {
            write!(f, "{vertex} ")?;
        }
        write!(f, "at {}", Point(self.position))
    }
}

/// A position as text.
pub(crate) struct Point(pub(crate) [f64; 3]);

impl fmt::Display for Point {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0;
        write!(f, "({x}, {y}, {z})")
    }
}
