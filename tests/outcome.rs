//! `docs/outcome.md` names every field of the outcome, and no other.

use brickmend::monitor::Stage;
use brickmend::repair::{LayerReport, LayersReport, SCHEMA_VERSION, StageReport};
use brickmend::sign::FillRule;

use crate::support::schema::check_document;
use crate::support::{repair_at, testdata};

/// Fields that only some outcomes have; their documentation says when.
const CONDITIONAL: [&str; 55] = [
    "part.number",
    "part.name",
    "part.places",
    "hidden.largest[]",
    "hidden.largest[].part",
    "hidden.largest[].part_number",
    "hidden.largest[].is_sealed",
    "hidden.largest[].triangles",
    "hidden.largest[].area",
    "hidden.largest[].lo",
    "hidden.largest[].hi",
    "input.dense_box.lo",
    "input.dense_box.hi",
    "settings.depth.auto",
    "settings.depth.auto.max_depth",
    "settings.depth.tolerance",
    "settings.depth.tolerance.length",
    "settings.depth.tolerance.length.model",
    "settings.depth.tolerance.length.percent",
    "settings.depth.tolerance.length.metres",
    "settings.depth.tolerance.max_depth",
    "settings.depth.levels",
    "settings.max_hole.size",
    "settings.max_hole.size.cells",
    "settings.max_hole.size.length",
    "settings.max_gap.cells",
    "settings.max_gap.length",
    "settings.sheet_thickness.cells",
    "settings.sheet_thickness.length",
    "mend.widest_holes[]",
    "mend.widest_holes[].lo",
    "mend.widest_holes[].hi",
    "mend.widest_holes[].area",
    "mend.widest_holes[].edges",
    "invented.largest_openings[].odd_faces",
    "invented.largest_openings[].lo_cell",
    "invented.largest_openings[].hi_cell",
    "patch.largest[].odd_faces",
    "patch.largest[].lo_cell",
    "patch.largest[].hi_cell",
    "deviation.creases.largest.distance",
    "deviation.creases.largest.nearest",
    "deviation.creases.largest.position",
    "settings.decimate.cells",
    "settings.decimate.length",
    "output.proof.places[].kind",
    "output.proof.places[].ends",
    "output.proof.places[].vertices",
    "output.proof.places[].position",
    "output.proof.places[].vertex",
    "output.proof.places[].triangle",
    "output.proof.places[].corners",
    "output.proof.places[].triangles",
    "output.proof.places[].fans",
    "output.proof.places[].meeting",
];

#[test]
fn the_documentation_names_every_field_and_no_other() {
    let mut outcome = repair_at(&testdata("models/bowl.obj"), 5, FillRule::Solid).expect("sound");
    // The caller stamps these.
    outcome.stages = Stage::ALL.map(|stage| (stage, StageReport::default())).into();
    outcome.memory.peak_bytes = Some(0);
    let layer = LayerReport::default();
    outcome.exports = Some(LayersReport {
        tolerance: 0.0,
        removed: layer.clone(),
        added: layer.clone(),
        patches: Some(layer),
    });
    let json = serde_json::to_value(&outcome).expect("plain data is always JSON");
    assert_eq!(json["schema"], SCHEMA_VERSION);
    check_document("docs/outcome.md", &json, &CONDITIONAL);
}
