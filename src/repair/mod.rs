//! The one place that knows the order of the stages.
//!
//! In:         a model file, [`Settings`], [`Limits`].
//! Out:        a proven file in its place, and an [`Outcome`] that tells everything; one of each
//!             per level of detail.
//! Invariant:  the output appears whole or not at all; what was there before stays until then.
//! Memory:     [`Limits::max_memory_bytes`], shared out by one accountant.
//! Fails:      [`RepairError`], one message with place, and the work folder kept or removed.

mod choose;
mod deeper;
mod depth;
mod error;
mod estimate;
mod finish;
mod inspect;
mod inspect_export;
mod inspection;
mod length;
mod levels;
mod lock;
mod measuring;
mod mending;
mod outcome;
mod painting;
mod parts;
mod plan;
mod revising;
mod run;
mod settings;
mod stages;
mod standing;
mod step;
mod surfaces;
mod thresholds;
mod verdict;
mod verification;
mod verify_file;
mod workspace;
mod writing;

pub use deeper::DepthTrial;
pub use error::{Blame, RepairError};
pub use estimate::{Bounds, Counts, DiskSteps, ESTIMATE_VERSION, Estimate, estimate};
pub use inspect::{inspect, inspect_exporting};
pub use inspection::{
    INSPECTION_VERSION, InspectSettings, Inspection, ModelSize, RepairCost, ToleranceReport,
};
pub use length::{Length, LengthError, Reach, Ruler};
pub use levels::Levels;
pub use lock::lock_folder;
pub use outcome::{
    DiskReport, Dropped, Found, Invented, LayerReport, LayersReport, MemoryReport, Outcome,
    OutputReport, ResumeReport, SCHEMA_VERSION, SoupReport, StageReport, Verdict,
};
pub use parts::{LeftOut, PartReport, PartsOutcome, repair_parts};
pub use plan::{MemoryPlan, floor_bytes};
pub use run::{repair, repair_levels};
pub use settings::{
    Depth, HiddenRule, Limits, MaxHole, NormalRule, PartsRule, Settings, TextureRule, ThinRule,
};
pub use thresholds::{
    Degrees, Measured, NoNumber, Share, Threshold, ThresholdError, VerifySettings,
};
pub use verification::{
    Reason, SurfaceReport, Thresholds, VERIFICATION_VERSION, Verification, VertexNames,
};
pub use verify_file::verify_file;
