//! `brickmend verify`: proves a file, and measures how far it lies from an original.

use std::fmt::Write as _;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use brickmend::deviate::{Deviation, Distances, Separation};
use brickmend::mesh::LengthUnit;
use brickmend::repair::{
    Degrees, Length, Limits, Share, SurfaceReport, Threshold, Verdict, Verification,
    VerifySettings, VertexNames, verify_file,
};
use clap::Args;

use crate::cli::arguments::{ResourceArguments, parse_size, parse_unit};
use crate::cli::exit_code::{EXIT_STATUS, Exit};
use crate::cli::export::Export;
use crate::cli::numbers::short;
use crate::cli::progress::{Chatter, Progress, on_one_line};
use crate::cli::signals::Stop;

/// Arguments of `brickmend verify`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub struct VerifyArguments {
    /// The model, whichever tool made it: OBJ, STL, PLY, OFF, 3MF or glTF, told by content.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// What it was made from; it may be open, inverted, or a soup.
    #[arg(long, value_name = "ORIGINAL")]
    against: Option<PathBuf>,
    /// Vertices in one place are one, whatever the file says. So it is in STL and glTF, and in PLY
    /// with texture coordinates or colours.
    #[arg(long)]
    by_place: bool,
    #[command(flatten)]
    measures: MeasureArguments,
    #[command(flatten)]
    resources: ResourceArguments,
    /// Most that scratch files may take of the disk, such as 20GB [default: no limit].
    #[arg(long, value_name = "SIZE", value_parser = parse_size, help_heading = "Resources")]
    max_disk: Option<u64>,
    /// Write both surfaces as PLY into this folder, coloured by how far they lie from each other:
    /// file.ply shows what FILE invented, original.ply what it lost.
    #[arg(long, requires = "against", value_name = "DIR", help_heading = "Report")]
    export: Option<PathBuf>,
    /// Print the verification as JSON on stdout; see docs/verify.md.
    #[arg(long, help_heading = "Report")]
    json: bool,
}

/// How far FILE may lie from ORIGINAL. REVIEW,FAIL are two values: beyond the first the verdict is
/// review, beyond the second fail; with one value it never fails.
#[derive(Debug, Args)]
#[command(next_help_heading = "Thresholds (REVIEW, or REVIEW,FAIL)")]
struct MeasureArguments {
    /// Surface that is farther away than this is lost or invented; in model units, with a unit, or
    /// in % of the diagonal of ORIGINAL's bounding box.
    #[arg(long, requires = "against", value_name = "LENGTH",
          default_value_t = VerifySettings::default().tolerance)]
    tolerance: Length,
    /// Largest distance, from what is seen of ORIGINAL to FILE, or from FILE to ORIGINAL.
    #[arg(long, requires = "against", value_name = "LENGTHS",
          default_value_t = VerifySettings::default().max_deviation)]
    max_deviation: Threshold<Length>,
    /// Share of what is seen of ORIGINAL that FILE lacks.
    #[arg(long, requires = "against", value_name = "PERCENTS",
          default_value_t = VerifySettings::default().max_lost)]
    max_lost: Threshold<Share>,
    /// Share of FILE's area that ORIGINAL lacks.
    #[arg(long, requires = "against", value_name = "PERCENTS",
          default_value_t = VerifySettings::default().max_invented)]
    max_invented: Threshold<Share>,
    /// Median angle between normals.
    #[arg(long, requires = "against", value_name = "DEGREES",
          default_value_t = VerifySettings::default().max_normal)]
    max_normal: Threshold<Degrees>,
    /// Share of ORIGINAL's visible sharp edges that FILE has, at least.
    #[arg(long, requires = "against", value_name = "PERCENTS",
          default_value_t = VerifySettings::default().min_creases)]
    min_creases: Threshold<Share>,
    /// Difference of volume, where both are sound.
    #[arg(long, requires = "against", value_name = "PERCENTS",
          default_value_t = VerifySettings::default().max_volume)]
    max_volume: Threshold<Share>,
    /// Difference in the number of components, where both are sound.
    #[arg(long, requires = "against", value_name = "COUNTS",
          default_value_t = VerifySettings::default().max_components)]
    max_components: Threshold<u64>,
    /// Difference of the genus, where both are sound: tunnels filled or new.
    #[arg(long, requires = "against", value_name = "COUNTS",
          default_value_t = VerifySettings::default().max_genus)]
    max_genus: Threshold<u64>,
    /// Points that are measured of each surface, and at most as many corners besides.
    #[arg(long, requires = "against", value_name = "N",
          default_value_t = VerifySettings::default().samples,
          value_parser = clap::value_parser!(u64).range(1..), help_heading = "Measuring")]
    samples: u64,
    /// Tell distances in cells of this size as well.
    #[arg(long, requires = "against", value_name = "LENGTH", help_heading = "Measuring")]
    cell: Option<Length>,
    /// What a model unit is, for files that do not say so.
    #[arg(long, requires = "against", value_name = "UNIT", value_parser = parse_unit,
          help_heading = "Measuring")]
    units: Option<LengthUnit>,
}

impl VerifyArguments {
    fn settings(&self) -> VerifySettings {
        let measures = &self.measures;
        VerifySettings {
            by_place: self.by_place,
            unit: measures.units,
            samples: measures.samples,
            tolerance: measures.tolerance,
            cell: measures.cell,
            max_deviation: measures.max_deviation,
            max_lost: measures.max_lost,
            max_invented: measures.max_invented,
            max_normal: measures.max_normal,
            min_creases: measures.min_creases,
            max_volume: measures.max_volume,
            max_components: measures.max_components,
            max_genus: measures.max_genus,
        }
    }
}

