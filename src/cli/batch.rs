//! `brickmend batch`: a folder of models, each in a process of its own.

use std::ffi::OsStr;
use std::io::Write;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use brickmend::catalogue::{
    BatchOptions, BatchReport, CatalogueError, Cause, Fleet, Pages, Retry, RunEnding, Selection,
    State, Summary, Wanted, run_batch,
};
use brickmend::io::Format;
use brickmend::repair::{Blame, Settings, TextureRule};
use brickmend::report::report_folder;
use brickmend::store::StoreError;
use clap::Args;
use jiff::ZonedDateTime;
use jiff::civil::Time;

use crate::cli::arguments::{FormatName, ResourceArguments, ResultArguments, parse_size};
use crate::cli::config::Config;
use crate::cli::exit_code::Exit;
use crate::cli::fleet::Terminal;
use crate::cli::progress::{Chatter, on_one_line};
use crate::cli::report;
use crate::cli::signals::Stop;
use crate::cli::time::{approximately, next_at, parse_clock, parse_time};

const EXIT_STATUS: &str = "\
Exit status:
  0    done: every model has a result
  2    usage, also a memory budget below the floor
  3    done, and some models failed: see brickmend status
  5    the folder of the results, scratch or the journal unusable, also a full disk: run again to go on
  6    another batch works on this folder of results
  7    stopped by --for, --until or --max-failures: run again to go on
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
    /// Only the models that this file lists, one path a line, within the folder.
    #[arg(long, value_name = "FILE", help_heading = "Models")]
    files_from: Option<PathBuf>,
    /// Do again what nothing changed about: failed, timeout, oom, review, degraded, all.
    #[arg(long, value_name = "LIST", value_delimiter = ',', help_heading = "Models")]
    retry: Vec<RetryName>,
    /// Read all models and results again to see whether they changed.
    #[arg(long, help_heading = "Models")]
    rehash: bool,
    #[command(flatten)]
    settings: BatchSettings,
    #[command(flatten)]
    result: ResultArguments,
    #[command(flatten)]
    resources: ResourceArguments,
    /// Tell what there is to do, and stop.
    #[arg(long, help_heading = "Report")]
    plan: bool,
    /// Print where the catalogue stands as JSON on stdout; see docs/journal.md.
    #[arg(long, help_heading = "Report")]
    json: bool,
}

/// What of a batch may be set once for all nights.
#[derive(Debug, Args)]
pub struct BatchSettings {
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
    /// Only models of this size and larger.
    #[arg(long, value_name = "SIZE", value_parser = parse_size, help_heading = "Models")]
    min_size: Option<u64>,
    /// Only models of this size and smaller.
    #[arg(long, value_name = "SIZE", value_parser = parse_size, help_heading = "Models")]
    max_size: Option<u64>,
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
    /// Stop at this time of the day, such as 06:00; the same command goes on.
    #[arg(long, value_name = "HH:MM", value_parser = parse_clock, help_heading = "Resources")]
    until: Option<Time>,
    /// What is drawn of each model that is done: small pictures before and after, a page.
    #[arg(long, value_enum, value_name = "WHAT", default_value_t = PagesName::All,
          help_heading = "Report")]
    pages: PagesName,
    /// Draw nothing: as --pages none.
    #[arg(long, conflicts_with = "pages", help_heading = "Report")]
    no_pages: bool,
}

