//! Whose refit is computed: one at a time, and only so many wait for theirs.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Refits at a time, those that wait for their turn included. A page asks for one at a time.
pub(super) const MOST_ASKED: usize = 8;

/// The refits of one server.
#[derive(Default)]
pub(super) struct Turns {
    /// Held by the one that is computed: it takes all cores.
    turn: Mutex<()>,
    /// Computed or waiting.
    asked: AtomicUsize,
}

/// A place among the refits, given back when its answer is made, also where nobody waits for that any more.
pub(super) struct Place(Arc<Turns>);

impl Turns {
    /// A place, unless all are taken.
    pub fn place(self: &Arc<Turns>) -> Option<Place> {
        let place = Place(self.clone());
        (self.asked.fetch_add(1, Ordering::SeqCst) < MOST_ASKED).then_some(place)
    }
}

impl Place {
    /// Waits until no other refit is computed.
    pub fn turn(&self) -> MutexGuard<'_, ()> {
        self.0.turn.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.0.asked.fetch_sub(1, Ordering::SeqCst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn so_many_may_wait_and_a_refused_one_takes_no_place() {
        let turns = Arc::new(Turns::default());
        let mut taken: Vec<Place> = (0..MOST_ASKED).map(|_| turns.place().expect("a place")).collect();
        assert!((0..3).all(|_| turns.place().is_none()));
        taken.pop();
        let last = turns.place().expect("the one that was given back");
        assert!(turns.place().is_none());
        let held = last.turn();
        assert!(turns.turn.try_lock().is_err(), "one at a time");
        drop(held);
        assert!(turns.turn.try_lock().is_ok());
    }

    #[test]
    fn a_refit_that_panics_gives_its_place_and_its_turn_back() {
        let turns = Arc::new(Turns::default());
        for _ in 0..2 * MOST_ASKED {
            let place = turns.place().expect("a place");
            let failed = std::thread::spawn(move || {
                let _turn = place.turn();
                panic!("a refit of a test");
            });
            assert!(failed.join().is_err());
        }
    }
}
