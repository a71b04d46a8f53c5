//! Takes parts out of the scene that nobody sees from outside of the whole.
//!
//! In:         the scene and its parts.
//! Out:        the scene without the parts of hidden places; how many these are.
//! Invariant:  a place is judged as a whole, by rays that meet the triangles themselves: a drawer whose
//!             front is seen stays with all that it has behind, and what is small stays as well. Of
//!             every scene something is left.
//! Memory:     that of a comparison (`deviate/`).

use std::sync::PoisonError;

use crate::deviate::{DeviateError, Means, PartsSeen};
use crate::ingest::Scattered;
use crate::io::{SEEN_NODES, SceneTree, SceneWriter};
use crate::mesh::SceneNode;
use crate::monitor::Monitor;
use crate::repair::RepairError;
use crate::repair::parts::outcome::PartsOutcome;
use crate::repair::parts::{Assembly, Model};
use crate::repair::settings::HiddenRule;
use crate::sign::FillRule;
use crate::store::{Resources, StoreError};

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
        let Resources { scratch, pool, monitor, share_bytes, .. } = *resources;
        let means = Means { scratch, pool, share_bytes, monitor };
        let scattered = model.scattered.get_mut().unwrap_or_else(PoisonError::into_inner);
        let seen = PartsSeen::find(&mut scattered.placed(resources)?, &means);
        let mut seen = seen.map_err(|error| match error {
            DeviateError::Source { source } => RepairError::Input(source),
            DeviateError::Store(error) => RepairError::Store(error),
        })?;
        let scene = scattered.scene.clone();
        let mut left = SceneWriter::create(scratch, SEEN_NODES)?;
        scene.for_each(|number, mut node| {
            if let Some(part) = node.part
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
        if outcome.hidden_places == model.places.total() {
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
