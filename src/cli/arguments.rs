//! Arguments that commands share: what changes the result, and what a run may use.

use std::path::PathBuf;

use brickmend::contour::Method;
use brickmend::ingest::SheetRule;
use brickmend::io::Format;
use brickmend::mesh::LengthUnit;
use brickmend::repair::{
    Depth, HiddenRule, Length, Limits, MaxHole, NormalRule, PartsRule, Reach, Settings,
    TextureRule, ThinRule,
};
use brickmend::sign::FillRule;
use clap::{Args, ValueEnum};

/// What changes the result.
#[derive(Debug, Args)]
#[command(next_help_heading = "Result")]
pub struct ResultArguments {
    /// Octree depth, 4 to 15: 2^DEPTH cells a side; or auto: cells of 0.4% of the bounding box
    /// diagonal, and deeper where much of the model is thinner than a cell. [default: auto]
    #[arg(long, value_parser = parse_depth)]
    depth: Option<DepthArgument>,
    /// Largest deviation, in model units or % of the bounding box diagonal; chooses the depth.
    #[arg(long, value_name = "LENGTH", conflicts_with = "depth")]
    tolerance: Option<Length>,
    /// Deepest depth that may be chosen.
    #[arg(long, default_value_t = Depth::DEFAULT_MAX,
          value_parser = clap::value_parser!(u32).range(4..=15))]
    max_depth: u32,
    /// What is inside.
    #[arg(long, value_enum, default_value_t = FillRuleName::Solid)]
    fill_rule: FillRuleName,
    /// What becomes of sheets without thickness.
    #[arg(long, value_enum, default_value_t = SheetRuleName::Thicken)]
    sheets: SheetRuleName,
    /// What becomes of walls thinner than a cell.
    #[arg(long, value_enum, default_value_t = ThinRuleName::Deeper)]
    thin: ThinRuleName,
    /// What becomes of the parts of a file (OBJ o and g, nodes of glTF, objects of 3MF).
    #[arg(long, value_enum, default_value_t = PartsRuleName::Union)]
    parts: PartsRuleName,
    /// What becomes of parts that nobody sees from outside; with --fill-rule solid.
    #[arg(long, value_enum, default_value_t = HiddenRuleName::Remove)]
    hidden: HiddenRuleName,
    /// Thickness of the walls that sheets without thickness become; in cells (2cells), model units,
    /// or % of the bounding box diagonal.
    #[arg(long, value_name = "LENGTH", default_value = "2cells", value_parser = parse_length)]
    sheet_thickness: Reach,
    /// Which openings are filled: all that are small for their shell (auto), all, or those no wider
    /// than a length. What the others open into gets walls.
    #[arg(long, value_name = "auto|all|LENGTH", default_value = "auto")]
    max_hole: MaxHole,
    /// Rims closer than this face each other across a crack, which is closed; 0 for none.
    #[arg(long, value_name = "LENGTH", default_value = "2cells")]
    max_gap: Reach,
    /// Angle in degrees below which a crease is noise.
    #[arg(long, value_name = "DEGREES", default_value = "12", value_parser = parse_angle)]
    crease: f64,
    /// Merge cells where no plane of the input lies farther than this from the vertex that stands
    /// for them; in cells (0.1cells), model units, or % of the bounding box diagonal; 0 merges
    /// none.
    #[arg(long, value_name = "LENGTH", default_value_t = Reach::DEFAULT_DECIMATE)]
    decimate: Reach,
    /// Merge more cells than --decimate says where that gives at most so many triangles.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    max_triangles: Option<u64>,
    /// How the surface is drawn. The guarantees rest on mdc; the others are for comparison. Where
    /// the proof of another one's file fails, the file is kept and the run ends with 4.
    #[arg(long, value_enum, default_value_t = MethodName::Mdc)]
    method: MethodName,
    /// What a model unit is, for files that do not say so: then lengths may be given in mm, cm, m or
    /// in, and 3MF and GLB outputs say it. No number is changed.
    #[arg(long, value_name = "UNIT", value_parser = parse_unit)]
    units: Option<LengthUnit>,
    /// Turn all numbers into this unit. Lengths given without a unit are in it, too.
    #[arg(long, value_name = "UNIT", value_parser = parse_unit)]
    to_units: Option<LengthUnit>,
    /// Which normals the output gets, in OBJ and GLB: smooth, but for creases (--crease), if the
    /// input has some (keep) or always (smooth).
    #[arg(long, value_enum, default_value_t = NormalRuleName::Keep)]
    normals: NormalRuleName,
    /// Where images lie that the output names and does not hold, in OBJ and PLY [default: refer; copy
    /// for batch].
    #[arg(long, value_enum)]
    pub textures: Option<TextureRuleName>,
    /// Give what closes openings a material of its own: NAME.patch for what NAME surrounds. In OBJ,
    /// PLY, 3MF and GLB.
    #[arg(long)]
    tag_patches: bool,
    /// Do not measure how far the output lies from the input.
    #[arg(long)]
    no_deviation: bool,
    /// Refuse NaN, infinite corners and wild indices in place of dropping such faces.
    #[arg(long)]
    strict: bool,
}

