//! The upper half of the page: totals, failures by reason, defects, what was slow and large.

use std::io;

use crate::catalogue::{Cause, CauseGroup, Journal, ListOrder, ListedModel, Summary, Totals};
use crate::report::catalogue_page::rows::Standing;
use crate::report::error::Halt;
use crate::report::html::{Markup, bytes, count, date, seconds};

/// Failed models that are named for each reason.
const EXAMPLES: u64 = 20;
/// Models in the lists of the slowest and largest.
const EXTREMES: u64 = 10;

/// Counts of outcomes that tell of defects, with what is done about them. The names are paths in
/// docs/outcome.md.
const DEFECTS: [(&str, &str, &str); 11] = [
    ("found.rim_edges", "Open edges", "closed, or made the rim of a wall"),
    ("found.duplicate_triangles", "Duplicate triangles", "one of each kept"),
    ("found.interface_triangles", "Walls between abutting solids", "left out"),
    ("found.degenerate_triangles", "Triangles without area", "left out"),
    ("input.nonfinite_triangles", "Triangles that are not finite", "left out"),
    ("found.fins.fins", "Fins", "taken out"),
    ("mend.filled_holes", "Holes", "filled"),
    ("mend.walled_shells", "Open shells", "given thickness"),
    ("thickened.triangles", "Triangles of walls thinner than a cell", "thickened"),
    ("hidden.hidden_bodies", "Parts that nobody sees", "left out"),
    ("hidden.sealed_bodies", "Parts that are sealed in", "filled in"),
];

/// Counts of the proofs that a sound result has none of.
const LEFT: [&str; 8] = [
    "output.proof.boundary_edges",
    "output.proof.nonmanifold_edges",
    "output.proof.nonmanifold_vertices",
    "output.proof.inconsistent_edges",
    "output.proof.degenerate_triangles",
    "output.proof.coincident_vertices",
    "output.proof.inward_components",
    "output.proof.intersecting_pairs",
];

/// Writes where the catalogue stands.
pub(crate) fn write_totals(
    html: &mut Markup,
    journal: &mut Journal,
    totals: &Totals,
) -> Result<(), Halt> {
    let summary = journal.summary()?;
    html.element("section", &[("id", "totals")], |html| {
        html.leaf("p", &[("class", "quiet")], &last_run(&summary))?;
        html.element("dl", &[("class", "cards")], |html| {
            let with_result = of_states(&summary, &["copied", "repaired", "degraded"]);
            card(html, "Models", &count(totals.models))?;
            card(html, "With a result", &count(with_result))?;
            card(html, "Failed", &count(of_states(&summary, &["failed"])))?;
            card(html, "To look at", &count(of_verdict(&summary, "review")))?;
            card(html, "Triangles read", &count(totals.triangles_before))?;
            card(html, "Triangles written", &count(totals.triangles_after))?;
            card(html, "Size of models", &bytes(totals.input_bytes))?;
            card(html, "Size of results", &bytes(totals.result_bytes))?;
            card(html, "Time of workers", &seconds(totals.seconds))?;
            card(html, "Largest worker", &bytes(totals.peak_bytes))
        })?;
        write_states(html, &summary, totals.models)
    })
    .map_err(Halt::Write)
}

fn last_run(summary: &Summary) -> String {
    let began = date(summary.started_ms);
    let ended = match (&summary.ending, summary.ended_ms) {
        (Some(ending), Some(ended_ms)) => format!("ended {}: {ending}", date(ended_ms)),
        _ => "without an end: under way, or killed".to_owned(),
    };
    let found = count(summary.found);
    format!("Run {}, {found} models; began {began}, {ended}.", summary.run)
}

fn of_states(summary: &Summary, names: &[&str]) -> u64 {
    let counts = summary.states.iter().filter(|count| names.contains(&count.state.as_str()));
    counts.map(|count| count.models).sum()
}

fn of_verdict(summary: &Summary, verdict: &str) -> u64 {
    let is = |found: &Option<String>| found.as_deref() == Some(verdict);
    summary.states.iter().filter(|count| is(&count.verdict)).map(|count| count.models).sum()
}

fn card(html: &mut Markup, name: &str, value: &str) -> io::Result<()> {
    html.element("div", &[], |html| {
        html.leaf("dt", &[], name)?;
        html.leaf("dd", &[], value)
    })
}

fn write_states(html: &mut Markup, summary: &Summary, models: u64) -> io::Result<()> {
    let mut kinds: Vec<(Standing, u64)> = Vec::new();
    for group in &summary.states {
        let standing = Standing::of(&group.state, group.verdict.as_deref());
        match kinds.iter_mut().find(|(kind, _)| *kind == standing) {
            Some((_, sum)) => *sum += group.models,
            None => kinds.push((standing, group.models)),
        }
    }
    kinds.sort_by_key(|(standing, _)| *standing);
    html.element(
        "div",
        &[("class", "share"), ("role", "img"), ("aria-label", "Verdicts")],
        |html| {
            for (standing, sum) in &kinds {
                let class = format!("is-{}", standing.name());
                let grow = format!("flex-grow:{sum}");
                let title = format!("{}: {}", standing.name(), count(*sum));
                html.leaf("span", &[("class", &class), ("style", &grow), ("title", &title)], "")?;
            }
            Ok::<_, io::Error>(())
        },
    )?;
    html.element("ul", &[("class", "legend"), ("id", "verdicts")], |html| {
        for (standing, sum) in &kinds {
            html.element("li", &[], |html| {
                standing.write_badge(html)?;
                let share = 100.0 * *sum as f64 / models.max(1) as f64;
                html.text(&format!(" {} ({share:.1} %): {}", count(*sum), standing.meaning()))
            })?;
        }
        Ok(())
    })
}

