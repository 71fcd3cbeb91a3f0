//! Several recordings at a time.

use super::memory;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// A core can be kept waiting by so many jobs; more only take memory from each other.
const JOBS_A_CORE: usize = 4;

/// Does `work` for 0..count on `jobs` cores; results in order.
///
/// As many are worked on at a time as there are cores, each on its own: nobody waits for anybody, and no more than that
/// are in memory. Where there are fewer than cores, each gets several for its chunks and candidates. Where the system refuses
/// threads, it goes on with those that there are.
pub(super) fn parallel_map<T: Send>(count: usize, jobs: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let jobs = jobs.clamp(1, JOBS_A_CORE * cores());
    let workers = jobs.min(count.max(1));
    let threads = |worker: usize| jobs / workers + usize::from(worker < jobs % workers);
    let pools: Vec<ThreadPool> = (0..workers).map_while(|worker| thread_pool(threads(worker)).ok()).collect();
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::with_capacity(count));
    // Without a pool of its own, in that of the process.
    let drive = |pool: Option<&ThreadPool>| {
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= count {
                break;
            }
            let result = pool.map_or_else(|| work(i), |pool| pool.install(|| work(i)));
            // Nobody panics while holding it: pushing is all that is done.
            done.lock().unwrap_or_else(PoisonError::into_inner).push((i, result));
        }
        if let Some(pool) = pool {
            pool.broadcast(|_| memory::give_back());
        }
    };
    std::thread::scope(|scope| {
        for pool in pools.iter().skip(1) {
            // One that cannot be started leaves its share to the others.
            let _ = std::thread::Builder::new().spawn_scoped(scope, || drive(Some(pool)));
        }
        drive(pools.first());
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(i, _)| *i);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Cores of this machine that the process may use.
pub(super) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Threads of a worker, or one, where the system does not give so many.
fn thread_pool(threads: usize) -> Result<ThreadPool, ThreadPoolBuildError> {
    let of = |threads| ThreadPoolBuilder::new().num_threads(threads).build();
    of(threads).or_else(|_| of(1))
}
