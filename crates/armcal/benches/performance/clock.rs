//! Wall time, and the time that the threads of this process were on a processor: the second tells how much of the
//! first was waiting for other programs.

use crate::{Result, process};
use std::time::Instant;

/// Field of proc(5)'s stat where the times of the process itself begin.
const OF_ITSELF: usize = 14;

/// Time one piece of work took.
#[derive(Debug, Clone, Copy)]
pub struct Spent {
    /// By the clock on the wall [s].
    pub wall_s: f64,
    /// On a processor, all threads together, user and system [s].
    pub cpu_s: f64,
}

/// Does the work and tells what it took.
pub fn spent<T>(work: impl FnOnce() -> T) -> (T, Spent) {
    let (began, cpu_s) = (Instant::now(), on_cpu_s());
    let result = work();
    let wall_s = began.elapsed().as_secs_f64();
    (result, Spent { wall_s, cpu_s: on_cpu_s() - cpu_s })
}

/// Medians of wall and processor time.
pub fn median(spent: &[Spent]) -> Spent {
    let of =
        |pick: fn(&Spent) -> f64| armcal_core::robust::median(&spent.iter().map(pick).collect::<Vec<f64>>());
    Spent { wall_s: of(|s| s.wall_s), cpu_s: of(|s| s.cpu_s) }
}

/// Time on a processor of the whole process since it began, ended threads included, user and system [s].
pub fn process_cpu_s() -> Result<f64> {
    process::stat_cpu_s(OF_ITSELF)
}

/// Time on a processor of all living threads since they began [s]; not a number where there is no `/proc`.
fn on_cpu_s() -> f64 {
    let Ok(threads) = std::fs::read_dir("/proc/self/task") else { return f64::NAN };
    let nanoseconds = threads.flatten().filter_map(|thread| {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    nanoseconds.sum::<f64>() * 1e-9
}
