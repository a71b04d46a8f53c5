//! The end of a process that can do nothing more than say why.

use crate::cli::exit_code::Exit;

/// Writes the parts of a line to stderr and ends the process: no memory is asked for, no lock is
/// taken, nothing is tidied up. A later run goes on from the last checkpoint.
pub fn say_and_end(parts: &[&str], exit: Exit) -> ! {
    for part in parts {
        let _ = rustix::io::write(rustix::stdio::stderr(), part.as_bytes());
    }
    signal_hook::low_level::exit(exit as i32)
}
