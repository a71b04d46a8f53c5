//! Reads the source text: who may import whom, and where each dependency is at home.
//!
//! The tables in this file are the written architecture. Changing one is a change of design.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Modules of the library by layer; a module imports from strictly lower layers only.
const LAYERS: [(&str, u32); 22] = [
    ("monitor", 0),
    ("geom", 1),
    ("mesh", 2),
    ("store", 2),
    ("octree", 3),
    ("defect", 3),
    ("io", 3),
    ("ingest", STAGE),
    ("bridge", STAGE),
    ("scan", STAGE),
    ("patch", STAGE),
    ("sign", STAGE),
    ("hidden", STAGE),
    ("contour", STAGE),
    ("transfer", STAGE),
    ("paint", STAGE),
    ("verify", STAGE),
    ("diagnose", STAGE),
    ("deviate", STAGE),
    ("repair", 5),
    ("catalogue", 6),
    ("report", 7),
];
const STAGE: u32 = 4;

/// The proof shares no code with what builds surfaces.
const VERIFY_IMPORTS: [&str; 6] = ["geom", "mesh", "io", "store", "defect", "monitor"];

/// Words of third-party crates, and the only files (or folders, ending in /) that may have them.
const HOMES: [(&str, &[&str]); 30] = [
    ("memmap2::", &["store/mapped.rs", "store/brick/"]),
    ("unsafe ", &["store/mapped.rs", "cli/signals.rs", "cli/allocator.rs"]),
    ("signal_hook::", &["cli/signals.rs", "cli/last_words.rs"]),
    ("indicatif::", &["cli/progress.rs", "cli/fleet.rs"]),
    ("tobj::", &["io/obj/"]),
    ("flate2::", &["io/packed/gzip.rs", "io/packed/tests.rs", "io/threemf/zip_file.rs"]),
    ("zstd::", &["io/packed/zstandard.rs", "io/packed/tests.rs", "io/threemf/tests.rs"]),
    ("zip::", &["io/threemf/"]),
    ("quick_xml::", &["io/threemf/xml.rs"]),
    ("draco_core::", &["io/gltf/draco.rs", "io/gltf/draco_tests.rs"]),
    ("exr::", &["report/image_exr.rs", "report/preview/tests.rs"]),
    ("png::", &["report/image_png.rs", "report/pictures.rs", "report/preview/tests.rs"]),
    ("base64::", &["report/model_page/carried.rs"]),
    ("jiff::", &["report/html/figures.rs", "cli/time.rs", "cli/batch.rs"]),
    ("toml::", &["cli/config/"]),
    ("strsim::", &["cli/config/"]),
    ("clap::", &["cli/"]),
    ("clap_complete::", &["cli/completions.rs"]),
    ("clap_mangen::", &["cli/man.rs"]),
    ("anyhow::", &["cli/"]),
    ("crossbeam::", &["store/pipeline.rs", "catalogue/"]),
    ("rusqlite::", &["catalogue/journal/", "catalogue/error.rs"]),
    ("walkdir::", &["catalogue/walk.rs"]),
    ("globset::", &["catalogue/walk.rs"]),
    ("blake3::", &["store/", "repair/run.rs"]),
    ("twox_hash::", &["store/digest.rs"]),
    (
        "rustix::",
        &["store/", "io/input.rs", "cli/last_words.rs", "catalogue/child.rs", "cli/worker.rs"],
    ),
    ("robust::", &["geom/", "verify/"]),
    (
        "rkyv::",
        &[
            "store/manifest.rs",
            "store/checkpoint.rs",
            "store/brick/",
            "octree/border.rs",
            "octree/brick.rs",
            "octree/cell_brick.rs",
            "octree/edge_brick.rs",
            "octree/sign_bricks.rs",
            // These hand on the aligned bytes that `encode` returns.
            "scan/mod.rs",
            "sign/hit_edges.rs",
            "sign/relabel.rs",
            "sign/exposed.rs",
            "sign/panes.rs",
            "sign/thin.rs",
            "contour/mc/vertices.rs",
        ],
    ),
    ("std::env::", &["cli/"]),
];

/// What the head of every stage says.
const HEAD_WORDS: [&str; 7] =
    ["In:", "Out:", "Invariant:", "Units:", "Memory:", "Fails:", "Source:"];

const MOST_CODE_LINES: usize = 600;
const MANY_CODE_LINES: usize = 300;

struct Source {
    /// Path below `src/`, with slashes.
    path: String,
    text: String,
    is_test: bool,
}

impl Source {
    /// The lines of code with their numbers: no comments, no test module.
    fn code(&self) -> Vec<(usize, String)> {
        let mut lines = Vec::new();
        let mut numbered = self.text.lines().enumerate().peekable();
        while let Some((number, line)) = numbered.next() {
            let next = numbered.peek().map_or("", |(_, next)| next.trim());
            if line.trim() == "#[cfg(test)]" && next.starts_with("mod ") && next.ends_with('{') {
                break;
            }
            let code = strip_comment(line);
            if !code.trim().is_empty() {
                lines.push((number + 1, code.to_owned()));
            }
        }
        lines
    }

