//! What people look at: pictures of a repair, before beside after.
//!
//! In:      meshes as streams ([`crate::mesh::MeshSource`]), never the stages that made them.
//! Out:     picture files, put in place only when complete.
//! Memory:  what the caller states as a share; see [`preview`].

mod image_exr;
mod image_png;
mod image_staged;
pub mod preview;

pub use preview::{
    OpenSource, PreviewError, PreviewOptions, PreviewStats, Side, SideStats, UpAxis, Views,
    write_preview,
};
