//! How the memory budget is shared out.
//!
//! The floor is what a run needs whatever the model: the program itself, and a workspace per
//! thread. What is above it goes to sorts, tables and mapped windows.

use crate::repair::RepairError;
use crate::repair::settings::Limits;
use crate::store::{Accountant, Lease};

/// The program, its libraries, stacks and fixed buffers.
const BASE_BYTES: u64 = 22 << 20;
/// One worker: bit planes, hits of a brick, triangles on their way.
const THREAD_BYTES: u64 = 8 << 20;
/// The least that sorts, tables and windows work with.
const LEAST_SHARE_BYTES: u64 = 8 << 20;
/// A mapped window, see `store`.
pub const WINDOW_BYTES: u64 = 256 << 10;
/// Brick files that are read at one time.
const OPEN_BRICK_FILES: u64 = 2;
/// More cached windows do not help.
const MAX_WINDOWS: u64 = 128;

/// The shares of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryPlan {
    /// Worker threads.
    pub threads: usize,
    /// For sorts, tables and unions.
    pub share_bytes: u64,
    /// Windows kept mapped per brick file.
    pub cached_windows: usize,
    /// For the program and the threads' workspaces.
    pub base_bytes: u64,
}

/// The smallest budget for `threads` workers.
#[must_use]
pub fn floor_bytes(threads: usize) -> u64 {
    BASE_BYTES + threads as u64 * THREAD_BYTES + LEAST_SHARE_BYTES
}

impl MemoryPlan {
    /// Takes the shares out of the budget for as long as the run lasts.
    ///
    /// # Errors
    /// [`RepairError::Store`] when they do not fit, which [`MemoryPlan::within`] rules out.
    pub fn lease(&self, accountant: &Accountant) -> Result<[Lease; 3], RepairError> {
        let windows = OPEN_BRICK_FILES * self.cached_windows as u64 * WINDOW_BYTES;
        Ok([
            accountant.lease("The program and its threads", self.base_bytes)?,
            accountant.lease("Mapped windows of bricks", windows)?,
            accountant.lease("Sorts, tables and unions", self.share_bytes)?,
        ])
    }

    /// Shares out the budget; takes fewer threads before it refuses.
    ///
    /// # Errors
    /// [`RepairError::BudgetBelowFloor`].
    pub fn within(limits: &Limits) -> Result<Self, RepairError> {
        let budget = limits.max_memory_bytes;
        let mut threads = limits.threads.max(1);
        while threads > 1 && floor_bytes(threads) > budget {
            threads -= 1;
        }
        if floor_bytes(threads) > budget {
            let (found_bytes, needed_bytes) = (budget, floor_bytes(1));
            return Err(RepairError::BudgetBelowFloor { found_bytes, needed_bytes });
        }
        let free = budget - BASE_BYTES - threads as u64 * THREAD_BYTES;
        // An eighth of what is free for windows, three quarters for sorts and tables; the rest is
        // slack for what allocators keep.
        let windows = (free / 8 / OPEN_BRICK_FILES / WINDOW_BYTES).clamp(2, MAX_WINDOWS);
        let share = limits.share_bytes.unwrap_or(free / 4 * 3);
        let base_bytes = BASE_BYTES + threads as u64 * THREAD_BYTES;
        let cached_windows = windows as usize;
        Ok(Self { threads, share_bytes: share, cached_windows, base_bytes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_threads_are_tried_before_a_budget_is_refused() {
        let limits =
            |bytes: u64| Limits { max_memory_bytes: bytes, threads: 64, ..Limits::default() };
        assert_eq!(MemoryPlan::within(&limits(8 << 30)).expect("plenty").threads, 64);
        let plan = MemoryPlan::within(&limits(64 << 20)).expect("64 MiB are enough");
        assert!((1..8).contains(&plan.threads));
        assert!(matches!(
            MemoryPlan::within(&limits(16 << 20)),
            Err(RepairError::BudgetBelowFloor { .. })
        ));
    }
}
