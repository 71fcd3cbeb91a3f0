//! Files that somebody makes shorter while they are mapped, or whose disk fails (Linux).
//!
//! Pages beyond the new end are gone: touching one is SIGBUS, which would end the process, and with it a campaign of a thousand
//! other recordings. So what is mapped is noted here, and the signal puts zeros where the file ends and says so; whoever read
//! the file asks afterwards, and discards what came of it. Any other SIGBUS goes where it went before.

#[cfg(target_os = "linux")]
pub(crate) use linux::Watched;

/// Elsewhere nothing is noted, and the signal ends the process.
#[cfg(not(target_os = "linux"))]
pub(crate) struct Watched;

#[cfg(not(target_os = "linux"))]
impl Watched {
    pub fn of(_: &[u8]) -> Watched {
        Watched
    }

    pub fn is_shortened(&self) -> bool {
        false
    }
}

#[cfg(target_os = "linux")]
mod linux {
    #![expect(unsafe_code, reason = "a signal has no safe interface")]

    use std::ptr;
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicUsize, Ordering};

    /// A place for a mapping; never freed, so that the signal may look at it at any time, and used again.
    struct Slot {
        /// Its first byte; 0 where there is none.
        start: AtomicUsize,
        end: AtomicUsize,
        shortened: AtomicBool,
        taken: AtomicBool,
        next: Option<&'static Slot>,
    }

    static FIRST: AtomicPtr<Slot> = AtomicPtr::new(ptr::null_mut());
    /// What was done about the signal before, and the size of a page; made before the first mapping is noted.
    static BEFORE: OnceLock<(libc::sigaction, usize)> = OnceLock::new();

    /// A mapping that is noted, as long as this lives.
    pub(crate) struct Watched(&'static Slot);

    impl Watched {
        /// Notes a mapping, whose first byte begins a page.
        pub fn of(mapped: &[u8]) -> Watched {
            BEFORE.get_or_init(install);
            let slot = slots().find(|slot| !slot.taken.swap(true, Ordering::AcqRel)).unwrap_or_else(added);
            let start = mapped.as_ptr().addr();
            slot.shortened.store(false, Ordering::Relaxed);
            slot.end.store(start + mapped.len(), Ordering::Relaxed);
            slot.start.store(start, Ordering::Release);
            Watched(slot)
        }

        /// Whether bytes of it were gone when somebody wanted them.
        pub fn is_shortened(&self) -> bool {
            self.0.shortened.load(Ordering::Acquire)
        }
    }

    impl Drop for Watched {
        fn drop(&mut self) {
            self.0.start.store(0, Ordering::Release);
            self.0.taken.store(false, Ordering::Release);
        }
    }

    fn slots() -> impl Iterator<Item = &'static Slot> {
        let at = FIRST.load(Ordering::Acquire);
        // SAFETY: it is NULL or a slot that was leaked.
        std::iter::successors(unsafe { at.as_ref() }, |slot| slot.next)
    }

    /// One more place, taken already.
    fn added() -> &'static Slot {
        let slot = Box::leak(Box::new(Slot {
            start: AtomicUsize::new(0),
            end: AtomicUsize::new(0),
            shortened: AtomicBool::new(false),
            taken: AtomicBool::new(true),
            next: None,
        }));
        loop {
            let first = FIRST.load(Ordering::Acquire);
            // SAFETY: as in `slots`.
            slot.next = unsafe { first.as_ref() };
            if FIRST.compare_exchange(first, slot, Ordering::AcqRel, Ordering::Acquire).is_ok() {
                return slot;
            }
        }
    }

    fn install() -> (libc::sigaction, usize) {
        // SAFETY: both structures are plain numbers, for which zeros are valid; the handler does nothing that a handler may not.
        unsafe {
            let mut before: libc::sigaction = std::mem::zeroed();
            let mut ours: libc::sigaction = std::mem::zeroed();
            let handler: extern "C" fn(libc::c_int, *mut libc::siginfo_t, *mut libc::c_void) = gone;
            ours.sa_sigaction = handler as libc::sighandler_t;
            ours.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
            libc::sigemptyset(&raw mut ours.sa_mask);
            libc::sigaction(libc::SIGBUS, &raw const ours, &raw mut before);
            let page = usize::try_from(libc::sysconf(libc::_SC_PAGESIZE)).unwrap_or(4096);
            (before, page)
        }
    }

    /// Puts zeros from the page that is gone to the end of its mapping, and lets the reader go on. It runs in the middle of
    /// anything, and so only reads and writes atomics and calls the system.
    extern "C" fn gone(signal: libc::c_int, info: *mut libc::siginfo_t, _: *mut libc::c_void) {
        let Some((before, page)) = BEFORE.get() else { return };
        // SAFETY: the system hands over what it knows of the signal.
        let at = unsafe { (*info).si_addr() }.addr();
        let holds = |slot: &&Slot| {
            let start = slot.start.load(Ordering::Acquire);
            start != 0 && (start..slot.end.load(Ordering::Relaxed)).contains(&at)
        };
        if let Some(slot) = slots().find(holds) {
            let from = at & !(page - 1);
            let bytes = slot.end.load(Ordering::Relaxed) - from;
            slot.shortened.store(true, Ordering::Release);
            // SAFETY: these pages are of the mapping that the slot stands for, read-only and without a file behind them. A
            // handler must leave `errno` as it was.
            let put = unsafe {
                let errno = *libc::__errno_location();
                let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS | libc::MAP_FIXED;
                let put =
                    libc::mmap(ptr::with_exposed_provenance_mut(from), bytes, libc::PROT_READ, flags, -1, 0);
                *libc::__errno_location() = errno;
                put
            };
            if put != libc::MAP_FAILED {
                return;
            }
        }
        // SAFETY: it is what was in force before; the access that failed is made again, and ends there.
        unsafe { libc::sigaction(signal, ptr::from_ref(before), ptr::null_mut()) };
    }
}

#[cfg(all(test, target_os = "linux"))]
#[path = "../tests/shortened.rs"]
mod tests;
