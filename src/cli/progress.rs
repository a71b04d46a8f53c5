//! The terminal: progress by work done, notes, and the seconds of every stage.
//!
//! Bars appear on a terminal only; elsewhere one line a minute.

use std::collections::BTreeMap;
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use brickmend::monitor::{Monitor, Stage};
use brickmend::repair::StageReport;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::signals::Stop;
use crate::cli::stage_clock::StageClock;

/// Off a terminal, progress is told this often.
pub const LINE_INTERVAL: Duration = Duration::from_secs(60);

/// How much is said, and where.
#[derive(Clone, Copy, Debug)]
pub struct Chatter {
    quiet: bool,
    verbose: u8,
    bars: bool,
}

impl Chatter {
    pub fn new(quiet: bool, verbose: u8) -> Self {
        Self { quiet, verbose, bars: !quiet && std::io::stderr().is_terminal() }
    }

    /// Whether only errors are told.
    pub fn is_quiet(self) -> bool {
        self.quiet
    }

    /// Whether more than usual is told.
    pub fn is_verbose(self) -> bool {
        self.verbose > 0
    }

    /// Whether bars are drawn.
    pub fn has_bars(self) -> bool {
        self.bars
    }

    /// Says `text` unless told to be quiet.
    pub fn say(self, text: &str) {
        if !self.quiet {
            write_line(text);
        }
    }

    /// Says `text` when told to be verbose.
    pub fn detail(self, text: &str) {
        if self.verbose > 0 {
            write_line(text);
        }
    }

    /// Says what went wrong, always: cause after cause in one line.
    pub fn error(self, error: &dyn std::error::Error) {
        let mut text = format!("brickmend: {error}");
        let mut source = error.source();
        while let Some(cause) = source {
            text.push_str(&format!(": {cause}"));
            source = cause.source();
        }
        write_line(&on_one_line(&text));
    }
}

/// `text` on one line, whatever names of files it holds: what would break the line or turn the
/// terminal around is shown as an escape.
pub fn on_one_line(text: &str) -> String {
    let breaks = |c: char| {
        c.is_control()
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    let mut line = String::with_capacity(text.len());
    for c in text.chars() {
        if breaks(c) { line.extend(c.escape_default()) } else { line.push(c) }
    }
    line
}

/// A closed stderr is no reason to stop working.
fn write_line(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// A monitor that draws on the terminal.
pub struct Progress {
    chatter: Chatter,
    stop: Stop,
    state: Mutex<State>,
}

struct State {
    bar: ProgressBar,
    clock: StageClock,
    last_line: Instant,
}

impl Progress {
    pub fn new(chatter: Chatter, stop: Stop) -> Self {
        let target =
            if chatter.bars { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(0), target);
        let style = ProgressStyle::with_template("{msg:8} [{bar:30}] {percent:>3} % {elapsed}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let state = State { bar, clock: StageClock::default(), last_line: Instant::now() };
        Self { chatter, stop, state: Mutex::new(state) }
    }

    /// Seconds of every stage so far.
    pub fn stages(&self) -> BTreeMap<Stage, StageReport> {
        self.state().clock.reports()
    }

    /// Takes the bar off the terminal.
    pub fn clear(&self) {
        self.state().bar.finish_and_clear();
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Monitor for Progress {
    fn begin(&self, stage: Stage, total: u64) {
        let mut state = self.state();
        state.clock.begin(stage, total);
        state.bar.set_length(total);
        state.bar.set_position(0);
        state.bar.set_message(stage.name());
    }

    fn advance(&self, done: u64) {
        let mut state = self.state();
        state.clock.advance(done);
        state.bar.set_position(state.clock.done());
        if !self.chatter.bars && state.last_line.elapsed() >= LINE_INTERVAL {
            state.last_line = Instant::now();
            if let Some((stage, share)) = state.clock.share() {
                self.chatter.say(&format!("{}: {:.0} %", stage.name(), (100.0 * share).floor()));
            }
        }
    }

    fn end(&self, stage: Stage) {
        let mut state = self.state();
        if let Some(seconds) = state.clock.end(stage) {
            self.chatter.detail(&format!("{}: {seconds:.3} s", stage.name()));
        }
    }

    fn checkpoint(&self, step: &str, items: u64) {
        let state = self.state();
        let text = if items == 0 {
            format!("checkpoint: {step}")
        } else {
            format!("checkpoint: {step}, {items} done")
        };
        state.bar.suspend(|| self.chatter.detail(&text));
    }

    fn note(&self, text: &str) {
        let state = self.state();
        state.bar.suspend(|| self.chatter.detail(text));
    }

    fn cancelled(&self) -> bool {
        self.stop.is_asked()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_a_line_or_turn_the_terminal_around() {
        let line = on_one_line("a\nb\r\x1b[31m\u{202e}c\u{2028}d é\\ \"x\"");
        assert_eq!(line, "a\\nb\\r\\u{1b}[31m\\u{202e}c\\u{2028}d é\\ \"x\"");
    }
}
