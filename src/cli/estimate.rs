//! `brickmend estimate`: what a repair will take, before it starts.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use brickmend::io::{Format, format_of_extension};
use brickmend::repair::{Estimate, estimate};
use clap::Args;

use crate::cli::arguments::{FormatName, ResourceArguments, ResultArguments};
use crate::cli::exit_code::{EXIT_STATUS, Exit};
use crate::cli::progress::{Chatter, Progress};
use crate::cli::signals::Stop;

/// Arguments of `brickmend estimate`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub struct EstimateArguments {
    /// The model: OBJ, STL, PLY, OFF, 3MF or glTF, told by content.
    input: PathBuf,
    /// Where the repaired model would go; its extension is its format. Nothing is written.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Format of the repaired model, where no output is named [default: ply].
    #[arg(long, value_enum, conflicts_with = "output")]
    format: Option<FormatName>,
    #[command(flatten)]
    result: ResultArguments,
    #[command(flatten)]
    resources: ResourceArguments,
    /// Print the estimate as JSON on stdout; see docs/estimate.md.
    #[arg(long, help_heading = "Report")]
    json: bool,
}

impl EstimateArguments {
    fn format(&self) -> Option<Format> {
        match &self.output {
            Some(output) => format_of_extension(output),
            None => Some(self.format.map_or(Format::Ply, Format::from)),
        }
    }
}

/// Runs the command.
pub fn run(arguments: &EstimateArguments, chatter: &Chatter) -> ExitCode {
    let Some(format) = arguments.format() else {
        chatter.error(&NoFormat { path: arguments.output.clone().unwrap_or_default() });
        return Exit::Usage.into();
    };
    let mut limits = arguments.resources.limits();
    if limits.work_dir.is_none() {
        limits.work_dir = arguments.output.as_deref().and_then(Path::parent).map(PathBuf::from);
        // A bare name lies in the current folder.
        limits.work_dir.take_if(|folder| folder.as_os_str().is_empty());
    }
    let settings = arguments.result.settings();
    let progress = Progress::new(*chatter, Stop::default());
    let result = estimate(&arguments.input, format, &settings, &limits, &progress);
    progress.clear();
    match result {
        Ok(estimate) => {
            tell(&estimate, arguments.json, chatter);
            Exit::Success.into()
        }
        Err(error) => {
            chatter.error(&error);
            Exit::from(&error).into()
        }
    }
}

fn tell(estimate: &Estimate, json: bool, chatter: &Chatter) {
    let text = if json {
        serde_json::to_string_pretty(estimate).expect("plain records serialise")
    } else if chatter.is_quiet() {
        return;
    } else {
        summary(estimate)
    };
    // A reader that went away is no failure of the estimate.
    let _ = writeln!(std::io::stdout(), "{text}");
}

fn summary(estimate: &Estimate) -> String {
    let mebibytes = |bytes: u64| format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20));
    let sums = &estimate.input;
    [
        format!(
            "{}: depth {}, cells of {:.4}, about {} leaf cells",
            estimate.path.display(),
            estimate.grid.depth,
            estimate.cell_size,
            estimate.leaf_cells
        ),
        format!(
            "  memory: at most {} of {}, of which {} are the floor with {} threads",
            mebibytes(estimate.memory_bytes),
            mebibytes(estimate.budget_bytes),
            mebibytes(estimate.memory_floor_bytes),
            estimate.threads
        ),
        format!(
            "  disk: at most {}, with an output of at most {}",
            mebibytes(estimate.disk_bytes),
            mebibytes(estimate.output_bytes)
        ),
        format!(
            "  time: about {:.1} s, on an idle machine like the one of docs/estimate.md",
            estimate.seconds
        ),
        format!(
            "  from: {} triangles, area {:.4}, rims of length {:.4}; what openings and sheets add \
             is bounded, what lies hidden in the solid is not left out",
            sums.stats.triangles, sums.area, sums.rims.length
        ),
    ]
    .join("\n")
}

/// An output whose extension names no format.
#[derive(Debug, thiserror::Error)]
#[error("{}: the extension names no format that is written", path.display())]
struct NoFormat {
    path: PathBuf,
}
