//! What the process says when it ends; every code is documented in the help of the commands.

use brickmend::repair::{Blame, RepairError};
use std::process::ExitCode;

/// The end of the process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All done.
    Success = 0,
    /// A bug of ours, which includes a failed proof.
    Internal = 1,
    /// The command line asks for what cannot be.
    Usage = 2,
    /// A batch is done, and some of its models failed.
    SomeFailed = 3,
    /// The result has no triangle, or another method's is not sound; an inspection that was to check
    /// found defects; or a verification failed.
    NoResult = 4,
    /// Output or scratch cannot be used.
    Unusable = 5,
    /// Another run holds the work folder.
    Locked = 6,
    /// Stopped by a limit; the same command goes on.
    Stopped = 7,
    /// The input cannot be read.
    Input = 65,
    /// The same command may well work the next time.
    Temporary = 75,
    /// Interrupted.
    Interrupted = 130,
    /// Asked to end.
    Terminated = 143,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

impl From<&RepairError> for Exit {
    fn from(error: &RepairError) -> Self {
        Self::from(error.blame())
    }
}

impl From<Blame> for Exit {
    fn from(blame: Blame) -> Self {
        match blame {
            Blame::Internal => Self::Internal,
            Blame::Usage => Self::Usage,
            Blame::Model => Self::NoResult,
            Blame::Disk => Self::Unusable,
            Blame::Lock => Self::Locked,
            Blame::Input => Self::Input,
            Blame::Temporary | Blame::Memory => Self::Temporary,
            Blame::Interrupted => Self::Interrupted,
            Blame::Limit => Self::Stopped,
        }
    }
}

/// For the help of commands.
pub const EXIT_STATUS: &str = "\
Exit status:
  0    done (the outcome may still ask for a look)
  1    internal error, also a failed proof: nothing is put in place
  2    usage, also a memory budget below the floor or a disk limit below the estimate
  4    the result has no triangle; or it is not sound, which --method mdc rules out; or
       inspect --check found defects; or the verdict of verify is fail
  5    output or scratch folder unusable, also a full disk: run again to go on
  6    another run holds the work folder
  7    stopped by --max-disk on the way: run again with more to go on
  65   the input cannot be read, or has no triangle
  75   the system had no memory left, or the input changed: run again to go on
  130  interrupted (SIGINT), state saved: run again to go on
  143  asked to end (SIGTERM), state saved: run again to go on";
