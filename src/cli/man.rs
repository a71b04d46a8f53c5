//! `brickmend man`: the manual, as the help has it.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, CommandFactory};
use clap_mangen::Man;

use crate::cli::Arguments;
use crate::cli::exit_code::Exit;
use crate::cli::progress::Chatter;

/// Arguments of `brickmend man`.
#[derive(Debug, Args)]
pub struct ManArguments {
    /// Folder for a page of each command; without it the first page goes to stdout.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// A page that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("Cannot write the manual to {path}")]
struct Unwritten {
    path: PathBuf,
    source: std::io::Error,
}

/// Runs the command.
pub fn run(arguments: &ManArguments, chatter: &Chatter) -> ExitCode {
    let mut command = Arguments::command();
    command.build();
    let Some(folder) = &arguments.out else {
        let mut text = Vec::new();
        Man::new(command).render(&mut text).expect("memory grows");
        // A reader that went away is no failure.
        let _ = std::io::stdout().write_all(&text);
        return Exit::Success.into();
    };
    match write_pages(command, folder) {
        Ok(()) => Exit::Success.into(),
        Err(source) => {
            chatter.error(&Unwritten { path: folder.clone(), source });
            Exit::Unusable.into()
        }
    }
}

/// A page for the program, and for each command that is no secret.
fn write_pages(command: clap::Command, folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for subcommand in command.get_subcommands().filter(|subcommand| !subcommand.is_hide_set()) {
        let name = format!("brickmend-{}", subcommand.get_name());
        write_page(subcommand.clone().name(name.clone()), &name, folder)?;
    }
    write_page(command, "brickmend", folder)
}

fn write_page(command: clap::Command, name: &str, folder: &Path) -> std::io::Result<()> {
    let mut text = Vec::new();
    Man::new(command).render(&mut text)?;
    std::fs::write(folder.join(format!("{name}.1")), text)
}
