//! The steps of a run, what each leaves in the work folder, and who reads it.
//!
//! A step is what a checkpoint can say of: it is finished, and its files are there. A stage that
//! takes long is made of several.

use crate::bridge::{ADDED, ADDED_ENTRIES, LEFT_OUT, ORIGINS, SLAB_ORIGINS};
use crate::contour::{CELLS, SURFACE};
use crate::ingest::{
    ATTRIBUTES, BIN_ENTRIES, BINS, DROPS, LOOK_MATERIALS, LOOKS, PART_NAMES, SOUP,
};
use crate::io::{IMAGES, MATERIALS};
use crate::monitor::Stage;
use crate::octree::FLIPS;
use crate::paint::DRAWN;
use crate::scan::HITS;
use crate::sign::{FLOODED, REGIONS, SIGNS};
use crate::transfer::BORDERS;

/// The output while it is written.
pub const OUTPUT_PART: &str = "output.part";

/// A step, in running order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// The input file becomes a spool of triangles.
    Read,
    /// Triangles go into the bins of bricks.
    Bin,
    /// Copies are settled, rims counted.
    Settle,
    /// Open sheets become walls, holes are filled.
    Mend,
    /// Bins become bricks of hits.
    Scan,
    /// Odd faces become flips.
    Patch,
    /// What the outside reaches.
    Flood,
    /// What the grid would lose is thickened, what nobody sees is left out, and all is scanned,
    /// patched and flooded again.
    Revise,
    /// Hits and flips become signs.
    Sign,
    /// The threshold is found that gives few enough triangles, where a number is set.
    Choose,
    /// Signs become vertices.
    Place,
    /// Surfaces in one cell are kept apart.
    Separate,
    /// The surface is drawn into spools, where it gets more than its shape.
    Draw,
    /// The surface is written.
    Write,
    /// The written file is proved.
    Prove,
    /// It is compared with the soup.
    Measure,
}

impl Step {
    /// All steps.
    pub const ALL: [Self; 16] = [
        Self::Read,
        Self::Bin,
        Self::Settle,
        Self::Mend,
        Self::Scan,
        Self::Patch,
        Self::Flood,
        Self::Revise,
        Self::Sign,
        Self::Choose,
        Self::Place,
        Self::Separate,
        Self::Draw,
        Self::Write,
        Self::Prove,
        Self::Measure,
    ];

