//! What may be inflated: memory that the chunks of all threads share, and an allowance of a recording that everything
//! made from its bytes is paid from, so that neither time nor room grows beyond the bytes that are there.
//!
//! Chunks are paid for in the order of the file by what they claim, before any is inflated: what is refused depends on the
//! file alone. Messages that are compressed one by one are inflated by many threads, so of them the sum decides.

use crate::RecordingError;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// A byte of a recording may stand for so many.
pub(crate) const TIMES: u64 = 100;
/// What a recording may inflate to beyond that [bytes].
const FREE_BYTES: u64 = 8 << 20;
/// What definitions may take where nothing more is stated [bytes].
const DEFINITION_BYTES: usize = 32 << 20;
/// All passes of a command over a recording may inflate so many times what one may: the longest, `armcal init` of many bodies
/// that cannot be read, make some more, and of a sound recording each takes a tenth of what it may.
const PASSES: u64 = 10;
/// The environment variable that says another number [MiB].
pub(crate) const FREE_VARIABLE: &str = "ARMCAL_INFLATE_MIB";

/// What whoever started the program says that a recording may take.
fn stated_bytes() -> Option<u64> {
    let mib: u64 = std::env::var(FREE_VARIABLE).ok()?.trim().parse().ok()?;
    Some(mib.saturating_mul(1 << 20))
}

/// What the texts of all definitions of a file may take in memory [bytes]: recorders write some megabytes at most.
pub(crate) fn most_definition_bytes() -> usize {
    stated_bytes().map_or(DEFINITION_BYTES, |stated| DEFINITION_BYTES.max(stated as usize))
}

/// What the bytes of one file, of all files of a recording in one pass, or in all passes, may still inflate to.
#[derive(Debug)]
pub struct Allowance {
    bytes: u64,
    free: u64,
    passes: u64,
    left: AtomicU64,
    exceeded: AtomicBool,
}

impl Allowance {
    /// Of a file of so many bytes, one of so many of a recording.
    pub(crate) fn of(bytes: u64, files: usize) -> Allowance {
        let free = stated_bytes().unwrap_or(FREE_BYTES) / files.max(1) as u64;
        Allowance { bytes, free, passes: 1, left: AtomicU64::new(0), exceeded: AtomicBool::new(false) }.full()
    }

    /// Of all passes over a recording of so many bytes.
    pub(crate) fn of_passes(bytes: u64) -> Allowance {
        Allowance { passes: PASSES, ..Allowance::of(bytes, 1) }.full()
    }

    fn full(self) -> Allowance {
        Allowance { left: AtomicU64::new(self.limit()), ..self }
    }

    fn limit(&self) -> u64 {
        self.free.saturating_add(self.bytes.saturating_mul(TIMES)).saturating_mul(self.passes)
    }

    /// What has been taken [bytes].
    pub(crate) fn taken(&self) -> u64 {
        self.limit() - self.left.load(Ordering::Relaxed)
    }

    /// Takes what a chunk of `packed` bytes claims to inflate to. One that alone claims too much takes nothing: its claim may
    /// be damaged, and the others are not to pay for that.
    pub(crate) fn admits(&self, packed: u64, claim: u64) -> bool {
        claim <= self.free.saturating_add(packed.saturating_mul(TIMES)) && self.take(claim)
    }

    /// Takes so many bytes, if they are left. Once they are not, nothing is.
    pub(crate) fn takes(&self, bytes: u64) -> bool {
        let taken = !self.is_exceeded() && self.take(bytes);
        self.exceeded.fetch_or(!taken, Ordering::Relaxed);
        taken
    }

    fn take(&self, bytes: u64) -> bool {
        self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(bytes)).is_ok()
    }

    /// Whether more was asked for than there was.
    pub(crate) fn is_exceeded(&self) -> bool {
        self.exceeded.load(Ordering::Relaxed)
    }

    /// The same as an error, of a recording.
    pub(crate) fn exceeded(&self, path: &Path) -> RecordingError {
        RecordingError::Inflates { path: path.to_owned(), limit: self.refusal() }
    }

    /// The limit in words.
    pub(crate) fn refusal(&self) -> String {
        let (limit, how) = (self.limit(), if self.passes > 1 { ", read again and again," } else { "" });
        format!(
            "it{how} inflates to more than the {limit} bytes that it may (docs/hardening.md, {FREE_VARIABLE})"
        )
    }
}

/// What large chunks may take together [bytes]; one that is larger than all of it waits until it is alone.
pub(crate) const BUDGET_BYTES: usize = if cfg!(test) { 256 << 10 } else { 32 << 20 };

static TAKEN: Mutex<usize> = Mutex::new(0);
static GIVEN_BACK: Condvar = Condvar::new();

/// A part of the budget, given back when it is dropped.
pub(crate) struct Share(usize);

impl Share {
    /// Waits until there is room. Whoever holds a share must not wait for another one.
    pub fn of(bytes: usize) -> Share {
        let full = |taken: &mut usize| *taken > 0 && taken.saturating_add(bytes) > BUDGET_BYTES;
        let mut taken = GIVEN_BACK.wait_while(lock(), full).unwrap_or_else(PoisonError::into_inner);
        *taken += bytes;
        Share(bytes)
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        *lock() -= self.0;
        GIVEN_BACK.notify_all();
    }
}

/// Nothing panics while it is held.
fn lock() -> MutexGuard<'static, usize> {
    TAKEN.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn shares_never_exceed_the_budget_unless_one_is_alone() {
        let (held, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        std::thread::scope(|scope| {
            for thread in 0..8 {
                let (held, most) = (&held, &most);
                scope.spawn(move || {
                    for round in 0..50 {
                        // From a quarter of the budget to twice all of it.
                        let bytes = BUDGET_BYTES * (1 + (thread + round) % 8) / 4;
                        let _share = Share::of(bytes);
                        let before = held.fetch_add(bytes, Ordering::SeqCst);
                        assert!(before == 0 || before + bytes <= BUDGET_BYTES, "{before} and {bytes}");
                        most.fetch_max(before + bytes, Ordering::SeqCst);
                        std::thread::yield_now();
                        held.fetch_sub(bytes, Ordering::SeqCst);
                    }
                });
            }
        });
        assert_eq!(most.into_inner(), 2 * BUDGET_BYTES, "the largest had its turn too");
    }
}
