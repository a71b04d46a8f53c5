//! Holds the tables of a document to the JSON that it describes.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

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
fn documented(document: &str) -> BTreeSet<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(document);
    let text = std::fs::read_to_string(path).expect("the document is there");
    let rows = text.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.map(|row| row.split('`').next().unwrap_or_default().to_owned()).collect()
}

/// Every field of `json` stands in `document`, and no other but the `conditional` ones.
pub fn check_document(document: &str, json: &Value, conditional: &[&str]) {
    let mut paths = BTreeSet::new();
    collect_paths(json, "", &mut paths);
    let documented = documented(document);
    let missing: Vec<_> = paths.difference(&documented).collect();
    assert!(missing.is_empty(), "{document} does not name {missing:#?}");
    let is_conditional = |path: &&String| conditional.contains(&path.as_str());
    let extra: Vec<_> = documented.difference(&paths).filter(|p| !is_conditional(p)).collect();
    assert!(extra.is_empty(), "{document} names what is not there: {extra:#?}");
}
