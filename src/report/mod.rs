//! What people look at: pictures of a repair, a page of a model, a page of a catalogue.
//!
//! In:      meshes as streams ([`crate::mesh::MeshSource`]), outcomes, the journal; never the stages
//!          that made them.
//! Out:     pictures, pages and layers, put in place only when complete.
//! Memory:  what the caller states as a share; see [`preview`].

mod catalogue_page;
mod coloured;
mod error;
mod html;
mod image_exr;
mod image_png;
mod image_staged;
mod layers;
mod light_mesh;
mod model_page;
mod pictures;
pub mod preview;

pub use catalogue_page::{FOLDER, INDEX, report_folder, write_catalogue_page};
pub use coloured::write_coloured;
pub use error::ReportError;
pub use layers::{DEFAULT_TOLERANCE, Layers, LayersError};
pub use model_page::{Gallery, MapOptions, ModelPage, PageOptions, PartsPage, write_model_page};
pub use preview::{
    Measuring, OpenSource, PatchRule, PreviewError, PreviewOptions, PreviewStats, Scene, Side,
    SideStats, UpAxis, Views, write_preview,
};
