//! Several recordings at a time.

use super::memory;
use crate::error::Error;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Cores of this machine that the process may use.
pub(super) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Does `work` for 0..count on `jobs` cores; results in order.
///
/// As many are worked on at a time as there are cores, each on its own: nobody waits for anybody, and no more than that
/// are in memory. Where there are fewer than cores, each gets several for its chunks and candidates.
///
/// # Errors
/// Threads that the system refuses.
pub(super) fn each<T: Send>(
    count: usize,
    jobs: usize,
    work: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, Error> {
    let workers = jobs.clamp(1, count.max(1));
    let pool = |worker: usize| {
        let threads = jobs.max(1) / workers + usize::from(worker < jobs.max(1) % workers);
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| Error::Threads { why: e.to_string() })
    };
    let pools = (0..workers).map(pool).collect::<Result<Vec<_>, Error>>()?;
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::with_capacity(count));
    std::thread::scope(|scope| {
        for pool in &pools {
            scope.spawn(|| {
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    if i >= count {
                        break;
                    }
                    let result = pool.install(|| work(i));
                    // Nobody panics while holding it: pushing is all that is done.
                    done.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((i, result));
                }
                pool.broadcast(|_| memory::give_back());
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    done.sort_by_key(|(i, _)| *i);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}
