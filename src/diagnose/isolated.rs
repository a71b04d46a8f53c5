//! Vertices that the file lists and no triangle names.

use crate::defect::{Defect, DefectKind, IsolatedVertex, MOST_PLACES, Marks};
use crate::diagnose::Means;
use crate::diagnose::finding::Finding;
use crate::diagnose::model::{BLOCK, Model};
use crate::store::StoreError;

/// Vertices that are ticked off in one pass, at least; they take a bit each.
const LEAST_WINDOW: u64 = 1 << 20;

/// As many can be shown at most: viewers number vertices as `int`.
const MOST_SHOWN: u64 = i32::MAX as u64;

/// Counts them, and lists the first.
pub(crate) fn find(
    model: &Model,
    marks: Option<&Marks>,
    means: &Means<'_>,
) -> Result<Finding, StoreError> {
    let kind = DefectKind::IsolatedVertex;
    let (Some(named), Some(listed)) = (&model.named, model.facts().listed_vertices) else {
        return Ok(Finding::none(kind));
    };
    // Some files repeat vertices at will: of these no list is begun.
    if marks.is_some() && listed.saturating_sub(model.facts().used_vertices) > MOST_SHOWN {
        let what = "Vertices to export that no triangle has";
        return Err(StoreError::TooMany { what, limit: MOST_SHOWN });
    }
    let window = (means.share_bytes / 2 * 8).max(LEAST_WINDOW);
    let mut places = Vec::new();
    let (mut count, mut from) = (0, 0);
    while from < listed {
        means.stop_if_asked()?;
        let width = window.min(listed - from);
        let mut used = vec![0_u64; width.div_ceil(64) as usize];
        named.each_block(BLOCK, |block| {
            for &vertex in block.iter().flatten() {
                let at = u64::from(vertex).wrapping_sub(from);
                if at < width {
                    used[(at / 64) as usize] |= 1 << (at % 64);
                }
            }
            Ok(())
        })?;
        for at in (0..width).filter(|at| used[(at / 64) as usize] >> (at % 64) & 1 == 0) {
            count += 1;
            if let Some(marks) = marks {
                marks.vertex(kind, (from + at) as u32)?;
            }
            if places.len() < MOST_PLACES {
                let vertex = IsolatedVertex { vertex: from + at };
                places.push(Defect::IsolatedVertex(vertex));
            }
        }
        from += width;
    }
    Ok(Finding::counted(kind, count, places))
}
