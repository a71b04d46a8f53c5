//! `brickmend batch`: a folder of models, each in a process of its own.

use std::ffi::OsStr;
use std::io::Write;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use brickmend::catalogue::{
    BatchOptions, BatchReport, CatalogueError, Cause, Fleet, Retry, RunEnding, Selection, Summary,
    Wanted, run_batch,
};
use brickmend::io::Format;
use brickmend::repair::{Blame, Settings, TextureRule};
use brickmend::store::StoreError;
use clap::Args;

use crate::cli::arguments::{FormatName, ResourceArguments, ResultArguments, parse_size};
use crate::cli::exit_code::Exit;
use crate::cli::fleet::Terminal;
use crate::cli::progress::{Chatter, on_one_line};
use crate::cli::signals::Stop;

const EXIT_STATUS: &str = "\
Exit status:
  0    done: every model has a result
  2    usage, also a memory budget below the floor
  3    done, and some models failed: see brickmend status
  5    the folder of the results, scratch or the journal unusable, also a full disk: run again to go on
  6    another batch works on this folder of results
  7    stopped by --for or --max-failures: run again to go on
  130  interrupted (SIGINT), state saved: run again to go on
  143  asked to end (SIGTERM), state saved: run again to go on";

/// Arguments of `brickmend batch`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub struct BatchArguments {
    /// Folder of the models; nothing in it is changed.
    source: PathBuf,
    /// Folder of the results, a tree like that of the models. The journal is in its .brickmend.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Format of all results [default: that of each model].
    #[arg(long, value_enum)]
    format: Option<FormatName>,
    /// Repair sound models too, which are copied otherwise.
    #[arg(long)]
    all: bool,
    /// Only models whose path or name fits this pattern; may be given several times.
    #[arg(long, value_name = "PATTERN", help_heading = "Models")]
    include: Vec<String>,
    /// No models whose path or name fits this pattern; may be given several times.
    #[arg(long, value_name = "PATTERN", help_heading = "Models")]
    exclude: Vec<String>,
    /// Only the models that this file lists, one path a line, within the folder.
    #[arg(long, value_name = "FILE", help_heading = "Models")]
    files_from: Option<PathBuf>,
    /// Only models of this size and larger.
    #[arg(long, value_name = "SIZE", value_parser = parse_size, help_heading = "Models")]
    min_size: Option<u64>,
    /// Only models of this size and smaller.
    #[arg(long, value_name = "SIZE", value_parser = parse_size, help_heading = "Models")]
    max_size: Option<u64>,
    /// Do again what nothing changed about: failed, timeout, oom, review, degraded, all.
    #[arg(long, value_name = "LIST", value_delimiter = ',', help_heading = "Models")]
    retry: Vec<RetryName>,
    /// Read all models and results again to see whether they changed.
    #[arg(long, help_heading = "Models")]
    rehash: bool,
    #[command(flatten)]
    result: ResultArguments,
    #[command(flatten)]
    resources: ResourceArguments,
    /// Models at one time [default: one per thread].
    #[arg(long, value_name = "N", help_heading = "Resources")]
    jobs: Option<usize>,
    /// Most that scratch files and the output of one model may take of the disk.
    #[arg(long, value_name = "SIZE", value_parser = parse_size, help_heading = "Resources")]
    max_disk: Option<u64>,
    /// Time for one attempt at one model, such as 90s, 10m or 2h; then it is tried with all memory,
    /// then on a coarser grid.
    #[arg(long, value_name = "TIME", value_parser = parse_time, help_heading = "Resources")]
    model_timeout: Option<u64>,
    /// Stop when more models than this have failed.
    #[arg(long, value_name = "N", help_heading = "Resources")]
    max_failures: Option<u64>,
    /// Stop after this time, such as 4h; the same command goes on.
    #[arg(long = "for", value_name = "TIME", value_parser = parse_time, help_heading = "Resources")]
    time: Option<u64>,
    /// Tell what there is to do, and stop.
    #[arg(long, help_heading = "Report")]
    plan: bool,
    /// Print where the catalogue stands as JSON on stdout; see docs/journal.md.
    #[arg(long, help_heading = "Report")]
    json: bool,
}

/// What is done again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum RetryName {
    Failed,
    Timeout,
    Oom,
    Review,
    Degraded,
    All,
}

/// Runs the command.
pub fn run(arguments: &BatchArguments, chatter: &Chatter) -> ExitCode {
    let stop = match Stop::listen() {
        Ok(stop) => stop,
        Err(error) => {
            chatter.error(&error);
            return Exit::Internal.into();
        }
    };
    let terminal = Terminal::new(*chatter, stop.clone());
    let report = batch(arguments, &terminal);
    terminal.clear();
    match report {
        Ok(report) => {
            tell(&report, arguments.json, chatter);
            exit_of(&report, &stop).into()
        }
        Err(error) => {
            chatter.error(&error);
            match error.blame() {
                Blame::Interrupted => stop.exit().into(),
                blame => Exit::from(blame).into(),
            }
        }
    }
}

