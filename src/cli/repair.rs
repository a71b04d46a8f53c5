//! `brickmend repair`: one model, from file to file, or to one file per level of detail.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use brickmend::catalogue::{Copied, CopyRequest, copy_if_sound};
use brickmend::io::{Format, format_of_extension};
use brickmend::repair::{
    Levels, Limits, Outcome, PartsOutcome, PartsRule, RepairError, SCHEMA_VERSION, Settings,
    Verdict, repair, repair_levels, repair_parts,
};
use brickmend::report::{LayersError, Views};
use clap::Args;

use crate::cli::arguments::{ResourceArguments, ResultArguments, parse_size};
use crate::cli::exit_code::{EXIT_STATUS, Exit};
use crate::cli::layers::{LayerArguments, Wanted, lines};
use crate::cli::memory::peak_resident_bytes;
use crate::cli::pictures::{DrawOptions, Pictured, draw_preview, write_page};
use crate::cli::progress::{Chatter, Progress, on_one_line};
use crate::cli::signals::Stop;

/// Arguments of `brickmend repair`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub struct RepairArguments {
    /// The model: OBJ, STL, PLY, OFF, 3MF or glTF, told by content.
    input: PathBuf,
    /// Where the repaired model goes; its extension is its format.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    result: ResultArguments,
    /// Copy a model with which nothing is wrong byte for byte, with the files that it names, if it is
    /// of the format of the output.
    #[arg(long, conflicts_with = "lod", help_heading = "Result")]
    only_broken: bool,
    /// Levels of detail: one file for each of these values of --decimate, such as
    /// 0,0.1,0.5,2cells, from one run; for -o out.ply they are out.0cells.ply, out.0.1cells.ply and
    /// so on.
    #[arg(long, value_name = "LENGTHS", help_heading = "Result",
          conflicts_with_all = ["decimate", "max_triangles", "preview", "report", "export"])]
    lod: Option<Levels>,
    #[command(flatten)]
    resources: ResourceArguments,
    /// Most that scratch files and the output may take of the disk, such as 20GB [default: no
    /// limit].
    #[arg(long, value_name = "SIZE", value_parser = parse_size, help_heading = "Resources")]
    max_disk: Option<u64>,
    /// Start anew, whatever an earlier run of the same work left.
    #[arg(long, help_heading = "Resources")]
    fresh: bool,
    /// Print the outcome as JSON on stdout, with --lod a list of them, with --parts separate those of
    /// the parts and of the whole; see docs/outcome.md and docs/parts.md.
    #[arg(long, help_heading = "Report")]
    json: bool,
    /// Draw input, output and a map of deviations into a PNG file, or layers of numbers into an EXR
    /// file; see docs/preview.md.
    #[arg(long, value_name = "FILE", help_heading = "Report")]
    preview: Option<PathBuf>,
    /// Write a page of the model: verdict, what was found and done, before and after, and how far the
    /// output lies from the input.
    #[arg(long, value_name = "FILE.html", help_heading = "Report")]
    report: Option<PathBuf>,
    /// From how many sides the picture shows the model: 6 along the axes, or 8 more from the corners of
    /// a cube [default: 6 in an EXR file, one from the front, the right and above in a PNG file].
    #[arg(long, value_name = "6|14", requires = "preview", value_parser = ["6", "14"],
          help_heading = "Report")]
    preview_views: Option<String>,
    /// Draw the edges of the triangles as well.
    #[arg(long, requires = "preview", help_heading = "Report")]
    preview_edges: bool,
    #[command(flatten)]
    layers: LayerArguments,
}

/// Runs the command.
pub fn run(arguments: &RepairArguments, chatter: &Chatter) -> ExitCode {
    let Some(format) = format_of_extension(&arguments.output) else {
        let path = arguments.output.display();
        chatter.error(&Refused(format!("{path}: the extension names no format that is written")));
        return Exit::Usage.into();
    };
    let stop = match Stop::listen() {
        Ok(stop) => stop,
        Err(error) => {
            chatter.error(&error);
            return Exit::Internal.into();
        }
    };
    let progress = Progress::new(*chatter, stop.clone());
    let settings = arguments.result.settings();
    let limits = Limits {
        max_disk_bytes: arguments.max_disk,
        fresh: arguments.fresh,
        ..arguments.resources.limits()
    };
    let (input, output) = (&arguments.input, &arguments.output);
    let wanted = Wanted {
        arguments: &arguments.layers,
        input,
        output,
        settings: &settings,
        limits: &limits,
        monitor: &progress,
    };
    if arguments.layers.export.is_some() && settings.parts == PartsRule::Separate {
        return fail(&RepairError::OnlyAsUnion { option: "--export" }, &stop, chatter);
    }
    if let Err(error) = wanted.prepare() {
        return fail_layers(&error, &stop, chatter).into();
    }
    if arguments.only_broken {
        let copied = copy(arguments, &limits, &progress);
        progress.clear();
        match copied {
            Ok(Copied::Done(files)) => {
                let cleared = wanted.clear().map_err(|error| fail_layers(&error, &stop, chatter));
                return finish_copy(arguments, files, cleared.err(), chatter);
            }
            Ok(Copied::Not(Some(reason))) => chatter.say(&on_one_line(&reason)),
            Ok(_) => {}
            Err(error) => return fail(&error, &stop, chatter),
        }
    }
    if settings.parts == PartsRule::Separate {
        return run_parts(arguments, (format, &settings, &limits), &progress, (&stop, chatter));
    }
    let result = match &arguments.lod {
        Some(Levels(levels)) => {
            repair_levels(input, output, format, &settings, levels, &limits, &progress)
        }
        None => repair(input, output, format, &settings, &limits, &progress).map(|one| vec![one]),
    };
    progress.clear();
    match result {
        Ok(mut outcomes) => {
            for outcome in &mut outcomes {
                outcome.stages = progress.stages();
            }
            let written = outcomes.iter_mut().try_for_each(|outcome| wanted.write(outcome));
            progress.clear();
            let failed = written.err().map(|error| fail_layers(&error, &stop, chatter));
            finish(arguments, &mut outcomes, failed, chatter)
        }
        Err(error) => fail(&error, &stop, chatter),
    }
}

