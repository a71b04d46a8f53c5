//! A monitor that remembers counters and gauges.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::monitor::{Counter, Gauge, Monitor, Stage};

/// Keeps every counter and the largest value of every gauge, and passes all on to another monitor.
pub struct Recording<'m> {
    next: &'m dyn Monitor,
    counters: [AtomicU64; Counter::ALL.len()],
    gauges: [AtomicU64; Gauge::ALL.len()],
}

impl<'m> Recording<'m> {
    /// A recording in front of `next`.
    #[must_use]
    pub fn new(next: &'m dyn Monitor) -> Self {
        Self { next, counters: Default::default(), gauges: Default::default() }
    }

    /// The sum of a counter so far.
    #[must_use]
    pub fn total(&self, counter: Counter) -> u64 {
        self.counters[counter as usize].load(Ordering::Relaxed)
    }

    /// The largest value of a gauge so far.
    #[must_use]
    pub fn peak(&self, gauge: Gauge) -> u64 {
        self.gauges[gauge as usize].load(Ordering::Relaxed)
    }
}

impl Monitor for Recording<'_> {
    fn begin(&self, stage: Stage, total: u64) {
        self.next.begin(stage, total);
    }
    fn advance(&self, done: u64) {
        self.next.advance(done);
    }
    fn end(&self, stage: Stage) {
        self.next.end(stage);
    }
    fn count(&self, counter: Counter, amount: u64) {
        self.counters[counter as usize].fetch_add(amount, Ordering::Relaxed);
        self.next.count(counter, amount);
    }
    fn gauge(&self, gauge: Gauge, now: u64) {
        self.gauges[gauge as usize].fetch_max(now, Ordering::Relaxed);
        self.next.gauge(gauge, now);
    }
    fn checkpoint(&self, step: &str, items: u64) {
        self.next.checkpoint(step, items);
    }
    fn note(&self, text: &str) {
        self.next.note(text);
    }
    fn cancelled(&self) -> bool {
        self.next.cancelled()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::Void;

    #[test]
    fn counters_add_up_and_gauges_keep_their_peak() {
        let recording = Recording::new(&Void);
        recording.count(Counter::InputBytesRead, 3);
        recording.count(Counter::InputBytesRead, 4);
        recording.gauge(Gauge::ResidentBricks, 9);
        recording.gauge(Gauge::ResidentBricks, 2);
        assert_eq!(recording.total(Counter::InputBytesRead), 7);
        assert_eq!(recording.peak(Gauge::ResidentBricks), 9);
    }
}
