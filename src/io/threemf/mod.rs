//! 3MF: a zip archive of XML parts. Core, and of the extensions: materials and production.

mod archive;
mod bases;
mod build;
mod groups;
#[cfg(test)]
mod hostile_tests;
mod instances;
mod model;
mod package;
mod paint;
mod part_name;
mod properties;
mod reader;
mod records;
mod scene;
#[cfg(test)]
mod tests;
mod transform;
mod vocabulary;
mod writer;
#[cfg(test)]
mod writer_tests;
mod xml;
mod zip_file;

pub(crate) use reader::ThreeMfReader;
pub(crate) use writer::ThreeMfWriter;
