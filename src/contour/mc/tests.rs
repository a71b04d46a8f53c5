//! Marching cubes over noise, judged by the proof.

use std::collections::HashSet;

use crate::contour::Method;
use crate::contour::noise_tests::{Contoured, Field, contour_by};
use crate::store::Backing;

fn assert_sound(found: &Contoured, name: &str) {
    let Contoured { kept, proof, stats, .. } = found;
    assert!(proof.holds(), "{name}: {:?}", proof.failures());
    assert_eq!(proof.unused_vertices, 0, "{name}");
    assert_eq!(stats.vertices, kept.vertices.len() as u64, "{name}");
    assert_eq!(stats.triangles, kept.triangles.len() as u64, "{name}");
    assert_eq!(stats.cell_vertices, stats.vertices, "{name}");
    assert!(stats.multi_cells > 0, "{name}: not much of a noise");
    // Every crossing is in the cycles of four cells, and a cycle of n gives n - 2 triangles.
    assert_eq!(stats.triangles, 4 * stats.vertices - 2 * stats.polygons, "{name}");
    let places: HashSet<_> = kept.vertices.iter().map(|v| v.map(f64::to_bits)).collect();
    assert_eq!(places.len(), kept.vertices.len(), "{name}");
}

#[test]
fn the_surface_of_noise_is_closed_and_manifold() {
    for (seed, inside_share, patch_share) in [(1, 0.5, 0.5), (2, 0.2, 0.0), (3, 0.8, 0.1)] {
        let field = Field { seed, inside_share, patch_share, wall_share: 0.0, decimate_cells: 0.0 };
        let found = contour_by(Method::Mc, &field, Backing::Memory, 1);
        assert_sound(&found, &format!("{inside_share} inside, {patch_share} patched"));
        assert!(found.proof.triangles > 10_000);
    }
}

#[test]
fn noise_in_mapped_bricks_and_on_more_threads_is_the_same() {
    let field = Field {
        seed: 6,
        inside_share: 0.5,
        patch_share: 0.3,
        wall_share: 0.0,
        decimate_cells: 0.0,
    };
    let one = contour_by(Method::Mc, &field, Backing::Memory, 1);
    assert_sound(&one, "in memory");
    for (backing, threads) in [(Backing::Mapped, 1), (Backing::Mapped, 4), (Backing::Memory, 4)] {
        let other = contour_by(Method::Mc, &field, backing, threads);
        assert!(one.kept.vertices == other.kept.vertices, "{backing:?} {threads}");
        assert!(one.kept.triangles == other.kept.triangles, "{backing:?} {threads}");
    }
}
