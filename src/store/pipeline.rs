//! Read, work, write: items in order through a pool of workers, with back-pressure.
//!
//! Memory: at most two items per worker are under way, fewer where they weigh much, or light ones in
//! batches; feeding waits until the oldest is taken.

use std::collections::{BTreeMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use crossbeam::channel::bounded;
use rayon::ThreadPool;

/// Batches of items under way per worker.
const BATCHES_PER_WORKER: usize = 2;
/// Most items of a batch: a worker that is woken for each spends much of its time on that.
const BATCH_ITEMS: usize = 8;
/// One item of a batch for so many that went before it, so that few items keep all workers busy.
const ITEMS_BEFORE: usize = 32;

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
    in_batches(pool, (light, 1), feed, workspace, work, take)
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
    feed: impl FnMut() -> Result<Option<I>, E>,
    workspace: impl Fn() -> W + Sync,
    work: impl Fn(&mut W, I) -> Result<O, E> + Sync,
    take: impl FnMut(O) -> Result<(), E>,
) -> Result<(), E> {
    in_batches(pool, (scales, BATCH_ITEMS), feed, workspace, work, take)
}

/// What a worker made of a batch: up to the first error, or a bug.
type Worked<O, E> = std::thread::Result<Result<Vec<O>, (Vec<O>, E)>>;

fn in_batches<I: Send, O: Send, W, E: Send>(
    pool: &ThreadPool,
    (scales, most_items): (Scales<impl Fn(&I) -> u64>, usize),
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
    let limit = workers * BATCHES_PER_WORKER;
    pool.in_place_scope(|scope| {
        let (batch_sender, batches) = bounded::<(u64, Vec<I>)>(limit);
        let (result_sender, results) = bounded::<(u64, Worked<O, E>)>(limit);
        for _ in 0..workers {
            let (batches, result_sender) = (batches.clone(), result_sender.clone());
            let (workspace, work) = (&workspace, &work);
            scope.spawn(move |_| {
                let mut space = workspace();
                for (number, batch) in batches {
                    let worked =
                        catch_unwind(AssertUnwindSafe(|| work_off(&mut space, batch, work)));
                    if result_sender.send((number, worked)).is_err() {
                        return;
                    }
                }
            });
        }
        drop((batches, result_sender));
        let mut waiting = BTreeMap::new();
        let mut under_way =
            UnderWay { scales, most_items, limit, fed: 0, weights: VecDeque::new() };
        let (mut sent, mut taken) = (0, 0);
        let mut next = feed()?;
        loop {
            while let Some(batch) = under_way.next_batch(&mut next, &mut feed)? {
                batch_sender.send((sent, batch)).expect("workers listen until the end");
                sent += 1;
            }
            if taken == sent {
                return Ok(());
            }
            let (number, result) = results.recv().expect("workers answer until all is taken");
            // A bug in a worker ends the run: nobody else would tell that its result is missing.
            waiting.insert(number, result.unwrap_or_else(|bug| resume_unwind(bug)));
            while let Some(result) = waiting.remove(&taken) {
                let (done, error) = match result {
                    Ok(done) => (done, None),
                    Err((done, error)) => (done, Some(error)),
                };
                done.into_iter().try_for_each(&mut take)?;
                error.map_or(Ok(()), Err)?;
                taken += 1;
                under_way.weights.pop_front();
            }
        }
    })
}

/// Works off a batch up to its first error.
fn work_off<I, O, W, E>(
    space: &mut W,
    batch: Vec<I>,
    work: impl Fn(&mut W, I) -> Result<O, E>,
) -> Result<Vec<O>, (Vec<O>, E)> {
    let mut done = Vec::with_capacity(batch.len());
    for item in batch {
        match work(space, item) {
            Ok(result) => done.push(result),
            Err(error) => return Err((done, error)),
        }
    }
    Ok(done)
}

/// Batches that were sent and not taken.
struct UnderWay<F> {
    scales: Scales<F>,
    most_items: usize,
    /// Most batches.
    limit: usize,
    /// Items so far.
    fed: usize,
    /// What each batch weighs, oldest first; a permit that workers take could deadlock, since results
    /// are taken in order.
    weights: VecDeque<u64>,
}

impl<F> UnderWay<F> {
    /// The next items, as many as may go now; `next` is the first of those that wait.
    fn next_batch<I, E>(
        &mut self,
        next: &mut Option<I>,
        feed: &mut impl FnMut() -> Result<Option<I>, E>,
    ) -> Result<Option<Vec<I>>, E>
    where
        F: Fn(&I) -> u64,
    {
        if self.weights.len() == self.limit {
            return Ok(None);
        }
        let most_bytes = self.scales.most_bytes;
        let before: u64 = self.weights.iter().sum();
        let most_items = (self.fed / ITEMS_BEFORE).clamp(1, self.most_items);
        let mut batch = Vec::new();
        let mut weight = 0_u64;
        while batch.len() < most_items {
            let fits = |item: &mut I| {
                let all = before.saturating_add(weight).saturating_add((self.scales.weigh)(item));
                // A heavy one goes alone; and a batch leaves room for others.
                if batch.is_empty() {
                    return all <= most_bytes || self.weights.is_empty();
                }
                all <= most_bytes && weight <= most_bytes / self.limit as u64
            };
            let Some(item) = next.take_if(fits) else { break };
            weight += (self.scales.weigh)(&item);
            batch.push(item);
            self.fed += 1;
            *next = feed()?;
        }
        if batch.is_empty() {
            return Ok(None);
        }
        self.weights.push_back(weight);
        Ok(Some(batch))
    }
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
    fn of_a_batch_all_before_its_first_error_is_taken() {
        for threads in [1, 2, 8] {
            let (mut next, mut taken) = (0_u64, 0);
            let result: Result<(), u64> = ordered_by_weight(
                &pool(threads),
                Scales { most_bytes: 1000, weigh: |_: &u64| 1 },
                || {
                    next += 1;
                    Ok(Some(next))
                },
                || (),
                |(), item| if item >= 500 { Err(item) } else { Ok(item) },
                |item| {
                    taken += 1;
                    assert_eq!(item, taken);
                    Ok(())
                },
            );
            assert_eq!((result, taken), (Err(500), 499));
        }
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
