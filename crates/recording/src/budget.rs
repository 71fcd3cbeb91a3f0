//! Memory that the inflated chunks of all threads share.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// What large chunks may take together [bytes]; one that is larger than all of it waits until it is alone.
pub(crate) const BUDGET_BYTES: usize = if cfg!(test) { 256 << 10 } else { 256 << 20 };

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
