//! The parts of a model that were repaired each for itself: verdicts, and what is worth a look.

use std::io;

use crate::catalogue::PartLine;
use crate::repair::{PartsOutcome, Verdict};
use crate::report::html::{Markup, count};

/// Columns of the list with their classes.
const COLUMNS: [(&str, &str); 6] = [
    ("Part", ""),
    ("Verdict", ""),
    ("Places", "number"),
    ("Triangles before", "number"),
    ("Triangles after", "number"),
    ("To look at", ""),
];

/// What a page tells of a model whose parts were kept apart.
#[derive(Clone, Copy, Debug)]
pub struct PartsPage<'p> {
    /// Of the whole.
    pub whole: &'p PartsOutcome,
    /// Of the parts, what is worth a look first; there may be more than are listed.
    pub parts: &'p [PartLine],
}

/// Name and meaning of a verdict.
pub(crate) fn words_of(verdict: Verdict) -> (&'static str, &'static str) {
    match verdict {
        Verdict::Pass => ("pass", "Sound, and nothing to look at."),
        Verdict::Review => ("review", "Sound, but a person should look."),
        Verdict::Fail => ("fail", "Not sound."),
    }
}

/// Writes the verdict of the whole and its counts.
pub(crate) fn write_whole(html: &mut Markup, page: &PartsPage) -> io::Result<()> {
    let whole = page.whole;
    let (name, text) = words_of(whole.verdict);
    html.element("p", &[("class", "verdict")], |html| {
        html.leaf("span", &[("class", &format!("badge is-{name}"))], name)?;
        html.leaf("span", &[], text)
    })?;
    if !whole.left_out.is_empty() {
        html.element("ul", &[("class", "reasons")], |html| {
            for part in &whole.left_out {
                html.leaf("li", &[], &format!("{} is left out: {}", part.name, part.reason))?;
            }
            Ok::<_, io::Error>(())
        })?;
    }
    html.element("dl", &[("class", "cards")], |html| {
        let cards = [
            ("Parts", whole.parts),
            ("Places", whole.places),
            ("Triangles", whole.triangles),
            ("Parts to look at", whole.to_review),
            ("Parts without a result", whole.empty_parts),
            ("Hidden places", whole.hidden_places),
        ];
        for (name, value) in cards {
            html.element("div", &[], |html| {
                html.leaf("dt", &[], name)?;
                html.leaf("dd", &[], &count(value))
            })?;
        }
        Ok(())
    })
}

/// Writes the list of parts, and how many are not in it.
pub(crate) fn write_parts(html: &mut Markup, page: &PartsPage) -> io::Result<()> {
    html.element("section", &[("id", "parts")], |html| {
        html.leaf("h2", &[], "Parts")?;
        html.element("table", &[], |html| {
            html.element("thead", &[], |html| {
                html.element("tr", &[], |html| {
                    for (name, class) in COLUMNS {
                        let attributes = [("scope", "col"), ("class", class)];
                        let used = if class.is_empty() { 1 } else { 2 };
                        html.leaf("th", &attributes[..used], name)?;
                    }
                    Ok::<_, io::Error>(())
                })
            })?;
            html.element("tbody", &[], |html| {
                page.parts.iter().try_for_each(|part| write_row(html, part))
            })
        })?;
        let more = page.whole.parts.saturating_sub(page.parts.len() as u64);
        if more == 0 {
            return Ok(());
        }
        html.leaf("p", &[("class", "quiet")], &format!("{} more parts.", count(more)))
    })
}

fn write_row(html: &mut Markup, part: &PartLine) -> io::Result<()> {
    let (name, _) = words_of(part.verdict);
    html.element("tr", &[], |html| {
        html.leaf("th", &[("scope", "row")], &part.name)?;
        html.element("td", &[], |html| {
            html.leaf("span", &[("class", &format!("badge is-{name}"))], name)
        })?;
        for number in [part.places, part.triangles_before, part.triangles_after] {
            html.leaf("td", &[("class", "number")], &count(number))?;
        }
        html.leaf("td", &[("class", "why")], &part.reasons.join("; "))
    })
}
