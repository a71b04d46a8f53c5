//! `brickmend config`: every setting with its value and where that comes from.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::parser::ValueSource;
use clap::{Args, CommandFactory};
use serde::Serialize;

use crate::cli::Arguments;
use crate::cli::arguments::{ResourceArguments, ResultArguments};
use crate::cli::batch::BatchSettings;
use crate::cli::config::{Config, Origin, keys};
use crate::cli::exit_code::{EXIT_STATUS, Exit};
use crate::cli::progress::on_one_line;

/// Version of what `--json` prints.
const SCHEMA: u32 = 1;

/// Arguments of `brickmend config`: all that may be set, and how it is shown.
#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub struct ConfigArguments {
    #[command(flatten)]
    result: ResultArguments,
    #[command(flatten)]
    resources: ResourceArguments,
    #[command(flatten)]
    batch: BatchSettings,
    /// Tell what holds for the model at this path within the folder of the models.
    #[arg(long, value_name = "MODEL", help_heading = "Report")]
    model: Option<PathBuf>,
    /// Print JSON; see docs/settings.md.
    #[arg(long, help_heading = "Report")]
    json: bool,
}

/// A setting.
#[derive(Serialize)]
struct Setting {
    key: String,
    /// None where it is not set: then what stands in the help holds.
    values: Vec<String>,
    /// flag, environment, file or default.
    origin: &'static str,
    /// Name of the variable, or file and line.
    place: String,
}

#[derive(Serialize)]
struct Told {
    schema: u32,
    file: Option<String>,
    settings: Vec<Setting>,
    /// What differs by folder, where no model was asked for.
    folders: Vec<ToldFolder>,
}

#[derive(Serialize)]
struct ToldFolder {
    pattern: String,
    settings: Vec<Setting>,
}

/// Runs the command.
pub fn run(arguments: &ConfigArguments, config: &Config) -> ExitCode {
    let told = config.tell(arguments.model.as_deref());
    let text = match arguments.json {
        true => serde_json::to_string_pretty(&told).expect("plain records serialise"),
        false => text_of(&told),
    };
    // A reader that went away is no failure.
    let _ = writeln!(std::io::stdout(), "{text}");
    Exit::Success.into()
}

impl Config {
    fn tell(&self, model: Option<&std::path::Path>) -> Told {
        let command = Arguments::command();
        let flags = command.clone().get_matches_from(&self.words);
        let Some((name, given)) = flags.subcommand() else { unreachable!("a command is required") };
        let folders = model.map(|model| self.folders_of(model)).unwrap_or_default();
        let mut layered = self.resolve(name, given, &folders);
        let described = command.find_subcommand(name).expect("it was parsed");
        let settings = keys::all().into_iter().map(|key| {
            let argument = described.get_arguments().find(|a| a.get_long() == Some(&key));
            let argument = argument.expect("the command has all settings");
            let id = argument.get_id().as_str();
            let (values, origin) = if given.value_source(id) == Some(ValueSource::CommandLine) {
                let raw = given.get_raw(id).into_iter().flatten();
                let values: Vec<_> = raw.map(|v| v.to_string_lossy().into_owned()).collect();
                let is_switch = !argument.get_action().takes_values();
                (if is_switch { vec!["true".to_owned()] } else { values }, Origin::Flag)
            } else if let Some(value) = layered.remove(&key) {
                (value.values, value.origin)
            } else {
                let values = argument.get_default_values().iter();
                (values.map(|v| v.to_string_lossy().into_owned()).collect(), Origin::Default)
            };
            self.setting(key, values, &origin)
        });
        let settings = settings.collect();
        let by_folder =
            self.folders().iter().filter(|_| model.is_none()).map(|folder| ToldFolder {
                pattern: folder.pattern.clone(),
                settings: folder
                    .entries
                    .iter()
                    .map(|entry| {
                        let origin = Origin::File(entry.line, None);
                        self.setting(entry.key.clone(), entry.values.clone(), &origin)
                    })
                    .collect(),
            });
        Told {
            schema: SCHEMA,
            file: self.file.as_ref().map(|file| file.path.display().to_string()),
            settings,
            folders: by_folder.collect(),
        }
    }

    fn setting(&self, key: String, values: Vec<String>, origin: &Origin) -> Setting {
        let word = match origin {
            Origin::Flag => "flag",
            Origin::Environment(_) => "environment",
            Origin::File(..) => "file",
            Origin::Default => "default",
        };
        Setting { key, values, origin: word, place: self.place(origin) }
    }
}

fn text_of(told: &Told) -> String {
    let mut lines = Vec::new();
    match &told.file {
        Some(file) => lines.push(format!("file: {file}")),
        None => lines.push("no file: brickmend.toml is not in this folder".to_owned()),
    }
    lines.extend(told.settings.iter().map(line_of));
    for folder in &told.folders {
        lines.push(format!("for {}:", folder.pattern));
        lines.extend(folder.settings.iter().map(line_of));
    }
    lines.iter().map(|line| on_one_line(line)).collect::<Vec<_>>().join("\n")
}

fn line_of(setting: &Setting) -> String {
    let values = match setting.values.is_empty() {
        true => "not set".to_owned(),
        false => setting.values.join(", "),
    };
    format!("{:16} = {values:16} ({})", setting.key, setting.place)
}
