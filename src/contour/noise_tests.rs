//! The surface of noise: every corner of the grid inside or outside by chance.
//!
//! Noise has every sign pattern at every place, also at brick borders, so whatever is not
//! manifold by construction shows here. The judge is the proof, which shares no code with this.

use std::convert::Infallible;

use glam::DVec3;

use crate::contour::mdc::cut_of;
use crate::contour::{
    ContourOptions, ContourStats, Method, SurfaceDetail, place_vertices, separate, write_surface,
};
use crate::mesh::shapes::{ListedTriangles, Random};
use crate::mesh::{MeshSink, SinkState, SinkStats, SinkTriangles};
use crate::monitor::Void;
use crate::octree::{
    BrickKey, CornerBits, Crossing, Domain, EdgeBits, LINES, PATCH, SIDE, SignBrick, SignBricks,
    SnapBox, SourcePlane, decode_cells, edge_position, encode, face_index, for_each_ambiguous_face,
};
use crate::store::{Backing, BrickFile, BrickWriter, NoCheckpoints, Resources, Scratch};
use crate::verify::{Outward, Proof, ProofOptions, ProvedSource, Vertices, prove};

/// The grid of the tests: 2 x 2 x 2 bricks.
const DEPTH: u32 = 6;
/// Corners of the grid from here up to, not including, there may be inside: all bricks share them.
const NOISE: std::ops::Range<usize> = 16..48;

/// A sink that keeps everything.
#[derive(Default)]
pub struct Kept {
    pub vertices: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl MeshSink for Kept {
    type Error = Infallible;

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), Infallible> {
        self.vertices.extend_from_slice(positions);
        Ok(())
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), Infallible> {
        assert_eq!(triangles.indices.len(), triangles.corners.len());
        self.triangles.extend_from_slice(triangles.indices);
        Ok(())
    }

    fn bytes_so_far(&self) -> u64 {
        0
    }

    fn checkpoint(&mut self) -> Result<SinkState, Infallible> {
        Ok(SinkState::default())
    }

    fn finish(self: Box<Self>) -> Result<SinkStats, Infallible> {
        Ok(SinkStats::default())
    }
}

/// Signs of all corners of the grid, and hits on its edges that look the same from every brick.
pub struct Field {
    pub seed: u64,
    pub inside_share: f64,
    pub patch_share: f64,
    /// Of ambiguous faces, those that are walled.
    pub wall_share: f64,
    pub decimate_cells: f64,
}

impl Field {
    fn random_at(&self, kind: u64, at: [usize; 3]) -> Random {
        let place = at.iter().fold(kind, |key, &c| key << 8 | c as u64);
        Random::new(self.seed.wrapping_mul(0x1_0000_0001) ^ place << 20 ^ place)
    }

    fn is_inside(&self, at: [usize; 3]) -> bool {
        at.iter().all(|c| NOISE.contains(c)) && self.random_at(3, at).share() < self.inside_share
    }

    /// A patch, or a plane of any direction through the edge, seen from the brick at `base`.
    fn hit(&self, axis: usize, at: [usize; 3], base: [usize; 3], cell: f64) -> Hit {
        let mut random = self.random_at(axis as u64, at);
        // Some hits lie at the very ends of their edges.
        let offset = match random.below(4) {
            0 => random.within(0.0, 1e-3),
            1 => 1.0 - random.within(1e-6, 1e-3),
            _ => random.share(),
        };
        if random.share() < self.patch_share {
            return Hit::Patch(PATCH | (offset * 65535.0) as u32);
        }
        let mut point = DVec3::from(std::array::from_fn(|a| (at[a] - base[a]) as f64));
        point[axis] += offset;
        let normal = (DVec3::from(random.point()) + DVec3::AXES[axis] * 1e-3).normalize_or_zero();
        let normal = normal.as_vec3();
        let offset = normal.as_dvec3().dot(point * cell);
        Hit::Plane(SourcePlane { offset, normal: normal.to_array(), ..SourcePlane::default() })
    }

    fn brick(&self, position: [u32; 3], cell: f64) -> SignBrick {
        let base = position.map(|c| c as usize * SIDE);
        let hit = |axis, at| self.hit(axis, at, base, cell);
        let mut brick = brick_at(base, |at| self.is_inside(at), hit);
        let mut marks = EdgeBits::default();
        brick.crossings.iter().for_each(|crossing| marks.set(crossing.edge));
        for_each_ambiguous_face(&marks, |axis, at| {
            let place = std::array::from_fn(|a| base[a] + at[a]);
            if self.random_at(4 + axis as u64, place).share() < self.wall_share {
                brick.walls.push(face_index(axis, at));
            }
        });
        brick
    }
}

