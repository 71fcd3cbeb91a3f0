//! Memory that the work on recordings is done with.

/// Recordings after which free memory is given back: what one leaves behind in pieces adds up over a thousand of them, and
/// giving back after each would have every page made anew.
pub(super) const EVERY: usize = 16;

/// Gives free memory back to the system. glibc keeps what a thread has freed for that thread, so that what comes after
/// the workers would have to be had in addition to all they ever needed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(super) fn give_back() {
    #[expect(unsafe_code, reason = "there is no other way to the allocator")]
    // SAFETY: it takes a number, and touches nothing but free blocks under the allocator's own locks.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Other allocators do so by themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(super) fn give_back() {}