    /// The module that the file belongs to: its first folder, or its own name.
    fn module(&self) -> &str {
        self.path.split(['/', '.']).next().unwrap_or_default()
    }

    fn is_stage_head(&self) -> bool {
        let module = self.module();
        self.path == format!("{module}/mod.rs") && layer_of(module) == Some(STAGE)
    }
}

fn strip_comment(line: &str) -> &str {
    // No string of ours holds two slashes but addresses, and these stand in comments.
    line.split("//").next().unwrap_or_default()
}

fn layer_of(module: &str) -> Option<u32> {
    LAYERS.iter().find(|(name, _)| *name == module).map(|(_, layer)| *layer)
}

fn collect(folder: &Path, paths: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("src is readable") {
        let path = entry.expect("src is readable").path();
        if path.is_dir() {
            collect(&path, paths);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            paths.push(path);
        }
    }
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    collect(&root, &mut paths);
    paths.sort();
    let read = paths.into_iter().map(|path| {
        let text = std::fs::read_to_string(&path).expect("source is text");
        let path = path.strip_prefix(&root).expect("below src").to_string_lossy().into_owned();
        let is_test = path.ends_with("tests.rs");
        Source { path, text, is_test }
    });
    let sources: Vec<Source> = read.collect();
    assert!(sources.len() > 50, "the source was not found");
    sources
}

/// Modules named after `crate::` in a line, also those in braces right after it.
fn imports_of(line: &str, prefix: &str) -> Vec<String> {
    let word = |text: &str| -> String {
        text.chars().take_while(|c| c.is_alphanumeric() || *c == '_' || *c == '*').collect()
    };
    let mut modules = Vec::new();
    for (at, _) in line.match_indices(prefix) {
        let own_word = line[..at].chars().next_back();
        if own_word.is_some_and(|c| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let rest = &line[at + prefix.len()..];
        match rest.strip_prefix('{') {
            Some(list) => modules.extend(list.split(',').map(|item| word(item.trim()))),
            None => modules.push(word(rest)),
        }
    }
    modules.retain(|module| !module.is_empty());
    modules
}

fn report(mut findings: Vec<String>) {
    findings.sort();
    findings.dedup();
    assert!(findings.is_empty(), "\n{}\n", findings.join("\n"));
}

#[test]
fn modules_import_from_strictly_lower_layers_only() {
    let mut findings = Vec::new();
    // Files of tests may bring several stages together.
    for source in sources().iter().filter(|s| !s.path.starts_with("cli/") && !s.is_test) {
        let module = source.module().to_owned();
        if ["lib", "main"].contains(&module.as_str()) {
            continue;
        }
        let Some(layer) = layer_of(&module) else {
            findings.push(format!("{}: {module} is in no layer", source.path));
            continue;
        };
        for (number, line) in source.code() {
            for import in imports_of(&line, "crate::") {
                let place = format!("{}:{number}", source.path);
                if import == module {
                    continue;
                }
                match layer_of(&import) {
                    Some(other) if other < layer => {}
                    Some(_) => findings.push(format!("{place}: {module} imports {import}")),
                    None => findings.push(format!("{place}: crate::{import} is in no layer")),
                }
                if module == "verify" && !VERIFY_IMPORTS.contains(&import.as_str()) {
                    findings.push(format!("{place}: the proof imports {import}"));
                }
            }
        }
    }
    report(findings);
}

#[test]
fn every_module_of_the_library_has_a_layer() {
    let lib = sources().into_iter().find(|s| s.path == "lib.rs").expect("lib.rs is there");
    let modules = lib.text.lines().filter_map(|line| line.strip_prefix("pub mod "));
    let unknown: Vec<_> = modules
        .map(|name| name.trim_end_matches(';'))
        .filter(|name| layer_of(name).is_none())
        .map(|name| format!("{name} is in no layer"))
        .collect();
    report(unknown);
}

#[test]
fn the_command_line_is_a_caller_like_any_other() {
    let mut findings = Vec::new();
    for source in sources() {
        let in_cli = source.path.starts_with("cli/") || source.path == "main.rs";
        for (number, line) in source.code() {
            let place = format!("{}:{number}", source.path);
            if in_cli {
                let imports = imports_of(&line, "crate::");
                if imports.iter().any(|module| module != "cli") {
                    findings.push(format!("{place}: imports other than brickmend:: and cli"));
                }
            } else if line.contains("cli::") {
                findings.push(format!("{place}: the library knows the command line"));
            }
        }
    }
    report(findings);
}

#[test]
fn imports_hide_nothing() {
    let mut findings = Vec::new();
    for source in sources() {
        for (number, line) in source.code() {
            let place = format!("{}:{number}", source.path);
            if imports_of(&line, "crate::").iter().any(|module| module == "*") {
                findings.push(format!("{place}: crate::*"));
            }
            if line.contains("super::") && !source.is_test {
                findings.push(format!("{place}: super:: outside of tests"));
            }
        }
    }
    report(findings);
}

#[test]
fn every_dependency_has_one_home() {
    let mut findings = Vec::new();
    for source in sources() {
        for (number, line) in source.code() {
            for (word, homes) in HOMES {
                let at_home = homes.iter().any(|home| match home.ends_with('/') {
                    true => source.path.starts_with(home),
                    false => source.path == *home,
                });
                let own_word = |at: usize| {
                    let before = line[..at].chars().next_back();
                    !before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':')
                };
                let named = line.match_indices(word).any(|(at, _)| own_word(at));
                if named && !at_home {
                    findings.push(format!("{}:{number}: {word} is not at home here", source.path));
                }
            }
        }
    }
    report(findings);
}

