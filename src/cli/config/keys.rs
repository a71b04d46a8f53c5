//! The keys of settings: the long names of the arguments that may stand in a file.

use clap::{Args, CommandFactory};

use crate::cli::Arguments;
use crate::cli::arguments::{ResourceArguments, ResultArguments};
use crate::cli::batch::BatchSettings;

/// Commands that read settings.
pub const COMMANDS: [&str; 5] = ["repair", "batch", "estimate", "inspect", "config"];

/// Names more alike than this are proposed for each other (Jaro and Winkler's measure, 0 to 1).
const ALIKE: f64 = 0.8;

/// Long names and numbers of the arguments that `augment` adds.
fn long_names(augment: fn(clap::Command) -> clap::Command) -> Vec<String> {
    let command = augment(clap::Command::new("keys"));
    let names = command.get_arguments().filter_map(|argument| argument.get_long());
    names.filter(|name| *name != "no-pages").map(str::to_owned).collect()
}

/// All keys, by name.
pub fn all() -> Vec<String> {
    let mut names = long_names(ResultArguments::augment_args);
    names.extend(long_names(ResourceArguments::augment_args));
    names.extend(long_names(BatchSettings::augment_args));
    names.sort();
    names
}

/// Whether the settings of this key may differ by folder.
pub fn is_of_folders(key: &str) -> bool {
    ["format", "all"].contains(&key)
        || long_names(ResultArguments::augment_args).iter().any(|name| name == key)
}

/// Whether the key has several values.
pub fn is_list(key: &str) -> bool {
    ["include", "exclude"].contains(&key)
}

/// Whether a command reads this key. What `inspect` calls by the names of the result is something
/// else.
pub fn takes(command: &str, key: &str) -> bool {
    let is_resource = || long_names(ResourceArguments::augment_args).iter().any(|name| name == key);
    id_of(command, key).is_some() && (command != "inspect" || is_resource())
}

/// Keys that stand for the same choice: one replaces the others.
pub fn alternatives(key: &str) -> &'static [&'static str] {
    match key {
        "depth" => &["tolerance"],
        "tolerance" => &["depth"],
        "lod" => &["decimate", "max-triangles"],
        "no-pages" => &["pages"],
        _ => &[],
    }
}

/// Long names and identifiers of all arguments of a command.
pub fn arguments_of(command: &str) -> Vec<(String, String)> {
    let all = Arguments::command();
    let Some(command) = all.find_subcommand(command) else { return Vec::new() };
    let named = command.get_arguments().filter_map(|argument| {
        Some((argument.get_long()?.to_owned(), argument.get_id().as_str().to_owned()))
    });
    named.collect()
}

/// The identifier of a command's argument with this long name.
pub fn id_of(command: &str, key: &str) -> Option<String> {
    arguments_of(command).into_iter().find(|(name, _)| name == key).map(|(_, id)| id)
}

/// A key that is much like this one.
pub fn close_to(key: &str) -> Option<String> {
    let wanted = key.replace('_', "-").to_lowercase();
    let alike = |name: &str| strsim::jaro_winkler(&wanted, name);
    let best = all().into_iter().max_by(|a, b| alike(a).total_cmp(&alike(b)));
    best.filter(|name| alike(name) >= ALIKE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_known_once_and_proposed() {
        let keys = all();
        let mut once = keys.clone();
        once.dedup();
        assert_eq!(keys, once);
        assert!(keys.iter().all(|key| id_of("config", key).is_some()));
        assert_eq!(close_to("dept").as_deref(), Some("depth"));
        assert_eq!(close_to("max_memory").as_deref(), Some("max-memory"));
        assert_eq!(close_to("zzz"), None);
    }

    #[test]
    fn the_thickness_that_an_inspection_tells_of_is_none_of_a_repair() {
        assert!(takes("repair", "thin") && !takes("inspect", "thin"));
        assert!(takes("inspect", "max-memory"));
    }
}
