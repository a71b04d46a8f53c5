//! Bins as entries of the soup beside bins of sorted copies.

use std::collections::BTreeMap;

use super::*;
use crate::ingest::read_soup;
use crate::mesh::Attributes;
use crate::mesh::shapes::{Corners, ListedTriangles, Random, shuffle, sphere};
use crate::monitor::Void;
use crate::store::{Backing, NoCheckpoints, Scratch};

/// The sources of each bin, in order, and how many triangles were copied for them.
type Held = (BTreeMap<u64, Vec<u32>>, u64);

/// What `fill` makes of a soup at depth 9, with a share of so many bytes.
fn held<F>(corners: &[Corners], share_bytes: u64, fill: F) -> Held
where
    F: Fn(Soup, &Domain, &Resources) -> Result<(Bins, SoupMeasure), StoreError>,
{
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads");
    let resources = Resources {
        scratch: &scratch,
        pool: &pool,
        share_bytes,
        cached_windows: 4,
        backing: Backing::Memory,
        checkpoints: &NoCheckpoints,
        monitor: &Void,
    };
    let mut source = ListedTriangles::without_indices(corners.to_vec());
    let soup = read_soup(&mut source, true, Attributes::NONE, &resources).expect("a sound soup");
    let domain = Domain::around(&soup.facts.bounds, 9, false).expect("room enough");
    let soup_state = soup.spool.state().clone();
    let (bins, _) = fill(soup, &domain, &resources).expect("room on the disk");
    let files = [bins.files(), vec![soup_state]].concat();
    drop(bins);
    let bins = Bins::open(&resources, &files, LeftOut::default()).expect("as it was left");
    let (spools, mut all) = (bins.spools(), BTreeMap::new());
    let mut walk = spools.bins();
    while let Some(bin) = walk.next().expect("readable") {
        let sources: &mut Vec<u32> = all.entry(bin.brick.0).or_default();
        let visited = spools.each_block(&bin, None, |block| {
            sources.extend(block.iter().map(|triangle| triangle.source));
            Ok(())
        });
        visited.expect("readable");
        assert_eq!(sources.len() as u64, bin.count);
    }
    assert_eq!(all.len() as u64, spools.count().expect("readable"));
    (all, files[0].records)
}

#[test]
fn entries_of_the_soup_hold_what_sorted_copies_hold() {
    let corners = sphere([0.1, 0.2, 0.3], 1.0, 90);
    let (entries, none) = held(&corners, 1 << 20, fill_bins);
    assert_eq!(none, 0);
    for share_bytes in [1 << 14, 1 << 24] {
        let (copies, count) = held(&corners, share_bytes, |s, d, r| sort_copies(&s, d, r));
        assert_eq!(copies, entries);
        assert!(count > corners.len() as u64);
    }
    assert!(entries.values().all(|sources| sources.is_sorted_by(|a, b| a < b)));
}

#[test]
fn a_soup_without_order_is_copied() {
    let mut corners = sphere([0.1, 0.2, 0.3], 1.0, 90);
    shuffle(&mut corners, &mut Random::new(7));
    let (bins, copies) = held(&corners, 1 << 20, fill_bins);
    assert_eq!(bins.values().map(|sources| sources.len() as u64).sum::<u64>(), copies);
    assert!(bins.values().all(|sources| sources.is_sorted_by(|a, b| a < b)));
}
