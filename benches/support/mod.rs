//! What the benches of stages share: shapes, and a folder in which the stages run up to any one.

#![allow(dead_code, reason = "each bench takes what it needs")]

use std::convert::Infallible;

use brickmend::contour::{ContourOptions, ContourStats, place_vertices, separate};
use brickmend::ingest::{Bins, Settled, fill_bins, read_soup, settle};
use brickmend::mesh::shapes::{
    Corners, ListedTriangles, Random, gear, rotation, sphere, transform,
};
use brickmend::mesh::{Attributes, MeshSink, SinkState, SinkStats, SinkTriangles};
use brickmend::monitor::Void;
use brickmend::octree::{Domain, Flips, SignBricks};
use brickmend::patch::patch;
use brickmend::scan::{HAS_ODD_FACES, ScanStats, scan};
use brickmend::sign::{FillRule, SignStats, assign_signs, flood};
use brickmend::store::{Backing, BrickFile, NoCheckpoints, Resources, Scratch};
use glam::DVec3;
use rayon::ThreadPool;
use tempfile::TempDir;

/// Windows of a brick file that stay mapped.
pub const CACHED_WINDOWS: usize = 128;

/// Shapes that differ in what they ask of a stage.
pub fn shapes() -> [(&'static str, Vec<Corners>); 3] {
    let mut random = Random::new(11);
    // Half a million triangles smaller than a cell, all slanted.
    let smooth = sphere([0.1, 0.2, 0.3], 1.0, 250);
    // A few hundred triangles, larger than bricks, with creases.
    let faceted = transform(&gear(40, 0.8, 1.0, 0.5), rotation(&mut random), DVec3::ZERO);
    // A tenth of the triangles is missing.
    let mut open = sphere([0.1, 0.2, 0.3], 1.0, 100);
    open.retain(|_| random.share() > 0.1);
    [("smooth", smooth), ("faceted", faceted), ("open", open)]
}

/// A folder and one thread.
pub struct Workshop {
    folder: TempDir,
    scratch: Scratch,
    pool: ThreadPool,
}

/// A model after ingest.
pub struct Ingested {
    pub domain: Domain,
    bins: Bins,
    settled: Settled,
}

impl Workshop {
    pub fn new() -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        Self { folder, scratch, pool }
    }

    pub fn folder(&self) -> &std::path::Path {
        self.folder.path()
    }

    pub fn resources(&self) -> Resources<'_> {
        Resources {
            scratch: &self.scratch,
            pool: &self.pool,
            share_bytes: 512 << 20,
            cached_windows: CACHED_WINDOWS,
            backing: Backing::Mapped,
            checkpoints: &NoCheckpoints,
            monitor: &Void,
        }
    }

    pub fn ingest(&self, triangles: &[Corners], depth: u32) -> Ingested {
        let resources = self.resources();
        let mut source = ListedTriangles::without_indices(triangles.to_vec());
        let soup =
            read_soup(&mut source, false, Attributes::NONE, &resources).expect("ingest works");
        let domain = Domain::around(&soup.facts.bounds, depth, false).expect("room enough");
        let triangles = soup.facts.stats.triangles;
        let (bins, _) = fill_bins(soup, &domain, &resources).expect("ingest works");
        let settled = settle(&bins, &domain, triangles, &resources).expect("ingest works");
        Ingested { domain, bins, settled }
    }

    pub fn scan(&self, model: &Ingested) -> (BrickFile, ScanStats) {
        let soup = model.bins.without(&model.settled.drops);
        scan(&soup, &model.domain, &self.resources()).expect("scan works")
    }

    pub fn patch(&self, model: &Ingested, hits: &BrickFile) -> Flips {
        let cell_units = f64::from(model.domain.cell_units);
        patch(hits, HAS_ODD_FACES, cell_units, &self.resources()).expect("patch works").0
    }

    pub fn sign(
        &self,
        model: &Ingested,
        hits: &BrickFile,
        flips: &Flips,
    ) -> (BrickFile, SignStats) {
        let resources = self.resources();
        let rule = FillRule::Solid;
        let (flooded, _) =
            flood(hits, flips, (rule, false), &model.domain, &resources).expect("sign works");
        assign_signs((hits, None), flips, &flooded, (rule, &model.domain), &resources)
            .expect("sign works")
    }

    pub fn place(
        &self,
        model: &Ingested,
        signs: SignBricks,
        options: &ContourOptions,
    ) -> (BrickFile, ContourStats) {
        place_vertices(signs, &model.domain, options, &self.resources()).expect("contour works")
    }

    pub fn separate(
        &self,
        model: &Ingested,
        signs: SignBricks,
        cells: &BrickFile,
        options: &ContourOptions,
        placed: &ContourStats,
    ) -> BrickFile {
        let resources = self.resources();
        let separated = separate(signs, cells, &model.domain, options, placed, &resources);
        separated.expect("contour works").0
    }
}

/// Takes a surface and forgets it.
#[derive(Default)]
pub struct Nowhere {
    pub stats: SinkStats,
}

impl MeshSink for Nowhere {
    type Error = Infallible;

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), Infallible> {
        self.stats.vertices += positions.len() as u64;
        Ok(())
    }

    fn needs_corners(&self) -> bool {
        false
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), Infallible> {
        self.stats.triangles += triangles.indices.len() as u64;
        Ok(())
    }

    fn bytes_so_far(&self) -> u64 {
        0
    }

    fn checkpoint(&mut self) -> Result<SinkState, Infallible> {
        Ok(SinkState::default())
    }

    fn finish(self: Box<Self>) -> Result<SinkStats, Infallible> {
        Ok(self.stats)
    }
}