/// Copies the model if nothing is wrong with it.
fn copy(
    arguments: &RepairArguments,
    limits: &Limits,
    progress: &Progress,
) -> Result<Copied, RepairError> {
    let (input, output) = (&*arguments.input, &*arguments.output);
    let real = |path: &Path| path.canonicalize().ok();
    // The repair refuses to write over its input.
    if real(input).is_some() && real(input) == real(output) {
        return Ok(Copied::NotSound);
    }
    let request = CopyRequest { input, output: Some(output), limits, is_one_of_many: false };
    copy_if_sound(&request, progress)
}

/// What is told of a copy; see docs/outcome.md.
#[derive(serde::Serialize)]
struct CopyOutcome {
    schema: u32,
    version: &'static str,
    copied: bool,
    files: Vec<String>,
}

/// Tells that the model was copied, draws the preview; `failed` is how the process ends otherwise.
fn finish_copy(
    arguments: &RepairArguments,
    files: Vec<PathBuf>,
    failed: Option<Exit>,
    chatter: &Chatter,
) -> ExitCode {
    let drawn = drawn(arguments, None, chatter);
    let mut exit = drawn.or(failed).unwrap_or(Exit::Success);
    if let Some(path) = &arguments.report
        && let Err(error) = write_page(path, &pictured(arguments, None))
    {
        chatter.error(&error);
        exit = Exit::from(error.blame());
    }
    if arguments.json {
        let version = env!("CARGO_PKG_VERSION");
        let files = files.iter().map(|path| path.display().to_string()).collect();
        let told = CopyOutcome { schema: SCHEMA_VERSION, version, copied: true, files };
        let text = serde_json::to_string_pretty(&told).expect("plain records serialise");
        // A reader that went away is no failure of the copy.
        let _ = writeln!(std::io::stdout(), "{text}");
    } else {
        let output = on_one_line(&arguments.output.display().to_string());
        let more = match files.len() {
            0 | 1 => String::new(),
            count => format!(", with {} files that it names", count - 1),
        };
        chatter.say(&format!("{output}: copied, since nothing is wrong with it{more}"));
    }
    exit.into()
}

/// Repairs the parts of a model, each for itself. Their outcomes are printed as they come.
fn run_parts(
    arguments: &RepairArguments,
    (format, settings, limits): (Format, &Settings, &Limits),
    progress: &Progress,
    (stop, chatter): (&Stop, &Chatter),
) -> ExitCode {
    if arguments.lod.is_some() {
        let error = RepairError::OnlyAsUnion { option: "--lod" };
        return fail(&error, stop, chatter);
    }
    if arguments.report.is_some() {
        let error = RepairError::OnlyAsUnion { option: "--report" };
        return fail(&error, stop, chatter);
    }
    let (input, output) = (&arguments.input, &arguments.output);
    let mut told = Told { is_json: arguments.json, ..Told::default() };
    let mut deliver = |outcome: Outcome| told.part(&outcome);
    let result = repair_parts(input, output, format, settings, limits, progress, &mut deliver);
    progress.clear();
    let mut whole = match result {
        Ok(whole) => whole,
        Err(error) => return fail(&error, stop, chatter),
    };
    let exit = if whole.verdict == Verdict::Fail { Exit::NoResult } else { Exit::Success };
    let exit = drawn(arguments, None, chatter).unwrap_or(exit);
    whole.stages = progress.stages();
    whole.peak_bytes = peak_resident_bytes();
    if arguments.json {
        told.whole(&whole);
    } else {
        chatter.say(&summary_of_parts(&whole, &told.reviews));
    }
    exit.into()
}

/// What was told of parts so far.
#[derive(Default)]
struct Told {
    is_json: bool,
    parts: u64,
    /// Names and reasons of the first parts to look at.
    reviews: Vec<String>,
}

