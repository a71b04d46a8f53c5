//! The words for what became of a model.

use serde::{Deserialize, Serialize};

use crate::repair::Blame;

/// Makes an enum whose members have names in the journal.
macro_rules! named {
    ($(#[$head:meta])* $name:ident { $($(#[$doc:meta])* $member:ident = $text:literal,)+ }) => {
        $(#[$head])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum $name { $($(#[$doc])* $member,)+ }

        impl $name {
            /// All of them, in order.
            pub const ALL: &[Self] = &[$(Self::$member,)+];

            /// Its name in the journal.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$member => $text,)+ }
            }

            /// The one that has this name.
            #[must_use]
            pub fn of(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|member| member.name() == name)
            }
        }
    };
}

named! {
    /// Where a model stands.
    State {
        /// There is no result yet, or none that still counts.
        Pending = "pending",
        /// Nothing was wrong with it; the result is a copy.
        Copied = "copied",
        /// Repaired as asked.
        Repaired = "repaired",
        /// Repaired, on a coarser grid than asked for, since nothing else came to an end.
        Degraded = "degraded",
        /// There is no result, and trying again would not help.
        Failed = "failed",
        /// The model is no longer in the folder; its result is left where it is.
        Gone = "gone",
    }
}

impl State {
    /// Whether there is a result.
    #[must_use]
    pub const fn has_result(self) -> bool {
        matches!(self, Self::Copied | Self::Repaired | Self::Degraded)
    }
}

named! {
    /// Why there is no result.
    Cause {
        /// The file cannot be read, or holds no triangle.
        Input = "input",
        /// The repair came to nothing.
        Model = "model",
        /// The settings do not fit this model.
        Usage = "usage",
        /// The memory did not do.
        Memory = "memory",
        /// The time did not do.
        Timeout = "timeout",
        /// The worker died.
        Crash = "crash",
        /// A bug of ours that the worker noticed.
        Internal = "internal",
        /// Output or scratch cannot be used.
        Disk = "disk",
        /// The disk limit did not do.
        DiskLimit = "disk_limit",
        /// Another process works on it.
        Lock = "lock",
        /// The model changed while it was read.
        Temporary = "temporary",
        /// The worker was asked to stop.
        Stopped = "stopped",
    }
}

impl From<Blame> for Cause {
    fn from(blame: Blame) -> Self {
        match blame {
            Blame::Internal => Self::Internal,
            Blame::Usage => Self::Usage,
            Blame::Model => Self::Model,
            Blame::Disk => Self::Disk,
            Blame::Lock => Self::Lock,
            Blame::Input => Self::Input,
            Blame::Temporary => Self::Temporary,
            Blame::Memory => Self::Memory,
            Blame::Interrupted => Self::Stopped,
            Blame::Limit => Self::DiskLimit,
        }
    }
}

named! {
    /// How much a worker is given, from one attempt to the next.
    Rung {
        /// Its share beside others.
        Shared = "shared",
        /// All memory and threads; goes on from the checkpoints of the attempt before.
        Alone = "alone",
        /// The same, on a grid one level coarser, from the start.
        Coarser = "coarser",
        /// Three levels coarser.
        Coarsest = "coarsest",
    }
}

impl Rung {
    /// Levels that the grid is coarser than predicted.
    #[must_use]
    pub const fn coarser_levels(self) -> u32 {
        match self {
            Self::Shared | Self::Alone => 0,
            Self::Coarser => 1,
            Self::Coarsest => 3,
        }
    }

    /// What is tried after this one came to nothing for `cause`.
    #[must_use]
    pub const fn next(self, cause: Cause) -> Option<Self> {
        match (cause, self) {
            // Another process has it for the moment, or the file was being written.
            (Cause::Lock | Cause::Temporary, Self::Shared) => Some(Self::Alone),
            (Cause::Memory | Cause::Timeout | Cause::Crash, Self::Shared) => Some(Self::Alone),
            (Cause::Memory | Cause::Timeout, Self::Alone) => Some(Self::Coarser),
            (Cause::Memory | Cause::Timeout, Self::Coarser) => Some(Self::Coarsest),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back() {
        assert!(State::ALL.iter().all(|&state| State::of(state.name()) == Some(state)));
        assert!(Cause::ALL.iter().all(|&cause| Cause::of(cause.name()) == Some(cause)));
        assert_eq!(State::of("lost"), None);
    }

    #[test]
    fn every_ladder_ends() {
        for &cause in Cause::ALL {
            let mut rung = Rung::Shared;
            let mut steps = 0;
            while let Some(next) = rung.next(cause) {
                assert!(next > rung);
                (rung, steps) = (next, steps + 1);
            }
            assert!(steps <= 3);
        }
        assert_eq!(Rung::Shared.next(Cause::Input), None);
        assert_eq!(Rung::Alone.next(Cause::Crash), None, "it would crash again");
    }
}