fn batch(arguments: &BatchArguments, fleet: &Terminal) -> Result<BatchReport, CatalogueError> {
    let limits = arguments.resources.limits();
    let program = std::env::current_exe()
        .map_err(|source| CatalogueError::Worker { program: PathBuf::new(), source })?;
    let wanted = Wanted {
        settings: settings_of(&arguments.result),
        format: arguments.format.map(Format::from),
        only_broken: !arguments.all,
    };
    let sizes = (arguments.min_size.unwrap_or(0), arguments.max_size.unwrap_or(u64::MAX));
    let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
    let options = BatchOptions {
        source: arguments.source.clone(),
        target: arguments.output.clone(),
        wanted: &|_| wanted,
        selection: Selection::new(&arguments.include, &arguments.exclude, Some(sizes))?,
        listed: arguments.files_from.as_deref().map(read_list).transpose()?,
        max_memory_bytes: limits.max_memory_bytes,
        max_disk_bytes: arguments.max_disk,
        jobs: arguments.jobs.unwrap_or(limits.threads).max(1),
        threads: limits.threads,
        work_dir: limits.work_dir,
        model_timeout_ms: arguments.model_timeout,
        max_failures: arguments.max_failures,
        stop_at_ms: arguments.time.map(|time| fleet.now_ms().saturating_add(time)),
        retry: retry(&arguments.retry),
        rehash: arguments.rehash,
        only_plan: arguments.plan,
        program,
        command: words.collect::<Vec<_>>().join(" "),
    };
    run_batch(&options, fleet)
}

/// The paths in a file, one a line, whatever bytes they have.
fn read_list(path: &Path) -> Result<Vec<PathBuf>, CatalogueError> {
    let bytes = std::fs::read(path).map_err(|e| StoreError::io("read the list", path, e))?;
    let lines =
        bytes.split(|&byte| byte == b'\n').map(|line| line.strip_suffix(b"\r").unwrap_or(line));
    Ok(lines.filter(|line| !line.is_empty()).map(|line| OsStr::from_bytes(line).into()).collect())
}

fn retry(names: &[RetryName]) -> Retry {
    let has = |name| names.contains(&name);
    let causes = [(RetryName::Timeout, Cause::Timeout), (RetryName::Oom, Cause::Memory)];
    Retry {
        all: has(RetryName::All),
        review: has(RetryName::Review),
        degraded: has(RetryName::Degraded),
        failed: has(RetryName::Failed),
        causes: causes.iter().filter(|(name, _)| has(*name)).map(|(_, cause)| *cause).collect(),
    }
}

fn exit_of(report: &BatchReport, stop: &Stop) -> Exit {
    match report.ending {
        Some(RunEnding::Stopped) => Exit::Stopped,
        Some(RunEnding::Interrupted) => stop.exit(),
        Some(RunEnding::DiskFull) => Exit::Unusable,
        Some(RunEnding::Done) if report.without_results > 0 => Exit::SomeFailed,
        Some(RunEnding::Done) | None => Exit::Success,
    }
}

fn tell(report: &BatchReport, json: bool, chatter: &Chatter) {
    if json {
        let text = serde_json::to_string_pretty(&report.summary).expect("plain records serialise");
        // A reader that went away is no failure of the batch.
        let _ = writeln!(std::io::stdout(), "{text}");
    } else {
        chatter.say(&text_of(&report.summary));
    }
}

/// Where a catalogue stands, for people.
pub fn text_of(summary: &Summary) -> String {
    let mut text = format!("{} models in the last run", summary.found);
    for count in &summary.states {
        let more = count.verdict.iter().chain(&count.cause).map(|word| format!(", {word}"));
        let more: String = more.collect();
        text.push_str(&format!(
            "\n  {:7} {}{more} ({:.1} s)",
            count.models, count.state, count.seconds
        ));
    }
    for work in &summary.under_way {
        text.push_str(&format!("\n  at work: {} ({})", on_one_line(&work.name), work.rung));
    }
    for failure in &summary.failures {
        let (name, reason) = (on_one_line(&failure.name), on_one_line(&failure.reason));
        text.push_str(&format!("\n  failed: {name}: {}: {reason}", failure.cause));
    }
    text
}

/// Milliseconds of a time such as 90s, 10m or 2h.
fn parse_time(text: &str) -> Result<u64, String> {
    let refuse = || format!("expected a time such as 90s, 10m or 2h, found {text:?}");
    let split = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let number: f64 = number.parse().map_err(|_| refuse())?;
    let seconds = match unit.trim() {
        "ms" => 0.001,
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        "d" => 86400.0,
        _ => return Err(refuse()),
    };
    Ok((number * seconds * 1000.0) as u64)
}

/// The settings of a batch: its results stand on their own, with copies of their images.
fn settings_of(arguments: &ResultArguments) -> Settings {
    let settings = arguments.settings();
    match arguments.textures {
        None => Settings { textures: TextureRule::Copy, ..settings },
        Some(_) => settings,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        assert_eq!(parse_time("90s"), Ok(90_000));
        assert_eq!(parse_time("1.5h"), Ok(5_400_000));
        assert!(parse_time("soon").is_err());
    }
}