/// What crosses an edge.
pub enum Hit {
    Patch(u32),
    /// From the brick's min corner.
    Plane(SourcePlane),
}

/// The brick whose min corner is `base`, by which corners of the grid are inside and what crosses
/// the edges along an axis from a corner.
pub fn brick_at(
    base: [usize; 3],
    is_inside: impl Fn([usize; 3]) -> bool,
    hit: impl Fn(usize, [usize; 3]) -> Hit,
) -> SignBrick {
    let mut corners = CornerBits::default();
    for (row, bits) in corners.rows.iter_mut().enumerate() {
        for x in 0..LINES {
            let at = [base[0] + x, base[1] + row % LINES, base[2] + row / LINES];
            *bits |= u64::from(is_inside(at)) << x;
        }
    }
    let mut marks = EdgeBits::default();
    marks.set_differences(&corners);
    let base_inside = corners.get([0; 3]);
    let mut brick = SignBrick { base_inside, ..SignBrick::default() };
    marks.for_each(|edge| {
        let (axis, at) = edge_position(edge);
        let plane = match hit(axis, std::array::from_fn(|a| base[a] + at[a])) {
            Hit::Patch(plane) => plane,
            Hit::Plane(plane) => {
                brick.planes.push(plane);
                brick.planes.len() as u32 - 1
            }
        };
        brick.crossings.push(Crossing { edge, plane });
    });
    brick
}

/// What came of a field.
pub struct Contoured {
    pub kept: Kept,
    pub proof: Proof,
    pub stats: ContourStats,
    /// Face points between clusters above the brick.
    pub far_points: usize,
}

fn contour(field: &Field, backing: Backing, threads: usize) -> Contoured {
    contour_by(Method::Mdc, field, backing, threads)
}

/// Contours a field by a method and proves what comes of it.
pub fn contour_by(method: Method, field: &Field, backing: Backing, threads: usize) -> Contoured {
    let unit = SnapBox { lo: [0.0; 3], hi: [1.0; 3] };
    let domain = Domain::around(&unit, DEPTH, false).expect("room enough");
    let brick = |key| field.brick(BrickKey(key).position(), f64::from(domain.cell_units));
    let options = ContourOptions {
        method,
        crease_deg: 12.0,
        decimate_cells: field.decimate_cells,
        surfaces: SurfaceDetail::None,
        sources: false,
    };
    contour_bricks(&domain, (0..8).map(|key| (key, brick(key))), &options, backing, threads)
}

/// Contours bricks of signs and proves what comes of it.
pub fn contour_bricks(
    domain: &Domain,
    bricks: impl Iterator<Item = (u64, SignBrick)>,
    options: &ContourOptions,
    backing: Backing,
    threads: usize,
) -> Contoured {
    let method = options.method;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let resources = Resources {
        scratch: &scratch,
        pool: &pool,
        share_bytes: 8 << 20,
        cached_windows: 2,
        backing,
        checkpoints: &NoCheckpoints,
        monitor: &Void,
    };
    let mut writer = BrickWriter::create(&scratch, "signs", backing).expect("room");
    for (key, brick) in bricks {
        writer.append(key, 0, &encode(&brick)).expect("room");
    }
    let signs = writer.finish(2).expect("room");
    let signs = SignBricks::whole(&signs);
    let (cells, placed) = place_vertices(signs, domain, options, &resources).expect("sound bricks");
    let (surface, separated) =
        separate(signs, &cells, domain, options, &placed, &resources).expect("sound bricks");
    if method != Method::Mc {
        for file in [&cells, &surface] {
            assert_vertices_lie_in_their_cells(file, domain);
        }
    }
    let far_points = if method == Method::Mdc { far_points_of(&surface) } else { 0 };
    let mut kept = Kept::default();
    let files = (&cells, &surface);
    let stats = write_surface(files, domain, options, (&separated, None), &mut kept, &resources)
        .expect("sound bricks");
    let source = ListedTriangles::with_indices(&kept.vertices, kept.triangles.clone());
    let mut open = || -> Result<ProvedSource<_>, Infallible> { Ok(Box::new(source.clone())) };
    let proof_options = ProofOptions {
        share_bytes: 32 << 20,
        outward: Outward::NotAsked,
        vertices: Vertices::Numbers,
        intersections: true,
    };
    let proof = prove(&mut open, &scratch, &proof_options, &pool, &Void).expect("room");
    Contoured { kept, proof, stats, far_points }
}

fn far_points_of(surface: &BrickFile) -> usize {
    let of_brick = |number| {
        let view = surface.view(number).expect("readable");
        let points = &decode_cells(&view).expect("a cell brick").points;
        points.iter().filter(|point| point.key.to_native() >> 60 & 1 == 1).count()
    };
    (0..surface.len()).map(of_brick).sum()
}

