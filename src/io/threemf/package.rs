//! The parts of a written package that say what the others are.

use crate::io::threemf::vocabulary::RELATIONSHIPS;

/// In front of everything that is XML.
pub(super) const HEAD: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";

/// Which endings of names stand for what.
pub(super) fn content_types(has_images: bool) -> String {
    let images = if has_images {
        "<Default Extension=\"png\" ContentType=\"image/png\"/>\
         <Default Extension=\"jpg\" ContentType=\"image/jpeg\"/>"
    } else {
        ""
    };
    format!(
        "{HEAD}<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\
         <Default Extension=\"rels\" \
         ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\
         <Default Extension=\"model\" \
         ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>{images}</Types>\n"
    )
}

/// Where a part leads to.
pub(super) fn relationships(kind: &str, targets: &[String]) -> String {
    let mut text = format!("{HEAD}<Relationships xmlns=\"{RELATIONSHIPS}\">");
    for (number, target) in targets.iter().enumerate() {
        text += &format!("<Relationship Id=\"rel{number}\" Type=\"{kind}\" Target=\"{target}\"/>");
    }
    text + "</Relationships>\n"
}
