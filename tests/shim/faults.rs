//! A library that is loaded before the program under test and makes the system fail on purpose.
//!
//! The tests compile it when they run and name it in `LD_PRELOAD`, so the program itself has no
//! hooks. Environment:
//!
//! - `SHIM_FAIL_CALL=n`: the n-th call for a file or a map fails, with `SHIM_ERRNO` (5).
//! - `SHIM_KILL_CALL=n`: the process is killed (SIGKILL) at the n-th call.
//! - `SHIM_FAIL_ALLOCATION=n`: the n-th request for 40 KiB of memory or more is refused.
//! - `SHIM_ONLY=writes`: only calls that change the disk are counted.
//!
//! When it strikes it says `shim: struck` on stderr. Calls on stdout and stderr do not count.

use std::ffi::{c_char, c_int, c_void};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

type Path = *const c_char;

unsafe extern "C" {
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
    fn getenv(name: *const c_char) -> *const c_char;
    fn __errno_location() -> *mut c_int;
    fn kill(process: c_int, signal: c_int) -> c_int;
    fn getpid() -> c_int;
    fn syscall(number: i64, ...) -> i64;
    fn __libc_malloc(size: usize) -> *mut c_void;
    fn __libc_calloc(count: usize, size: usize) -> *mut c_void;
    fn __libc_realloc(block: *mut c_void, size: usize) -> *mut c_void;
    fn __libc_memalign(align: usize, size: usize) -> *mut c_void;
}

const NEXT: *mut c_void = -1_isize as *mut c_void;
const UNSET: u64 = u64::MAX;
const UNREAD: u64 = u64::MAX - 1;
const NO_MEMORY: c_int = 12;
const LARGE_BYTES: usize = 40 << 10;
const WRITE: i64 = 1;

static CALLS: AtomicU64 = AtomicU64::new(0);
static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

/// A number of the environment, read once and without asking for memory.
struct Setting {
    name: &'static [u8],
    value: AtomicU64,
}

static FAIL_CALL: Setting = Setting::new(b"SHIM_FAIL_CALL\0");
static KILL_CALL: Setting = Setting::new(b"SHIM_KILL_CALL\0");
static FAIL_ALLOCATION: Setting = Setting::new(b"SHIM_FAIL_ALLOCATION\0");
static ERRNO: Setting = Setting::new(b"SHIM_ERRNO\0");
static ONLY: Setting = Setting::new(b"SHIM_ONLY\0");

impl Setting {
    const fn new(name: &'static [u8]) -> Self {
        Self { name, value: AtomicU64::new(UNREAD) }
    }

    fn get(&self) -> u64 {
        let known = self.value.load(Ordering::Relaxed);
        if known != UNREAD {
            return known;
        }
        let mut text = unsafe { getenv(self.name.as_ptr().cast()) };
        let mut value = UNSET;
        if !text.is_null() {
            value = 0;
            while unsafe { *text } != 0 {
                let digit = unsafe { *text } as u8;
                value = value.wrapping_mul(10).wrapping_add(u64::from(digit.wrapping_sub(b'0')));
                text = unsafe { text.add(1) };
            }
        }
        self.value.store(value, Ordering::Relaxed);
        value
    }
}

fn say_struck() {
    let text = b"shim: struck\n";
    unsafe { syscall(WRITE, 2, text.as_ptr(), text.len()) };
}

fn set_errno(errno: c_int) {
    unsafe { *__errno_location() = errno };
}

/// Counts a call; whether it has to fail.
fn strikes(changes_disk: bool) -> bool {
    if ONLY.get() != UNSET && !changes_disk {
        return false;
    }
    let number = CALLS.fetch_add(1, Ordering::SeqCst) + 1;
    if number == KILL_CALL.get() {
        say_struck();
        unsafe { kill(getpid(), 9) };
    }
    if number == FAIL_CALL.get() {
        say_struck();
        let errno = ERRNO.get();
        set_errno(if errno == UNSET { 5 } else { errno as c_int });
        return true;
    }
    false
}

fn strikes_allocation(bytes: usize) -> bool {
    if bytes < LARGE_BYTES || FAIL_ALLOCATION.get() == UNSET {
        return false;
    }
    let number = ALLOCATIONS.fetch_add(1, Ordering::SeqCst) + 1;
    if number == FAIL_ALLOCATION.get() {
        say_struck();
        set_errno(NO_MEMORY);
        return true;
    }
    false
}

