//! Triangles on their way in and out: batches, names, and the two ends of the pipeline.
//!
//! Formats end at [`MeshSource`] and [`MeshSink`]; no stage knows a file format.

pub mod shapes;

mod attributes;
mod batch;
mod material;
mod scene;
mod sink;
mod source;
mod texture;
mod unit;

pub use attributes::Attributes;
pub use batch::{NO_POLYGON, Part, TriangleBatch};
pub use material::{Material, Surface};
pub use scene::{Affine, IDENTITY, Placement, SceneNode, apply, compose, mirrors, stretch};
pub use sink::{
    CornerForm, CornerValues, DrawnFrom, InnerCrossing, MeshSink, SinkFile, SinkState, SinkStats,
    SinkTriangles, VertexValues,
};
pub use source::{Discarded, MeshSource};
pub use texture::{Image, Maps, OtherMaps, Texture};
pub use unit::LengthUnit;
