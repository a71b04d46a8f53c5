//! The writer of elements.

use std::io::{self, Write};

use crate::report::html::figures::visible;

/// Elements that hold nothing.
const VOID: [&str; 4] = ["img", "input", "link", "meta"];

/// A page under way.
pub(crate) struct Markup<'w> {
    out: &'w mut dyn Write,
}

/// Name and value of an attribute.
pub(crate) type Attribute<'a> = (&'a str, &'a str);

impl<'w> Markup<'w> {
    /// Writes to `out`.
    pub(crate) fn new(out: &'w mut dyn Write) -> Self {
        Self { out }
    }

    /// Writes what is markup already: our own styles, scripts and declarations.
    pub(crate) fn raw(&mut self, text: &str) -> io::Result<()> {
        self.out.write_all(text.as_bytes())
    }

    /// What bytes can be written to as they are: data that has no character of markup.
    pub(crate) fn plain(&mut self) -> &mut dyn Write {
        self.out
    }

    /// Writes text.
    pub(crate) fn text(&mut self, text: &str) -> io::Result<()> {
        self.raw(&escaped(text))
    }

    /// Writes an element with what `content` writes in it.
    pub(crate) fn element<E: From<io::Error>>(
        &mut self,
        name: &str,
        attributes: &[Attribute],
        content: impl FnOnce(&mut Self) -> Result<(), E>,
    ) -> Result<(), E> {
        self.open(name, attributes)?;
        content(self)?;
        Ok(self.raw(&format!("</{name}>"))?)
    }

    /// Writes an element that holds text only.
    pub(crate) fn leaf(
        &mut self,
        name: &str,
        attributes: &[Attribute],
        text: &str,
    ) -> io::Result<()> {
        self.element(name, attributes, |html| html.text(text))
    }

    /// Writes an element that holds nothing, as `img` does.
    pub(crate) fn void(&mut self, name: &str, attributes: &[Attribute]) -> io::Result<()> {
        debug_assert!(VOID.contains(&name), "{name} has an end");
        self.open(name, attributes)
    }

    fn open(&mut self, name: &str, attributes: &[Attribute]) -> io::Result<()> {
        let mut text = format!("<{name}");
        for (attribute, value) in attributes {
            text.push_str(&format!(" {attribute}=\"{}\"", escaped(value)));
        }
        text.push('>');
        self.raw(&text)
    }
}

/// `text` as it stands in elements and in attributes.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in visible(text).chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// JSON as it stands in an element `script`: nothing in it can end that.
pub(crate) fn script_text(json: &str) -> String {
    json.replace('<', "\\u003c").replace('\u{2028}', "\\u2028").replace('\u{2029}', "\\u2029")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(write: impl FnOnce(&mut Markup) -> io::Result<()>) -> String {
        let mut bytes = Vec::new();
        write(&mut Markup::new(&mut bytes)).expect("memory grows");
        String::from_utf8(bytes).expect("text")
    }

    #[test]
    fn no_text_of_others_becomes_markup() {
        let hostile = "\"><script>alert('x')</script>&\u{0}\u{202e}";
        let text = written(|html| html.leaf("p", &[("title", hostile)], hostile));
        assert_eq!(text.matches('<').count(), 2, "{text}");
        assert_eq!(text.matches('>').count(), 2, "{text}");
        assert_eq!(text.matches('"').count(), 2, "{text}");
        assert!(!text.contains('\u{0}') && !text.contains('\u{202e}'), "{text}");
    }

    #[test]
    fn no_json_ends_its_script() {
        let json = serde_json::to_string("</script><!--\u{2028}").expect("text");
        let text = script_text(&json);
        assert!(!text.contains('<'));
        let back: String = serde_json::from_str(&text).expect("still JSON");
        assert_eq!(back, "</script><!--\u{2028}");
    }

    #[test]
    fn elements_close_in_order() {
        let text = written(|html| {
            html.element("ul", &[], |html| {
                html.void("img", &[("src", "a&b")])?;
                html.leaf("li", &[], "1 < 2")
            })
        });
        assert_eq!(text, "<ul><img src=\"a&amp;b\"><li>1 &lt; 2</li></ul>");
    }
}