fn assert_vertices_lie_in_their_cells(cells: &BrickFile, domain: &Domain) {
    let cell_units = i64::from(domain.cell_units);
    for number in 0..cells.len() {
        let view = cells.view(number).expect("readable");
        let record = decode_cells(&view).expect("a cell brick");
        for (low, side, vertices) in cut_of(record) {
            for position in &record.positions[vertices] {
                let reach = record.reaches.iter().find(|r| r.is_granted && r.position == *position);
                for a in 0..3 {
                    let mut low = low[a] as i64 * cell_units;
                    if let Some(reach) = reach.filter(|reach| usize::from(reach.face / 2) == a) {
                        low += if reach.face % 2 == 1 { cell_units } else { -cell_units };
                    }
                    let within = i64::from(position[a].to_native()) - low;
                    assert!(0 < within && within < side * cell_units, "{within} of {side} cells");
                }
            }
        }
    }
}

fn assert_sound(found: &Contoured, name: &str) {
    let Contoured { kept, proof, stats, .. } = found;
    assert!(proof.holds(), "{name}: {:?}", proof.failures());
    assert_eq!(proof.unused_vertices, 0, "{name}");
    assert_eq!(stats.vertices, kept.vertices.len() as u64, "{name}");
    assert_eq!(stats.triangles, kept.triangles.len() as u64, "{name}");
    assert!(stats.multi_cells > 0 && stats.fans > 0, "{name}: not much of a noise");
}

#[test]
fn the_surface_of_noise_is_closed_and_manifold() {
    for (seed, inside_share, patch_share, wall_share) in [
        (1, 0.5, 0.5, 0.0),
        (2, 0.2, 0.5, 0.5),
        (3, 0.5, 0.0, 1.0),
        (4, 0.2, 0.0, 1.0),
        (5, 0.8, 0.1, 0.2),
        (8, 0.5, 0.3, 0.1),
    ] {
        let field = Field { seed, inside_share, patch_share, wall_share, decimate_cells: 0.0 };
        let found = contour(&field, Backing::Memory, 1);
        assert_sound(&found, &format!("{inside_share} inside, {wall_share} walled"));
        assert!(found.proof.triangles > 10_000);
    }
}

#[test]
fn noise_in_mapped_bricks_and_on_more_threads_is_the_same() {
    let field = Field {
        seed: 6,
        inside_share: 0.5,
        patch_share: 0.3,
        wall_share: 0.5,
        decimate_cells: 0.0,
    };
    let one = contour(&field, Backing::Memory, 1);
    assert_sound(&one, "in memory");
    for (backing, threads) in [(Backing::Mapped, 1), (Backing::Mapped, 4), (Backing::Memory, 4)] {
        let other = contour(&field, backing, threads);
        assert!(one.kept.vertices == other.kept.vertices, "{backing:?} {threads}");
        assert!(one.kept.triangles == other.kept.triangles, "{backing:?} {threads}");
    }
}

#[test]
fn flipped_faces_occur_in_noise_and_are_needed() {
    let field = Field {
        seed: 7,
        inside_share: 0.5,
        patch_share: 1.0,
        wall_share: 0.0,
        decimate_cells: 0.0,
    };
    let found = contour(&field, Backing::Memory, 1);
    assert_sound(&found, "all patched");
    assert!(found.stats.flipped_faces > 0 && found.stats.flipped_faces.is_multiple_of(2));
}

#[test]
fn clusters_of_noise_are_sound_at_any_threshold() {
    let mut clusters = 0;
    for (seed, inside_share, patch_share, wall_share, decimate_cells) in [
        (11, 0.5, 0.5, 0.0, 0.3),
        (12, 0.2, 0.0, 0.5, 0.7),
        (13, 0.5, 0.0, 0.3, 1.1),
        (14, 0.05, 0.2, 1.0, 2.0),
        (15, 0.9, 1.0, 0.0, 5.0),
        (16, 0.3, 0.1, 1.0, 5.0),
    ] {
        let field = Field { seed, inside_share, patch_share, wall_share, decimate_cells };
        let found = contour(&field, Backing::Memory, 1);
        assert_sound(&found, &format!("{inside_share} inside, {decimate_cells} cells"));
        clusters += found.stats.clusters;
        let other = contour(&field, Backing::Mapped, 4);
        assert!(found.kept.vertices == other.kept.vertices, "{seed}");
        assert!(found.kept.triangles == other.kept.triangles, "{seed}");
    }
    assert!(clusters > 1000, "{clusters}");
}
