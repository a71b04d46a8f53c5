//! `brickmend completions`: what a shell needs to complete the command line.

use std::io::Write;
use std::process::ExitCode;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::cli::Arguments;
use crate::cli::exit_code::Exit;

/// Arguments of `brickmend completions`.
#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// The shell.
    shell: Shell,
}

/// Runs the command.
pub fn run(arguments: &CompletionsArguments) -> ExitCode {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "brickmend", &mut text);
    // A reader that went away is no failure.
    let _ = std::io::stdout().write_all(&text);
    Exit::Success.into()
}
