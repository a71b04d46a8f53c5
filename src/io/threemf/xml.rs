//! XML as a stream of tags, with namespaces and places; the only home of quick-xml.
//!
//! In: the bytes of a part. Out: start and end tags; text, comments and instructions are passed
//! over. Memory: one tag or text of at most [`MOST_MARKUP_BYTES`], the names and declarations of
//! at most [`MOST_DEPTH`] open elements. Fails: what is not well-formed, or has a document type
//! (entities expand to nothing here).

use std::borrow::Cow;
use std::io::{BufRead, BufReader, Error, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::name::{NamespaceResolver, QName, ResolveResult};
use quick_xml::reader::NsReader;

use crate::io::error::{IoError, Place, shown};
use crate::io::threemf::archive::of_std;
use crate::io::threemf::vocabulary::Space;

/// The longest tag, comment or text between two tags.
const MOST_MARKUP_BYTES: usize = 1 << 20;
/// Elements inside of one another; models have eight.
const MOST_DEPTH: usize = 32;
/// Namespaces declared at the same time.
const MOST_NAMESPACES: usize = 64;
const BUFFER_BYTES: usize = 64 << 10;

/// A place in a part of the package, for messages.
#[derive(Clone, Debug)]
pub(super) struct Where {
    pub(super) path: PathBuf,
    pub(super) part: String,
    pub(super) offset: u64,
}

impl Where {
    /// The error of a place that is not what it should be.
    pub(super) fn unreadable(&self, expected: impl Into<String>, found: &str) -> IoError {
        let found = format!("{found} in {}", shown(self.part.as_bytes()));
        IoError::unreadable(&self.path, Place::Byte(self.offset), expected, found)
    }
}

/// A start tag.
pub(super) struct Tag<'x> {
    pub(super) at: &'x Where,
    start: BytesStart<'x>,
    names: &'x NamespaceResolver,
}

impl Tag<'_> {
    /// The namespace and the name in it.
    pub(super) fn name(&self) -> (Space, &str) {
        let (space, _) = self.names.resolve_element(self.start.name());
        (space_of(&space), self.start.name().local_name().into_inner())
    }

    /// The name as written.
    pub(super) fn shown(&self) -> String {
        shown(self.start.name().into_inner().as_bytes())
    }

    /// Shows all attributes: namespace, name in it, value.
    pub(super) fn attributes(
        &self,
        mut visit: impl FnMut(Space, &str, &str) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        // Looking for twins would take the square of their number.
        for attribute in self.start.attributes().with_checks(false) {
            let attribute = attribute.map_err(|e| self.ill_formed(&e.to_string()))?;
            let (space, name) = self.attribute_name(attribute.key);
            let value = if attribute.value.contains('&') {
                let value = attribute.normalized_value(XmlVersion::Implicit1_0);
                value.map_err(|e| self.ill_formed(&e.to_string()))?
            } else {
                Cow::Borrowed(&*attribute.value)
            };
            visit(space, name, &value)?;
        }
        Ok(())
    }

    fn attribute_name<'n>(&self, name: QName<'n>) -> (Space, &'n str) {
        match name.prefix() {
            None => (Space::None, name.into_inner()),
            Some(_) => {
                let (space, name) = self.names.resolve_attribute(name);
                (space_of(&space), name.into_inner())
            }
        }
    }

    /// The namespace that a prefix stands for here.
    pub(super) fn namespace(&self, prefix: &str) -> Option<String> {
        let name = format!("{prefix}:x");
        match self.names.resolve_attribute(QName(&name)).0 {
            ResolveResult::Bound(namespace) => Some(namespace.into_inner().to_owned()),
            _ => None,
        }
    }

    fn ill_formed(&self, found: &str) -> IoError {
        self.at.unreadable("well-formed XML", found)
    }
}

fn space_of(space: &ResolveResult) -> Space {
    match space {
        ResolveResult::Bound(namespace) => Space::of(namespace.into_inner()),
        ResolveResult::Unbound => Space::None,
        ResolveResult::Unknown(_) => Space::Other,
    }
}

/// What a reader is shown.
pub(super) enum Markup<'x> {
    Start(Tag<'x>),
    End(&'x Where),
}

/// Shows the tags of `part` one after the other; an element without content has both.
pub(super) fn read_xml(
    bytes: impl Read,
    path: &Path,
    part: &str,
    mut visit: impl FnMut(Markup) -> Result<(), IoError>,
) -> Result<(), IoError> {
    let bytes = BufReader::with_capacity(BUFFER_BYTES, bytes);
    let limited = Limited { bytes, left: 0, path: path.to_path_buf() };
    let mut reader = NsReader::from_reader(limited);
    reader.config_mut().expand_empty_elements = true;
    reader.resolver_mut().set_max_namespace_bindings(MOST_NAMESPACES);
    let mut at = Where { path: path.to_path_buf(), part: part.to_owned(), offset: 0 };
    let (mut buffer, mut depth, mut has_root) = (Vec::new(), 0, false);
    loop {
        buffer.clear();
        reader.get_mut().left = MOST_MARKUP_BYTES;
        at.offset = reader.buffer_position();
        let event = match reader.read_event_into(&mut buffer) {
            Ok(event) => event,
            Err(error) => return Err(failed(error, &at)),
        };
        match event {
            Event::Start(start) => {
                depth += 1;
                if depth > MOST_DEPTH {
                    return Err(IoError::too_many(path, "levels of elements", MOST_DEPTH as u64));
                }
                if depth == 1 && std::mem::replace(&mut has_root, true) {
                    return Err(at.unreadable("one element around all others", "another one"));
                }
                visit(Markup::Start(Tag { at: &at, start, names: reader.resolver() }))?;
            }
            Event::End(_) => {
                depth -= 1;
                visit(Markup::End(&at))?;
            }
            Event::DocType(_) => {
                return Err(at.unreadable("XML without a document type", "<!DOCTYPE"));
            }
            Event::Eof if depth == 0 && has_root => return Ok(()),
            Event::Eof => return Err(at.unreadable("the rest of the XML", "the end of the text")),
            _ => {}
        }
    }
}

fn failed(error: quick_xml::Error, at: &Where) -> IoError {
    match error {
        quick_xml::Error::Io(error) => match Arc::try_unwrap(error) {
            Ok(error) => of_std(error, &at.path, Place::Byte(at.offset), "the whole part"),
            Err(error) => at.unreadable("the whole part", &error.to_string()),
        },
        error => at.unreadable("well-formed XML in UTF-8", &error.to_string()),
    }
}

/// Bytes of which no markup takes too many.
struct Limited<R> {
    bytes: R,
    left: usize,
    path: PathBuf,
}

impl<R: BufRead> Read for Limited<R> {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(bytes.len());
        bytes[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for Limited<R> {
    #[inline]
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        let available = self.bytes.fill_buf()?;
        if self.left == 0 && !available.is_empty() {
            let what = "bytes in one tag";
            return Err(Error::other(IoError::too_many(
                &self.path,
                what,
                MOST_MARKUP_BYTES as u64,
            )));
        }
        Ok(&available[..available.len().min(self.left)])
    }

    #[inline]
    fn consume(&mut self, count: usize) {
        self.left = self.left.saturating_sub(count);
        self.bytes.consume(count);
    }
}
