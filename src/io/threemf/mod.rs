//! 3MF: a zip archive of XML parts. Core, and of the extensions: materials and production.

mod archive;
mod groups;
mod instances;
mod model;
mod part_name;
mod properties;
mod reader;
mod scene;
mod transform;
mod vocabulary;
mod xml;

pub(crate) use reader::ThreeMfReader;
