//! A batch on the terminal: one bar for all models, one line for each worker.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use brickmend::catalogue::{Ahead, Ended, Fleet, State};
use brickmend::monitor::Stage;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::memory::resident_bytes;
use crate::cli::progress::{Chatter, LINE_INTERVAL, on_one_line};
use crate::cli::signals::Stop;
use crate::cli::time::approximately;

/// Of a longer name of a model the end is shown.
const LONGEST_NAME: usize = 48;

/// A fleet that draws on the terminal.
pub struct Terminal {
    chatter: Chatter,
    stop: Stop,
    bars: MultiProgress,
    state: Mutex<Drawn>,
}

struct Drawn {
    all: ProgressBar,
    workers: Vec<Line>,
    counts: Counts,
    last_line: Instant,
}

/// What a worker does.
struct Line {
    bar: ProgressBar,
    model: String,
    /// Where it is, and the memory that it takes.
    at: Option<(Stage, f64)>,
    resident_bytes: u64,
}

/// How the models of this run ended so far.
#[derive(Default)]
struct Counts {
    failed: u64,
    left_seconds: Option<f64>,
}

impl Line {
    /// The facts first, in columns; of a long name the end, which tells models apart.
    fn draw(&self) {
        if self.model.is_empty() {
            return self.bar.set_message("idle");
        }
        let (stage, share) = match self.at {
            Some((stage, share)) => (stage.name(), format!("{:.0} %", 100.0 * share)),
            None => ("starts", String::new()),
        };
        let memory = match self.resident_bytes {
            0 => String::new(),
            bytes => format!("{} MiB", bytes >> 20),
        };
        let name = end_of(&self.model, LONGEST_NAME);
        self.bar.set_message(format!("{stage:<8} {share:>5} {memory:>10}  {name}"));
    }
}

impl Drawn {
    fn draw_all(&self) {
        let mut words = Vec::new();
        if self.counts.failed > 0 {
            words.push(format!("{} failed", self.counts.failed));
        }
        words.extend(
            self.counts.left_seconds.map(|left| format!("about {} to go", approximately(left))),
        );
        let bytes: u64 = self.workers.iter().map(|line| line.resident_bytes).sum();
        if bytes > 0 {
            let all_bytes = bytes + resident_bytes().unwrap_or(0);
            words.push(format!("{} MiB", all_bytes >> 20));
        }
        self.all.set_message(words.join(", "));
    }
}

/// The end of a name, of so many characters at most.
fn end_of(name: &str, most: usize) -> String {
    let surplus = name.chars().count().saturating_sub(most);
    if surplus == 0 {
        return name.to_owned();
    }
    let end: String = name.chars().skip(surplus + 1).collect();
    format!("\u{2026}{end}")
}

impl Terminal {
    pub fn new(chatter: Chatter, stop: Stop) -> Self {
        let target = if chatter.has_bars() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let bars = MultiProgress::with_draw_target(target);
        let all = bars.add(ProgressBar::new(0));
        let style =
            ProgressStyle::with_template("{pos}/{len} models [{bar:24}] {elapsed}, {wide_msg}");
        all.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let state = Drawn {
            all,
            workers: Vec::new(),
            counts: Counts::default(),
            last_line: Instant::now(),
        };
        Self { chatter, stop, bars, state: Mutex::new(state) }
    }

    /// Takes the bars off the terminal.
    pub fn clear(&self) {
        let state = self.state();
        state.workers.iter().for_each(|line| line.bar.finish_and_clear());
        state.all.finish_and_clear();
    }

    fn state(&self) -> MutexGuard<'_, Drawn> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn worker<'d>(&self, state: &'d mut Drawn, slot: usize) -> &'d mut Line {
        while state.workers.len() <= slot {
            let bar = self.bars.add(ProgressBar::new_spinner());
            let style = ProgressStyle::with_template("  {elapsed:>5} {wide_msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
            let line = Line { bar, model: String::new(), at: None, resident_bytes: 0 };
            state.workers.push(line);
        }
        &mut state.workers[slot]
    }
}

impl Fleet for Terminal {
    fn now_ms(&self) -> u64 {
        SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_millis() as u64)
    }

    fn cancelled(&self) -> bool {
        self.stop.is_asked()
    }

    fn looking(&self, done: u64, total: u64) {
        let state = self.state();
        state.all.set_length(total);
        state.all.set_position(done);
        state.all.set_message("looked at");
    }

    fn ahead(&self, ahead: &Ahead) {
        let state = self.state();
        state.all.set_length(ahead.found);
        state.all.set_position(ahead.settled);
        state.all.set_message("");
        let seconds = approximately(ahead.seconds);
        let mut text =
            format!("{} models: {} to do, about {seconds} of work", ahead.found, ahead.pending);
        for (reason, count) in &ahead.passed.counts {
            text.push_str(&format!("; {count} files {}", reason.noun()));
        }
        state.all.suspend(|| self.chatter.say(&text));
    }

    fn started(&self, slot: usize, model: &str) {
        let mut state = self.state();
        let line = self.worker(&mut state, slot);
        (line.model, line.at, line.resident_bytes) = (on_one_line(model), None, 0);
        line.bar.reset_elapsed();
        line.draw();
    }

    fn working(&self, slot: usize, stage: Stage, share: f64, resident_bytes: Option<u64>) {
        let mut state = self.state();
        let line = self.worker(&mut state, slot);
        (line.at, line.resident_bytes) = (Some((stage, share)), resident_bytes.unwrap_or(0));
        line.draw();
        state.draw_all();
    }

    fn ended(&self, slot: usize, ended: &Ended) {
        let mut state = self.state();
        let line = self.worker(&mut state, slot);
        (line.model, line.at, line.resident_bytes) = (String::new(), None, 0);
        line.bar.reset_elapsed();
        line.draw();
        if ended.state != State::Pending {
            state.all.inc(1);
        }
        state.counts.failed += u64::from(ended.state == State::Failed);
        state.counts.left_seconds = Some(ended.left_seconds);
        state.draw_all();
        let name = on_one_line(ended.model);
        if let (Some(cause), reason) = (ended.cause, ended.reason.unwrap_or_default()) {
            let text = format!("{name}: {}: {}", cause.name(), on_one_line(reason));
            state.all.suspend(|| self.chatter.say(&text));
        } else {
            let text = format!("{name}: {}, {:.2} s", ended.state.name(), ended.seconds);
            state.all.suspend(|| self.chatter.detail(&text));
        }
        if !self.chatter.has_bars() && state.last_line.elapsed() >= LINE_INTERVAL {
            state.last_line = Instant::now();
            let (done, all) = (state.all.position(), state.all.length().unwrap_or(0));
            let left = approximately(ended.left_seconds);
            let text = format!("{done} of {all} models, about {left} to go");
            self.chatter.say(&text);
        }
    }

    fn note(&self, text: &str) {
        self.state().all.suspend(|| self.chatter.say(text));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_long_names_the_end_is_shown() {
        assert_eq!(end_of("a/é.obj", 7), "a/é.obj");
        assert_eq!(end_of("ab/é.obj", 7), "…/é.obj");
    }
}
