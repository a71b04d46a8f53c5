//! A few offenders of each kind, the same ones for every share and any number of threads.

/// How many places are told of each kind of defect.
pub const MOST_PLACES: usize = 8;

/// Keeps the items with the smallest keys.
pub struct Smallest<K: Ord + Copy, T> {
    kept: Vec<(K, T)>,
}

impl<K: Ord + Copy, T> Default for Smallest<K, T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<K: Ord + Copy, T> Smallest<K, T> {
    /// None yet.
    #[must_use]
    pub fn new() -> Self {
        Self { kept: Vec::with_capacity(MOST_PLACES + 1) }
    }

    /// Keeps an item if few have smaller keys.
    pub fn offer(&mut self, key: K, item: T) {
        if self.kept.len() == MOST_PLACES && self.kept[MOST_PLACES - 1].0 <= key {
            return;
        }
        let at = self.kept.partition_point(|(k, _)| *k < key);
        self.kept.insert(at, (key, item));
        self.kept.truncate(MOST_PLACES);
    }

    /// The items kept, by ascending keys.
    pub fn iter(&self) -> impl Iterator<Item = &(K, T)> {
        self.kept.iter()
    }
}
