//! Counts what is resident while it is, from any thread.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::monitor::{Gauge, Monitor};

/// A running count of resident things that tells its gauge whenever it grows.
pub struct Resident<'m> {
    gauge: Gauge,
    monitor: &'m dyn Monitor,
    now: AtomicU64,
}

/// Keeps things counted until it is dropped.
pub struct Held<'r> {
    count: u64,
    now: &'r AtomicU64,
}

impl<'m> Resident<'m> {
    /// Nothing is resident yet.
    #[must_use]
    pub fn new(gauge: Gauge, monitor: &'m dyn Monitor) -> Self {
        Self { gauge, monitor, now: AtomicU64::new(0) }
    }

    /// Counts `count` things as resident while the result lives.
    pub fn hold(&self, count: usize) -> Held<'_> {
        let count = count as u64;
        let now = self.now.fetch_add(count, Ordering::Relaxed) + count;
        self.monitor.gauge(self.gauge, now);
        Held { count, now: &self.now }
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        self.now.fetch_sub(self.count, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::{Recording, Void};

    #[test]
    fn the_peak_is_what_was_held_at_one_time() {
        let recording = Recording::new(&Void);
        let bricks = Resident::new(Gauge::ResidentBricks, &recording);
        let first = bricks.hold(3);
        drop(bricks.hold(4));
        drop(first);
        drop(bricks.hold(5));
        assert_eq!(recording.peak(Gauge::ResidentBricks), 7);
    }
}