/// Runs the command.
pub fn run(arguments: &VerifyArguments, chatter: &Chatter) -> ExitCode {
    let stop = match Stop::listen() {
        Ok(stop) => stop,
        Err(error) => {
            chatter.error(&error);
            return Exit::Internal.into();
        }
    };
    let limits = Limits { max_disk_bytes: arguments.max_disk, ..arguments.resources.limits() };
    let progress = Progress::new(*chatter, stop.clone());
    let original = arguments.against.as_deref();
    let result = verify_file(&arguments.file, original, &arguments.settings(), &limits, &progress);
    progress.clear();
    match result {
        Ok(verification) => {
            tell(&verification, arguments.json, chatter);
            if let (Some(folder), Some(original)) = (&arguments.export, &arguments.against) {
                let export = Export {
                    folder,
                    surfaces: [original, &arguments.file],
                    limits: &limits,
                    monitor: &progress,
                };
                if let Err(error) = export.write(verification.deviation.as_ref()) {
                    chatter.error(&error);
                    return if stop.is_asked() { stop.exit() } else { Exit::Unusable }.into();
                }
            }
            match verification.verdict {
                Verdict::Fail => Exit::NoResult.into(),
                Verdict::Pass | Verdict::Review => Exit::Success.into(),
            }
        }
        Err(error) => {
            chatter.error(&error);
            match Exit::from(&error) {
                Exit::Interrupted => stop.exit().into(),
                exit => exit.into(),
            }
        }
    }
}

fn tell(verification: &Verification, json: bool, chatter: &Chatter) {
    let text = if json {
        serde_json::to_string_pretty(verification).expect("plain records serialise")
    } else if chatter.is_quiet() {
        return;
    } else {
        report(verification)
    };
    // A reader that went away is no failure of the verification.
    let _ = writeln!(std::io::stdout(), "{}", text.trim_end());
}

fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "pass",
        Verdict::Review => "review",
        Verdict::Fail => "fail",
    }
}

fn report(verification: &Verification) -> String {
    let mut text = on_one_line(&verification.file.path.display().to_string());
    let _ = writeln!(text, ": {}", word(verification.verdict));
    for reason in &verification.reasons {
        let _ = writeln!(text, "  {}: {}", word(reason.verdict), reason.text);
    }
    if verification.proof.holds() {
        text.push_str(
            "  proved: closed, manifold, oriented, no degenerate or intersecting triangle",
        );
        text.push_str(match verification.vertices {
            VertexNames::Numbers => "\n",
            VertexNames::Places => "; vertices by place\n",
        });
    }
    write_surface(&mut text, "file", &verification.file);
    if let Some(original) = &verification.original {
        write_surface(&mut text, "original", original);
    }
    if let Some(deviation) = &verification.deviation {
        write_deviation(&mut text, deviation);
    }
    text
}

fn write_surface(text: &mut String, name: &str, surface: &SurfaceReport) {
    let size = match (surface.genus, surface.volume) {
        (Some(genus), Some(volume)) => format!("volume {}, genus {genus}", short(volume)),
        _ => "not closed".to_owned(),
    };
    let components = surface.components;
    let _ = writeln!(
        text,
        "  {name:9} {} triangles in {components} component{}, area {}, {size}",
        surface.triangles,
        if components == 1 { "" } else { "s" },
        short(surface.area),
    );
}

fn write_deviation(text: &mut String, deviation: &Deviation) {
    let _ = writeln!(
        text,
        "  {:20} {:>11} {:>11} {:>11} {:>11}   normals",
        "distance", "mean", "rms", "99.9 %", "largest"
    );
    write_distances(text, "original to file", &deviation.original_to_file);
    write_distances(text, "file to original", &deviation.file_to_original);
    let tolerance = short(deviation.tolerance);
    let lost = &deviation.lost;
    let _ = writeln!(
        text,
        "  within {tolerance}: lost {} of the visible surface ({} are visible){}, invented {}",
        percent(lost.share),
        percent(lost.visible_share),
        at(lost.largest.filter(|found| found.distance > deviation.tolerance)),
        percent(deviation.invented_share),
    );
    let Some(creases) = &deviation.creases else { return };
    match creases.kept_share {
        Some(kept) => {
            let length = short(creases.visible_length);
            let _ = writeln!(text, "  sharp edges: {} kept of length {length}", percent(kept));
        }
        None => text.push_str("  sharp edges: none is visible\n"),
    }
}

fn write_distances(text: &mut String, name: &str, distances: &Distances) {
    let largest = distances.largest.map_or(0.0, |found| found.distance);
    let [mean, rms, p999, largest] =
        [distances.mean, distances.rms, distances.p999, largest].map(short);
    let normals = &distances.normals;
    let _ = writeln!(
        text,
        "  {name:20} {mean:>11} {rms:>11} {p999:>11} {largest:>11}   median {:.1}, 99 % {:.1} deg",
        normals.median_deg, normals.p99_deg
    );
    if let Some(in_cells) = distances.in_cells {
        let [mean, rms, p999, largest] = in_cells.map(|cells| format!("{cells:.3}"));
        let _ =
            writeln!(text, "  {:20} {mean:>11} {rms:>11} {p999:>11} {largest:>11}", "  in cells");
    }
}

fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

fn at(found: Option<Separation>) -> String {
    found.map_or(String::new(), |found| {
        let [x, y, z] = found.position.map(short);
        format!(" at ({x} {y} {z})")
    })
}
