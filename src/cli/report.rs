//! `brickmend report`: the page of a catalogue, from its journal.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use brickmend::catalogue::{FOLDER, Journal};
use brickmend::report::{INDEX, ReportError, report_folder, write_catalogue_page};
use clap::Args;

use crate::cli::exit_code::{EXIT_STATUS, Exit};
use crate::cli::progress::{Chatter, on_one_line};

/// Arguments of `brickmend report`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub struct ReportArguments {
    /// Folder of the results.
    results: PathBuf,
    /// Where the page goes [default: .brickmend/report/index.html in the folder of the results].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Runs the command.
pub fn run(arguments: &ReportArguments, chatter: &Chatter) -> ExitCode {
    match write(&arguments.results, arguments.output.as_deref()) {
        Ok(path) => {
            chatter.say(&on_one_line(&path.display().to_string()));
            Exit::Success.into()
        }
        Err(error) => {
            chatter.error(&error);
            Exit::from(error.blame()).into()
        }
    }
}

/// Writes the page of the results in `target`; where it is.
pub fn write(target: &Path, output: Option<&Path>) -> Result<PathBuf, ReportError> {
    let mut journal = Journal::open_to_read(target)?;
    let path = match output {
        Some(path) => path.to_path_buf(),
        None => {
            let folder = report_folder(target);
            debug_assert!(folder.starts_with(target.join(FOLDER)));
            std::fs::create_dir_all(&folder).map_err(|source| ReportError::Folder {
                doing: "create",
                path: folder.clone(),
                source,
            })?;
            folder.join(INDEX)
        }
    };
    write_catalogue_page(&mut journal, target, &path)?;
    Ok(path)
}