    /// Its name in the manifest.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Bin => "bin",
            Self::Settle => "settle",
            Self::Mend => "mend",
            Self::Scan => "scan",
            Self::Patch => "patch",
            Self::Flood => "flood",
            Self::Revise => "revise",
            Self::Sign => "sign",
            Self::Choose => "choose",
            Self::Place => "place",
            Self::Separate => "separate",
            Self::Draw => "draw",
            Self::Write => "write",
            Self::Prove => "prove",
            Self::Measure => "measure",
        }
    }

    /// The stage that it is a part of.
    pub const fn stage(self) -> Stage {
        match self {
            Self::Read | Self::Bin | Self::Settle => Stage::Ingest,
            Self::Mend | Self::Revise => Stage::Bridge,
            Self::Scan => Stage::Scan,
            Self::Patch => Stage::Patch,
            Self::Flood | Self::Sign => Stage::Sign,
            Self::Choose | Self::Place | Self::Separate | Self::Draw | Self::Write => {
                Stage::Contour
            }
            Self::Prove => Stage::Verify,
            Self::Measure => Stage::Deviate,
        }
    }

    /// The files that it leaves. Those of attributes are empty where the output gets none.
    pub const fn writes(self) -> &'static [&'static str] {
        match self {
            Self::Read => &[SOUP, ATTRIBUTES, LOOKS, LOOK_MATERIALS, PART_NAMES, MATERIALS, IMAGES],
            Self::Bin => &[BINS, BIN_ENTRIES],
            Self::Settle => &[DROPS],
            Self::Mend => &[LEFT_OUT, ADDED, ADDED_ENTRIES, ORIGINS],
            Self::Scan => &[HITS],
            Self::Patch => &[FLIPS],
            Self::Flood => &[FLOODED, REGIONS],
            Self::Revise => &[BORDERS, SLAB_ORIGINS],
            Self::Sign => &[SIGNS],
            Self::Place => &[CELLS],
            Self::Separate => &[SURFACE],
            Self::Draw => &DRAWN,
            Self::Write => &[OUTPUT_PART],
            Self::Choose | Self::Prove | Self::Measure => &[],
        }
    }

    /// The files that it cannot do without.
    pub const fn reads(self) -> &'static [&'static str] {
        match self {
            Self::Read => &[],
            Self::Bin => &[SOUP, ATTRIBUTES, LOOKS, LOOK_MATERIALS, PART_NAMES, MATERIALS, IMAGES],
            Self::Settle => &[SOUP, BINS, BIN_ENTRIES],
            Self::Mend => &[SOUP, BINS, BIN_ENTRIES, DROPS],
            Self::Scan => &[SOUP, BINS, BIN_ENTRIES, LEFT_OUT, ADDED, ADDED_ENTRIES],
            Self::Patch => &[HITS],
            Self::Flood => &[HITS, FLIPS],
            Self::Revise => &[
                SOUP,
                ATTRIBUTES,
                LOOKS,
                LOOK_MATERIALS,
                PART_NAMES,
                MATERIALS,
                IMAGES,
                BINS,
                BIN_ENTRIES,
                LEFT_OUT,
                ADDED,
                ADDED_ENTRIES,
                HITS,
                FLIPS,
                FLOODED,
                REGIONS,
            ],
            Self::Sign => &[HITS, FLIPS, FLOODED, REGIONS, BORDERS],
            // With what later steps of every level read that is there by now.
            Self::Choose => &[HITS, SIGNS, SOUP, ATTRIBUTES, ORIGINS, SLAB_ORIGINS],
            Self::Place => &[HITS, SIGNS],
            Self::Separate => &[HITS, SIGNS, CELLS],
            Self::Draw => &[CELLS, SURFACE, ORIGINS, SLAB_ORIGINS],
            Self::Write => &[
                CELLS,
                SURFACE,
                DRAWN[0],
                DRAWN[1],
                DRAWN[2],
                DRAWN[3],
                ATTRIBUTES,
                LOOK_MATERIALS,
                MATERIALS,
                IMAGES,
            ],
            Self::Prove => &[OUTPUT_PART, LOOK_MATERIALS, MATERIALS, IMAGES],
            Self::Measure => &[SOUP, OUTPUT_PART, LOOK_MATERIALS, MATERIALS, IMAGES],
        }
    }

    /// The step that leaves `file`.
    pub fn writer_of(file: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|step| step.writes().contains(&file))
    }

    /// Whether `file` is still of use once this step is finished: as input of a later step, or to
    /// do this one again.
    pub fn still_needs(self, file: &str) -> bool {
        let last_reader = Self::ALL.into_iter().rfind(|step| step.reads().contains(&file));
        // Choosing leaves no file, so what the signs came from waits for the step after it.
        let finished = if self == Self::Choose { Self::Sign } else { self };
        last_reader.is_none_or(|reader| reader >= finished)
    }

    /// The last step from which on all steps up to this one find their inputs, given the files that are there.
    pub fn with_inputs(self, is_there: impl Fn(&str) -> bool) -> Self {
        let mut first = self;
        loop {
            let under_way = Self::ALL.into_iter().filter(|step| (first..=self).contains(step));
            let missing = under_way.flat_map(Self::reads).filter(|file| !is_there(file));
            // What a step under way leaves will be there.
            let writers = missing.filter_map(|f| Self::writer_of(f)).filter(|w| *w < first);
            match writers.min() {
                Some(writer) => first = writer,
                None => return first,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_input_is_left_by_an_earlier_step() {
        for step in Step::ALL {
            for file in step.reads() {
                assert!(Step::writer_of(file).is_some_and(|writer| writer < step), "{file}");
            }
        }
    }

    #[test]
    fn inputs_of_a_step_outlive_it_by_one() {
        assert!(Step::Scan.still_needs(BINS));
        assert!(Step::Patch.still_needs(BINS), "what is thickened is scanned again");
        assert!(!Step::Sign.still_needs(BINS));
        assert!(Step::Sign.still_needs(FLIPS));
        assert!(Step::Choose.still_needs(FLIPS));
        assert!(!Step::Place.still_needs(FLIPS));
        assert!(Step::Separate.still_needs(HITS), "most signs are told by them");
        assert!(!Step::Draw.still_needs(HITS));
        assert!(Step::Prove.still_needs(OUTPUT_PART));
    }

    #[test]
    fn a_lost_file_is_made_again_from_the_nearest_step_whose_inputs_are_there() {
        assert_eq!(Step::Sign.with_inputs(|_| true), Step::Sign);
        assert_eq!(Step::Sign.with_inputs(|file| file != REGIONS), Step::Flood);
        assert_eq!(Step::Sign.with_inputs(|file| file != REGIONS && file != FLIPS), Step::Patch);
        assert_eq!(Step::Prove.with_inputs(|file| file == BINS), Step::Read);
        let of_place = [SOUP, HITS, SIGNS];
        assert_eq!(Step::Place.with_inputs(|file| of_place.contains(&file)), Step::Place);
        let without_signs =
            Step::Place.with_inputs(|file| file != SIGNS && of_place.contains(&file));
        assert_eq!(without_signs, Step::Read, "on the way what is thickened is scanned again");
        assert_eq!(Step::Prove.with_inputs(|_| false), Step::Read);
    }
}
