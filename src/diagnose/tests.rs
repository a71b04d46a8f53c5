//! Each defect on the smallest model that shows it, none on clean shapes, and the same for any share.

use glam::{DMat3, DVec3};

use crate::defect::{Defect, DefectKind};
use crate::diagnose::{Diagnosis, Finding, Means, Model, ModelFacts, Tolerances, diagnose};
use crate::mesh::shapes::{
    Corners, ListedTriangles, Random, area, bounds, cuboid, gear, rotation, sphere, tetrahedron,
    torus, transform,
};
use crate::monitor::Void;
use crate::store::Scratch;

const AMPLE: u64 = 64 << 20;
const SCARCE: u64 = 16 << 10;

fn look(mut source: ListedTriangles, share_bytes: u64) -> (Diagnosis, ModelFacts) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let means = Means { scratch: &scratch, share_bytes, monitor: &Void };
    let model = Model::read(&mut source, &means).expect("nothing fails in memory");
    let facts = model.facts().clone();
    let [low, high] = facts.bounds.unwrap_or_default();
    let diagonal = DVec3::from(low).distance(DVec3::from(high));
    let tolerances =
        Tolerances { thin: 0.002 * diagonal, tiny: 0.005 * diagonal, junction: 1e-6 * diagonal };
    let diagnosis = diagnose(&model, &tolerances, None, &means).expect("the scratch folder works");
    (diagnosis, facts)
}

fn diagnosis(corners: &[Corners]) -> Diagnosis {
    look(ListedTriangles::without_indices(corners.to_vec()), AMPLE).0
}

fn finding(diagnosis: &Diagnosis, kind: DefectKind) -> &Finding {
    let mut own = diagnosis.findings.iter().filter(|finding| finding.kind == kind);
    let found = own.next().expect("every kind is told");
    assert!(own.next().is_none(), "{kind:?} is told twice");
    assert!(found.places.len() as u64 <= found.count);
    assert!(found.count == 0 || !found.places.is_empty(), "{kind:?} has no place");
    found
}

fn count(diagnosis: &Diagnosis, kind: DefectKind) -> u64 {
    finding(diagnosis, kind).count
}

/// Kinds that were found, with their counts.
fn found(diagnosis: &Diagnosis) -> Vec<(DefectKind, u64)> {
    let some = diagnosis.findings.iter().filter(|finding| finding.count > 0);
    some.map(|finding| (finding.kind, finding.count)).collect()
}

fn shapes() -> [Vec<Corners>; 5] {
    [
        sphere([0.3, -0.2, 0.1], 1.0, 9),
        torus(1.0, 0.45, 24, 12),
        cuboid([-1.0, 0.0, 2.0], [1.0, 0.5, 2.5]),
        gear(9, 0.7, 1.0, 0.4),
        tetrahedron([1.0, 2.0, 3.0], 4.0),
    ]
}

fn pose(shape: &[Corners], random: &mut Random) -> Vec<Corners> {
    transform(shape, rotation(random), DVec3::new(3.0, -1.0, 0.5))
}

#[test]
fn clean_shapes_have_no_defect_in_any_pose() {
    let mut random = Random::new(11);
    for shape in shapes() {
        for turned in
            std::iter::once(shape.clone()).chain((0..6).map(|_| pose(&shape, &mut random)))
        {
            let diagnosis = diagnosis(&turned);
            assert_eq!(found(&diagnosis), []);
            assert_eq!((diagnosis.shells.count, diagnosis.shells.manifold), (1, 1));
            assert_eq!(diagnosis.edges, turned.len() as u64 / 2 * 3);
            let [shell] = diagnosis.shells.largest[..] else { panic!("one shell is told") };
            assert!((shell.area / area(&turned) - 1.0).abs() < 1e-12);
            let volume = shell.volume.expect("it is closed");
            assert!((volume / crate::mesh::shapes::volume(&turned) - 1.0).abs() < 1e-9);
            assert!(shell.is_closed && !shell.is_hidden);
        }
    }
}

