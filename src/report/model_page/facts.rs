//! Verdict, reasons, and tables of what was found, decided and done.

use std::io;

use serde_json::Value;

use crate::repair::Outcome;
use crate::report::ModelPage;
use crate::report::html::{Markup, bytes, count, decimal};
use crate::report::model_page::part_table::{words_of, write_whole};

/// A line of a table.
type Fact = (&'static str, String);

/// Writes the verdict with its reasons.
pub(crate) fn write_verdict(html: &mut Markup, model: &ModelPage) -> io::Result<()> {
    html.element("section", &[("id", "verdict")], |html| {
        if let Some(parts) = &model.parts {
            return write_whole(html, parts);
        }
        let Some(outcome) = model.outcome else {
            return html.element("p", &[("class", "verdict")], |html| {
                html.leaf("span", &[("class", "badge is-copied")], "copied")?;
                html.leaf("span", &[], "Nothing is wrong with it, so it was copied byte for byte.")
            });
        };
        let (name, text) = words_of(outcome.verdict);
        html.element("p", &[("class", "verdict")], |html| {
            html.leaf("span", &[("class", &format!("badge is-{name}"))], name)?;
            html.leaf("span", &[], text)
        })?;
        if !outcome.reasons.is_empty() || outcome.output.caveat.is_some() {
            html.element("ul", &[("class", "reasons")], |html| {
                for reason in outcome.reasons.iter().chain(&outcome.output.caveat) {
                    html.leaf("li", &[], reason)?;
                }
                Ok::<_, io::Error>(())
            })?;
        }
        html.element("dl", &[("class", "cards")], |html| {
            let proof = &outcome.output.proof;
            let cards = [
                ("Triangles before", count(outcome.input.stats.triangles)),
                ("Triangles after", count(proof.triangles)),
                ("Bodies", count(proof.components)),
                ("Depth", outcome.grid.depth.to_string()),
                ("Cell", decimal(outcome.cell_size)),
                ("Result", bytes(outcome.output.bytes)),
            ];
            for (name, value) in cards {
                html.element("div", &[], |html| {
                    html.leaf("dt", &[], name)?;
                    html.leaf("dd", &[], &value)
                })?;
            }
            Ok(())
        })
    })
}

/// Writes the tables.
pub(crate) fn write_facts(html: &mut Markup, outcome: &Outcome) -> io::Result<()> {
    html.element("section", &[("id", "facts")], |html| {
        html.leaf("h2", &[], "Found, decided, done")?;
        html.element("div", &[("class", "facts")], |html| {
            write_table(html, "Found in the model", &found(outcome))?;
            write_table(html, "Decided", &decided(outcome))?;
            write_table(html, "Done", &done(outcome))?;
            write_table(html, "Proved on the file as written", &proved(outcome))
        })
    })
}

fn write_table(html: &mut Markup, title: &str, facts: &[Fact]) -> io::Result<()> {
    html.element("div", &[], |html| {
        html.leaf("h3", &[], title)?;
        if facts.is_empty() {
            return html.leaf("p", &[("class", "quiet")], "Nothing.");
        }
        html.element("table", &[], |html| {
            html.element("tbody", &[], |html| {
                for (name, value) in facts {
                    html.element("tr", &[], |html| {
                        html.leaf("th", &[("scope", "row")], name)?;
                        html.leaf("td", &[], value)
                    })?;
                }
                Ok(())
            })
        })
    })
}

/// Counts that are above zero.
fn counts(all: &[(&'static str, u64)]) -> Vec<Fact> {
    let some = all.iter().filter(|(_, number)| *number > 0);
    some.map(|(name, number)| (*name, count(*number))).collect()
}

fn found(outcome: &Outcome) -> Vec<Fact> {
    let (found, input) = (&outcome.found, &outcome.input);
    let settle = &found.settle;
    let mut facts = counts(&[
        ("Triangles that are not finite", input.stats.nonfinite_triangles),
        ("Faces with wild indices", input.stats.discarded.wild_index_faces),
        ("Faces with fewer than three corners", input.stats.discarded.short_faces),
        ("Open edges", settle.rim_edges),
        ("Duplicate triangles", settle.duplicate_triangles),
        ("Walls between abutting solids", settle.interface_triangles),
        ("Triangles without area", settle.degenerate_triangles),
        ("Fins", settle.fins.fins),
        ("Open shells", outcome.mend.open_shells),
        ("Openings of the grid", found.openings),
        ("Edges of the grid hit more than once", found.multi_edges),
    ]);
    if settle.rim_length > 0.0 {
        facts.push(("Length of open edges", decimal(settle.rim_length)));
    }
    facts
}

fn decided(outcome: &Outcome) -> Vec<Fact> {
    let mend = &outcome.mend;
    let mut facts = vec![
        ("Depth", format!("{}: {}", outcome.grid.depth, outcome.depth_reason)),
        ("Side of a cell", decimal(outcome.cell_size)),
    ];
    if outcome.votes.fell_back {
        facts.push(("Fill rule", "solid, since votes on orientation contradict each other".into()));
    }
    facts.extend(counts(&[
        ("Openings that are wanted and stay", mend.wanted_openings),
        ("Holes to fill", mend.filled_holes),
        ("... as the surface around bends", mend.smooth_holes),
        ("Shells that become walls", mend.walled_shells),
        ("Parts that nobody sees", outcome.hidden.hidden_bodies),
        ("Parts that are sealed in", outcome.hidden.sealed_bodies),
    ]));
    for body in &outcome.hidden.largest {
        let how = if body.is_sealed { "Sealed in" } else { "Hidden" };
        let name = if body.part.is_empty() { "a part without a name" } else { &body.part };
        facts.push((how, format!("{name}, {} triangles", count(body.triangles))));
    }
    facts
}

fn done(outcome: &Outcome) -> Vec<Fact> {
    let (mend, thickened) = (&outcome.mend, &outcome.thickened);
    let mut facts = counts(&[
        ("Triangles of walls and fills", mend.added_triangles),
        ("Triangles thickened, of thin walls", thickened.triangles),
        ("Sets of odd faces closed", outcome.patch.components),
        ("Polygons on patches", outcome.invented.patch_polygons),
        ("Edges of thin surface dropped", outcome.dropped.thin_edges),
        ("Edges of buried surface dropped", outcome.dropped.buried_edges),
    ]);
    let measures = [
        ("Area of fills", mend.filled_area),
        ("Area that became walls", mend.walled_area),
        ("Length of cracks that were joined", mend.joined_length),
        ("Volume filled in", outcome.invented.filled_volume),
        ("Share of the surface that was dropped", outcome.dropped.share_of_surface),
    ];
    let some = measures.into_iter().filter(|(_, value)| *value != 0.0);
    facts.extend(some.map(|(name, value)| (name, decimal(value))));
    facts.push(("Area, of the model's", decimal(outcome.output.area_ratio)));
    if !outcome.transfer.lost.is_empty() {
        facts.push(("Not in the result", outcome.transfer.lost.join(", ")));
    }
    facts
}

fn proved(outcome: &Outcome) -> Vec<Fact> {
    let proof = &outcome.output.proof;
    let zero = [
        ("Open edges", proof.boundary_edges),
        ("Edges of more than two triangles", proof.nonmanifold_edges),
        ("Vertices of more than one fan", proof.nonmanifold_vertices),
        ("Edges that run the same way twice", proof.inconsistent_edges),
        ("Triangles without area", proof.degenerate_triangles),
        ("Vertices in one place", proof.coincident_vertices),
        ("Bodies that face inward", proof.inward_components),
        ("Pairs of triangles that meet", proof.intersecting_pairs),
    ];
    let mut facts: Vec<Fact> = zero.iter().map(|(name, number)| (*name, count(*number))).collect();
    facts.push(("Bodies", count(proof.components)));
    facts.push(("Euler characteristic", proof.euler_characteristic.to_string()));
    facts.push(("Volume", decimal(proof.volume)));
    facts.push(("Area", decimal(proof.area)));
    facts
}

/// Writes the settings, and every number of the outcome.
pub(crate) fn write_settings(html: &mut Markup, outcome: &Outcome) -> io::Result<()> {
    let plain = "plain records serialise";
    html.element("section", &[], |html| {
        html.element("details", &[], |html| {
            html.leaf("summary", &[], "Settings")?;
            html.element("table", &[], |html| {
                html.element("tbody", &[], |html| {
                    let settings = serde_json::to_value(outcome.settings).expect(plain);
                    for (name, value) in settings.as_object().into_iter().flatten() {
                        html.element("tr", &[], |html| {
                            html.leaf("th", &[("scope", "row")], &name.replace('_', "-"))?;
                            html.leaf("td", &[], &text_of(value))
                        })?;
                    }
                    Ok::<_, io::Error>(())
                })
            })
        })?;
        html.element("details", &[], |html| {
            html.leaf("summary", &[], "All numbers (JSON; docs/outcome.md)")?;
            html.element("pre", &[], |html| {
                for line in serde_json::to_string_pretty(outcome).expect(plain).lines() {
                    html.text(line)?;
                    html.raw("\n")?;
                }
                Ok(())
            })
        })
    })
}

fn text_of(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::String(text) => text.clone(),
        Value::Object(fields) => {
            let texts = fields.iter().map(|(name, value)| format!("{name} {}", text_of(value)));
            texts.collect::<Vec<_>>().join(", ")
        }
        other => other.to_string(),
    }
}