impl BatchArguments {
    /// What is wanted of each model.
    pub fn wanted(&self) -> Wanted {
        Wanted {
            settings: settings_of(&self.result),
            format: self.settings.format.map(Format::from),
            only_broken: !self.settings.all,
        }
    }
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

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum PagesName {
    /// Pictures and a page of each model.
    All,
    /// Pictures.
    Thumbnails,
    /// Nothing; the page of the catalogue is written all the same.
    None,
}

impl From<PagesName> for Pages {
    fn from(name: PagesName) -> Self {
        match name {
            PagesName::All => Self::All,
            PagesName::Thumbnails => Self::Thumbnails,
            PagesName::None => Self::None,
        }
    }
}

/// Runs the command.
pub fn run(arguments: &BatchArguments, config: &Config, chatter: &Chatter) -> ExitCode {
    let stop = match Stop::listen() {
        Ok(stop) => stop,
        Err(error) => {
            chatter.error(&error);
            return Exit::Internal.into();
        }
    };
    let terminal = Terminal::new(*chatter, stop.clone());
    let report = batch(arguments, config, &terminal);
    terminal.clear();
    match report {
        Ok(batch) => {
            tell(&batch, arguments.json, chatter);
            let page = write_page(&batch, arguments, chatter);
            page.unwrap_or_else(|| exit_of(&batch, &stop)).into()
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

/// Writes the page of the catalogue; how the process ends where that fails.
fn write_page(batch: &BatchReport, arguments: &BatchArguments, chatter: &Chatter) -> Option<Exit> {
    batch.ending?;
    match report::write(&arguments.output, None) {
        Ok(path) => {
            chatter.say(&format!("report: {}", on_one_line(&path.display().to_string())));
            None
        }
        Err(error) => {
            chatter.error(&error);
            Some(Exit::from(error.blame()))
        }
    }
}

impl BatchSettings {
    /// When the batch stops: by the earlier of --for and --until.
    fn stop_at_ms(&self, now_ms: u64) -> Option<u64> {
        let after = self.time.map(|time| now_ms.saturating_add(time));
        let at = self.until.map(|time| next_at(&ZonedDateTime::now(), time));
        after.into_iter().chain(at).min()
    }
}

fn batch(
    arguments: &BatchArguments,
    config: &Config,
    fleet: &Terminal,
) -> Result<BatchReport, CatalogueError> {
    let limits = arguments.resources.limits();
    let program = std::env::current_exe()
        .map_err(|source| CatalogueError::Worker { program: PathBuf::new(), source })?;
    let all = arguments.wanted();
    let wanted = |relative: &Path| config.wanted(relative, all);
    let settings = &arguments.settings;
    let sizes = (settings.min_size.unwrap_or(0), settings.max_size.unwrap_or(u64::MAX));
    let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
    let options = BatchOptions {
        source: arguments.source.clone(),
        target: arguments.output.clone(),
        wanted: &wanted,
        selection: Selection::new(&settings.include, &settings.exclude, Some(sizes))?,
        listed: arguments.files_from.as_deref().map(read_list).transpose()?,
        max_memory_bytes: limits.max_memory_bytes,
        max_disk_bytes: settings.max_disk,
        jobs: settings.jobs.unwrap_or(limits.threads).max(1),
        threads: limits.threads,
        work_dir: limits.work_dir,
        model_timeout_ms: settings.model_timeout,
        max_failures: settings.max_failures,
        pages: if settings.no_pages { Pages::None } else { settings.pages.into() },
        report: report_folder(&arguments.output),
        stop_at_ms: settings.stop_at_ms(fleet.now_ms()),
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
        text.push_str(&format!("\n  {:7} {}{more}", count.models, count.state));
        let is_pending = count.state == State::Pending.name();
        // What is still to be done took no time yet.
        match (is_pending, summary.pending_seconds) {
            (false, _) => text.push_str(&format!(" ({:.1} s)", count.seconds)),
            (true, seconds) if seconds > 0.0 => {
                text.push_str(&format!(" (about {} on one worker)", approximately(seconds)));
            }
            (true, _) => {}
        }
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

/// The settings of a batch: its results stand on their own, with copies of their images.
fn settings_of(arguments: &ResultArguments) -> Settings {
    let settings = arguments.settings();
    match arguments.textures {
        None => Settings { textures: TextureRule::Copy, ..settings },
        Some(_) => settings,
    }
}