/// The function of the same name in the next library.
fn next(cache: &AtomicUsize, name: &'static [u8]) -> usize {
    let known = cache.load(Ordering::Relaxed);
    if known != 0 {
        return known;
    }
    let found = unsafe { dlsym(NEXT, name.as_ptr().cast()) } as usize;
    cache.store(found, Ordering::Relaxed);
    found
}

/// Defines a function that counts and then calls the one of the system.
macro_rules! counted {
    ($name:ident($($argument:ident: $kind:ty),*) -> $result:ty, $failed:expr, $changes:expr) => {
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($argument: $kind),*) -> $result {
            static CACHE: AtomicUsize = AtomicUsize::new(0);
            let system = next(&CACHE, concat!(stringify!($name), "\0").as_bytes());
            let system: unsafe extern "C" fn($($kind),*) -> $result =
                unsafe { std::mem::transmute(system) };
            if $changes.is_some_and(strikes) {
                return $failed;
            }
            unsafe { system($($argument),*) }
        }
    };
}

/// Whether a call on this file counts, and whether it changes the disk.
fn on(file: c_int, changes_disk: bool) -> Option<bool> {
    (file != 1 && file != 2).then_some(changes_disk)
}

const CHANGES: Option<bool> = Some(true);
const LOOKS: Option<bool> = Some(false);
/// `O_WRONLY | O_RDWR | O_CREAT`.
const TO_WRITE: c_int = 0o103;

counted!(open64(path: Path, flags: c_int, mode: c_int) -> c_int, -1, Some(flags & TO_WRITE != 0));
counted!(read(file: c_int, to: *mut c_void, count: usize) -> isize, -1, on(file, false));
counted!(pread64(file: c_int, to: *mut c_void, count: usize, at: i64) -> isize, -1, on(file, false));
counted!(write(file: c_int, from: *const c_void, count: usize) -> isize, -1, on(file, true));
counted!(pwrite64(file: c_int, from: *const c_void, count: usize, at: i64) -> isize, -1, on(file, true));
counted!(fallocate64(file: c_int, mode: c_int, at: i64, count: i64) -> c_int, -1, CHANGES);
counted!(fallocate(file: c_int, mode: c_int, at: i64, count: i64) -> c_int, -1, CHANGES);
counted!(ftruncate64(file: c_int, count: i64) -> c_int, -1, CHANGES);
counted!(rename(from: Path, to: Path) -> c_int, -1, CHANGES);
counted!(unlink(path: Path) -> c_int, -1, CHANGES);
counted!(mkdir(path: Path, mode: u32) -> c_int, -1, CHANGES);
counted!(rmdir(path: Path) -> c_int, -1, CHANGES);
counted!(fsync(file: c_int) -> c_int, -1, CHANGES);
counted!(flock(file: c_int, how: c_int) -> c_int, -1, LOOKS);
counted!(mmap64(
    at: *mut c_void, count: usize, protection: c_int, flags: c_int, file: c_int, offset: i64
) -> *mut c_void, NEXT, (file >= 0).then_some(false));
counted!(mmap(
    at: *mut c_void, count: usize, protection: c_int, flags: c_int, file: c_int, offset: i64
) -> *mut c_void, NEXT, (file >= 0).then_some(false));

#[unsafe(no_mangle)]
pub unsafe extern "C" fn malloc(size: usize) -> *mut c_void {
    if strikes_allocation(size) { std::ptr::null_mut() } else { unsafe { __libc_malloc(size) } }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn calloc(count: usize, size: usize) -> *mut c_void {
    if strikes_allocation(count.saturating_mul(size)) {
        return std::ptr::null_mut();
    }
    unsafe { __libc_calloc(count, size) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn realloc(block: *mut c_void, size: usize) -> *mut c_void {
    if strikes_allocation(size) {
        return std::ptr::null_mut();
    }
    unsafe { __libc_realloc(block, size) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn posix_memalign(
    block: *mut *mut c_void,
    align: usize,
    size: usize,
) -> c_int {
    if strikes_allocation(size) {
        return NO_MEMORY;
    }
    let found = unsafe { __libc_memalign(align, size) };
    unsafe { *block = found };
    if found.is_null() { NO_MEMORY } else { 0 }
}
