//! Painting of surfaces that are made by hand, into a sink that keeps all.

use crate::mesh::{
    Attributes, CornerForm, DrawnFrom, InnerCrossing, MeshSink, SinkState, SinkStats,
    SinkTriangles, Surface, VertexValues,
};
use crate::monitor::Void;
use crate::octree::AttributeRecord;
use crate::paint::{Drawing, Origins, PaintOptions, paint};
use crate::store::{Backing, NoCheckpoints, Resources, Scratch, SpoolWriter, StoreError};

/// Keeps what it takes.
#[derive(Default)]
struct Kept {
    form: CornerForm,
    positions: Vec<[f64; 3]>,
    colours: Vec<[u8; 4]>,
    vertex_uvs: Vec<[f32; 2]>,
    vertex_normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    indices: Vec<[u32; 3]>,
    corner_uvs: Vec<[[f32; 2]; 3]>,
    corner_normals: Vec<[[f32; 3]; 3]>,
    surfaces: Vec<Surface>,
}

impl MeshSink for Kept {
    type Error = StoreError;

    fn corner_form(&self) -> CornerForm {
        self.form
    }

    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<(), StoreError> {
        self.positions.extend_from_slice(positions);
        Ok(())
    }

    fn vertex_values(&mut self, values: &VertexValues) -> Result<(), StoreError> {
        self.colours.extend_from_slice(values.colours);
        self.vertex_uvs.extend_from_slice(values.uvs);
        self.vertex_normals.extend_from_slice(values.normals);
        Ok(())
    }

    fn list_uvs(&mut self, uvs: &[[f32; 2]]) -> Result<(), StoreError> {
        self.uvs.extend_from_slice(uvs);
        Ok(())
    }

    fn list_normals(&mut self, normals: &[[f32; 3]]) -> Result<(), StoreError> {
        self.normals.extend_from_slice(normals);
        Ok(())
    }

    fn triangles(&mut self, triangles: &SinkTriangles) -> Result<(), StoreError> {
        self.indices.extend_from_slice(triangles.indices);
        self.surfaces.extend_from_slice(triangles.surfaces);
        self.corner_uvs.extend_from_slice(triangles.uvs.values);
        self.corner_normals.extend_from_slice(triangles.normals.values);
        // Numbers and values say the same, and name what was handed over before.
        for (numbers, values) in triangles.uvs.numbers.iter().zip(triangles.uvs.values) {
            assert_eq!(numbers.map(|number| self.uvs[number as usize]), *values);
        }
        for (numbers, values) in triangles.normals.numbers.iter().zip(triangles.normals.values) {
            assert_eq!(numbers.map(|number| self.normals[number as usize]), *values);
        }
        Ok(())
    }

    fn bytes_so_far(&self) -> u64 {
        0
    }

    fn checkpoint(&mut self) -> Result<SinkState, StoreError> {
        Ok(SinkState::default())
    }

    fn finish(self: Box<Self>) -> Result<SinkStats, StoreError> {
        Ok(SinkStats::default())
    }
}

