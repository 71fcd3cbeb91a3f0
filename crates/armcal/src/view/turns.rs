//! Whose refit is computed: one at a time, and only so many requests are under way.

use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Requests at a time that compute or write, those that wait for their turn included. A page asks for one at a time.
pub(super) const MOST_ASKED: usize = 8;

/// The requests of one server.
pub(super) struct Turns {
    /// Of the one that is computed: it takes all cores.
    turn: Arc<Semaphore>,
    /// Of those that are computed, written, or wait.
    places: Arc<Semaphore>,
}

/// What is held, and given back when it is dropped: when the work is done, or its client left while it waited.
pub(super) type Held = OwnedSemaphorePermit;

impl Turns {
    pub fn new() -> Turns {
        Turns { turn: Arc::new(Semaphore::new(1)), places: Arc::new(Semaphore::new(MOST_ASKED)) }
    }

    /// A place, unless all are taken.
    pub fn place(&self) -> Option<Held> {
        self.places.clone().try_acquire_owned().ok()
    }

    /// Waits until no other refit is computed; those who wait come in their order.
    pub async fn turn(&self) -> Option<Held> {
        // It is never closed.
        self.turn.clone().acquire_owned().await.ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::pin::pin;
    use std::task::{Context, Poll, Waker};

    #[test]
    fn so_many_may_wait_and_one_is_computed() {
        let turns = Turns::new();
        let mut taken: Vec<Held> = (0..MOST_ASKED).map(|_| turns.place().expect("a place")).collect();
        assert!(turns.place().is_none());
        taken.pop();
        assert!(turns.place().is_some(), "the one that was given back");
        let now = |turn: std::pin::Pin<&mut dyn Future<Output = Option<Held>>>| {
            turn.poll(&mut Context::from_waker(Waker::noop()))
        };
        let Poll::Ready(Some(held)) = now(pin!(turns.turn())) else { panic!("nobody else has it") };
        {
            let mut left = pin!(turns.turn());
            assert!(now(left.as_mut()).is_pending(), "one at a time");
            drop(held);
            // It is this one's turn, but its client leaves.
        }
        assert!(now(pin!(turns.turn())).is_ready());
    }

    #[test]
    fn work_that_panics_gives_back_what_it_held() {
        let turns = Turns::new();
        for _ in 0..2 * MOST_ASKED {
            let place = turns.place().expect("a place");
            let failed = std::thread::spawn(move || {
                let _place = place;
                panic!("a refit of a test");
            });
            assert!(failed.join().is_err());
        }
    }
}
