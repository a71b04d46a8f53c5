//! The command line: arguments to settings, events to the terminal, errors to exit codes.

mod allocator;
mod arguments;
mod batch;
mod estimate;
mod exit_code;
mod fleet;
mod inspect;
mod last_words;
mod memory;
mod numbers;
mod progress;
mod repair;
mod signals;
mod stage_clock;
mod status;
mod verify;
mod worker;

use clap::{Parser, Subcommand};

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
    /// Work for a batch.
    #[command(hide = true)]
    Worker(worker::WorkerArguments),
    /// Tell what a repair will take: leaves, memory, disk, seconds.
    Estimate(estimate::EstimateArguments),
}

/// Parses the command line and runs the command.
pub fn run() -> std::process::ExitCode {
    allocator::return_large_blocks();
    // A usage error leaves here with exit code 2.
    let arguments = Arguments::parse();
    let chatter = Chatter::new(arguments.quiet, arguments.verbose);
    match arguments.command {
        Command::Repair(arguments) => repair::run(&arguments, &chatter),
        Command::Inspect(arguments) => inspect::run(&arguments, &chatter),
        Command::Verify(arguments) => verify::run(&arguments, &chatter),
        Command::Batch(arguments) => batch::run(&arguments, &chatter),
        Command::Status(arguments) => status::run(&arguments, &chatter),
        Command::Worker(arguments) => worker::run(&arguments, &chatter),
        Command::Estimate(arguments) => estimate::run(&arguments, &chatter),
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