/// Writes why models failed.
pub(crate) fn write_failures(html: &mut Markup, journal: &mut Journal) -> Result<(), Halt> {
    let groups = journal.causes()?;
    if groups.is_empty() {
        return Ok(());
    }
    html.element("section", &[("id", "failures")], |html| {
        html.leaf("h2", &[], "Failures by reason")?;
        groups.iter().try_for_each(|group| write_group(html, journal, group))
    })
}

fn write_group(html: &mut Markup, journal: &mut Journal, group: &CauseGroup) -> Result<(), Halt> {
    let (models, time) = (count(group.models), seconds(group.seconds));
    html.element("details", &[], |html| {
        html.leaf("summary", &[], &format!("{}: {models} models, {time}", group.cause))?;
        html.element("ul", &[("class", "reasons")], |html| {
            if let Some(cause) = Cause::of(&group.cause) {
                let order = ListOrder::FailedFor(cause.name());
                journal.each_model(order, Some(EXAMPLES), |model| write_example(html, &model))?;
            }
            let more = group.models.saturating_sub(EXAMPLES);
            if more > 0 {
                let text = format!("and {} more, in the table below", count(more));
                html.leaf("li", &[("class", "quiet")], &text)?;
            }
            Ok::<_, Halt>(())
        })
    })
}

fn write_example(html: &mut Markup, model: &ListedModel) -> Result<(), Halt> {
    html.element("li", &[], |html| {
        html.leaf("bdi", &[("class", "name")], &model.name)?;
        let reason = model.reason.as_deref().unwrap_or_default();
        html.leaf("span", &[("class", "quiet")], &format!(" {reason}"))?;
        Ok(())
    })
}

/// Writes what was wrong with the models, and what is of their results.
pub(crate) fn write_defects(html: &mut Markup, journal: &mut Journal) -> Result<(), Halt> {
    let fields: Vec<&str> = DEFECTS.iter().map(|(field, ..)| *field).collect();
    let found = journal.outcome_sums(&fields)?;
    let left: u64 = journal.outcome_sums(&LEFT)?.iter().map(|sum| sum.sum).sum();
    if found.iter().all(|sum| sum.models == 0) {
        return Ok(());
    }
    html.element("section", &[("id", "defects")], |html| {
        html.leaf("h2", &[], "Defects found and fixed")?;
        html.element("div", &[("class", "scroll")], |html| {
            html.element("table", &[], |html| {
                write_head(html, &["What", "Models", "Found", "Done"], &[1, 2])?;
                html.element("tbody", &[], |html| {
                    for ((_, name, done), sum) in DEFECTS.iter().zip(&found) {
                        if sum.models > 0 {
                            let cells = [*name, &count(sum.models), &count(sum.sum), *done];
                            write_row(html, &cells, &[1, 2])?;
                        }
                    }
                    Ok::<_, io::Error>(())
                })
            })
        })?;
        let text = format!("Defects that the proofs counted in the results: {}.", count(left));
        html.leaf("p", &[("class", "quiet")], &text)
    })
    .map_err(Halt::Write)
}

/// Writes which models took longest, and which are largest.
pub(crate) fn write_extremes(html: &mut Markup, journal: &mut Journal) -> Result<(), Halt> {
    html.element("section", &[("class", "beside")], |html| {
        write_extreme(html, journal, "Slowest", ListOrder::Slowest)?;
        write_extreme(html, journal, "Largest", ListOrder::Largest)
    })
}

fn write_extreme(
    html: &mut Markup,
    journal: &mut Journal,
    title: &str,
    order: ListOrder,
) -> Result<(), Halt> {
    html.element("div", &[], |html| {
        html.leaf("h2", &[], title)?;
        html.element("div", &[("class", "scroll")], |html| {
            html.element("table", &[], |html| {
                write_head(html, &["Model", "Time", "Memory", "Size"], &[1, 2, 3])?;
                html.element("tbody", &[], |html| {
                    journal.each_model(order, Some(EXTREMES), |model| {
                        let time = model.seconds.map_or_else(String::new, seconds);
                        let memory = model.peak_bytes.map_or_else(String::new, bytes);
                        let cells = [&model.name, &time, &memory, &bytes(model.input_bytes)];
                        write_row(html, &cells.map(String::as_str), &[1, 2, 3])?;
                        Ok(())
                    })
                })
            })
        })
    })
}

fn write_head(html: &mut Markup, names: &[&str], numbers: &[usize]) -> io::Result<()> {
    html.element("thead", &[], |html| {
        html.element("tr", &[], |html| {
            for (column, name) in names.iter().enumerate() {
                html.leaf("th", class_of(column, numbers), name)?;
            }
            Ok(())
        })
    })
}

fn write_row(html: &mut Markup, cells: &[&str], numbers: &[usize]) -> io::Result<()> {
    html.element("tr", &[], |html| {
        for (column, text) in cells.iter().enumerate() {
            html.element("td", class_of(column, numbers), |html| html.leaf("bdi", &[], text))?;
        }
        Ok(())
    })
}

fn class_of(column: usize, numbers: &[usize]) -> &'static [(&'static str, &'static str)] {
    if numbers.contains(&column) { &[("class", "number")] } else { &[] }
}
