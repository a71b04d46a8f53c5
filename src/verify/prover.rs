//! The order of the passes over the tape, and the division of the share among them.

use crate::defect::{
    BoundaryEdge, CoincidentVertices, Defect, EdgePlace, InconsistentEdge, InwardComponent, Marks,
    NonmanifoldEdge, NonmanifoldVertex, Smallest, VertexPlace,
};
use crate::mesh::MeshSource;
use crate::monitor::Monitor;
use crate::store::{Labels, Scratch, Sequence, StoreError};
use crate::verify::coincidence::find_coincident;
use crate::verify::components::{Component, Measure, OPEN, UNDECIDED, unite};
use crate::verify::fans::judge_fans;
use crate::verify::intake::{Intake, read};
use crate::verify::intersect::Intersections;
use crate::verify::link::Judgement;
use crate::verify::nesting::{Nesting, nest};
use crate::verify::numbering::number_positions;
use crate::verify::places::Positions;
use crate::verify::positions::position_of;
use crate::verify::tape::Tape;
use crate::verify::{Outward, Proof, ProofOptions, VerifyError, Vertices};

/// One proof under way.
pub(crate) struct Prover<'p> {
    scratch: &'p Scratch,
    quarter_bytes: u64,
    outward: Outward,
    vertices: Vertices,
    marks: Option<&'p Marks>,
    monitor: &'p dyn Monitor,
    tape: Tape,
    intake: Intake,
    proof: Proof,
}

impl<'p> Prover<'p> {
    /// A proof of nothing yet. The tape takes a quarter of the share, each pass at most the rest.
    pub(crate) fn new(
        scratch: &'p Scratch,
        options: &ProofOptions,
        marks: Option<&'p Marks>,
        monitor: &'p dyn Monitor,
    ) -> Self {
        let quarter_bytes = options.share_bytes / 4;
        Self {
            scratch,
            quarter_bytes,
            outward: options.outward,
            vertices: options.vertices,
            marks,
            monitor,
            tape: Tape::new(scratch, quarter_bytes),
            intake: Intake::default(),
            proof: Proof::default(),
        }
    }

    /// Reads the file onto the tape, and into the cells where pairs of triangles meet.
    pub(crate) fn read<S: MeshSource + ?Sized>(
        &mut self,
        source: &mut S,
        intersections: Option<&mut Intersections<'_>>,
    ) -> Result<(), VerifyError<S::Error>> {
        let Self { tape, vertices, marks, monitor, .. } = self;
        self.intake = read(source, tape, (*vertices, *marks), intersections, *monitor)?;
        Ok(())
    }

    /// Makes all passes.
    pub(crate) fn judge(mut self) -> Result<Proof, StoreError> {
        let (tape, scratch, monitor) = (&mut self.tape, self.scratch, self.monitor);
        let indexed = self.intake.vertices.is_some();
        let (vertices, space) = match self.intake.vertices {
            Some(vertices) => (vertices, vertices),
            None => {
                let numbered = number_positions(tape, scratch, 2 * self.quarter_bytes, monitor)?;
                (numbered.vertices, numbered.space)
            }
        };
        let share = (scratch, 2 * self.quarter_bytes);
        let judgement = judge_fans(&self.tape, space, self.marks, share, monitor)?;
        self.enter_counts(vertices, &judgement);
        self.proof.places.append(&mut self.intake.nonfinite_places);
        self.enter_places(indexed, &judgement)?;
        self.proof.places.append(&mut self.intake.degenerate_places);
        if indexed {
            self.enter_coincidence(space)?;
        }
        let (mut labels, whole) = unite(&self.tape, space, scratch, self.quarter_bytes, monitor)?;
        self.proof.euler_characteristic += whole as i64;
        self.count_components(&mut labels, space - judgement.used_vertices)?;
        if self.outward != Outward::NotAsked {
            self.enter_orientation(&mut labels, &judgement.unbalanced)?;
        }
        Ok(self.proof)
    }

    fn enter_counts(&mut self, vertices: u64, judgement: &Judgement) {
        let proof = &mut self.proof;
        self.intake.enter_into(proof);
        proof.vertices = vertices;
        proof.edges = judgement.edges;
        proof.boundary_edges = judgement.boundary_edges;
        proof.nonmanifold_edges = judgement.nonmanifold_edges;
        proof.inconsistent_edges = judgement.inconsistent_edges;
        proof.nonmanifold_vertices = judgement.nonmanifold_vertices;
        proof.unused_vertices = vertices - judgement.used_vertices;
        // The triangles of the topology are added when they are counted.
        proof.euler_characteristic = judgement.used_vertices as i64 - judgement.edges as i64;
    }

