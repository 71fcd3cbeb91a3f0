//! Memory that the work on recordings is done with.

/// Recordings after which free memory is given back: what one leaves behind in pieces adds up over a thousand of them, and
/// giving back after each would have every page made anew.
pub(super) const EVERY: usize = 16;

/// Blocks from this size on are the system's own, and go back to it as soon as they are freed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const OWN_BYTES: libc::c_int = 4 << 20;
/// Free memory at the end of what a thread has goes back from this size on. At 1 MiB every recording takes seven times as many
/// page faults: what one step gives back the next one has made anew.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const FREE_BYTES: libc::c_int = 8 << 20;
/// Freeing a block of this size makes glibc look at the end of what the thread has: above 64 KiB, and not one of
/// [`OWN_BYTES`].
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE_BYTES: usize = 128 << 10;

/// Has free memory given back while the work goes on. glibc raises both limits to the largest block it has ever freed, up to
/// 32 MiB and twice that, so that every thread would keep what the largest recording of its own needed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(super) fn keep_little() {
    #[expect(unsafe_code, reason = "there is no other way to the allocator")]
    // SAFETY: it takes numbers, and changes two limits under the allocator's own locks.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, OWN_BYTES);
        libc::mallopt(libc::M_TRIM_THRESHOLD, FREE_BYTES);
    }
}

/// Gives free memory back to the system: of all threads what lies between their blocks, of this thread what lies after them
/// too. glibc keeps what a thread has freed for that thread, so that what comes after the workers would have to be had in
/// addition to all they ever needed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(super) fn give_back() {
    #[expect(unsafe_code, reason = "there is no other way to the allocator")]
    // SAFETY: these take numbers, change a limit and touch nothing but free blocks under the allocator's own locks.
    unsafe {
        libc::mallopt(libc::M_TRIM_THRESHOLD, 0);
        // `malloc_trim` leaves the end of all threads but the first; a thread looks at its own when it frees a large block.
        drop(std::hint::black_box(Vec::<u8>::with_capacity(LARGE_BYTES)));
        libc::mallopt(libc::M_TRIM_THRESHOLD, FREE_BYTES);
        libc::malloc_trim(0);
    }
}

/// Other allocators do so by themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(super) fn keep_little() {}

/// Other allocators do so by themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(super) fn give_back() {}
