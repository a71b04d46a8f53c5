//! Read, work, write: items in order through a pool of workers, with back-pressure.
//!
//! Memory: at most two items per worker are under way, fewer where they weigh much; feeding waits
//! until the oldest is taken.

use std::collections::{BTreeMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use crossbeam::channel::bounded;
use rayon::ThreadPool;

/// Items under way per worker.
const ITEMS_PER_WORKER: usize = 2;

/// Feeds items to `work` on the threads of `pool` and hands the results to `take` in feeding order.
///
/// `feed` and `take` run on the calling thread, which is not one of the pool's; each worker keeps
/// one workspace. With one thread everything runs on the calling thread.
///
/// # Errors
/// The first error of `feed`, `work` (in feeding order) or `take` ends the run.
pub fn ordered<I: Send, O: Send, W, E: Send>(
    pool: &ThreadPool,
    feed: impl FnMut() -> Result<Option<I>, E>,
    workspace: impl Fn() -> W + Sync,
    work: impl Fn(&mut W, I) -> Result<O, E> + Sync,
    take: impl FnMut(O) -> Result<(), E>,
) -> Result<(), E> {
    let light = Scales { most_bytes: u64::MAX, weigh: |_: &I| 0 };
    ordered_by_weight(pool, light, feed, workspace, work, take)
}

/// What items weigh, and how much may be under way at one time.
#[derive(Clone, Copy)]
pub struct Scales<F> {
    /// The items under way weigh at most this together; a heavier one goes alone.
    pub most_bytes: u64,
    /// About how much memory an item takes, with its result.
    pub weigh: F,
}

/// As [`ordered`], with no more under way than `scales` allow.
///
/// # Errors
/// As [`ordered`].
pub fn ordered_by_weight<I: Send, O: Send, W, E: Send>(
    pool: &ThreadPool,
    scales: Scales<impl Fn(&I) -> u64>,
    mut feed: impl FnMut() -> Result<Option<I>, E>,
    workspace: impl Fn() -> W + Sync,
    work: impl Fn(&mut W, I) -> Result<O, E> + Sync,
    mut take: impl FnMut(O) -> Result<(), E>,
) -> Result<(), E> {
    let workers = pool.current_num_threads();
    if workers == 1 {
        let mut space = workspace();
        while let Some(item) = feed()? {
            take(work(&mut space, item)?)?;
        }
        return Ok(());
    }
    let limit = workers * ITEMS_PER_WORKER;
    pool.in_place_scope(|scope| {
        let (item_sender, items) = bounded::<(u64, I)>(limit);
        let (result_sender, results) = bounded::<(u64, std::thread::Result<Result<O, E>>)>(limit);
        for _ in 0..workers {
            let (items, result_sender) = (items.clone(), result_sender.clone());
            let (workspace, work) = (&workspace, &work);
            scope.spawn(move |_| {
                let mut space = workspace();
                for (number, item) in items {
                    let worked = catch_unwind(AssertUnwindSafe(|| work(&mut space, item)));
                    if result_sender.send((number, worked)).is_err() {
                        return;
                    }
                }
            });
        }
        drop((items, result_sender));
        let mut waiting = BTreeMap::new();
        // Of the items under way, oldest first; a permit that workers take could deadlock, since
        // results are taken in order.
        let mut weights = VecDeque::new();
        let (mut fed, mut taken, mut weight) = (0, 0, 0_u64);
        let mut next = feed()?;
        loop {
            while let Some(item) = next.take_if(|item| {
                let more = (scales.weigh)(item);
                weights.is_empty()
                    || weights.len() < limit && weight.saturating_add(more) <= scales.most_bytes
            }) {
                let more = (scales.weigh)(&item);
                weights.push_back(more);
                weight += more;
                item_sender.send((fed, item)).expect("workers listen until the end");
                fed += 1;
                next = feed()?;
            }
            if taken == fed {
                return Ok(());
            }
            let (number, result) = results.recv().expect("workers answer until all is taken");
            // A bug in a worker ends the run: nobody else would tell that its result is missing.
            waiting.insert(number, result.unwrap_or_else(|bug| resume_unwind(bug)));
            while let Some(result) = waiting.remove(&taken) {
                take(result?)?;
                taken += 1;
                weight -= weights.pop_front().unwrap_or(0);
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    fn pool(threads: usize) -> ThreadPool {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool")
    }

    #[test]
    #[should_panic(expected = "a bug")]
    fn a_bug_in_a_worker_ends_the_run_on_any_number_of_threads() {
        let mut next = 0_u64;
        let feed = || {
            next += 1;
            Ok::<_, ()>((next <= 1000).then_some(next))
        };
        let work = |(): &mut (), item| if item == 500 { panic!("a bug") } else { Ok(item) };
        let _ = ordered(&pool(4), feed, || (), work, |_| Ok(()));
    }

    #[test]
    fn results_arrive_in_order_on_any_number_of_threads() {
        for threads in [1, 2, 8] {
            let mut next = 0_u64;
            let mut out = Vec::new();
            let result: Result<(), ()> = ordered(
                &pool(threads),
                || {
                    next += 1;
                    Ok((next <= 1000).then_some(next))
                },
                || 0_u64,
                |count, item| {
                    *count += 1;
                    Ok(item * item)
                },
                |square| {
                    out.push(square);
                    Ok(())
                },
            );
            assert_eq!(result, Ok(()));
            assert_eq!(out, (1..=1000).map(|i| i * i).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_first_error_in_order_ends_the_run() {
        let mut next = 0_u64;
        let mut taken = 0;
        let result: Result<(), u64> = ordered(
            &pool(4),
            || {
                next += 1;
                Ok(Some(next))
            },
            || (),
            |(), item| if item >= 50 { Err(item) } else { Ok(item) },
            |_| {
                taken += 1;
                Ok(())
            },
        );
        assert_eq!(result, Err(50));
        assert_eq!(taken, 49);
    }

    #[test]
    fn heavy_items_go_alone_and_light_ones_together() {
        for threads in [1, 2, 8] {
            let under_way = AtomicU64::new(0);
            let mut next = 0_u64;
            let mut taken = 0;
            let scales = Scales { most_bytes: 10, weigh: |item: &u64| item % 13 };
            let result: Result<(), ()> = ordered_by_weight(
                &pool(threads),
                scales,
                || {
                    next += 1;
                    Ok((next <= 2000).then_some(next))
                },
                || (),
                |(), item| {
                    let weight = item % 13;
                    let together = under_way.fetch_add(weight, Ordering::SeqCst) + weight;
                    assert!(together <= 10.max(weight), "{together} with one of {weight}");
                    under_way.fetch_sub(weight, Ordering::SeqCst);
                    Ok(item)
                },
                |item| {
                    taken += 1;
                    assert_eq!(item, taken);
                    Ok(())
                },
            );
            assert_eq!((result, taken), (Ok(()), 2000));
        }
    }
}
