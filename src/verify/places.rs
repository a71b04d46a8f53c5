//! A few offenders of each kind, the same ones for every share.

use crate::monitor::Monitor;
use crate::store::StoreError;
use crate::verify::tape::Tape;

/// How many places are told of each kind of defect.
pub(crate) const MOST_PLACES: usize = 8;

/// Keeps the items with the smallest keys.
pub(crate) struct Smallest<K: Ord + Copy, T> {
    kept: Vec<(K, T)>,
}

impl<K: Ord + Copy, T> Smallest<K, T> {
    pub(crate) fn new() -> Self {
        Self { kept: Vec::with_capacity(MOST_PLACES + 1) }
    }

    pub(crate) fn offer(&mut self, key: K, item: T) {
        if self.kept.len() == MOST_PLACES && self.kept[MOST_PLACES - 1].0 <= key {
            return;
        }
        let at = self.kept.partition_point(|(k, _)| *k < key);
        self.kept.insert(at, (key, item));
        self.kept.truncate(MOST_PLACES);
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &(K, T)> {
        self.kept.iter()
    }
}

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
