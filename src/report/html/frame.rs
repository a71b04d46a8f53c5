//! What is around every page: declarations, style, heading, scripts.

use std::io;

use crate::report::html::Markup;

/// The style of all pages.
const STYLE: &str = include_str!("assets/page.css");

/// Nothing is loaded but pictures beside the page and in it, nothing is sent.
const POLICY: &str = "default-src 'none'; img-src 'self' file: data:; style-src 'unsafe-inline'; \
     script-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

/// What a page needs around its content.
pub(crate) struct Frame<'f> {
    /// In the heading, and of the window.
    pub(crate) title: &'f str,
    /// Address of the page that this one is a part of, if there is one.
    pub(crate) back: Option<&'f str>,
    /// Our own scripts.
    pub(crate) scripts: &'f [&'f str],
}

/// Writes a page with what `content` writes in it.
pub(crate) fn write_page<E: From<io::Error>>(
    out: &mut dyn io::Write,
    frame: &Frame,
    content: impl FnOnce(&mut Markup) -> Result<(), E>,
) -> Result<(), E> {
    let html = &mut Markup::new(out);
    html.raw("<!DOCTYPE html>\n")?;
    html.element("html", &[("lang", "en")], |html| {
        html.element("head", &[], |html| write_head(html, frame))?;
        html.raw("\n")?;
        html.element("body", &[], |html| {
            html.element("header", &[], |html| {
                if let Some(back) = frame.back {
                    html.leaf("a", &[("href", back), ("class", "back")], "All models")?;
                }
                html.leaf("h1", &[], frame.title)
            })?;
            html.element("main", &[], content)?;
            let maker = concat!("Written by brickmend ", env!("CARGO_PKG_VERSION"));
            html.leaf("footer", &[], maker)?;
            for script in frame.scripts {
                html.element("script", &[], |html| html.raw(script))?;
            }
            Ok::<_, E>(())
        })
    })?;
    html.raw("\n")?;
    Ok(())
}

fn write_head(html: &mut Markup, frame: &Frame) -> io::Result<()> {
    html.void("meta", &[("charset", "utf-8")])?;
    html.void("meta", &[("http-equiv", "Content-Security-Policy"), ("content", POLICY)])?;
    let view = [("name", "viewport"), ("content", "width=device-width, initial-scale=1")];
    html.void("meta", &view)?;
    html.void("meta", &[("name", "color-scheme"), ("content", "light dark")])?;
    html.leaf("title", &[], frame.title)?;
    html.element("style", &[], |html| html.raw(STYLE))
}
