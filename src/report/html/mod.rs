//! HTML as text: elements that close, strings that are escaped, figures that people can read.
//!
//! In:         strings of any content: names of files and words of readers are hostile.
//! Out:        one page, as a stream; style and scripts stand in it, nothing is loaded from elsewhere.
//! Invariant:  every element that is opened is closed; no text of others becomes markup or script.
//! Memory:     what is being written.
//! Fails:      as the writer does.

mod address;
mod figures;
mod frame;
mod markup;

pub(crate) use address::{address_of, way_between};
pub(crate) use figures::{bytes, count, date, decimal, seconds, visible};
pub(crate) use frame::{Frame, write_page};
pub(crate) use markup::{Markup, script_text};
