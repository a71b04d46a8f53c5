//! The verdict on a file beside its original: each measure against its thresholds, in words.

use crate::deviate::{Deviation, Separation};
use crate::repair::finish::broken_promises;
use crate::repair::outcome::Verdict;
use crate::repair::thresholds::Threshold;
use crate::repair::verification::{Reason, SurfaceReport, Thresholds};
use crate::verify::Proof;

/// The reasons against a file, those that fail it first, and what they make together.
pub fn judge(
    proof: &Proof,
    compared: Option<(&Compared<'_>, &Thresholds)>,
) -> (Verdict, Vec<Reason>) {
    let mut reasons = Vec::new();
    let broken = broken_promises(proof);
    if !broken.is_empty() {
        let text = format!("The file is not sound: {}", broken.join("; "));
        reasons.push(Reason { verdict: Verdict::Fail, text });
    }
    if let Some((compared, thresholds)) = compared {
        compared.judge(thresholds, &mut reasons);
    }
    // The sort keeps the order of those that are alike.
    reasons.sort_by_key(|reason| reason.verdict != Verdict::Fail);
    let verdict = reasons.first().map_or(Verdict::Pass, |reason| reason.verdict);
    (verdict, reasons)
}

/// A file beside its original.
pub struct Compared<'c> {
    pub file: &'c SurfaceReport,
    pub original: &'c SurfaceReport,
    /// `None` where it could not be measured.
    pub deviation: Option<&'c Deviation>,
    /// Whether volume, components and genus of the two mean the same: neither has a border, and no
    /// triangles of either meet.
    pub are_solids: bool,
}

impl Compared<'_> {
    fn judge(&self, thresholds: &Thresholds, reasons: &mut Vec<Reason>) {
        match self.deviation {
            Some(deviation) => judge_deviation(deviation, thresholds, reasons),
            None => reasons.push(Reason {
                verdict: Verdict::Review,
                text: "Nothing was measured: a surface has no area, or is too large".to_owned(),
            }),
        }
        if self.are_solids {
            self.judge_solids(thresholds, reasons);
        }
    }

    fn judge_solids(&self, thresholds: &Thresholds, reasons: &mut Vec<Reason>) {
        let (file, original) = (self.file, self.original);
        let genus = |surface: &SurfaceReport| surface.genus.unwrap_or_default();
        let (now, before) = (genus(file), genus(original));
        let what = if now < before { "tunnels were filled" } else { "there are new tunnels" };
        let text = || format!("The genus is {now}, that of the original {before}: {what}");
        above(&thresholds.max_genus, now.abs_diff(before) as f64, text, reasons);
        let (now, before) = (file.components, original.components);
        let text = || format!("There are {now} components, in the original {before}");
        above(&thresholds.max_components, now.abs_diff(before) as f64, text, reasons);
        if let (Some(now), Some(before)) = (file.volume, original.volume)
            && now > 0.0
            && before > 0.0
        {
            let change = (now - before) / before;
            let text = || {
                let way = if change > 0.0 { "larger" } else { "smaller" };
                format!("The volume is {} {way} than that of the original", percent(change.abs()))
            };
            above(&thresholds.max_volume, change.abs(), text, reasons);
        }
    }
}

fn judge_deviation(deviation: &Deviation, thresholds: &Thresholds, reasons: &mut Vec<Reason>) {
    let diagonal = deviation.diagonal;
    let far = |found: &Separation| {
        format!(
            "{} ({} of the diagonal) at {}",
            rounded(found.distance),
            percent(found.distance / diagonal),
            place(found.position)
        )
    };
    if let Some(found) = &deviation.lost.largest {
        let text =
            || format!("Visible surface of the original lies up to {} off the file", far(found));
        above(&thresholds.max_deviation, found.distance, text, reasons);
    }
    if let Some(found) = &deviation.file_to_original.largest {
        let text = || format!("The file lies up to {} off the original", far(found));
        above(&thresholds.max_deviation, found.distance, text, reasons);
    }
    let tolerance = rounded(deviation.tolerance);
    let lost = deviation.lost.share;
    let text = || {
        let at = deviation
            .lost
            .largest
            .map_or(String::new(), |found| format!(", most of all at {}", place(found.position)));
        format!(
            "{} of what is seen of the original is lost: farther than {tolerance} from the file{at}",
            percent(lost)
        )
    };
    above(&thresholds.max_lost, lost, text, reasons);
    let invented = deviation.invented_share;
    let text = || {
        format!(
            "{} of the file's area is invented: farther than {tolerance} from the original",
            percent(invented)
        )
    };
    above(&thresholds.max_invented, invented, text, reasons);
    let [there, back] = [&deviation.original_to_file, &deviation.file_to_original];
    let angle = there.normals.median_deg.max(back.normals.median_deg);
    let text =
        || format!("Half of the area has normals that differ by {angle:.1} degrees and more");
    above(&thresholds.max_normal_deg, angle, text, reasons);
    if let Some(creases) = &deviation.creases
        && let Some(kept) = creases.kept_share
    {
        let text = || {
            let at = creases.largest.map_or(String::new(), |found| {
                format!(", for one not at {}", place(found.position))
            });
            format!("{} of the length of visible sharp edges is kept{at}", percent(kept))
        };
        let least = thresholds.min_creases;
        let lost = Threshold { review: 1.0 - least.review, fail: least.fail.map(|x| 1.0 - x) };
        above(&lost, 1.0 - kept, text, reasons);
    }
}

/// Adds a reason where a value passes its thresholds.
fn above(
    threshold: &Threshold<f64>,
    value: f64,
    text: impl Fn() -> String,
    reasons: &mut Vec<Reason>,
) {
    let verdict = match threshold.fail {
        Some(most) if value > most => Verdict::Fail,
        _ if value > threshold.review => Verdict::Review,
        _ => return,
    };
    reasons.push(Reason { verdict, text: text() });
}

fn percent(share: f64) -> String {
    let share = share * 100.0;
    if share >= 10.0 { format!("{share:.0} %") } else { format!("{share:.2} %") }
}

/// A number with four digits that count.
pub fn rounded(x: f64) -> String {
    if x == 0.0 || !(1e-3..1e6).contains(&x.abs()) {
        return if x == 0.0 { "0".to_owned() } else { format!("{x:.3e}") };
    }
    let decimals = (3 - x.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{x:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

fn place([x, y, z]: [f64; 3]) -> String {
    format!("({} {} {})", rounded(x), rounded(y), rounded(z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fails_comes_before_what_is_to_be_looked_at() {
        let mut reasons = Vec::new();
        let threshold = Threshold { review: 0.1, fail: Some(0.5) };
        for (value, text) in [(0.1, "nothing"), (0.2, "look"), (0.6, "bad")] {
            above(&threshold, value, || text.to_owned(), &mut reasons);
        }
        let told: Vec<_> = reasons.iter().map(|r| (r.verdict, r.text.as_str())).collect();
        assert_eq!(told, [(Verdict::Review, "look"), (Verdict::Fail, "bad")]);
        let (verdict, reasons) = judge(&Proof::default(), None);
        assert_eq!(verdict, Verdict::Fail);
        assert_eq!(reasons[0].text, "The file is not sound: no triangle");
    }

    #[test]
    fn numbers_have_four_digits() {
        for (x, text) in [(0.0, "0"), (12.34567, "12.35"), (-0.5, "-0.5"), (1e-7, "1.000e-7")] {
            assert_eq!(rounded(x), text);
        }
    }
}