#[test]
fn a_hole_is_a_loop_with_its_length_and_place() {
    let mut random = Random::new(5);
    let ball = pose(&sphere([0.0; 3], 1.0, 8), &mut random);
    let lost = ball[70];
    let open: Vec<_> = ball.iter().copied().filter(|corners| *corners != lost).collect();
    let diagnosis = diagnosis(&open);
    assert_eq!(found(&diagnosis), [(DefectKind::OpenLoop, 1), (DefectKind::OpenShell, 1)]);
    let around: f64 =
        (0..3).map(|i| DVec3::from(lost[i]).distance(DVec3::from(lost[(i + 1) % 3]))).sum();
    assert_eq!(diagnosis.loops.edges, 3);
    assert!((diagnosis.loops.total_length - around).abs() < 1e-12);
    let Defect::OpenLoop(place) = finding(&diagnosis, DefectKind::OpenLoop).places[0] else {
        panic!("a loop is told")
    };
    assert_eq!((place.edges, place.bounds), (3, bounds(&[lost])));
    let Defect::OpenShell(shell) = finding(&diagnosis, DefectKind::OpenShell).places[0] else {
        panic!("a shell is told")
    };
    assert_eq!(shell.triangles, open.len() as u64);
    assert!((shell.open_share - 3.0 / (3 * open.len()) as f64).abs() < 1e-12);
}