/// What a run may use.
#[derive(Debug, Args)]
#[command(next_help_heading = "Resources")]
pub struct ResourceArguments {
    /// Peak resident memory, such as 256MiB or 1GB.
    #[arg(long, value_name = "SIZE", default_value = "1GiB", value_parser = parse_size)]
    pub max_memory: u64,
    /// Worker threads [default: one per processor].
    #[arg(short = 'j', long, value_name = "N")]
    threads: Option<usize>,
    /// Folder for scratch files [default: beside the output].
    #[arg(long, value_name = "DIR")]
    pub work_dir: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FillRuleName {
    /// All that the outside cannot reach: unites overlaps, fills cavities.
    Solid,
    /// Winding number by the orientation of triangles, most votes count: keeps cavities, unites
    /// overlaps.
    Nonzero,
    /// Parity of the walls crossed: keeps cavities, hollows overlaps.
    Evenodd,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SheetRuleName {
    /// Free ones become plates; fins, flat sheets that hang from a surface by an edge, go.
    Thicken,
    /// Flat free ones and fins go.
    Remove,
    /// All become plates.
    KeepFins,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ThinRuleName {
    /// With --depth auto the grid gets deeper; what is thin still is thickened.
    Deeper,
    /// They become as thick as sheets do.
    Thicken,
    /// They go where the grid misses them, and are counted.
    Drop,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PartsRuleName {
    /// All become one solid.
    Union,
    /// Each is repaired for itself, and keeps its name and its places; where the output has scenes
    /// (GLB, 3MF) also nodes, transforms and what is shared.
    Separate,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum HiddenRuleName {
    /// They go, and are named in the outcome.
    Remove,
    /// They stay, unless they are sealed in.
    Keep,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TextureRuleName {
    /// Those beside the input stay there; those inside of it come beside the output.
    Refer,
    /// All come beside the output.
    Copy,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum NormalRuleName {
    /// Normals where the input has some.
    Keep,
    /// Normals.
    Smooth,
    /// None.
    None,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MethodName {
    /// Manifold dual contouring: creases and corners stay sharp.
    Mdc,
    /// Dual contouring: one vertex a cell, so not manifold where sheets share a cell.
    Dc,
    /// Dual marching cubes: vertices in the middle of their crossings, so creases are round.
    Dmc,
    /// Marching cubes: sound as well, but cuts creases and corners off, and leaves slivers.
    Mc,
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Mdc => Self::Mdc,
            MethodName::Dc => Self::Dc,
            MethodName::Dmc => Self::Dmc,
            MethodName::Mc => Self::Mc,
        }
    }
}

/// A format that is written, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FormatName {
    Obj,
    Stl,
    Ply,
    Off,
    #[value(name = "3mf")]
    ThreeMf,
    Glb,
}

impl From<FormatName> for Format {
    fn from(name: FormatName) -> Self {
        match name {
            FormatName::Obj => Self::Obj,
            FormatName::Stl => Self::Stl,
            FormatName::Ply => Self::Ply,
            FormatName::Off => Self::Off,
            FormatName::ThreeMf => Self::ThreeMf,
            FormatName::Glb => Self::Glb,
        }
    }
}

impl ResultArguments {
    pub fn settings(&self) -> Settings {
        let max_depth = self.max_depth;
        let depth = match (self.depth, self.tolerance) {
            (Some(DepthArgument::Levels(depth)), _) => Depth::Levels(depth),
            (_, Some(length)) => Depth::Tolerance { length, max_depth },
            _ => Depth::Auto { max_depth },
        };
        let fill_rule = match self.fill_rule {
            FillRuleName::Solid => FillRule::Solid,
            FillRuleName::Nonzero => FillRule::Nonzero,
            FillRuleName::Evenodd => FillRule::Evenodd,
        };
        let sheets = match self.sheets {
            SheetRuleName::Thicken => SheetRule::Thicken,
            SheetRuleName::Remove => SheetRule::Remove,
            SheetRuleName::KeepFins => SheetRule::KeepFins,
        };
        let thin = match self.thin {
            ThinRuleName::Deeper => ThinRule::Deeper,
            ThinRuleName::Thicken => ThinRule::Thicken,
            ThinRuleName::Drop => ThinRule::Drop,
        };
        let parts = match self.parts {
            PartsRuleName::Union => PartsRule::Union,
            PartsRuleName::Separate => PartsRule::Separate,
        };
        let hidden = match self.hidden {
            HiddenRuleName::Remove => HiddenRule::Remove,
            HiddenRuleName::Keep => HiddenRule::Keep,
        };
        let (max_hole, max_gap) = (self.max_hole, self.max_gap);
        let sheet_thickness = self.sheet_thickness;
        let (crease_deg, strict) = (self.crease, self.strict);
        let (decimate, max_triangles) = (self.decimate, self.max_triangles);
        let method = self.method.into();
        let normals = match self.normals {
            NormalRuleName::Keep => NormalRule::Keep,
            NormalRuleName::Smooth => NormalRule::Smooth,
            NormalRuleName::None => NormalRule::None,
        };
        let textures = match self.textures {
            None | Some(TextureRuleName::Refer) => TextureRule::Refer,
            Some(TextureRuleName::Copy) => TextureRule::Copy,
        };
        Settings {
            depth,
            fill_rule,
            sheets,
            thin,
            parts,
            hidden,
            max_hole,
            max_gap,
            sheet_thickness,
            crease_deg,
            method,
            decimate,
            max_triangles,
            unit: self.units,
            to_unit: self.to_units,
            textures,
            normals,
            tag_patches: self.tag_patches,
            deviation: !self.no_deviation,
            strict,
        }
    }
}

impl ResourceArguments {
    pub fn limits(&self) -> Limits {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        Limits {
            max_memory_bytes: self.max_memory,
            threads: self.threads.unwrap_or(processors),
            work_dir: self.work_dir.clone(),
            ..Limits::default()
        }
    }
}

fn parse_length(text: &str) -> Result<Reach, String> {
    match text.parse::<Reach>() {
        Ok(Reach::Cells(cells)) if cells <= 0.0 => Err("a wall needs a thickness".to_owned()),
        Ok(length) => Ok(length),
        Err(error) => Err(error.to_string()),
    }
}

/// What `--depth` says.
#[derive(Clone, Copy, Debug)]
enum DepthArgument {
    Auto,
    Levels(u32),
}

fn parse_depth(text: &str) -> Result<DepthArgument, String> {
    if text == "auto" {
        return Ok(DepthArgument::Auto);
    }
    let levels = text.parse().ok().filter(|levels| Depth::RANGE.contains(levels));
    levels.map(DepthArgument::Levels).ok_or_else(|| "expected auto, or 4 to 15".to_owned())
}

fn parse_angle(text: &str) -> Result<f64, String> {
    match text.trim_end_matches("deg").trim().parse::<f64>() {
        Ok(degrees) if (0.0..=90.0).contains(&degrees) => Ok(degrees),
        _ => Err("expected an angle from 0 to 90 degrees".to_owned()),
    }
}

/// A unit by its name or its sign.
pub fn parse_unit(text: &str) -> Result<LengthUnit, String> {
    let name = match text {
        "um" => "micron",
        "mm" => "millimeter",
        "cm" => "centimeter",
        "in" => "inch",
        "ft" => "foot",
        "m" => "meter",
        name => name,
    };
    let expected = "expected um, mm, cm, in, ft or m";
    LengthUnit::of(name).ok_or_else(|| format!("{expected}, found {text:?}"))
}

/// Sizes with decimal (kB, MB, GB) or binary (KiB, MiB, GiB) units.
pub fn parse_size(text: &str) -> Result<u64, String> {
    let refuse = || format!("expected a size such as 256MiB or 1GB, found {text:?}");
    let split = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let number: f64 = number.parse().map_err(|_| refuse())?;
    let factor = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kb" => 1e3,
        "m" | "mb" => 1e6,
        "g" | "gb" => 1e9,
        "t" | "tb" => 1e12,
        "kib" => 1024.0,
        "mib" => 1024.0_f64.powi(2),
        "gib" => 1024.0_f64.powi(3),
        "tib" => 1024.0_f64.powi(4),
        _ => return Err(refuse()),
    };
    Ok((number * factor) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_decimal_or_binary_by_their_unit() {
        assert_eq!(parse_size("256MiB"), Ok(256 << 20));
        assert_eq!(parse_size("1GB"), Ok(1_000_000_000));
        assert_eq!(parse_size("1.5 GiB"), Ok(3 << 29));
        assert!(parse_size("many").is_err());
        assert!(parse_size("1 parsec").is_err());
    }
}
