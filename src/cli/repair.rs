//! `brickmend repair`: one model, from file to file.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use brickmend::contour::Method;
use brickmend::io::{ReadOptions, format_of_extension};
use brickmend::monitor::Void;
use brickmend::repair::{Depth, Length, Limits, Outcome, RepairError, Settings, Verdict, repair};
use brickmend::report::{OpenSource, PreviewOptions, write_preview};
use brickmend::sign::FillRule;
use brickmend::store::Scratch;
use clap::{Args, ValueEnum};

use crate::cli::exit_code::{EXIT_STATUS, Exit};
use crate::cli::memory::peak_resident_bytes;
use crate::cli::progress::{Chatter, Progress, on_one_line};

/// Arguments of `brickmend repair`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub struct RepairArguments {
    /// The model: OBJ, STL, PLY or OFF, told by content.
    input: PathBuf,
    /// Where the repaired model goes; its extension is its format.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Octree depth, 4 to 15: 2^DEPTH cells a side.
    #[arg(long, value_parser = clap::value_parser!(u32).range(4..=15), help_heading = "Result")]
    depth: Option<u32>,
    /// Largest deviation, in model units or % of the bounding box diagonal; chooses the depth.
    /// [default: 0.2%]
    #[arg(long, value_name = "LENGTH", conflicts_with = "depth", help_heading = "Result")]
    tolerance: Option<Length>,
    /// Deepest depth that --tolerance may choose.
    #[arg(long, default_value_t = Depth::DEFAULT_MAX, help_heading = "Result",
          value_parser = clap::value_parser!(u32).range(4..=15))]
    max_depth: u32,
    /// What is inside.
    #[arg(long, value_enum, default_value_t = FillRuleName::Solid, help_heading = "Result")]
    fill_rule: FillRuleName,
    /// Angle in degrees below which a crease is noise.
    #[arg(long, value_name = "DEGREES", default_value = "12", value_parser = parse_angle,
          help_heading = "Result")]
    crease: f64,
    /// Refuse NaN, infinite corners and wild indices in place of dropping such faces.
    #[arg(long, help_heading = "Result")]
    strict: bool,
    /// Peak resident memory, such as 256MiB or 1GB.
    #[arg(long, value_name = "SIZE", default_value = "1GiB", value_parser = parse_size,
          help_heading = "Resources")]
    max_memory: u64,
    /// Worker threads [default: one per processor].
    #[arg(short = 'j', long, value_name = "N", help_heading = "Resources")]
    threads: Option<usize>,
    /// Folder for scratch files [default: beside the output].
    #[arg(long, value_name = "DIR", help_heading = "Resources")]
    work_dir: Option<PathBuf>,
    /// Print the outcome as JSON on stdout; see docs/outcome.md.
    #[arg(long, help_heading = "Report")]
    json: bool,
    /// Draw input beside output into a PNG or EXR file.
    #[arg(long, value_name = "FILE", help_heading = "Report")]
    preview: Option<PathBuf>,
    /// Draw the edges of the triangles as well.
    #[arg(long, requires = "preview", help_heading = "Report")]
    preview_edges: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FillRuleName {
    /// All that the outside cannot reach: unites overlaps, fills cavities.
    Solid,
    /// Parity of the walls crossed: keeps cavities, hollows overlaps.
    Evenodd,
}

fn parse_angle(text: &str) -> Result<f64, String> {
    match text.trim_end_matches("deg").trim().parse::<f64>() {
        Ok(degrees) if (0.0..=90.0).contains(&degrees) => Ok(degrees),
        _ => Err("expected an angle from 0 to 90 degrees".to_owned()),
    }
}

/// Sizes with decimal (kB, MB, GB) or binary (KiB, MiB, GiB) units.
fn parse_size(text: &str) -> Result<u64, String> {
    let refuse = || format!("expected a size such as 256MiB or 1GB, found {text:?}");
    let split = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let number: f64 = number.parse().map_err(|_| refuse())?;
    let factor = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kb" => 1e3,
        "m" | "mb" => 1e6,
        "g" | "gb" => 1e9,
        "t" | "tb" => 1e12,
        "kib" => 1024.0,
        "mib" => 1024.0_f64.powi(2),
        "gib" => 1024.0_f64.powi(3),
        "tib" => 1024.0_f64.powi(4),
        _ => return Err(refuse()),
    };
    Ok((number * factor) as u64)
}

