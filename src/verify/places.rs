//! Where the vertices are that have a part in defects.

use crate::monitor::Monitor;
use crate::store::StoreError;
use crate::verify::tape::Tape;

/// Where the few vertices are that have a part in defects.
pub(crate) struct Positions {
    ids: Vec<u32>,
    found: Vec<Option<[f64; 3]>>,
}

impl Positions {
    /// Looks the vertices up on the tape.
    pub(crate) fn find(
        tape: &Tape,
        mut ids: Vec<u32>,
        monitor: &dyn Monitor,
    ) -> Result<Self, StoreError> {
        ids.sort_unstable();
        ids.dedup();
        let mut found = vec![None; ids.len()];
        let mut missing = ids.len();
        if missing > 0 {
            tape.each(monitor, |triangle| {
                if triangle.is_whole() {
                    for (id, corner) in triangle.ids.iter().zip(triangle.corners) {
                        if let Ok(at) = ids.binary_search(id)
                            && found[at].is_none()
                        {
                            found[at] = Some(corner.map(|x| x + 0.0));
                            missing -= 1;
                        }
                    }
                }
                Ok(missing > 0)
            })?;
        }
        Ok(Self { ids, found })
    }

    /// The position of one of them.
    pub(crate) fn of(&self, id: u32) -> [f64; 3] {
        let at = self.ids.binary_search(&id).expect("only vertices that were looked up are asked");
        self.found[at].expect("a vertex with a defect has a whole triangle on the tape")
    }
}
