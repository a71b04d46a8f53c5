//! What writing needs of a method: the vertices of a brick, and its triangles.
//!
//! Every method leaves a brick file whose directory says in its flags how many vertices come from
//! each brick, and numbers them in the order of the bricks.

use crate::contour::mc::Triangles;
use crate::contour::mdc::{BrickTriangles, Layers, Polygons};
use crate::contour::{ContourError, Method};
use crate::octree::Domain;

/// What a byte of a record takes as triangles, besides the byte.
#[derive(Clone, Copy)]
pub struct Factors {
    /// Where the sink takes numbers of vertices.
    pub plain: u64,
    /// Where it takes corners as well.
    pub with_corners: u64,
}

impl Method {
    /// What the records of this method take as triangles, the owners of their vertices included.
    pub(crate) const fn factors(self) -> Factors {
        match self {
            Self::Mdc | Self::Dc | Self::Dmc => Factors { plain: 4, with_corners: 18 },
            Self::Mc => Factors { plain: 8, with_corners: 40 },
        }
    }
}

/// Makes the triangles of one brick after another, by one of the methods.
pub enum Maker<'m> {
    /// Manifold dual contouring.
    Mdc(Box<Polygons<'m>>),
    /// Marching cubes.
    Mc(Triangles<'m>),
}

impl<'m> Maker<'m> {
    /// The maker of `method` over all bricks; `bases` are the numbers of their first vertices.
    pub fn new(
        method: Method,
        cells: Layers<'m>,
        bases: &'m [u32],
        domain: &Domain,
        with_corners: bool,
    ) -> Self {
        match method {
            Method::Mdc | Method::Dc | Method::Dmc => {
                let is_careful = method == Method::Mdc;
                let polygons = Polygons::new(cells, bases, domain, is_careful, with_corners);
                Self::Mdc(Box::new(polygons))
            }
            Method::Mc => Self::Mc(Triangles::new(cells.first(), bases, domain, with_corners)),
        }
    }

    /// The triangles of brick `number`.
    ///
    /// # Errors
    /// [`ContourError`].
    pub fn triangles(&mut self, number: usize) -> Result<BrickTriangles, ContourError> {
        match self {
            Self::Mdc(polygons) => polygons.triangles(number),
            Self::Mc(triangles) => triangles.triangles(number),
        }
    }
}
