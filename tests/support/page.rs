//! Reads our own pages strictly: every element closed in order, every attribute quoted.

use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};

const VOID: [&str; 4] = ["img", "input", "link", "meta"];

/// An element that was opened.
#[derive(Debug)]
pub struct Element {
    pub name: String,
    pub attributes: Vec<(String, String)>,
    /// The text in it and in all that is in it, but for scripts and styles.
    pub text: String,
}

impl Element {
    pub fn attribute(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(key, _)| key == name);
        found.map(|(_, value)| value.as_str())
    }
}

/// A page that was read.
pub struct Page {
    /// In the order in which they were opened.
    pub elements: Vec<Element>,
    /// The content of elements `script` and `style`, with the number of the element.
    pub raw: Vec<(usize, String)>,
}

impl Page {
    /// Reads a page; panics where it is not well-formed.
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("a page is text");
        let rest = text.strip_prefix("<!DOCTYPE html>\n").expect("a page says what it is");
        let mut page = Self { elements: Vec::new(), raw: Vec::new() };
        let mut open: Vec<usize> = Vec::new();
        let mut rest = rest.trim_end();
        while !rest.is_empty() {
            let Some(after) = rest.strip_prefix('<') else {
                let end = rest.find('<').unwrap_or(rest.len());
                let words = unescaped(&rest[..end]);
                for &element in &open {
                    page.elements[element].text.push_str(&words);
                }
                assert!(!open.is_empty() || words.trim().is_empty(), "text outside: {words}");
                rest = &rest[end..];
                continue;
            };
            let end = end_of_tag(after);
            let tag = &after[..end];
            rest = &after[end + 1..];
            if let Some(name) = tag.strip_prefix('/') {
                let last = open.pop().expect("something is open");
                assert_eq!(page.elements[last].name, name, "closed in order");
                continue;
            }
            let element = element_of(tag);
            let (name, number) = (element.name.clone(), page.elements.len());
            page.elements.push(element);
            if name == "script" || name == "style" {
                let close = format!("</{name}>");
                let end = rest.find(&close).expect("it is closed");
                page.raw.push((number, rest[..end].to_owned()));
                rest = &rest[end + close.len()..];
            } else if !VOID.contains(&name.as_str()) {
                open.push(number);
            }
        }
        assert!(open.is_empty(), "left open: {open:?}");
        page
    }

    /// All elements of a name.
    pub fn all<'p>(&'p self, name: &'p str) -> impl Iterator<Item = &'p Element> {
        self.elements.iter().filter(move |element| element.name == name)
    }

    /// What stands beside a name in a list of definitions.
    pub fn card(&self, name: &str) -> &str {
        let at = self.elements.iter().position(|e| e.name == "dt" && e.text == name);
        let at = at.unwrap_or_else(|| panic!("no card {name}"));
        &self.elements[at + 1].text
    }

    /// The JSON of the element with this id.
    pub fn data(&self, id: &str) -> serde_json::Value {
        let is = |number: usize| self.elements[number].attribute("id") == Some(id);
        let (_, text) = self.raw.iter().find(|(number, _)| is(*number)).expect("it has data");
        assert!(!text.contains('<'), "nothing can end the script");
        serde_json::from_str(text).expect("JSON")
    }

    /// Every address of the page. None leads elsewhere.
    pub fn addresses(&self) -> Vec<&str> {
        let mut addresses = Vec::new();
        for element in &self.elements {
            for (name, value) in &element.attributes {
                assert!(!name.starts_with("on"), "{name} is a script");
                if ["src", "href", "action", "data", "poster", "srcset"].contains(&name.as_str()) {
                    let is_ours = !value.contains(':') && !value.starts_with('/');
                    let is_picture = value.starts_with("data:image/png;base64,");
                    assert!(is_ours || is_picture, "leads elsewhere: {value}");
                    addresses.push(value.as_str());
                }
            }
        }
        for (number, raw) in &self.raw {
            if self.elements[*number].attribute("type") == Some("application/json") {
                continue;
            }
            for word in ["http:", "https:", "url(", "@import", "fetch(", "XMLHttpRequest"] {
                assert!(!raw.contains(word), "{word} in a script or a style");
            }
        }
        addresses
    }
}

/// The file that an address of a page in `folder` leads to.
pub fn file_at(folder: &Path, address: &str) -> PathBuf {
    let mut bytes = Vec::new();
    let mut rest = address.as_bytes();
    while let [first, after @ ..] = rest {
        if *first == b'%' {
            let digits = std::str::from_utf8(&after[..2]).expect("two digits");
            bytes.push(u8::from_str_radix(digits, 16).expect("two digits"));
            rest = &after[2..];
        } else {
            bytes.push(*first);
            rest = after;
        }
    }
    folder.join(OsString::from_vec(bytes))
}

fn end_of_tag(text: &str) -> usize {
    let mut is_quoted = false;
    for (at, c) in text.char_indices() {
        match c {
            '"' => is_quoted = !is_quoted,
            '>' if !is_quoted => return at,
            '<' => panic!("a tag in a tag: {text:.60}"),
            _ => {}
        }
    }
    panic!("a tag without an end: {text:.60}")
}

fn element_of(tag: &str) -> Element {
    let (name, mut rest) = tag.split_once(' ').unwrap_or((tag, ""));
    assert!(name.chars().all(|c| c.is_ascii_alphanumeric()), "an element called {name}");
    let mut attributes: Vec<(String, String)> = Vec::new();
    while !rest.is_empty() {
        let (key, after) = rest.split_once("=\"").expect("a value in quotes");
        assert!(key.chars().all(|c| c.is_ascii_alphanumeric() || c == '-'), "{key}");
        let (value, after) = after.split_once('"').expect("the quotes end");
        assert!(attributes.iter().all(|(other, _)| other != key), "{key} twice");
        attributes.push((key.to_owned(), unescaped(value)));
        rest = after.strip_prefix(' ').unwrap_or(after);
    }
    Element { name: name.to_owned(), attributes, text: String::new() }
}

fn unescaped(text: &str) -> String {
    for (at, _) in text.match_indices('&') {
        let known = ["&amp;", "&lt;", "&gt;", "&quot;", "&#39;"];
        assert!(known.iter().any(|known| text[at..].starts_with(known)), "{text:.80}");
    }
    let text = text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"");
    text.replace("&#39;", "'").replace("&amp;", "&")
}
