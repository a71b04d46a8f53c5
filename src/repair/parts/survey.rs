//! Takes parts out of the scene that nobody sees from outside of the whole.
//!
//! In:         the scene and its parts.
//! Out:        the scene without the parts of hidden places; how many these are.
//! Invariant:  a place is hidden if all bodies are (`hidden/`) that its part has there; so a drawer
//!             whose front is seen stays with all that it has behind. What is small on the grid of
//!             the survey, which may miss it altogether, stays.
//! Memory:     that of a run.
//! Source:     as `hidden/`; on a grid of at most [`SURVEY_DEPTH`] levels, which is enough to see.

use std::sync::PoisonError;

use crate::ingest::Scattered;
use crate::io::{SEEN_NODES, SceneTree, SceneWriter};
use crate::mesh::SceneNode;
use crate::monitor::Monitor;
use crate::repair::RepairError;
use crate::repair::inner::Inner;
use crate::repair::parts::outcome::PartsOutcome;
use crate::repair::parts::{Assembly, Model};
use crate::repair::run::Feed;
use crate::repair::settings::{Depth, HiddenRule, PartsRule, Settings, ThinRule};
use crate::repair::stages::Handles;
use crate::repair::step::Step;
use crate::sign::FillRule;
use crate::store::{Resources, StoreError};

/// The whole is looked at on a grid no deeper than this.
const SURVEY_DEPTH: u32 = 8;
/// Parts smaller than so many cells of that grid are not judged: it may have no hit of them.
const LEAST_CELLS: f64 = 8.0;

impl Assembly<'_> {
    /// The scene without what nobody sees; `None` where that is all of it.
    pub(super) fn survey(
        &self,
        model: &mut Model,
        outcome: &mut PartsOutcome,
        resources: &Resources,
    ) -> Result<Option<SceneTree>, RepairError> {
        let is_asked = self.settings.hidden == HiddenRule::Remove
            && self.settings.fill_rule == FillRule::Solid;
        if !is_asked || model.places.total() <= 1 {
            return Ok(None);
        }
        self.recording.note("looking which parts are seen");
        let settings = Settings {
            depth: Depth::Levels(model.depth.min(SURVEY_DEPTH)),
            thin: ThinRule::Thicken,
            parts: PartsRule::Union,
            ..self.settings
        };
        let run = self.run_of(Feed::Placed { of: &model.scattered }, settings, 0.0);
        let workspace = self.open_inner(Inner::Whole, false)?;
        let mut findings = run.earlier_findings(&workspace)?;
        let mut handles = Handles::default();
        match run.steps(&workspace, self.pool, &mut findings, &mut handles, Step::Flood) {
            Ok(()) => {}
            // What cannot be looked at as a whole stays as it is.
            Err(RepairError::OutputTooCoarse { .. }) => return Ok(None),
            Err(error) => return Err(error),
        }
        let inner = Resources { scratch: workspace.scratch(), ..*resources };
        let mut seen = run.survey(&workspace, &mut findings, &mut handles, &inner)?;
        let least = LEAST_CELLS * findings.domain().cell_size();
        let scattered = model.scattered.get_mut().unwrap_or_else(PoisonError::into_inner);
        let places = &mut model.places;
        let scene = scattered.scene.clone();
        let mut left = SceneWriter::create(resources.scratch, SEEN_NODES)?;
        scene.for_each(|number, mut node| {
            if let Some(part) = node.part
                && places.size(part, scattered)? >= least
                && !seen.is_seen(number)?
            {
                outcome.hidden_places += 1;
                let name = name_of(&node, part, scattered)?;
                outcome.leave_out(part, &name, "nobody sees it from outside".to_owned());
                node.part = None;
            }
            left.push(&node)
        })?;
        let left = left.finish()?;
        // Something is seen of every scene.
        if outcome.hidden_places == places.total() {
            outcome.hidden_places = 0;
            outcome.left_out.clear();
        }
        Ok((outcome.hidden_places > 0).then_some(left))
    }
}

/// The name of a node, or that of its part.
fn name_of(node: &SceneNode, part: u32, scattered: &mut Scattered) -> Result<String, StoreError> {
    if node.name.is_empty() { scattered.name(part) } else { Ok(node.name.clone()) }
}
