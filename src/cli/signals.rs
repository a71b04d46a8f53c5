//! What the system says to a running process: stop soon, stop now, or that a page of a file is gone.

#![expect(unsafe_code, reason = "handlers of signals run between any two instructions")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGBUS, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::{flag, low_level};

use crate::cli::exit_code::Exit;
use crate::cli::last_words::say_and_end;

/// What SIGBUS says before the process ends.
const PAGE_LOST: &str = "brickmend: a page of a scratch file could not be read or written \
                         (SIGBUS); the disk is full or broken, or the file was cut off\n";

/// The requests to stop that came so far.
#[derive(Clone, Debug, Default)]
pub struct Stop {
    asked: Arc<AtomicBool>,
    signal: Arc<AtomicUsize>,
}

impl Stop {
    /// Listens from now on. The first SIGINT or SIGTERM asks to stop, a second one ends the
    /// process at once.
    ///
    /// # Errors
    /// The system refuses the handlers.
    pub fn listen() -> std::io::Result<Self> {
        let stop = Self::default();
        for signal in [SIGINT, SIGTERM] {
            // The order matters: what looks for an earlier request comes before what makes one.
            flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&stop.asked))?;
            flag::register_usize(signal, Arc::clone(&stop.signal), signal as usize)?;
            flag::register(signal, Arc::clone(&stop.asked))?;
        }
        // A file beyond the limit of its size is an error of the write, not the end.
        flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))?;
        // SAFETY: the handler makes two system calls, which may be made from a handler, and ends
        // the process.
        unsafe { low_level::register(SIGBUS, || say_and_end(&[PAGE_LOST], Exit::Unusable)) }?;
        Ok(stop)
    }

    /// Whether the work should stop at the next safe point.
    pub fn is_asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// The exit code of a run that stopped because it was asked to.
    pub fn exit(&self) -> Exit {
        if self.signal.load(Ordering::Relaxed) == SIGTERM as usize {
            Exit::Terminated
        } else {
            Exit::Interrupted
        }
    }
}
