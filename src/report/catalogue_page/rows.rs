//! The table of all models: the first as text, all as data for the script.

use std::io;
use std::path::PathBuf;

use serde::Serialize;

use crate::catalogue::{Journal, ListOrder, ListedModel};
use crate::report::catalogue_page::PLAIN_ROWS;
use crate::report::error::Halt;
use crate::report::html::{Markup, address_of, bytes, count, script_text, seconds, visible};
use crate::report::model_page::Gallery;

/// Where a model stands, in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Standing {
    Pass,
    Copied,
    Review,
    Degraded,
    Fail,
    Failed,
    Pending,
    Gone,
}

impl Standing {
    /// By the words of the journal.
    pub(crate) fn of(state: &str, verdict: Option<&str>) -> Self {
        match (state, verdict) {
            (_, Some("fail")) => Self::Fail,
            ("degraded", _) => Self::Degraded,
            (_, Some("review")) => Self::Review,
            ("repaired", _) => Self::Pass,
            ("copied", _) => Self::Copied,
            ("failed", _) => Self::Failed,
            ("gone", _) => Self::Gone,
            _ => Self::Pending,
        }
    }

    /// The word.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Copied => "copied",
            Self::Review => "review",
            Self::Degraded => "degraded",
            Self::Fail => "fail",
            Self::Failed => "failed",
            Self::Pending => "pending",
            Self::Gone => "gone",
        }
    }

    /// What it means.
    pub(crate) const fn meaning(self) -> &'static str {
        match self {
            Self::Pass => "repaired",
            Self::Copied => "nothing was wrong",
            Self::Review => "repaired; a person should look",
            Self::Degraded => "repaired on a coarser grid",
            Self::Fail => "written, and not sound",
            Self::Failed => "no result",
            Self::Pending => "still to be done",
            Self::Gone => "no longer in the folder",
        }
    }

    /// Writes the word as a badge.
    pub(crate) fn write_badge(self, html: &mut Markup) -> io::Result<()> {
        html.leaf("span", &[("class", &format!("badge is-{}", self.name()))], self.name())
    }
}

/// What lies around the page.
pub(crate) struct Surroundings {
    /// Folder of pages and pictures.
    pub(crate) report_folder: PathBuf,
    /// The way there from the page.
    pub(crate) to_report: PathBuf,
    /// The way to the results.
    pub(crate) to_target: PathBuf,
}

/// What the script knows of a model. Short names: there may be many thousands.
#[derive(Serialize)]
struct Entry<'m> {
    i: i64,
    n: &'m str,
    s: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    w: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    t: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    m: Option<u64>,
    b: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    f: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    a: Option<u64>,
    /// Address of the result, from the folder of the results.
    #[serde(skip_serializing_if = "Option::is_none")]
    r: Option<String>,
    /// 1 for a page, 2 for pictures.
    p: u8,
}

/// A model with what lies beside the page of it.
struct Shown {
    standing: Standing,
    why: Option<String>,
    result: Option<String>,
    has_page: bool,
    has_pictures: bool,
}

impl Shown {
    fn of(model: &ListedModel, surroundings: &Surroundings) -> Self {
        let gallery = Gallery::new(&surroundings.report_folder, model.id);
        let standing = Standing::of(&model.state, model.verdict.as_deref());
        let has_result = matches!(model.state.as_str(), "copied" | "repaired" | "degraded");
        let words = model.cause.iter().chain(&model.reason).map(String::as_str);
        let words: Vec<&str> = words.collect();
        Self {
            standing,
            why: (!words.is_empty()).then(|| words.join(": ")),
            result: has_result.then(|| address_of(&model.output)),
            has_page: has_result && gallery.page().is_file(),
            has_pictures: has_result && gallery.after().is_file(),
        }
    }
}

/// Writes the table, the fields that sort and filter it, and the data.
pub(crate) fn write_models(
    html: &mut Markup,
    journal: &mut Journal,
    models: u64,
    surroundings: &Surroundings,
) -> Result<(), Halt> {
    html.element("section", &[("id", "models")], |html| {
        html.leaf("h2", &[], "All models")?;
        write_controls(html)?;
        html.element("table", &[("class", "models")], |html| {
            write_head(html)?;
            html.element("tbody", &[], |html| {
                journal.each_model(ListOrder::Urgency, Some(PLAIN_ROWS), |model| {
                    write_row(html, &model, surroundings).map_err(Halt::Write)
                })
            })
        })?;
        if models > PLAIN_ROWS {
            let (shown, all) = (count(PLAIN_ROWS), count(models));
            let text = format!("Without script the table ends here: {shown} of {all} models.");
            html.leaf("p", &[("class", "quiet plain-only")], &text)?;
        }
        Ok::<_, Halt>(())
    })?;
    write_data(html, journal, surroundings)
}

/// Key, heading, and whether it holds numbers.
const COLUMNS: [(&str, &str, bool); 7] = [
    ("name", "Model", false),
    ("standing", "Verdict", false),
    ("time", "Time", true),
    ("memory", "Memory", true),
    ("size", "Size", true),
    ("before", "Triangles before", true),
    ("after", "after", true),
];