/// A tetrahedron, its sides of looks 0, 0, 1 and 1 after sources 0, 1, 2 and one that was added for 2.
fn painted(form: CornerForm, wanted: Attributes) -> Kept {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let resources = Resources {
        scratch: &scratch,
        pool: &pool,
        share_bytes: 1 << 20,
        cached_windows: 2,
        backing: Backing::Mapped,
        checkpoints: &NoCheckpoints,
        monitor: &Void,
    };
    let places = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let sides = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|side| side.map(|i| i as u32));
    let corners = sides.map(|side| side.map(|i| places[i as usize]));
    let mut records = SpoolWriter::create(&scratch, "records").expect("a spool");
    for source in 0..3_usize {
        let uvs = corners[source]
            .map(|[x, y, z]| [10.0 * source as f32 + x as f32, (y + 2.0 * z) as f32]);
        let colours = [[40 * source as u8, 7, 0, 255]; 3];
        let corners = corners[source];
        records.push(AttributeRecord { corners, uvs, colours, unused: 0 }).expect("pushed");
    }
    let records = records.finish().expect("finished");
    let mut added = SpoolWriter::create(&scratch, "origins").expect("a spool");
    added.push(2_u32).expect("pushed");
    let added = added.finish().expect("finished");
    let origins = Origins::new(3, &[&added], &resources).expect("a table");
    let mut drawing = Drawing::new(wanted, origins, &resources).expect("spools");
    drawing.vertices(&places).expect("taken");
    let surfaces = [0, 0, 1, 1].map(|look| Surface::new(look, look == 1));
    let inner = [InnerCrossing { vertex: 3, position: places[3], surface: surfaces[0], source: 0 }];
    let triangles = SinkTriangles {
        indices: &sides,
        corners: &corners,
        surfaces: &surfaces,
        from: DrawnFrom { sources: &[0, 1, 2, 3], inner: &inner },
        ..SinkTriangles::default()
    };
    drawing.triangles(&triangles).expect("taken");
    let drawn = drawing.end().expect("drawn");
    let options = PaintOptions { wanted, surfaces: true, cell: 0.25, crease_deg: 12.0, slack: 0.0 };
    let mut kept = Kept { form, ..Kept::default() };
    paint(&drawn, &records, &options, &mut kept, &resources).expect("painted");
    assert_eq!(kept.surfaces, surfaces);
    kept
}

#[test]
fn corners_have_one_coordinate_for_each_look_around_their_vertex() {
    let kept = painted(CornerForm::OfCorners, Attributes::ALL);
    assert_eq!(kept.positions.len(), 4);
    assert_eq!(kept.indices[0], [0, 2, 1]);
    // Two looks meet at each vertex; but at none of the ends of an edge is there a third.
    assert_eq!(kept.uvs.len(), 8);
    // Vertex 0 is a corner of sources 0 and 1, and the lower number has it.
    assert_eq!(kept.corner_uvs[0][0], [0.0, 0.0]);
    assert_eq!(kept.corner_uvs[1][0], [0.0, 0.0]);
    // Of look 1 only the added triangle is there, which stands for source 2: that goes on a cell.
    let far = kept.corner_uvs[3][1];
    assert!(far[0] > 20.0 && far[0] < 21.0, "{far:?}");
    assert_eq!(kept.corner_uvs[2][0], [21.0, 0.0]);
    // Every corner has the normal of its side: all creases are sharp.
    assert_eq!(kept.normals.len(), 12);
    assert_eq!(kept.corner_normals[0], [[0.0, 0.0, -1.0]; 3]);
    assert_eq!(kept.colours[0], [0, 7, 0, 255]);
}

#[test]
fn vertices_are_split_by_look_and_normal_as_far_as_these_are_wanted() {
    let all = painted(CornerForm::OfVertices, Attributes::ALL);
    assert_eq!(all.positions.len(), 12, "three normals at every vertex");
    assert_eq!(all.vertex_uvs.len(), 12);
    assert!(all.uvs.is_empty() && all.corner_uvs.is_empty());
    let wanted = Attributes { normals: false, ..Attributes::ALL };
    let flat = painted(CornerForm::OfVertices, wanted);
    assert_eq!(flat.positions.len(), 8, "two looks at every vertex");
    assert!(flat.vertex_normals.is_empty());
    let [a, b, _] = flat.indices[1];
    assert_eq!(flat.indices[0][0], a);
    assert_eq!(flat.indices[0][2], b);
    let wanted = Attributes { normals: true, ..Attributes::NONE };
    let shaded = painted(CornerForm::OfVertices, wanted);
    assert_eq!(shaded.positions.len(), 12);
    assert!(shaded.vertex_uvs.is_empty() && shaded.colours.is_empty());
}