    fn enter_places(&mut self, indexed: bool, judgement: &Judgement) -> Result<(), StoreError> {
        let edges = || {
            let boundary = judgement.boundary_places.iter().map(|(edge, ())| *edge);
            let crowded = judgement.nonmanifold_places.iter().map(|(edge, _)| *edge);
            let inconsistent = judgement.inconsistent_places.iter().map(|(edge, ())| *edge);
            boundary.chain(crowded).chain(inconsistent)
        };
        let vertices = judgement.vertex_places.iter().map(|(vertex, _)| *vertex);
        let ids = edges().flatten().chain(vertices).collect();
        let positions = Positions::find(&self.tape, ids, self.monitor)?;
        let edge_place = |edge: &[u32; 2]| EdgePlace {
            ends: edge.map(|id| positions.of(id)),
            vertices: indexed.then_some(*edge),
        };
        let places = &mut self.proof.places;
        for (edge, ()) in judgement.boundary_places.iter() {
            places.push(Defect::BoundaryEdge(BoundaryEdge { edge: edge_place(edge) }));
        }
        for (edge, triangles) in judgement.nonmanifold_places.iter() {
            let defect = NonmanifoldEdge { edge: edge_place(edge), triangles: *triangles };
            places.push(Defect::NonmanifoldEdge(defect));
        }
        for (edge, ()) in judgement.inconsistent_places.iter() {
            places.push(Defect::InconsistentEdge(InconsistentEdge { edge: edge_place(edge) }));
        }
        for &(id, fans) in judgement.vertex_places.iter() {
            let vertex = VertexPlace { position: positions.of(id), vertex: indexed.then_some(id) };
            places.push(Defect::NonmanifoldVertex(NonmanifoldVertex { vertex, fans }));
        }
        Ok(())
    }

    fn enter_coincidence(&mut self, space: u64) -> Result<(), StoreError> {
        let share_bytes = 2 * self.quarter_bytes;
        let found = find_coincident(&self.tape, space, self.scratch, share_bytes, self.monitor)?;
        self.proof.coincident_vertices = found.vertices;
        for &(vertex, (first, key)) in found.places.iter() {
            let pair = CoincidentVertices { vertices: [first, vertex], position: position_of(key) };
            self.proof.places.push(Defect::CoincidentVertices(pair));
        }
        Ok(())
    }

    fn count_components(&mut self, labels: &mut Labels, unused: u64) -> Result<(), StoreError> {
        let mut sets = 0;
        for vertex in 0..labels.len() as u32 {
            sets += u64::from(labels.label(vertex)? == vertex);
        }
        // A vertex of no triangle is a set of its own.
        self.proof.components = sets - unused;
        Ok(())
    }

    fn enter_orientation(
        &mut self,
        labels: &mut Labels,
        unbalanced: &Sequence<u32>,
    ) -> Result<(), StoreError> {
        let [low, high] = self.proof.bounds.unwrap_or_default();
        let reach = low.iter().chain(&high).fold(0.0_f64, |most, x| most.max(x.abs()));
        let mut measure = Measure {
            tape: &self.tape,
            labels,
            unbalanced,
            count: self.proof.components,
            reach,
            scratch: self.scratch,
            share_bytes: self.quarter_bytes,
            monitor: self.monitor,
        };
        let components = measure.components()?;
        let chunk = (self.quarter_bytes / 4 / 64).max(16) as usize;
        let (tape, monitor, nested) =
            (&self.tape, self.monitor, self.outward == Outward::AlternatesWithNesting);
        let (mut inward, mut undecided) = (0, 0);
        let mut places = Smallest::new();
        components.each_block(chunk, |components| {
            let nestings = if nested && self.proof.components > 1 {
                nest(components, tape, labels, monitor)?
            } else {
                vec![Nesting::default(); components.len()]
            };
            for (component, nesting) in components.iter().zip(nestings) {
                match verdict(component, nesting) {
                    Some(true) => {}
                    Some(false) => {
                        inward += 1;
                        places.offer(component.first, component.anchor);
                    }
                    None => undecided += 1,
                }
            }
            Ok(())
        })?;
        self.proof.inward_components = inward;
        self.proof.undecided_components = undecided;
        for &(triangle, position) in places.iter() {
            let defect = InwardComponent { triangle, position };
            self.proof.places.push(Defect::InwardComponent(defect));
        }
        Ok(())
    }
}

/// Whether a component faces outward; an open one is not asked.
fn verdict(component: &Component, nesting: Nesting) -> Option<bool> {
    match component.side {
        OPEN => Some(true),
        UNDECIDED => None,
        0 => Some(false),
        _ if nesting.touches => None,
        side => Some((side < 0) == nesting.odd),
    }
}
