//! Time and memory of each stage, as a plot.

use std::io;

use crate::monitor::Stage;
use crate::repair::{Outcome, StageReport};
use crate::report::html::{Markup, bytes, seconds};

const WIDTH: f64 = 640.0;
const ROW: f64 = 34.0;
const BAR: f64 = 11.0;
const NAMES: f64 = 62.0;
/// Where bars of memory begin.
const MIDDLE: f64 = 365.0;
/// Room for the figure at the end of a bar.
const FIGURE: f64 = 78.0;

/// Writes what the stages took, if the caller told.
pub(crate) fn write_stages(html: &mut Markup, outcome: &Outcome) -> io::Result<()> {
    let stages: Vec<(Stage, StageReport)> =
        Stage::ALL.iter().filter_map(|s| Some((*s, *outcome.stages.get(s)?))).collect();
    if stages.is_empty() {
        return Ok(());
    }
    html.element("section", &[("id", "stages")], |html| {
        html.leaf("h2", &[], "Time and memory")?;
        write_plot(html, &stages)?;
        html.leaf("p", &[("class", "quiet")], &summary(outcome, &stages))
    })
}

fn summary(outcome: &Outcome, stages: &[(Stage, StageReport)]) -> String {
    let total: f64 = stages.iter().map(|(_, report)| report.seconds).sum();
    let memory = &outcome.memory;
    let mut text = format!("{} in all, {} threads", seconds(total), memory.threads);
    if let Some(peak) = memory.peak_bytes {
        let budget = bytes(memory.budget_bytes);
        text.push_str(&format!("; {} of {budget} of memory at most", bytes(peak)));
    }
    text.push_str(&format!("; {} of disk at most.", bytes(outcome.disk.peak_bytes)));
    text
}

fn write_plot(html: &mut Markup, stages: &[(Stage, StageReport)]) -> io::Result<()> {
    let height = 24.0 + ROW * stages.len() as f64;
    let most = |of: fn(&StageReport) -> f64| {
        stages.iter().map(|(_, report)| of(report)).fold(f64::MIN_POSITIVE, f64::max)
    };
    let longest = most(|report| report.seconds.max(report.cpu_seconds));
    let largest = most(|report| report.resident_bytes.unwrap_or(0) as f64);
    let view = format!("0 0 {WIDTH} {height}");
    let attributes = [
        ("class", "plot"),
        ("viewBox", &*view),
        ("role", "img"),
        ("aria-label", "Time and memory of each stage"),
    ];
    html.element("svg", &attributes, |html| {
        write_text(html, NAMES, 12.0, "label", "wall time; below it, time of all processors")?;
        write_text(html, MIDDLE, 12.0, "label", "memory")?;
        for (row, (stage, report)) in stages.iter().enumerate() {
            let top = 22.0 + ROW * row as f64;
            write_text(html, 0.0, top + 15.0, "label", stage.name())?;
            let room = MIDDLE - NAMES - FIGURE;
            let figure = seconds(report.seconds);
            write_bar(html, (NAMES, top), room * report.seconds / longest, "wall", &figure)?;
            let figure = seconds(report.cpu_seconds);
            let below = (NAMES, top + BAR + 1.0);
            write_bar(html, below, room * report.cpu_seconds / longest, "cpu", &figure)?;
            if let Some(size) = report.resident_bytes {
                let room = WIDTH - MIDDLE - FIGURE;
                let length = room * size as f64 / largest;
                write_bar(html, (MIDDLE, top + 5.0), length, "memory", &bytes(size))?;
            }
        }
        Ok(())
    })
}

fn write_bar(
    html: &mut Markup,
    (x, y): (f64, f64),
    length: f64,
    class: &str,
    figure: &str,
) -> io::Result<()> {
    let [left, top, width, height] =
        [x, y, length.max(1.0), BAR].map(|value| format!("{value:.1}"));
    let place =
        [("class", class), ("x", &*left), ("y", &top), ("width", &width), ("height", &height)];
    html.leaf("rect", &place, "")?;
    write_text(html, x + length.max(1.0) + 5.0, y + BAR - 1.0, "figure", figure)
}

fn write_text(html: &mut Markup, x: f64, y: f64, class: &str, text: &str) -> io::Result<()> {
    let (x, y) = (format!("{x:.1}"), format!("{y:.1}"));
    html.leaf("text", &[("x", &x), ("y", &y), ("class", class)], text)
}
