//! What the user asked for, and what the run may use.

use std::path::PathBuf;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::contour::Method;
use crate::ingest::SheetRule;
use crate::io::Format;
use crate::mesh::{Attributes, LengthUnit};
use crate::repair::RepairError;
use crate::repair::length::{Length, LengthError, Reach};
use crate::sign::FillRule;
use crate::store::Backing;

/// How fine the grid is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Depth {
    /// Cells of 0.4 % of the diagonal; deeper where much of the model is thinner than a cell.
    Auto {
        /// The deepest level that may be chosen.
        max_depth: u32,
    },
    /// 2^levels cells a side.
    Levels(u32),
    /// The smallest depth whose cells are at most twice this length, up to `max_depth`.
    Tolerance {
        /// The largest deviation asked for.
        length: Length,
        /// The deepest level that may be chosen.
        max_depth: u32,
    },
}

impl Depth {
    /// Shallowest and deepest grids.
    pub const RANGE: std::ops::RangeInclusive<u32> = 4..=15;
    /// Chosen by the model.
    pub const DEFAULT: Self = Self::Auto { max_depth: Self::DEFAULT_MAX };
    /// The tolerance that the grid begins with when it is chosen by the model.
    pub const DEFAULT_TOLERANCE: Length = Length::Percent(0.2);
    /// The deepest level that is chosen unless the user allows more.
    pub const DEFAULT_MAX: u32 = 12;
}

/// What becomes of walls thinner than a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ThinRule {
    /// The grid gets deeper where its depth is chosen by the model; what is thin still is thickened.
    #[default]
    Deeper,
    /// They become as thick as sheets do.
    Thicken,
    /// They go where the grid misses them.
    Drop,
}

/// What becomes of parts that nobody sees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HiddenRule {
    /// They go, with the fill rule `solid`; the others keep what is within.
    #[default]
    Remove,
    /// They stay where the outside touches them.
    Keep,
}

/// Which openings are filled; the others are wanted, and what they open into gets walls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MaxHole {
    /// Those that are small for their shell.
    #[default]
    Auto,
    /// All.
    All,
    /// Those that are no wider than this.
    Size(Reach),
}

impl FromStr for MaxHole {
    type Err = LengthError;

    fn from_str(text: &str) -> Result<Self, LengthError> {
        match text.trim() {
            "auto" => Ok(Self::Auto),
            "all" => Ok(Self::All),
            size => size.parse().map(Self::Size),
        }
    }
}

/// Which normals the output gets, where its format holds any.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalRule {
    /// Normals if the input has some: smooth, but for creases.
    #[default]
    Keep,
    /// The same whatever the input has.
    Smooth,
    /// None.
    None,
}

/// What becomes of the parts of a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PartsRule {
    /// All of them become one solid.
    #[default]
    Union,
    /// Each is repaired for itself, and keeps its name and its places.
    Separate,
}

/// Where images lie that an output names and does not hold (OBJ, PLY).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TextureRule {
    /// Those beside the input stay there; those inside of it come beside the output.
    #[default]
    Refer,
    /// All come beside the output.
    Copy,
}