impl Told {
    fn part(&mut self, outcome: &Outcome) {
        if self.is_json {
            let text = serde_json::to_string(outcome).expect("plain records serialise");
            let front = if self.parts == 0 { "{\"parts\": [\n" } else { ",\n" };
            // A reader that went away is no failure of the repair.
            let _ = write!(std::io::stdout(), "{front}{text}");
        } else if let (Some(part), Verdict::Review | Verdict::Fail) =
            (&outcome.part, outcome.verdict)
            && self.reviews.len() < MOST_REVIEWS
        {
            let reasons = outcome.reasons.join("; ");
            self.reviews.push(format!("{}: {reasons}", on_one_line(&part.name)));
        }
        self.parts += 1;
    }

    fn whole(&self, whole: &PartsOutcome) {
        let text = serde_json::to_string_pretty(whole).expect("plain records serialise");
        let _ = writeln!(std::io::stdout(), "\n], \"whole\": {text}}}");
    }
}

/// The most parts whose reasons are told as text.
const MOST_REVIEWS: usize = 8;

fn summary_of_parts(whole: &PartsOutcome, reviews: &[String]) -> String {
    let mut text = format!(
        "{}: {} parts in {} places, {} triangles; {} to look at, {} left out",
        on_one_line(&whole.output.display().to_string()),
        whole.parts,
        whole.places,
        whole.triangles,
        whole.to_review,
        whole.empty_parts + whole.hidden_places,
    );
    for part in &whole.left_out {
        text.push_str(&format!("\n  left out: {}: {}", on_one_line(&part.name), part.reason));
    }
    for review in reviews {
        text.push_str("\n  look: ");
        text.push_str(review);
    }
    text
}

fn fail(error: &RepairError, stop: &Stop, chatter: &Chatter) -> ExitCode {
    chatter.error(error);
    match Exit::from(error) {
        Exit::Interrupted => stop.exit().into(),
        exit => exit.into(),
    }
}

/// How the process ends where layers failed.
fn fail_layers(error: &LayersError, stop: &Stop, chatter: &Chatter) -> Exit {
    chatter.error(error);
    match Exit::from(error.blame()) {
        Exit::Interrupted => stop.exit(),
        exit => exit,
    }
}

/// Tells the outcomes, draws the preview; `failed` is how the process ends otherwise.
fn finish(
    arguments: &RepairArguments,
    outcomes: &mut [Outcome],
    failed: Option<Exit>,
    chatter: &Chatter,
) -> ExitCode {
    let sound = outcomes.iter().all(|outcome| outcome.verdict != Verdict::Fail);
    let exit = if sound { Exit::Success } else { Exit::NoResult };
    let exit = failed.unwrap_or(exit);
    let mut exit = drawn(arguments, outcomes.first(), chatter).unwrap_or(exit);
    for outcome in outcomes.iter_mut() {
        outcome.memory.peak_bytes = peak_resident_bytes();
    }
    if let Some(path) = &arguments.report
        && let [outcome] = &*outcomes
        && let Err(error) = write_page(path, &pictured(arguments, Some(outcome)))
    {
        chatter.error(&error);
        exit = Exit::from(error.blame());
    }
    if arguments.json {
        let text = match &*outcomes {
            [outcome] if arguments.lod.is_none() => serde_json::to_string_pretty(outcome),
            outcomes => serde_json::to_string_pretty(outcomes),
        };
        let text = text.expect("plain records serialise");
        // A reader that went away is no failure of the repair.
        let _ = writeln!(std::io::stdout(), "{text}");
    } else {
        outcomes.iter().for_each(|outcome| chatter.say(&summary(outcome)));
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
    if let Some(caveat) = &outcome.output.caveat {
        text.push_str("\n  note: ");
        text.push_str(caveat);
    }
    text.push_str(&outcome.exports.as_ref().map_or(String::new(), lines));
    if outcome.verdict != Verdict::Pass {
        for reason in &outcome.reasons {
            text.push_str("\n  look: ");
            text.push_str(reason);
        }
    }
    text
}

/// Draws the preview, if one is wanted; how the process ends where that fails.
fn drawn(
    arguments: &RepairArguments,
    outcome: Option<&Outcome>,
    chatter: &Chatter,
) -> Option<Exit> {
    let path = arguments.preview.as_ref()?;
    let options = DrawOptions {
        has_edges: arguments.preview_edges,
        views: arguments.preview_views.as_deref().map(|views| match views {
            "14" => Views::Fourteen,
            _ => Views::Six,
        }),
    };
    let error = draw_preview(path, &pictured(arguments, outcome), &options).err()?;
    chatter.error(&Refused(format!("{}: the preview failed: {error}", path.display())));
    Some(Exit::Unusable)
}

fn pictured<'a>(arguments: &'a RepairArguments, outcome: Option<&'a Outcome>) -> Pictured<'a> {
    let settings = arguments.result.settings();
    Pictured {
        input: &arguments.input,
        output: &arguments.output,
        outcome,
        limits: arguments.resources.limits(),
        share_bytes: arguments.resources.max_memory / 6,
        is_measured: settings.deviation,
        tags_patches: settings.tag_patches,
    }
}

/// A refusal of the command line's own.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Refused(String);
