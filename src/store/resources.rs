//! What a stage may use: scratch, threads, its share of memory, and the caller's ear.

use rayon::ThreadPool;

use crate::monitor::Monitor;
use crate::store::{Backing, Scratch};

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
    /// Who hears of progress, and may stop the work.
    pub monitor: &'r dyn Monitor,
}