fn write_controls(html: &mut Markup) -> io::Result<()> {
    html.element("form", &[("class", "controls script-only"), ("id", "controls")], |html| {
        let named = |html: &mut Markup, text: &str| html.leaf("span", &[], text);
        html.element("label", &[], |html| {
            named(html, "Find")?;
            let words = "name or reason";
            html.void("input", &[("type", "search"), ("id", "find"), ("placeholder", words)])
        })?;
        html.element("label", &[], |html| {
            named(html, "Verdict")?;
            html.element("select", &[("id", "standing")], |html| {
                html.leaf("option", &[("value", "")], "all")
            })
        })?;
        html.element("label", &[], |html| {
            named(html, "Sort by")?;
            html.element("select", &[("id", "sort")], |html| {
                html.leaf("option", &[("value", "urgency")], "what to look at first")?;
                for (key, name, _) in COLUMNS {
                    let name = if key == "after" { "Triangles after" } else { name };
                    html.leaf("option", &[("value", key)], name)?;
                }
                Ok::<_, io::Error>(())
            })
        })?;
        let turn = [("type", "button"), ("id", "turn"), ("aria-label", "Turn the order around")];
        html.leaf("button", &turn, "\u{2191}")?;
        html.leaf("output", &[("id", "shown")], "")
    })?;
    html.element("nav", &[("class", "pager script-only"), ("aria-label", "Pages")], |html| {
        html.leaf("button", &[("type", "button"), ("id", "earlier")], "Earlier")?;
        html.leaf("span", &[("id", "place")], "")?;
        html.leaf("button", &[("type", "button"), ("id", "later")], "Later")
    })
}

fn write_head(html: &mut Markup) -> io::Result<()> {
    html.element("thead", &[], |html| {
        html.element("tr", &[], |html| {
            html.leaf("th", &[("class", "pictures")], "Before, after")?;
            for (key, name, is_number) in COLUMNS {
                let class = if is_number { "number" } else { "words" };
                html.leaf("th", &[("class", class), ("data-key", key)], name)?;
            }
            Ok(())
        })
    })
}

fn write_row(html: &mut Markup, model: &ListedModel, around: &Surroundings) -> io::Result<()> {
    let shown = Shown::of(model, around);
    let gallery = Gallery::new(&around.to_report, model.id);
    let page = shown.has_page.then(|| address_of(&gallery.page()));
    html.element("tr", &[], |html| {
        html.element("td", &[("class", "pictures")], |html| {
            if !shown.has_pictures {
                return Ok(());
            }
            for (path, words) in [(gallery.before(), "before"), (gallery.after(), "after")] {
                let attributes = [
                    ("src", &*address_of(&path)),
                    ("alt", words),
                    ("loading", "lazy"),
                    ("width", "64"),
                    ("height", "64"),
                ];
                html.void("img", &attributes)?;
            }
            Ok::<_, io::Error>(())
        })?;
        html.element("td", &[("class", "words")], |html| {
            match &page {
                Some(page) => html.element("a", &[("href", page)], |html| {
                    html.leaf("bdi", &[("class", "name")], &model.name)
                })?,
                None => html.leaf("bdi", &[("class", "name")], &model.name)?,
            }
            if let Some(result) = &shown.result {
                let way = address_of(&around.to_target);
                let address =
                    if way.is_empty() { result.clone() } else { format!("{way}/{result}") };
                html.text(" ")?;
                html.leaf("a", &[("href", &address), ("class", "result")], "result")?;
            }
            if let Some(why) = &shown.why {
                html.leaf("div", &[("class", "why")], why)?;
            }
            Ok::<_, io::Error>(())
        })?;
        html.element("td", &[("class", "words")], |html| shown.standing.write_badge(html))?;
        let number =
            |value: Option<u64>, text: fn(u64) -> String| value.map_or_else(String::new, text);
        let numbers = [
            ("Time", model.seconds.map_or_else(String::new, seconds)),
            ("Memory", number(model.peak_bytes, bytes)),
            ("Size", bytes(model.input_bytes)),
            ("Before", number(model.triangles_before, count)),
            ("After", number(model.triangles_after, count)),
        ];
        for (name, text) in numbers {
            html.leaf("td", &[("class", "number"), ("data-name", name)], &text)?;
        }
        Ok(())
    })
}

fn write_data(
    html: &mut Markup,
    journal: &mut Journal,
    surroundings: &Surroundings,
) -> Result<(), Halt> {
    let attributes = [("type", "application/json"), ("id", "models-data")];
    html.element("script", &attributes, |html| {
        let plain = "plain records serialise";
        let way = |path: &PathBuf| serde_json::to_string(&address_of(path)).expect(plain);
        let (report, target) = (way(&surroundings.to_report), way(&surroundings.to_target));
        html.raw(&format!("{{\"report\":{report},\"target\":{target},\"models\":["))?;
        let mut is_first = true;
        journal.each_model(ListOrder::Urgency, None, |model| {
            let shown = Shown::of(&model, surroundings);
            let entry = Entry {
                i: model.id,
                n: &visible(&model.name),
                s: shown.standing.name(),
                w: shown.why.as_deref().map(|why| visible(why).into_owned()),
                t: model.seconds,
                m: model.peak_bytes,
                b: model.input_bytes,
                f: model.triangles_before,
                a: model.triangles_after,
                r: shown.result,
                p: u8::from(shown.has_page) + 2 * u8::from(shown.has_pictures),
            };
            let json = serde_json::to_string(&entry).expect(plain);
            let comma = if is_first { "\n" } else { ",\n" };
            is_first = false;
            html.raw(comma)?;
            html.raw(&script_text(&json))?;
            Ok::<_, Halt>(())
        })?;
        html.raw("\n]}")?;
        Ok(())
    })
}
