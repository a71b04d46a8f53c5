//! Repairs broken 3D models out of core.
//!
//! Any polygon soup goes in; a closed, 2-manifold, consistently oriented surface comes out, at any
//! octree depth, inside the memory that the caller granted.
//!
//! ```text
//! file -> ingest -> scan -> patch -> sign -> contour -> verify -> deviate -> file
//!           |        |        |       |        |
//!          bins    bricks   flips   signs    cells      (all on disk, in the work folder)
//! ```
//!
//! Guaranteed of every file that is put in place: closed, edge- and vertex-manifold, outward
//! oriented, free of degenerate triangles, proved on the file as written.
//!
//! A run that was stopped or killed goes on from its last checkpoint when it is started again, and
//! ends with the same bytes; what lies on the disk is checked before it is believed.
//!
//! Refused: input that cannot be parsed, input in which no triangle is left, memory budgets below
//! the floor, output grids too coarse for the depth. `ARCHITECTURE.md` shows the rooms and their
//! invariants.

pub mod bridge;
pub mod catalogue;
pub mod contour;
pub mod defect;
pub mod deviate;
pub mod diagnose;
pub mod geom;
pub mod hidden;
pub mod ingest;
pub mod io;
pub mod mesh;
pub mod monitor;
pub mod octree;
pub mod paint;
pub mod patch;
pub mod repair;
pub mod report;
pub mod scan;
pub mod sign;
pub mod store;
pub mod transfer;
pub mod verify;