#[test]
fn rims_are_told_apart_by_the_fans_at_their_vertices() {
    // Two sheets that touch in a point.
    let (o, x, y) = ([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let mirrored = |p: [f64; 3]| p.map(|x| -x);
    let sheets = [[o, x, y], [o, mirrored(x), mirrored(y)]];
    let loops = diagnosis(&sheets).loops;
    assert_eq!((loops.count, loops.edges, loops.most_edges), (2, 6, 3));
    // Two triangles taken out that have an edge in common, or a vertex: one hole.
    let ball = sphere([0.0; 3], 1.0, 4);
    for shared in [2, 1] {
        let beside = |other: &&Corners| {
            ball[0].iter().filter(|corner| other.contains(corner)).count() == shared
        };
        let second = *ball.iter().find(beside).expect("a neighbour");
        let open: Vec<_> = ball[1..].iter().copied().filter(|own| *own != second).collect();
        let loops = diagnosis(&open).loops;
        let edges = if shared == 2 { 4 } else { 6 };
        assert_eq!((loops.count, loops.edges, loops.most_edges), (1, edges, edges));
    }
    // Far apart they are two.
    let open: Vec<_> = ball[1..ball.len() - 1].to_vec();
    let loops = diagnosis(&open).loops;
    assert_eq!((loops.count, loops.edges, loops.most_edges), (2, 6, 3));
}

#[test]
fn copies_are_told_with_what_they_copy_and_which_way_they_face() {
    let mut soup = sphere([0.0; 3], 1.0, 3);
    let triangles = soup.len() as u64;
    let [a, b, c] = soup[5];
    soup.extend([[b, c, a], [a, c, b]]);
    let diagnosis = diagnosis(&soup);
    let found = finding(&diagnosis, DefectKind::DuplicateTriangle);
    assert_eq!(found.count, 2);
    assert!((found.size - 2.0 * area(&[[a, b, c]])).abs() < 1e-12);
    let told: Vec<_> = found
        .places
        .iter()
        .map(|place| match place {
            Defect::DuplicateTriangle(copy) => (copy.triangles, copy.is_reversed),
            other => panic!("{other}"),
        })
        .collect();
    assert_eq!(told, [([5, triangles], false), ([5, triangles + 1], true)]);
}

#[test]
fn a_vertex_on_an_edge_is_a_junction_also_where_rounding_moved_it() {
    let mut random = Random::new(2);
    for turn in 0..6 {
        let mut soup = pose(&cuboid([0.0; 3], [1.0, 2.0, 3.0]), &mut random);
        let [p, q, r] = soup[4];
        let cut: [f64; 3] = std::array::from_fn(|i| p[i] + 0.37 * (q[i] - p[i]));
        soup[4] = [p, cut, r];
        soup.push([cut, q, r]);
        if turn % 2 == 1 {
            // As a file of single precision has it.
            soup.iter_mut().flatten().flatten().for_each(|x| *x = f64::from(*x as f32));
        }
        let diagnosis = diagnosis(&soup);
        let junctions = finding(&diagnosis, DefectKind::TJunction);
        assert_eq!(junctions.count, 1, "turn {turn}");
        let Defect::TJunction(junction) = junctions.places[0] else { panic!("a junction is told") };
        assert!(DVec3::from(junction.position).distance(DVec3::from(cut)) < 1e-6);
    }
}

#[test]
fn fins_are_told_and_what_they_hang_from_is_not() {
    let mut random = Random::new(9);
    let mut soup = pose(&sphere([0.0; 3], 1.0, 6), &mut random);
    let triangles = soup.len() as u64;
    for at in [7, 50] {
        let [p, q, _] = soup[at];
        let out: [f64; 3] = std::array::from_fn(|i| p[i] * 1.5 + 0.1 * i as f64);
        soup.push([q, p, out]);
    }
    let diagnosis = diagnosis(&soup);
    let fins = finding(&diagnosis, DefectKind::Fin);
    assert_eq!(fins.count, 2);
    assert!((fins.size - area(&soup[triangles as usize..])).abs() < 1e-12);
    let mut firsts: Vec<_> = fins
        .places
        .iter()
        .map(|place| match place {
            Defect::Fin(fin) => (fin.triangle, fin.triangles),
            other => panic!("{other}"),
        })
        .collect();
    firsts.sort_unstable();
    assert_eq!(firsts, [(triangles, 1), (triangles + 1, 1)]);
}

#[test]
fn what_lies_inside_is_hidden_and_what_shows_through_a_hole_is_not() {
    let mut random = Random::new(4);
    for _ in 0..5 {
        let turn = rotation(&mut random);
        let outer = transform(&cuboid([-1.0; 3], [1.0; 3]), turn, DVec3::ZERO);
        let inner = transform(&sphere([0.0; 3], 0.4, 4), turn, DVec3::ZERO);
        let all: Vec<_> = outer.iter().chain(&inner).copied().collect();
        let closed = diagnosis(&all);
        let hidden = finding(&closed, DefectKind::HiddenShell);
        assert_eq!(hidden.count, 1);
        let Defect::HiddenShell(place) = hidden.places[0] else { panic!("a shell is told") };
        assert_eq!((place.triangle, place.triangles), (12, inner.len() as u64));
        assert_eq!(count(&diagnosis(&all[2..]), DefectKind::HiddenShell), 0);
    }
}

#[test]
fn thin_walls_are_told_and_gaps_are_not() {
    let mut random = Random::new(6);
    for _ in 0..5 {
        let turn = rotation(&mut random);
        let plate = transform(&cuboid([0.0; 3], [1.0, 1.0, 0.001]), turn, DVec3::ZERO);
        let thin = diagnosis(&plate);
        let walls = finding(&thin, DefectKind::ThinWall);
        assert_eq!(walls.count, 4);
        assert!((walls.size - 0.001).abs() < 1e-9);
        let mut boxes = cuboid([0.0; 3], [1.0, 1.0, 0.5]);
        boxes.extend(cuboid([0.0, 0.0, 0.501], [1.0; 3]));
        let gap = diagnosis(&transform(&boxes, turn, DVec3::ZERO));
        assert_eq!(count(&gap, DefectKind::ThinWall), 0);
        // Inside out it is the other way round: the gap is the wall.
        boxes.iter_mut().for_each(|corners| corners.swap(1, 2));
        let inverted = diagnosis(&transform(&boxes, turn, DVec3::ZERO));
        assert_eq!(count(&inverted, DefectKind::ThinWall), 4);
    }
}

#[test]
fn shells_that_are_inside_out_are_told_and_cavities_are_not() {
    let mut random = Random::new(12);
    let flipped = |shape: Vec<Corners>| -> Vec<Corners> {
        shape.into_iter().map(|[a, b, c]| [a, c, b]).collect()
    };
    for _ in 0..5 {
        let turn = rotation(&mut random);
        let told = |shells: &[Vec<Corners>]| {
            let soup = transform(&shells.concat(), turn, DVec3::new(7.0, 8.0, -9.0));
            let found = finding(&diagnosis(&soup), DefectKind::InwardComponent).clone();
            let mut firsts: Vec<_> = found
                .places
                .iter()
                .map(|place| match place {
                    Defect::InwardComponent(component) => component.triangle,
                    other => panic!("{other}"),
                })
                .collect();
            firsts.sort_unstable();
            assert_eq!(firsts.len() as u64, found.count);
            firsts
        };
        let (large, small) = (cuboid([-1.0; 3], [1.0; 3]), sphere([0.1; 3], 0.5, 3));
        let beside = sphere([4.0, 0.0, 0.0], 1.0, 3);
        assert!(told(&[large.clone(), small.clone(), beside.clone()]).is_empty(), "all outward");
        assert!(told(&[large.clone(), flipped(small.clone())]).is_empty(), "a cavity");
        assert_eq!(told(&[large.clone(), flipped(beside.clone())]), [12]);
        assert_eq!(told(&[flipped(large.clone()), small.clone()]), [0]);
        assert_eq!(told(&[flipped(large.clone()), flipped(small.clone())]), [0]);
        // What is open has no inside, whichever way it faces, and so no cavities.
        assert_eq!(told(&[large[1..].to_vec(), flipped(small.clone())]), [11]);
        assert!(told(&[flipped(large[1..].to_vec())]).is_empty());
    }
    // One that hangs on an open shell by a vertex is a shell of its own.
    let mut soup = flipped(tetrahedron([0.0; 3], 1.0));
    soup.push([[0.0; 3], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]);
    assert_eq!(count(&diagnosis(&soup), DefectKind::InwardComponent), 1);
}

#[test]
fn specks_are_tiny() {
    let mut soup = sphere([0.0; 3], 1.0, 6);
    soup.extend(tetrahedron([1.5, 0.0, 0.0], 0.002));
    let diagnosis = diagnosis(&soup);
    assert_eq!(found(&diagnosis), [(DefectKind::TinyShell, 1)]);
    assert_eq!((diagnosis.shells.count, diagnosis.shells.closed), (2, 2));
}

#[test]
fn vertices_of_a_file_are_merged_by_place_and_those_without_a_triangle_are_told() {
    let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let mut vertices = square.to_vec();
    // Vertex 4 is 2 again, with another zero; 5 and 6 are used by none.
    vertices.extend([[1.0, 1.0, -0.0], [5.0; 3], [f64::NAN; 3]]);
    let source = ListedTriangles::with_indices(&vertices, vec![[0, 1, 2], [0, 4, 3]]);
    let (diagnosis, facts) = look(source, AMPLE);
    assert_eq!((facts.used_vertices, facts.positions), (5, 4));
    assert_eq!((facts.listed_vertices, diagnosis.edges), (Some(7), 5));
    let isolated = finding(&diagnosis, DefectKind::IsolatedVertex);
    assert_eq!(isolated.count, 2);
    assert!(matches!(isolated.places[0], Defect::IsolatedVertex(vertex) if vertex.vertex == 5));
    let merged = finding(&diagnosis, DefectKind::CoincidentVertices);
    assert_eq!(merged.count, 1);
    let place = merged.places[0];
    assert!(matches!(place, Defect::CoincidentVertices(pair) if pair.vertices == [2, 4]));
    assert_eq!(diagnosis.shells.count, 1, "the two triangles hang together over one place");
}

/// A soup with some of everything.
fn wreck(random: &mut Random) -> Vec<Corners> {
    let mut soup = sphere([0.0; 3], 1.0, 14);
    soup.extend(transform(&torus(0.6, 0.1, 40, 12), rotation(random), DVec3::splat(0.1)));
    soup.extend(cuboid([0.5, 0.5, 0.5], [2.0, 2.0, 0.501]));
    for _ in 0..40 {
        let at = random.point();
        soup.extend(tetrahedron(at, 0.004 * random.share()));
    }
    for at in (0..soup.len()).step_by(29) {
        let [p, q, r] = soup[at];
        let cut: [f64; 3] = std::array::from_fn(|i| p[i].midpoint(q[i]));
        soup[at] = [p, cut, r];
        soup.push([cut, q, r]);
        soup.push(soup[at + 1]);
        soup.push([q, p, random.point()]);
    }
    soup.retain(|_| random.share() > 0.05);
    soup.push([[f64::NAN; 3]; 3]);
    soup
}

#[test]
fn the_share_changes_nothing() {
    let mut random = Random::new(21);
    let soup = wreck(&mut random);
    let ample = diagnosis(&soup);
    for kind in [
        DefectKind::OpenLoop,
        DefectKind::DuplicateTriangle,
        DefectKind::TJunction,
        DefectKind::Fin,
        DefectKind::OpenShell,
        DefectKind::ThinWall,
        DefectKind::TinyShell,
    ] {
        assert!(count(&ample, kind) > 0, "{kind:?} is not tested");
    }
    for share in [SCARCE, 256 << 10] {
        let (scarce, _) = look(ListedTriangles::without_indices(soup.clone()), share);
        assert_eq!(ample, scarce, "{share} bytes");
    }
}

#[test]
fn counts_do_not_depend_on_the_order_of_the_file() {
    let mut random = Random::new(22);
    let soup = wreck(&mut random);
    let counts = |soup: &[Corners]| {
        let diagnosis = diagnosis(soup);
        (found(&diagnosis), diagnosis.loops.count, diagnosis.shells.count, diagnosis.edges)
    };
    let before = counts(&soup);
    let mut shuffled = soup.clone();
    crate::mesh::shapes::shuffle(&mut shuffled, &mut random);
    assert_eq!(before, counts(&shuffled));
}

#[test]
fn nothing_and_nothing_finite_are_no_trouble() {
    for soup in [vec![], vec![[[f64::INFINITY; 3]; 3]], vec![[[1.0; 3]; 3]; 2]] {
        let diagnosis = diagnosis(&soup);
        assert_eq!((found(&diagnosis), diagnosis.shells.count), (vec![], 0));
    }
    let far = transform(&sphere([0.0; 3], 1e150, 3), DMat3::IDENTITY, DVec3::splat(1e154));
    let _ = diagnosis(&far);
}
