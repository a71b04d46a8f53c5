//! One accountant owns the memory budget; everyone who holds memory holds a lease on it.
//!
//! The accountant does not allocate. It makes sure that the sum of what was promised to buffers,
//! caches and threads stays below the budget, and remembers the peak for the outcome.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::store::StoreError;

/// Grants shares of one memory budget.
#[derive(Clone, Debug)]
pub struct Accountant {
    ledger: Arc<Ledger>,
}

#[derive(Debug)]
struct Ledger {
    budget_bytes: u64,
    granted_bytes: AtomicU64,
    peak_bytes: AtomicU64,
}

impl Accountant {
    /// An accountant over `budget_bytes`, of which nothing is granted yet.
    #[must_use]
    pub fn new(budget_bytes: u64) -> Self {
        let ledger = Ledger {
            budget_bytes,
            granted_bytes: AtomicU64::new(0),
            peak_bytes: AtomicU64::new(0),
        };
        Self { ledger: Arc::new(ledger) }
    }

    /// Takes `bytes` out of the budget until the lease is dropped.
    ///
    /// # Errors
    /// [`StoreError::OverBudget`] when less than that is free.
    pub fn lease(&self, what: &'static str, bytes: u64) -> Result<Lease, StoreError> {
        let ledger = &self.ledger;
        let mut granted = ledger.granted_bytes.load(Ordering::Relaxed);
        loop {
            let free_bytes = ledger.budget_bytes.saturating_sub(granted);
            if bytes > free_bytes {
                return Err(StoreError::OverBudget {
                    what,
                    needed_bytes: bytes,
                    free_bytes,
                    budget_bytes: ledger.budget_bytes,
                });
            }
            let after = granted + bytes;
            match ledger.granted_bytes.compare_exchange_weak(
                granted,
                after,
                Ordering::Relaxed,
                Ordering::Relaxed,
            ) {
                Ok(_) => {
                    ledger.peak_bytes.fetch_max(after, Ordering::Relaxed);
                    return Ok(Lease { ledger: Arc::clone(ledger), bytes });
                }
                Err(now) => granted = now,
            }
        }
    }

    /// What is not granted at the moment.
    #[must_use]
    pub fn free_bytes(&self) -> u64 {
        let granted = self.ledger.granted_bytes.load(Ordering::Relaxed);
        self.ledger.budget_bytes.saturating_sub(granted)
    }

    /// The whole budget.
    #[must_use]
    pub fn budget_bytes(&self) -> u64 {
        self.ledger.budget_bytes
    }

    /// The most that was granted at one time.
    #[must_use]
    pub fn peak_bytes(&self) -> u64 {
        self.ledger.peak_bytes.load(Ordering::Relaxed)
    }
}

/// A share of the budget, given back on drop.
#[derive(Debug)]
pub struct Lease {
    ledger: Arc<Ledger>,
    bytes: u64,
}

impl Lease {
    /// The size of the share.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        self.ledger.granted_bytes.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leases_never_exceed_the_budget_and_come_back() {
        let accountant = Accountant::new(100);
        let first = accountant.lease("first", 60).expect("60 of 100 fit");
        let refusal = accountant.lease("second", 41);
        assert!(matches!(
            refusal,
            Err(StoreError::OverBudget { needed_bytes: 41, free_bytes: 40, .. })
        ));
        drop(first);
        assert_eq!(accountant.free_bytes(), 100);
        assert_eq!(accountant.peak_bytes(), 60);
    }
}
