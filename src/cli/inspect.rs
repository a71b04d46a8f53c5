//! `brickmend inspect`: what is wrong with models, before anything is repaired.

use std::fmt::Write as _;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use brickmend::defect::{Defect, DefectKind};
use brickmend::diagnose::{Finding, Measure};
use brickmend::mesh::LengthUnit;
use brickmend::repair::{InspectSettings, Inspection, Length, RepairCost, inspect_exporting};
use clap::Args;

use crate::cli::arguments::{ResourceArguments, parse_unit};
use crate::cli::exit_code::{EXIT_STATUS, Exit};
use crate::cli::numbers::short;
use crate::cli::progress::{Chatter, Progress, on_one_line};
use crate::cli::signals::Stop;

/// Arguments of `brickmend inspect`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub struct InspectArguments {
    /// The models: OBJ, STL, PLY, OFF, 3MF or glTF, told by content.
    #[arg(required = true, value_name = "FILE")]
    inputs: Vec<PathBuf>,
    /// End with 4 where a model has defects; remarks alone are none.
    #[arg(long)]
    check: bool,
    /// Walls thinner than this are told, in model units, with a unit, or in % of the bounding box
    /// diagonal: measured from the middle of each triangle straight to the other side.
    #[arg(long, value_name = "LENGTH", default_value_t = InspectSettings::DEFAULT_THIN)]
    thin: Length,
    /// Shells whose boxes have a smaller diagonal are told.
    #[arg(long, value_name = "LENGTH", default_value_t = InspectSettings::DEFAULT_TINY)]
    tiny: Length,
    /// A vertex that is no farther from an edge lies on it: a T-junction.
    #[arg(long, value_name = "LENGTH", default_value_t = InspectSettings::DEFAULT_JUNCTION)]
    junction: Length,
    /// What a model unit is, for files that do not say so.
    #[arg(long, value_name = "UNIT", value_parser = parse_unit)]
    units: Option<LengthUnit>,
    /// Write all points, edges and triangles with a defect into this folder, one PLY for each kind that
    /// is found; of one FILE. See docs/inspect.md.
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    #[command(flatten)]
    resources: ResourceArguments,
    /// Print each report as one line of JSON on stdout; see docs/inspect.md.
    #[arg(long, help_heading = "Report")]
    json: bool,
}

/// Files of the same names would come from each.
#[derive(Debug, thiserror::Error)]
#[error("--export takes one FILE; inspect the others by themselves")]
struct SeveralExports;

/// Runs the command: a report for each file, a line for each that cannot be read.
pub fn run(arguments: &InspectArguments, chatter: &Chatter) -> ExitCode {
    let stop = match Stop::listen() {
        Ok(stop) => stop,
        Err(error) => {
            chatter.error(&error);
            return Exit::Internal.into();
        }
    };
    if arguments.export.is_some() && arguments.inputs.len() > 1 {
        chatter.error(&SeveralExports);
        return Exit::Usage.into();
    }
    let settings = InspectSettings {
        thin: arguments.thin,
        tiny: arguments.tiny,
        junction: arguments.junction,
        unit: arguments.units,
    };
    let limits = arguments.resources.limits();
    let mut has_defects = false;
    let mut failure = None;
    for input in &arguments.inputs {
        let progress = Progress::new(*chatter, stop.clone());
        let result =
            inspect_exporting(input, &settings, arguments.export.as_deref(), &limits, &progress);
        progress.clear();
        match result {
            Ok(inspection) => {
                has_defects |= !inspection.is_sound;
                tell(&inspection, arguments.json, chatter);
            }
            Err(error) => {
                chatter.error(&error);
                match Exit::from(&error) {
                    Exit::Interrupted => return stop.exit().into(),
                    exit => failure.get_or_insert(exit),
                };
            }
        }
    }
    let found = if arguments.check && has_defects { Exit::NoResult } else { Exit::Success };
    // What could not be looked at outweighs what was found.
    failure.unwrap_or(found).into()
}

fn tell(inspection: &Inspection, json: bool, chatter: &Chatter) {
    let text = if json {
        serde_json::to_string(inspection).expect("plain records serialise")
    } else if chatter.is_quiet() {
        return;
    } else {
        report(inspection, chatter.is_verbose())
    };
    // A reader that went away is no failure of the inspection.
    let _ = writeln!(std::io::stdout(), "{}", text.trim_end());
}

/// Places that are told of each kind, unless all are asked for.
const FEW_PLACES: usize = 2;

