//! `brickmend status`: where a catalogue stands, while a batch works on it and after.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use brickmend::catalogue::{CatalogueError, Journal, Told};
use clap::Args;

use crate::cli::batch::text_of;
use crate::cli::exit_code::{EXIT_STATUS, Exit};
use crate::cli::progress::{Chatter, on_one_line};

/// Arguments of `brickmend status`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub struct StatusArguments {
    /// Folder of the results.
    output: PathBuf,
    /// Tell of one model, by its path within the folder of the models: all attempts, and why.
    #[arg(long, value_name = "MODEL")]
    why: Option<PathBuf>,
    /// Print JSON; see docs/journal.md.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &StatusArguments, chatter: &Chatter) -> ExitCode {
    match answer(arguments) {
        Ok(text) => {
            // A reader that went away is no failure.
            let _ = writeln!(std::io::stdout(), "{text}");
            Exit::Success.into()
        }
        Err(error) => {
            chatter.error(&error);
            Exit::from(error.blame()).into()
        }
    }
}

fn answer(arguments: &StatusArguments) -> Result<String, CatalogueError> {
    let mut journal = Journal::open_to_read(&arguments.output)?;
    let plain = "plain records serialise";
    if let Some(model) = &arguments.why {
        let id = journal.find(model)?;
        let told = journal.tell(id)?;
        let json = || serde_json::to_string_pretty(&told).expect(plain);
        return Ok(if arguments.json { json() } else { text_of_model(&told) });
    }
    let summary = journal.summary()?;
    let json = || serde_json::to_string_pretty(&summary).expect(plain);
    Ok(if arguments.json { json() } else { text_of(&summary) })
}

fn text_of_model(told: &Told) -> String {
    let words = [Some(&told.state), told.verdict.as_ref(), told.cause.as_ref()];
    let words: Vec<&str> = words.into_iter().flatten().map(String::as_str).collect();
    let mut text = format!("{}: {}", on_one_line(&told.name), words.join(", "));
    if let Some(reason) = &told.reason {
        text.push_str(&format!("\n  {}", on_one_line(reason)));
    }
    if let Some(because) = &told.because {
        text.push_str(&format!("\n  asked for because: {}", on_one_line(because)));
    }
    for file in &told.beside {
        let missing = if file.is_there { "" } else { ", not there" };
        text.push_str(&format!("\n  names {}{missing}", on_one_line(&file.name)));
    }
    for attempt in &told.attempts {
        let ending = attempt.ending.as_deref().unwrap_or("without an end");
        let mebibytes = attempt.memory_bytes >> 20;
        text.push_str(&format!(
            "\n  run {}, {}, {mebibytes} MiB, {} threads: {ending}",
            attempt.run, attempt.rung, attempt.threads
        ));
        if let Some(message) = &attempt.message {
            text.push_str(&format!(": {}", on_one_line(message)));
        }
    }
    text
}
