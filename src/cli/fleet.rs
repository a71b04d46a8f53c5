//! A batch on the terminal: one bar for all models, one line for each worker.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use brickmend::catalogue::{Ahead, Ended, Fleet, State};
use brickmend::monitor::Stage;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::progress::{Chatter, LINE_INTERVAL, on_one_line};
use crate::cli::signals::Stop;

/// A fleet that draws on the terminal.
pub struct Terminal {
    chatter: Chatter,
    stop: Stop,
    bars: MultiProgress,
    state: Mutex<Drawn>,
}

struct Drawn {
    all: ProgressBar,
    workers: Vec<(ProgressBar, String)>,
    last_line: Instant,
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
        let style = ProgressStyle::with_template("{pos}/{len} models [{bar:30}] {elapsed} {msg}");
        all.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let state = Drawn { all, workers: Vec::new(), last_line: Instant::now() };
        Self { chatter, stop, bars, state: Mutex::new(state) }
    }

    /// Takes the bars off the terminal.
    pub fn clear(&self) {
        let state = self.state();
        state.workers.iter().for_each(|(bar, _)| bar.finish_and_clear());
        state.all.finish_and_clear();
    }

    fn state(&self) -> MutexGuard<'_, Drawn> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn worker<'d>(&self, state: &'d mut Drawn, slot: usize) -> &'d mut (ProgressBar, String) {
        while state.workers.len() <= slot {
            let bar = self.bars.add(ProgressBar::new_spinner());
            let style = ProgressStyle::with_template("  {elapsed:>5} {wide_msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
            state.workers.push((bar, String::new()));
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
        let mut text = format!(
            "{} models: {} to do, about {:.0} s of work",
            ahead.found, ahead.pending, ahead.seconds
        );
        for (reason, count) in &ahead.passed.counts {
            text.push_str(&format!("; {count} files {}", reason.noun()));
        }
        state.all.suspend(|| self.chatter.say(&text));
    }

    fn started(&self, slot: usize, model: &str) {
        let mut state = self.state();
        let (bar, name) = self.worker(&mut state, slot);
        *name = on_one_line(model);
        bar.reset_elapsed();
        bar.set_message(name.clone());
    }

    fn working(&self, slot: usize, stage: Stage, share: f64) {
        let mut state = self.state();
        let (bar, name) = self.worker(&mut state, slot);
        bar.set_message(format!("{name}: {} {:.0} %", stage.name(), 100.0 * share));
    }

    fn ended(&self, slot: usize, ended: &Ended) {
        let mut state = self.state();
        self.worker(&mut state, slot).0.set_message("");
        if ended.state != State::Pending {
            state.all.inc(1);
        }
        state.all.set_message(format!("about {:.0} s to go", ended.left_seconds));
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
            let text = format!("{done} of {all} models, about {:.0} s to go", ended.left_seconds);
            self.chatter.say(&text);
        }
    }

    fn note(&self, text: &str) {
        self.state().all.suspend(|| self.chatter.say(text));
    }
}
