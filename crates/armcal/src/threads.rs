//! The threads that all computing shares, as many of them as the system gives.

use crate::error::Error;
use rayon::{ThreadBuilder, ThreadPoolBuilder};
use std::io;
use std::sync::mpsc::{Sender, channel};

/// Refusals after which no more are asked for.
const REFUSALS: usize = 3;

/// Starts them. rayon would start them at their first use, all or none, and panic where one is refused; so they are started
/// here and handed over.
///
/// # Errors
/// The system gives none at all.
pub fn start_workers() -> Result<(), Error> {
    let refused = |e: &dyn std::fmt::Display| Error::Threads { why: e.to_string() };
    let mut idle: Vec<Sender<ThreadBuilder>> = Vec::new();
    let mut refusals: Vec<io::Error> = Vec::new();
    while idle.len() < worker_count() && refusals.len() < REFUSALS {
        let (sender, receiver) = channel::<ThreadBuilder>();
        let work = move || receiver.recv().into_iter().for_each(ThreadBuilder::run);
        match std::thread::Builder::new().spawn(work) {
            Ok(_) => idle.push(sender),
            Err(e) => refusals.push(e),
        }
    }
    if let (true, Some(why)) = (idle.is_empty(), refusals.first()) {
        return Err(refused(why));
    }
    let all = ThreadPoolBuilder::new().num_threads(idle.len());
    let pool = all.spawn_handler(|thread| {
        idle.pop()
            .map_or(Ok(()), |sender| sender.send(thread).map_err(|_| io::Error::other("a thread ended")))
    });
    pool.build_global().map_err(|e| refused(&e))
}

/// As many as rayon would start.
fn worker_count() -> usize {
    let told = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.parse::<usize>().ok());
    told.filter(|threads| *threads > 0)
        .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
}
