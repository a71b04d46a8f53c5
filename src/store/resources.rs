//! What a stage may use: scratch, threads, its share of memory, checkpoints, and the caller's ear.

use rayon::ThreadPool;

use crate::monitor::Monitor;
use crate::store::{Backing, Checkpoints, Scales, Scratch};

/// What `repair` lends to a stage.
#[derive(Clone, Copy)]
pub struct Resources<'r> {
    /// The work folder.
    pub scratch: &'r Scratch,
    /// The worker threads.
    pub pool: &'r ThreadPool,
    /// Memory for sorts, tables and unions, all of them together.
    pub share_bytes: u64,
    /// Windows of a brick file that may stay mapped.
    pub cached_windows: usize,
    /// Where brick files lie.
    pub backing: Backing,
    /// Where the running step begins, and notes how far it has come.
    pub checkpoints: &'r dyn Checkpoints,
    /// Who hears of progress, and may stop the work.
    pub monitor: &'r dyn Monitor,
}

impl Resources<'_> {
    /// Scales for work on bricks: those under way take at most a quarter of the share together.
    pub fn scales<I, F: Fn(&I) -> u64>(&self, weigh: F) -> Scales<F> {
        Scales { most_bytes: self.share_bytes / 4, weigh }
    }
}
