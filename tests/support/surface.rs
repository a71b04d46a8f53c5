//! A written surface, read back and judged by brute force.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use brickmend::io::ReadOptions;
use brickmend::mesh::TriangleBatch;
use brickmend::monitor::Void;
use brickmend::sign::FillRule;
use brickmend::store::Scratch;
use brickmend::verify::{Outward, Proof, ProofOptions, ProvedSource, Vertices, prove};
use glam::DVec3;
use tempfile::TempDir;

/// Vertices and triangles of a file; positions are the vertices where the file has no numbers.
pub struct Surface {
    pub vertices: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    pub proof: Proof,
}

impl Surface {
    /// Reads a file that must keep every promise; `rule` says which way components may face.
    ///
    /// # Panics
    /// It does not.
    pub fn read_proven(path: &Path, rule: FillRule) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let outward = match rule {
            FillRule::Solid => Outward::AllPositive,
            FillRule::Nonzero | FillRule::Evenodd => Outward::AlternatesWithNesting,
        };
        // Seams and creases split the vertices of GLB.
        let is_split = path.extension().is_some_and(|extension| extension == "glb");
        let vertices = if is_split { Vertices::Positions } else { Vertices::Numbers };
        let options =
            ProofOptions { share_bytes: 16 << 20, outward, vertices, intersections: true };
        let read = ReadOptions::in_scene(16 << 20);
        let mut open = || -> Result<ProvedSource<_>, brickmend::io::IoError> {
            brickmend::io::open(path, &scratch, &read)
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        let proof = prove(&mut open, &scratch, &options, &pool, &Void).expect("a readable file");
        assert!(proof.holds(), "{:?}", proof.failures());
        let mut source = brickmend::io::open(path, &scratch, &read).expect("a readable file");
        let mut surface = Self { vertices: Vec::new(), triangles: Vec::new(), proof };
        let mut numbers = HashMap::new();
        let mut batch = TriangleBatch::default();
        while source.next_batch(&mut batch).expect("a readable file") {
            for corners in &batch.corners {
                surface.triangles.push(corners.map(|corner| {
                    *numbers.entry(corner.map(f64::to_bits)).or_insert_with(|| {
                        surface.vertices.push(corner);
                        surface.vertices.len() as u32 - 1
                    })
                }));
            }
        }
        surface.check(rule);
        surface
    }

    fn check(&self, rule: FillRule) {
        assert!(!self.triangles.is_empty());
        self.check_edges();
        self.check_fans();
        for triangle in &self.triangles {
            let [p, q, r] = triangle.map(|number| self.vertices[number as usize]);
            assert!(!is_degenerate(p, q, r), "{p:?} {q:?} {r:?}");
        }
        let volumes = self.component_volumes();
        assert!(volumes.iter().all(|&v| v != 0.0));
        if rule == FillRule::Solid {
            assert!(volumes.iter().all(|&v| v > 0.0), "{volumes:?}");
        }
        assert_eq!(self.proof.triangles as usize, self.triangles.len());
        assert_eq!(self.proof.components as usize, volumes.len());
        assert_eq!(self.proof.euler_characteristic, self.euler_characteristic());
        let sum: f64 = volumes.iter().sum();
        assert!((sum / self.proof.volume - 1.0).abs() < 1e-6, "{sum} {}", self.proof.volume);
    }

    /// Every edge has one triangle on either side, in opposite directions.
    fn check_edges(&self) {
        let mut directed = HashSet::new();
        for &[p, q, r] in &self.triangles {
            for edge in [[p, q], [q, r], [r, p]] {
                assert!(directed.insert(edge), "{edge:?} has two triangles on one side");
            }
        }
        for &[p, q] in &directed {
            assert!(directed.contains(&[q, p]), "{p} {q} has one triangle");
        }
    }

    /// The triangles at a vertex are one closed fan.
    fn check_fans(&self) {
        let mut around: Vec<Vec<(u32, u32)>> = vec![Vec::new(); self.vertices.len()];
        for &[p, q, r] in &self.triangles {
            for (at, from, to) in [(p, q, r), (q, r, p), (r, p, q)] {
                around[at as usize].push((from, to));
            }
        }
        for (vertex, steps) in around.iter().enumerate() {
            let next: HashMap<u32, u32> = steps.iter().copied().collect();
            let start = steps.first().expect("every vertex is used").0;
            let (mut at, mut length) = (start, 0);
            loop {
                at = next[&at];
                length += 1;
                if at == start {
                    break;
                }
            }
            assert_eq!(length, steps.len(), "vertex {vertex} has more than one fan");
        }
    }