/// Everything that changes the result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// How fine.
    pub depth: Depth,
    /// What is inside.
    pub fill_rule: FillRule,
    /// What becomes of sheets without thickness.
    pub sheets: SheetRule,
    /// What becomes of walls thinner than a cell.
    pub thin: ThinRule,
    /// What becomes of the parts of a model.
    #[serde(default)]
    pub parts: PartsRule,
    /// What becomes of parts that nobody sees.
    pub hidden: HiddenRule,
    /// Which openings are filled.
    pub max_hole: MaxHole,
    /// Rims that are no farther apart than this face each other across a crack.
    pub max_gap: Reach,
    /// Thickness of the walls that sheets become.
    pub sheet_thickness: Reach,
    /// Smaller dihedral angles are noise.
    pub crease_deg: f64,
    /// The contouring method.
    pub method: Method,
    /// Cells are merged where no plane lies farther than this from the vertex that stands for
    /// them; 0 for none.
    pub decimate: Reach,
    /// The threshold above is raised until the surface has at most so many triangles.
    pub max_triangles: Option<u64>,
    /// What a model unit is, for files that do not say so.
    pub unit: Option<LengthUnit>,
    /// The unit that numbers are turned into; they stay as they are if `None`.
    #[serde(default)]
    pub to_unit: Option<LengthUnit>,
    /// Where images lie that the output does not hold.
    #[serde(default)]
    pub textures: TextureRule,
    /// Which normals the output gets.
    pub normals: NormalRule,
    /// Whether what closes openings is told apart in the output, where its format can.
    pub tag_patches: bool,
    /// Whether the output is compared with the input at the end.
    pub deviation: bool,
    /// Refuse broken faces in place of dropping them.
    pub strict: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            depth: Depth::DEFAULT,
            fill_rule: FillRule::Solid,
            sheets: SheetRule::Thicken,
            thin: ThinRule::Deeper,
            parts: PartsRule::Union,
            hidden: HiddenRule::Remove,
            max_hole: MaxHole::Auto,
            max_gap: Reach::Cells(2.0),
            sheet_thickness: Reach::Cells(2.0),
            crease_deg: 12.0,
            method: Method::Mdc,
            decimate: Reach::DEFAULT_DECIMATE,
            max_triangles: None,
            unit: None,
            to_unit: None,
            textures: TextureRule::Refer,
            normals: NormalRule::Keep,
            tag_patches: false,
            deviation: true,
            strict: false,
        }
    }
}

impl Settings {
    /// The attributes that an output of `format` gets if the input has them. Marching cubes does not
    /// know which triangles its surface comes from.
    pub(crate) fn takes(&self, format: Format) -> Attributes {
        let has_sources = self.method != Method::Mc;
        let normals = self.normals != NormalRule::None;
        format.attributes().and(Attributes { uvs: has_sources, colours: has_sources, normals })
    }

    /// The attributes that an output of `format` gets if the input has `given`.
    pub(crate) fn gets(&self, format: Format, given: Attributes) -> Attributes {
        let normals = given.normals || self.normals == NormalRule::Smooth;
        self.takes(format).and(Attributes { normals, ..given })
    }

    /// Refuses what cannot be, whatever the model.
    ///
    /// # Errors
    /// [`RepairError::NothingToMerge`], [`RepairError::OnlyAsUnion`].
    pub(crate) fn check(&self) -> Result<(), RepairError> {
        if self.max_triangles.is_some() && self.method != Method::Mdc {
            return Err(RepairError::NothingToMerge { option: "--max-triangles" });
        }
        if self.max_triangles.is_some() && self.parts == PartsRule::Separate {
            return Err(RepairError::OnlyAsUnion { option: "--max-triangles" });
        }
        Ok(())
    }
}

/// What a run may use; nothing here changes the result.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Peak resident memory of the process.
    pub max_memory_bytes: u64,
    /// Worker threads; fewer are taken when memory is short.
    pub threads: usize,
    /// Most that the work folder and the output may take of the disk; no limit when `None`.
    pub max_disk_bytes: Option<u64>,
    /// Where the work folder goes; beside the output when `None`.
    pub work_dir: Option<PathBuf>,
    /// Discard what an earlier run of the same work left.
    pub fresh: bool,
    /// Long steps note their progress each time they have written this much.
    pub checkpoint_bytes: u64,
    /// Share of every sort and table, for tests of the spilled forms; from the budget when `None`.
    pub share_bytes: Option<u64>,
    /// Files beside the output that may be replaced whatever is in them: those of an earlier result.
    pub replaces: Vec<PathBuf>,
    /// Where brick files lie.
    pub backing: Backing,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_memory_bytes: 1 << 30,
            threads: 1,
            max_disk_bytes: None,
            work_dir: None,
            fresh: false,
            checkpoint_bytes: 16 << 20,
            share_bytes: None,
            replaces: Vec::new(),
            backing: Backing::Mapped,
        }
    }
}
