//! What reading an input may take of memory and of time, held on one thread: whoever asks makes it the only one that works.

use super::memory::peak_bytes;

/// Memory beside the chunks [bytes], and how often the largest chunk may be there at once.
const MEMORY_BYTES: usize = 64 << 20;
const CHUNKS: usize = 2;
/// 2 s for 10 MB, and what opening, reading and comparing takes of the smallest file.
const NS_A_BYTE: u64 = 200;
const LEAST_NS: u64 = 50_000_000;
/// An input is too slow when it is so every time: the machine has others to serve.
const TRIES: usize = 3;
/// How much there is to do in an input.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// Bytes, inflated.
    pub bytes: usize,
    /// Those of its largest chunk.
    pub chunk: usize,
}

impl Size {
    /// Of something that is not inflated.
    pub fn plain(bytes: &[u8]) -> Size {
        Size { bytes: bytes.len(), chunk: 0 }
    }
}

/// Runs `f`, which must keep to what is allowed for an input of that size.
pub fn held(size: Size, f: impl Fn()) {
    let most_bytes = MEMORY_BYTES + CHUNKS * size.chunk;
    let most_ns = LEAST_NS + NS_A_BYTE * size.bytes as u64;
    for tried in 1.. {
        let begun = thread_ns();
        let ((), peak) = peak_bytes(&f);
        let ns = thread_ns() - begun;
        assert!(peak <= most_bytes, "{peak} bytes allocated for {size:?}, {most_bytes} are allowed");
        if ns <= most_ns {
            break;
        }
        assert!(tried < TRIES, "{ns} ns of the processor for {size:?}, {most_ns} are allowed");
    }
}

/// Time that the processor has spent on this thread [ns].
fn thread_ns() -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    #[expect(unsafe_code, reason = "the standard library does not tell it")]
    // SAFETY: the clock is one that POSIX has, and what it writes to is there.
    let failed = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    assert_eq!(failed, 0, "a thread has a clock");
    time.tv_sec.cast_unsigned() * 1_000_000_000 + time.tv_nsec.cast_unsigned()
}