#[test]
fn every_file_says_what_it_is_for() {
    let heads = sources().into_iter().filter(|s| !s.text.starts_with("//!"));
    report(heads.map(|s| format!("{}: does not begin with //!", s.path)).collect());
}

#[test]
fn every_stage_says_what_goes_in_and_out_and_what_it_holds() {
    let mut findings = Vec::new();
    for source in sources().iter().filter(|s| s.is_stage_head()) {
        let head: Vec<&str> = source.text.lines().take_while(|l| l.starts_with("//!")).collect();
        for word in HEAD_WORDS {
            if !head.iter().any(|line| line.contains(word)) {
                findings.push(format!("{}: the head does not say {word}", source.path));
            }
        }
    }
    report(findings);
}

#[test]
fn no_file_is_too_long() {
    let mut findings = Vec::new();
    let mut long = BTreeMap::new();
    for source in sources() {
        let lines = source.code().len();
        if lines > MOST_CODE_LINES {
            findings.push(format!("{}: {lines} lines of code", source.path));
        } else if lines > MANY_CODE_LINES {
            long.insert(source.path, lines);
        }
    }
    // Shown by `cargo test -- --nocapture`; long is no failure.
    for (path, lines) in long {
        println!("{path}: {lines} lines of code, more than {MANY_CODE_LINES}");
    }
    report(findings);
}

#[test]
fn names_say_what_is_in_a_file() {
    let empty = ["util", "utils", "misc", "manager", "helper", "helpers", "common", "handler"];
    let findings = sources().into_iter().filter_map(|source| {
        let mut names = source.path.split(['/', '.']);
        names.any(|name| empty.contains(&name)).then(|| format!("{}: empty name", source.path))
    });
    report(findings.collect());
}

#[test]
fn nothing_is_left_for_later() {
    let marks = ["todo!(", "unimplemented!(", "TODO", "FIXME", "XXX"];
    let mut findings = Vec::new();
    for source in sources() {
        for (number, line) in source.text.lines().enumerate() {
            if let Some(mark) = marks.iter().find(|mark| line.contains(*mark)) {
                findings.push(format!("{}:{}: {mark}", source.path, number + 1));
            }
        }
    }
    report(findings);
}

#[test]
fn every_file_of_tests_is_in_the_binary_of_all() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let all = std::fs::read_to_string(root.join("all.rs")).expect("the binary has a root");
    let mut findings = Vec::new();
    for entry in std::fs::read_dir(&root).expect("tests are readable") {
        let name = entry.expect("tests are readable").file_name().into_string().expect("a name");
        let Some(module) = name.strip_suffix(".rs").filter(|module| *module != "all") else {
            continue;
        };
        if !all.lines().any(|line| line == format!("mod {module};")) {
            findings.push(format!("tests/{name} is run by nobody"));
        }
    }
    report(findings);
}

#[test]
fn links_in_the_documents_lead_somewhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let documents = [
        "README.md",
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "docs/format.md",
        "docs/outcome.md",
        "docs/estimate.md",
        "docs/inspect.md",
        "docs/layers.md",
        "docs/verify.md",
        "docs/journal.md",
        "docs/parts.md",
        "docs/preview.md",
        "docs/benchmarks/peers.md",
        "docs/glossary.md",
        "docs/journal.md",
        "docs/nightly.md",
        "docs/settings.md",
        "testdata/README.md",
    ];
    let mut findings = Vec::new();
    for document in documents {
        let path = root.join(document);
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        if text.is_empty() {
            findings.push(format!("{document}: missing or empty"));
        }
        let folder = path.parent().expect("a document lies in a folder");
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let target = link.split('#').next().unwrap_or_default();
            let elsewhere = target.is_empty() || target.contains("://");
            if !elsewhere && !folder.join(target).exists() {
                findings.push(format!("{document}: {link} leads nowhere"));
            }
        }
    }
    report(findings);
}