    /// Signed volumes of the components, each about one of its own vertices.
    pub fn component_volumes(&self) -> Vec<f64> {
        let mut parents: Vec<u32> = (0..self.vertices.len() as u32).collect();
        fn root(parents: &mut [u32], mut at: u32) -> u32 {
            while parents[at as usize] != at {
                parents[at as usize] = parents[parents[at as usize] as usize];
                at = parents[at as usize];
            }
            at
        }
        for &[p, q, r] in &self.triangles {
            for other in [q, r] {
                let (a, b) = (root(&mut parents, p), root(&mut parents, other));
                parents[a.max(b) as usize] = a.min(b);
            }
        }
        let mut volumes = HashMap::new();
        for triangle in &self.triangles {
            let component = root(&mut parents, triangle[0]);
            let origin = self.at(component);
            let [p, q, r] = triangle.map(|number| self.at(number) - origin);
            *volumes.entry(component).or_insert(0.0) += p.dot(q.cross(r)) / 6.0;
        }
        let mut volumes: Vec<(u32, f64)> = volumes.into_iter().collect();
        volumes.sort_by_key(|entry| entry.0);
        volumes.into_iter().map(|entry| entry.1).collect()
    }

    /// Of a closed surface, whose edges have two triangles each.
    fn euler_characteristic(&self) -> i64 {
        self.vertices.len() as i64 - self.triangles.len() as i64 / 2
    }

    /// Position of a vertex.
    pub fn at(&self, number: u32) -> DVec3 {
        self.vertices[number as usize].into()
    }

    /// The same geometry has the same list, whatever the order of vertices and triangles.
    pub fn sorted_triangles(&self) -> Vec<[[u64; 3]; 3]> {
        let mut list: Vec<_> = self
            .triangles
            .iter()
            .map(|triangle| {
                let mut keys = triangle.map(|n| self.vertices[n as usize].map(f64::to_bits));
                let least = (0..3).min_by_key(|&i| keys[i]).expect("three corners");
                keys.rotate_left(least);
                keys
            })
            .collect();
        list.sort_unstable();
        list
    }
}

/// Whether three points lie on a line; exact where their differences are.
pub fn is_degenerate(p: [f64; 3], q: [f64; 3], r: [f64; 3]) -> bool {
    let side = |to: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|a| {
            let difference = to[a] - p[a];
            // What the subtraction lost, after Knuth; nothing, for points of one lattice.
            let other = difference - to[a];
            let lost = (to[a] - (difference - other)) + (-p[a] - other);
            assert_eq!(lost, 0.0, "{to:?} {p:?} are not on one lattice");
            difference
        })
    };
    let (e, f) = (side(q), side(r));
    (0..3).all(|a| {
        let (u, v) = ((a + 1) % 3, (a + 2) % 3);
        product(e[u], f[v]) == product(e[v], f[u])
    })
}

/// The exact product, as an odd number and a power of two.
fn product(x: f64, y: f64) -> (i128, i32) {
    let parts = |x: f64| {
        let bits = x.to_bits();
        let exponent = (bits >> 52 & 0x7ff) as i32;
        let fraction = (bits & ((1 << 52) - 1)) as i128;
        let mantissa = if exponent == 0 { fraction } else { fraction | 1 << 52 };
        (if x < 0.0 { -mantissa } else { mantissa }, exponent.max(1))
    };
    let ((a, i), (b, j)) = (parts(x), parts(y));
    let whole = a * b;
    if whole == 0 {
        return (0, 0);
    }
    let zeros = whole.trailing_zeros();
    (whole >> zeros, i + j + zeros as i32)
}

#[test]
fn collinear_points_are_told_from_nearly_collinear_ones() {
    let far = 1e6;
    assert!(is_degenerate([far, 0.0, 0.0], [far + 0.25, 0.5, 0.0], [far + 0.5, 1.0, 0.0]));
    assert!(!is_degenerate([far, 0.0, 0.0], [far + 0.25, 0.5, 0.0], [far + 0.5, 1.0, 1e-100]));
    assert!(is_degenerate([1.0; 3], [1.0; 3], [2.0, 3.0, 4.0]));
}
