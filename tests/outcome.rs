//! `docs/outcome.md` names every field of the outcome, and no other.

mod support;

use std::collections::BTreeSet;
use std::path::Path;

use brickmend::monitor::Stage;
use brickmend::repair::{SCHEMA_VERSION, StageReport};
use brickmend::sign::FillRule;
use serde_json::Value;

use support::{repair_at, testdata};

/// Adds the dotted path of every key; `[]` stands for the items of a list.
fn collect_paths(value: &Value, path: &str, paths: &mut BTreeSet<String>) {
    match value {
        Value::Object(fields) => {
            for (key, field) in fields {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                paths.insert(path.clone());
                collect_paths(field, &path, paths);
            }
        }
        Value::Array(items) => {
            for item in items.iter().filter(|item| item.is_object()) {
                collect_paths(item, &format!("{path}[]"), paths);
            }
        }
        _ => {}
    }
}

/// The first word in backticks of every row of a table, but the words of header rows.
fn documented() -> BTreeSet<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/outcome.md");
    let text = std::fs::read_to_string(path).expect("docs/outcome.md is there");
    let rows = text.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.map(|row| row.split('`').next().unwrap_or_default().to_owned()).collect()
}

/// Fields that only some outcomes have; their documentation says when.
const CONDITIONAL: [&str; 9] = [
    "input.dense_box.lo",
    "input.dense_box.hi",
    "settings.depth.tolerance",
    "settings.depth.tolerance.length",
    "settings.depth.tolerance.length.model",
    "settings.depth.tolerance.length.percent",
    "settings.depth.tolerance.length.metres",
    "settings.depth.tolerance.max_depth",
    "settings.depth.levels",
];

#[test]
fn the_documentation_names_every_field_and_no_other() {
    let mut outcome = repair_at(&testdata("models/bowl.obj"), 5, FillRule::Solid).expect("sound");
    // The caller stamps these.
    outcome.stages = Stage::ALL.map(|stage| (stage, StageReport::default())).into();
    outcome.memory.peak_bytes = Some(0);
    let json = serde_json::to_value(&outcome).expect("plain data is always JSON");
    assert_eq!(json["schema"], SCHEMA_VERSION);
    let mut paths = BTreeSet::new();
    collect_paths(&json, "", &mut paths);
    let documented = documented();
    let missing: Vec<_> = paths.difference(&documented).collect();
    assert!(missing.is_empty(), "docs/outcome.md does not name {missing:#?}");
    let conditional = |path: &&String| CONDITIONAL.contains(&path.as_str());
    let extra: Vec<_> = documented.difference(&paths).filter(|p| !conditional(p)).collect();
    assert!(extra.is_empty(), "docs/outcome.md names what is not there: {extra:#?}");
}