fn report(inspection: &Inspection, verbose: bool) -> String {
    let mut text = on_one_line(&inspection.path.display().to_string());
    let kinds = inspection.defects().count();
    let notes = inspection.notes().count();
    let plural = |count: usize| if count == 1 { "" } else { "s" };
    let defects = match kinds {
        0 => "sound".to_owned(),
        kinds => format!("{kinds} kind{} of defects", plural(kinds)),
    };
    let _ = write!(text, ": {defects}");
    if notes > 0 {
        let _ = write!(text, ", {notes} remark{}", plural(notes));
    }
    text.push('\n');
    write_size(&mut text, inspection);
    let width = inspection.findings.iter().map(|f| f.kind.noun(f.count).len()).max().unwrap_or(0);
    for finding in inspection.defects() {
        write_finding(&mut text, finding, width, verbose);
    }
    if notes > 0 {
        text.push_str("  harmless by themselves:\n");
    }
    for finding in inspection.notes() {
        write_finding(&mut text, finding, width, verbose);
    }
    match &inspection.repair {
        Some(cost) => write_cost(&mut text, cost, inspection),
        None => text.push_str("  repair: refused, no triangle with an area is left\n"),
    }
    text
}

fn write_size(text: &mut String, inspection: &Inspection) {
    let size = &inspection.size;
    let count =
        |count: u64, noun: &str| format!("{count} {noun}{}", if count == 1 { "" } else { "s" });
    let unit = size.unit.map_or(String::new(), |unit| format!(" {}", unit.name()));
    let _ = writeln!(
        text,
        "  {} in {}, {} and {}; {} vertices by place, {} merged",
        count(size.triangles, "triangle"),
        count(inspection.parts.count, "part"),
        count(inspection.materials.count, "material"),
        count(inspection.shells.count, "shell"),
        size.vertices,
        size.merged_vertices,
    );
    if let Some([low, high]) = size.bounds {
        let sides: [f64; 3] = std::array::from_fn(|axis| high[axis] - low[axis]);
        let [x, y, z] = sides.map(short);
        let volume = size.volume.map_or("no volume: not closed".to_owned(), |volume| {
            format!("volume {}", short(volume))
        });
        let area = short(size.area);
        let _ = writeln!(
            text,
            "  box {x} x {y} x {z}{unit}, area {area}, {volume}; {} of the shells closed",
            inspection.shells.closed
        );
    }
}

fn write_finding(text: &mut String, finding: &Finding, width: usize, verbose: bool) {
    let noun = finding.kind.noun(finding.count);
    let size = short(finding.size);
    let size = match finding.measure {
        Measure::TotalLength => format!("  length {size}"),
        Measure::LongestLength => format!("  longest {size}"),
        Measure::LeastLength => format!("  thinnest {size}"),
        Measure::TotalArea => format!("  area {size}"),
        Measure::None => String::new(),
    };
    let _ = write!(text, "  {:>9} {noun:width$}{size:18}", finding.count);
    if verbose {
        let _ = writeln!(text, "  repair: {}", finding.kind.remedy());
        for place in &finding.places {
            let _ = writeln!(text, "            {place}");
        }
        return;
    }
    let at = finding.places.iter().filter_map(place_of).take(FEW_PLACES);
    let at: Vec<String> = at.collect();
    if !at.is_empty() {
        let more = if finding.count > at.len() as u64 { ", .." } else { "" };
        let _ = write!(text, "  at {}{more}", at.join(", "));
    }
    // Sizes fill their column, places may be missing.
    text.truncate(text.trim_end().len());
    text.push('\n');
}

/// A place in short: coordinates, or a number where there are none.
fn place_of(defect: &Defect) -> Option<String> {
    match (defect.kind(), defect) {
        (DefectKind::NonfiniteTriangle, Defect::NonfiniteTriangle(found)) => {
            Some(format!("triangle {}", found.triangle))
        }
        (DefectKind::IsolatedVertex, Defect::IsolatedVertex(found)) => {
            Some(format!("vertex {}", found.vertex))
        }
        _ => defect.place().map(|place| {
            let [x, y, z] = place.map(short);
            format!("({x} {y} {z})")
        }),
    }
}

fn write_cost(text: &mut String, cost: &RepairCost, inspection: &Inspection) {
    let mebibytes = |bytes: u64| format!("{:.0} MiB", bytes as f64 / f64::from(1 << 20));
    if inspection.is_sound {
        text.push_str("  nothing needs a repair; one");
    } else {
        text.push_str("  repair");
    }
    let _ = writeln!(
        text,
        " would take depth {}, cells of {}, about {} leaf cells; {} of memory and {} of disk at \
         most, about {:.1} s",
        cost.depth,
        short(cost.cell_size),
        cost.leaf_cells,
        mebibytes(cost.memory_bytes),
        mebibytes(cost.disk_bytes),
        cost.seconds,
    );
}
