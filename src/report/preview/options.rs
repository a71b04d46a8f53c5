//! What a preview shows, and what is known of it afterwards.

#[cfg(doc)]
use crate::mesh::Surface;

/// The directions from which the model is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Views {
    /// One view from the front, the right and above.
    #[default]
    Isometric,
    /// Two by two: front, back, top and isometric, row by row.
    Four,
    /// Along the axes: front, back, right, left, top and bottom.
    Six,
    /// These, and from the corners of a cube.
    Fourteen,
}

/// The axis of the model that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum UpAxis {
    /// Front is +Z, right is +X, as in most OBJ and glTF files.
    #[default]
    Y,
    /// Front is -Y, right is +X, as in most files for printing and CAD.
    Z,
}

/// How it is known what of the output closes an opening (EXR).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum PatchRule {
    /// It is not.
    #[default]
    Unknown,
    /// The output tells: by materials whose names end with [`Surface::PATCH_ENDING`].
    Tagged,
    /// It lies farther from the input than this, model units.
    Beyond(f64),
}

/// How a preview is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreviewOptions {
    /// Width of one view of one side.
    pub width_px: u32,
    /// Height of one view.
    pub height_px: u32,
    /// Memory for samples and rows.
    pub share_bytes: u64,
    /// From where the model is seen.
    pub views: Views,
    /// Which axis points up.
    pub up: UpAxis,
    /// Whether the edges of triangles are drawn as dark lines.
    pub edges: bool,
    /// Whether creases, and where one surface ends before another, are drawn as dark lines (PNG).
    pub creases: bool,
    /// How patches are known (EXR).
    pub patches: PatchRule,
}

impl Default for PreviewOptions {
    fn default() -> Self {
        Self {
            width_px: 900,
            height_px: 900,
            share_bytes: 64 << 20,
            views: Views::default(),
            up: UpAxis::default(),
            edges: false,
            creases: true,
            patches: PatchRule::default(),
        }
    }
}

/// What was drawn of one side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct SideStats {
    /// Triangles that came out of the source.
    pub triangles: u64,
    /// Triangles left out because a corner is not finite, or too far off to be projected.
    pub skipped_triangles: u64,
    /// Samples, over all views, that show a front face.
    pub front_samples: u64,
    /// Samples that show a back face; above zero, a wrong normal or a hole can be seen.
    pub back_samples: u64,
}

/// What was drawn.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PreviewStats {
    /// Width of the picture (PNG) or of a layer (EXR).
    pub width_px: u32,
    /// Height of the picture or of a layer.
    pub height_px: u32,
    /// Bands into which the picture was cut; each streams both sources once.
    pub bands: u32,
    /// The mesh before the repair.
    pub input: SideStats,
    /// The mesh after the repair.
    pub output: SideStats,
    /// The largest deviation that the map shows, model units; `None` where there is no map.
    pub largest_deviation: Option<f64>,
    /// Size of the finished file.
    pub bytes: u64,
}
