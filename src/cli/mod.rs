//! The command line: arguments to settings, events to the terminal, errors to exit codes.

mod allocator;
mod arguments;
mod batch;
mod completions;
mod config;
mod estimate;
mod exit_code;
mod export;
mod fleet;
mod inspect;
mod last_words;
mod layers;
mod man;
mod memory;
mod numbers;
mod pictures;
mod progress;
mod repair;
mod report;
mod signals;
mod stage_clock;
mod status;
mod time;
mod verify;
mod worker;

use std::path::PathBuf;

use clap::{Parser, Subcommand};

use crate::cli::config::Config;
use crate::cli::exit_code::Exit;
use crate::cli::progress::Chatter;

/// Repairs broken 3D models: any polygon soup becomes a closed, 2-manifold, outward oriented
/// surface, in the memory it was told to use.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Say less: errors only.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Say more; twice for every event.
    #[arg(short, long, global = true, action = clap::ArgAction::Count, conflicts_with = "quiet")]
    verbose: u8,
    /// File of settings [default: brickmend.toml, if it is in the current folder].
    #[arg(long, global = true, value_name = "FILE")]
    config: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Repair one model.
    Repair(repair::RepairArguments),
    /// Tell what is wrong with models; changes nothing.
    Inspect(inspect::InspectArguments),
    /// Prove that a model is sound, and measure how far it lies from an original.
    Verify(verify::VerifyArguments),
    /// Repair a folder of models, as far as that is not done.
    Batch(batch::BatchArguments),
    /// Tell where a folder of results stands.
    Status(status::StatusArguments),
    /// Write the page of a folder of results anew.
    Report(report::ReportArguments),
    /// Work for a batch.
    #[command(hide = true)]
    Worker(worker::WorkerArguments),
    /// Tell what a repair will take: leaves, memory, disk, seconds.
    Estimate(estimate::EstimateArguments),
    /// Tell all settings, and where each comes from.
    Config(config::ConfigArguments),
    /// Print what completes this command line in a shell.
    Completions(completions::CompletionsArguments),
    /// Print the manual, or write it page by page into a folder.
    Man(man::ManArguments),
}

/// Parses the command line and runs the command.
pub fn run() -> std::process::ExitCode {
    allocator::return_large_blocks();
    // A usage error leaves here with exit code 2.
    let (arguments, config) = match Config::parse() {
        Ok(parsed) => parsed,
        Err(error) => {
            Chatter::new(false, 0).error(&error);
            return Exit::Usage.into();
        }
    };
    let chatter = Chatter::new(arguments.quiet, arguments.verbose);
    match arguments.command {
        Command::Repair(arguments) => repair::run(&arguments, &chatter),
        Command::Inspect(arguments) => inspect::run(&arguments, &chatter),
        Command::Verify(arguments) => verify::run(&arguments, &chatter),
        Command::Batch(arguments) => batch::run(&arguments, &config, &chatter),
        Command::Status(arguments) => status::run(&arguments, &chatter),
        Command::Report(arguments) => report::run(&arguments, &chatter),
        Command::Worker(arguments) => worker::run(&arguments, &chatter),
        Command::Estimate(arguments) => estimate::run(&arguments, &chatter),
        Command::Config(arguments) => config::run(&arguments, &config),
        Command::Completions(arguments) => completions::run(&arguments),
        Command::Man(arguments) => man::run(&arguments, &chatter),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_consistent() {
        Arguments::command().debug_assert();
    }
}
