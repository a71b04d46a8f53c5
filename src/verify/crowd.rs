//! Judges vertices that have too many triangles for a counting sort, by external sort.
//!
//! Memory:     `share_bytes`, whatever the number of triangles at one vertex.
//! Fails:      only as [`StoreError`].

use bytemuck::{Pod, Zeroable};

use crate::store::{Record, Scratch, Sorter, StoreError, Unite};
use crate::verify::fans::{Corner, Visit, most_wedges};
use crate::verify::link::{Judgement, Spoke, Wedge, spokes};

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
struct SpokeRecord(Spoke);

impl Record for SpokeRecord {
    type Key = Spoke;
    fn key(&self) -> Spoke {
        self.0
    }
}

/// Judges the vertices of all corners that `visit` shows; vertex numbers are below `space`.
pub(crate) fn judge_by_sorting(
    judgement: &mut Judgement,
    space: u64,
    scratch: &Scratch,
    share_bytes: u64,
    visit: &Visit<'_>,
) -> Result<(), StoreError> {
    let mut sorter = Sorter::<Corner>::new(scratch, share_bytes / 4);
    let mut outcome = Ok(());
    visit(&mut |corner| {
        if outcome.is_ok() {
            outcome = sorter.push(corner);
        }
    })?;
    outcome?;
    let mut sorted = sorter.finish()?;
    let most = most_wedges(share_bytes);
    let mut wedges: Vec<Wedge> = Vec::new();
    let mut next = sorted.next()?;
    while let Some(Corner { vertex, .. }) = next {
        wedges.clear();
        let mut crowd: Option<Crowd> = None;
        while let Some(corner) = next
            && corner.vertex == vertex
        {
            match &mut crowd {
                Some(crowd) => crowd.add(corner.wedge)?,
                None if wedges.len() == most => {
                    let mut large = Crowd::new(scratch, share_bytes / 4, space)?;
                    wedges.iter().try_for_each(|&wedge| large.add(wedge))?;
                    large.add(corner.wedge)?;
                    crowd = Some(large);
                }
                None => wedges.push(corner.wedge),
            }
            next = sorted.next()?;
        }
        match crowd {
            Some(crowd) => crowd.judge(judgement, vertex)?,
            None => judgement.judge(vertex, &mut wedges)?,
        }
    }
    Ok(())
}

/// The wedges of one vertex, on disk.
struct Crowd {
    spokes: Sorter<SpokeRecord>,
    fans: Unite,
}

impl Crowd {
    fn new(scratch: &Scratch, share_bytes: u64, space: u64) -> Result<Self, StoreError> {
        let fans = Unite::new(scratch, share_bytes / 2, space)?;
        Ok(Self { spokes: Sorter::new(scratch, share_bytes / 2), fans })
    }

    fn add(&mut self, wedge: Wedge) -> Result<(), StoreError> {
        spokes(wedge).into_iter().try_for_each(|spoke| self.spokes.push(SpokeRecord(spoke)))?;
        self.fans.unite(wedge[0], wedge[1])
    }

    fn judge(self, judgement: &mut Judgement, vertex: u32) -> Result<(), StoreError> {
        let mut labels = self.fans.finish()?;
        let mut sorted = self.spokes.finish()?;
        let (mut fans, mut balanced) = (0, true);
        let mut next = sorted.next()?;
        while let Some(SpokeRecord(first)) = next {
            let neighbour = (first / 2) as u32;
            let mut directions = [0_u64; 2];
            while let Some(SpokeRecord(spoke)) = next
                && spoke / 2 == first / 2
            {
                directions[(spoke % 2) as usize] += 1;
                next = sorted.next()?;
            }
            balanced &= judgement.edge([vertex, neighbour], directions[0], directions[1]);
            // The label of a fan is its smallest neighbour, so each fan is counted once.
            fans += u64::from(labels.label(neighbour)? == neighbour);
        }
        judgement.vertex(vertex, fans, balanced)
    }
}