impl RepairArguments {
    fn settings(&self) -> Settings {
        let depth = match (self.depth, self.tolerance) {
            (Some(depth), _) => Depth::Levels(depth),
            (None, tolerance) => Depth::Tolerance {
                length: tolerance.unwrap_or(Length::Percent(0.2)),
                max_depth: self.max_depth,
            },
        };
        let fill_rule = match self.fill_rule {
            FillRuleName::Solid => FillRule::Solid,
            FillRuleName::Evenodd => FillRule::Evenodd,
        };
        let (crease_deg, strict) = (self.crease, self.strict);
        Settings { depth, fill_rule, crease_deg, method: Method::Mdc, strict }
    }

    fn limits(&self) -> Limits {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        Limits {
            max_memory_bytes: self.max_memory,
            threads: self.threads.unwrap_or(processors),
            work_dir: self.work_dir.clone(),
            ..Limits::default()
        }
    }
}

/// Runs the command.
pub fn run(arguments: &RepairArguments, chatter: &Chatter) -> ExitCode {
    let Some(format) = format_of_extension(&arguments.output) else {
        let path = arguments.output.display();
        chatter.error(&Refused(format!("{path}: the extension names no format that is written")));
        return Exit::Usage.into();
    };
    let progress = Progress::new(*chatter);
    let settings = arguments.settings();
    let limits = arguments.limits();
    let (input, output) = (&arguments.input, &arguments.output);
    let result = repair(input, output, format, &settings, &limits, &progress);
    progress.clear();
    match result {
        Ok(mut outcome) => {
            outcome.stages = progress.stages();
            finish(arguments, &mut outcome, chatter)
        }
        Err(error) => fail(&error, chatter),
    }
}

fn fail(error: &RepairError, chatter: &Chatter) -> ExitCode {
    chatter.error(error);
    Exit::from(error).into()
}

/// Tells the outcome, draws the preview.
fn finish(arguments: &RepairArguments, outcome: &mut Outcome, chatter: &Chatter) -> ExitCode {
    let mut exit = Exit::Success;
    if let Some(path) = &arguments.preview
        && let Err(error) = draw(arguments, path)
    {
        chatter.error(&Refused(format!("{}: the preview failed: {error}", path.display())));
        exit = Exit::Unusable;
    }
    outcome.memory.peak_bytes = peak_resident_bytes();
    if arguments.json {
        let text = serde_json::to_string_pretty(outcome).expect("plain records serialise");
        // A reader that went away is no failure of the repair.
        let _ = writeln!(std::io::stdout(), "{text}");
    } else {
        chatter.say(&summary(outcome));
    }
    exit.into()
}

fn summary(outcome: &Outcome) -> String {
    let proof = &outcome.output.proof;
    let mut text = format!(
        "{}: {} triangles, {} components, depth {}, area {:.4} of the input's, volume {:.6}",
        on_one_line(&outcome.output.path.display().to_string()),
        proof.triangles,
        proof.components,
        outcome.grid.depth,
        outcome.output.area_ratio,
        proof.volume,
    );
    if outcome.verdict == Verdict::Review {
        for reason in &outcome.reasons {
            text.push_str("\n  look: ");
            text.push_str(reason);
        }
    }
    text
}

/// Draws input beside output; a sixth of the memory budget is for the bands.
fn draw(arguments: &RepairArguments, path: &Path) -> Result<(), String> {
    let scratch =
        Scratch::new(path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")));
    let share_bytes = arguments.max_memory / 6;
    let options = ReadOptions { share_bytes };
    let open = |path: &Path| -> Result<Box<dyn brickmend::mesh::MeshSource<Error = _>>, _> {
        let source = brickmend::io::open(path, &scratch, &options)?;
        Ok(source as Box<dyn brickmend::mesh::MeshSource<Error = _>>)
    };
    let input: &OpenSource<brickmend::io::IoError> = &|| open(&arguments.input);
    let output: &OpenSource<brickmend::io::IoError> = &|| open(&arguments.output);
    let options =
        PreviewOptions { share_bytes, edges: arguments.preview_edges, ..PreviewOptions::default() };
    write_preview(path, input, Some(output), &options, &Void)
        .map(|_| ())
        .map_err(|error| error.to_string())
}

/// A refusal of the command line's own.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Refused(String);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_decimal_or_binary_by_their_unit() {
        assert_eq!(parse_size("256MiB"), Ok(256 << 20));
        assert_eq!(parse_size("1GB"), Ok(1_000_000_000));
        assert_eq!(parse_size("1.5 GiB"), Ok(3 << 29));
        assert!(parse_size("many").is_err());
        assert!(parse_size("1 parsec").is_err());
    }
}
