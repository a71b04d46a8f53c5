//! Memory that the system refuses ends the process with one clear line, wherever it was asked for.
//!
//! A checkpoint is on the disk, so the same command goes on from there; with a smaller
//! `--max-memory` it may fit.

#![expect(unsafe_code, reason = "allocators are unsafe by nature; all calls are handed on")]

use std::alloc::{GlobalAlloc, Layout, System};

use crate::cli::exit_code::Exit;
use crate::cli::last_words::say_and_end;

/// The system's allocator, which never returns empty-handed.
pub struct OrEnd;

#[global_allocator]
static ALLOCATOR: OrEnd = OrEnd;

/// Digits of the largest number of bytes.
const MOST_DIGITS: usize = 20;

/// Blocks of this size and more go back to the system at once when they are freed. Left alone, the
/// system's allocator learns from the largest block freed and keeps the more the longer it runs.
#[cfg(target_env = "gnu")]
const LARGE_BYTES: i32 = 1 << 20;

/// What a thread may keep of smaller blocks that are free: threads need as much again for the next
/// brick, and memory that comes back from the system is cleared page by page.
#[cfg(target_env = "gnu")]
const KEPT_BYTES: i32 = 4 << 20;

/// Makes the allocator return large blocks, and keep small ones. Nothing where it has no such setting.
pub fn return_large_blocks() {
    #[cfg(target_env = "gnu")]
    {
        /// `M_TRIM_THRESHOLD` and `M_MMAP_THRESHOLD` of malloc.h.
        const TRIM_THRESHOLD: i32 = -1;
        const MMAP_THRESHOLD: i32 = -3;
        unsafe extern "C" {
            fn mallopt(parameter: i32, value: i32) -> i32;
        }
        // SAFETY: settings of the allocator, allowed at any time; both are within bounds.
        unsafe {
            mallopt(MMAP_THRESHOLD, LARGE_BYTES);
            mallopt(TRIM_THRESHOLD, KEPT_BYTES);
        }
    }
}

fn or_end(block: *mut u8, bytes: usize) -> *mut u8 {
    if block.is_null() {
        refused(bytes);
    }
    block
}

#[cold]
fn refused(bytes: usize) -> ! {
    let mut digits = [b'0'; MOST_DIGITS];
    let mut first = MOST_DIGITS;
    let mut left = bytes;
    while left > 0 {
        first -= 1;
        digits[first] = b'0' + (left % 10) as u8;
        left /= 10;
    }
    let number = std::str::from_utf8(&digits[first..]).unwrap_or("some");
    let parts = [
        "brickmend: the system refused ",
        number,
        " bytes of memory; run again to go on, with a smaller --max-memory if it happens again\n",
    ];
    say_and_end(&parts, Exit::Temporary)
}

// SAFETY: every call is the system allocator's, with the same arguments.
unsafe impl GlobalAlloc for OrEnd {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are those of the system allocator.
        or_end(unsafe { System.alloc(layout) }, layout.size())
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        or_end(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }
    unsafe fn realloc(&self, block: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        // SAFETY: as above.
        or_end(unsafe { System.realloc(block, layout, new_size) }, new_size)
    }
    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(block, layout) }
    }
}
