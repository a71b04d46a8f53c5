//! Bounds, and the parallel projection that fits them into a view.
//!
//! In:         corners in model units.
//! Out:        corners in samples (x right, y down) and a depth, 0 near to 1 far.
//! Invariant:  all of the bounds is inside the view, with a margin on every side.

use glam::DVec3;

use crate::report::preview::{UpAxis, Views};

/// The part of the view that the bounds fill.
const FILL: f64 = 0.92;
/// How far the depth range reaches beyond the bounds, relative to its length.
const DEPTH_MARGIN: f64 = 0.05;

/// What a viewer calls right, up and forward, in model space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    right: DVec3,
    up: DVec3,
    forward: DVec3,
}

impl Frame {
    /// The frames of all views, row by row.
    pub(crate) fn all(views: Views, up: UpAxis) -> Vec<Self> {
        let (top, front) = match up {
            UpAxis::Y => (DVec3::Y, DVec3::Z),
            UpAxis::Z => (DVec3::Z, DVec3::NEG_Y),
        };
        let looking = |&number: &usize| {
            let [x, y, z] = STANDS[number].towards;
            let forward = -(DVec3::X * x + top * y + front * z).normalize();
            // From above and from below, the front is at the lower and at the upper edge.
            let up = if x == 0.0 && z == 0.0 { front * -y } else { top };
            let right = forward.cross(up).normalize();
            Self { right, up: right.cross(forward), forward }
        };
        stands_of(views).iter().map(looking).collect()
    }

    /// A place of the model as coordinates along right, up and forward.
    fn along(&self, place: DVec3) -> DVec3 {
        DVec3::new(self.right.dot(place), self.up.dot(place), self.forward.dot(place))
    }
}

/// The box around finite corners, along the axes of a [`Frame`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    lo: DVec3,
    hi: DVec3,
}

impl Bounds {
    /// The box around nothing.
    pub(crate) const EMPTY: Self = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY };

    /// Whether nothing was added.
    pub(crate) fn is_empty(&self) -> bool {
        self.lo.x > self.hi.x
    }

    /// Makes room for a triangle; false, and no change, when it lies too far off.
    pub(crate) fn add(&mut self, frame: &Frame, corners: &[DVec3; 3]) -> bool {
        let [a, b, c] = corners.map(|corner| frame.along(corner));
        let usable = a.is_finite() && b.is_finite() && c.is_finite();
        if usable {
            self.lo = self.lo.min(a).min(b).min(c);
            self.hi = self.hi.max(a).max(b).max(c);
        }
        usable
    }
}

/// Where a view stands in the picture, counted in views from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Grid {
    /// Views beside each other on one side.
    pub(crate) columns: u32,
    /// Views above each other.
    pub(crate) rows: u32,
}

impl Grid {
    /// The arrangement of `views`.
    pub(crate) fn of(views: Views) -> Self {
        match views {
            Views::Isometric => Self { columns: 1, rows: 1 },
            Views::Four => Self { columns: 2, rows: 2 },
            Views::Six => Self { columns: 3, rows: 2 },
            Views::Fourteen => Self { columns: 7, rows: 2 },
        }
    }
}

/// A corner on its way to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Projected {
    /// Samples from the left edge of the view.
    pub(crate) x: f64,
    /// Samples from its upper edge.
    pub(crate) y: f64,
    /// 0 at the near end of the depth range, 1 at the far end.
    pub(crate) depth: f64,
}

/// A parallel projection of the bounds onto one view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera {
    frame: Frame,
    centre: DVec3,
    /// Model units per unit of the scaled model, whose longest half edge is 1.
    unit: f64,
    scale: f64,
    width: f64,
    height: f64,
    near: f64,
    depth_range: f64,
}

impl Camera {
    /// The camera that fits `bounds`, taken along `frame`, into a view; its size in samples.
    pub(crate) fn new(frame: Frame, bounds: &Bounds, (width, height): (u32, u32)) -> Self {
        // Nothing to see: any camera will do.
        let bounds =
            if bounds.is_empty() { &Bounds { lo: DVec3::ZERO, hi: DVec3::ZERO } } else { bounds };
        // Halves first: the difference of two huge numbers would overflow.
        let half = bounds.hi * 0.5 - bounds.lo * 0.5;
        let centre = bounds.lo * 0.5 + bounds.hi * 0.5;
        let unit = if half.max_element() > 0.0 { half.max_element() } else { 1.0 };
        // A flat model still needs a width, a height and a depth.
        let reach = (half / unit).max(DVec3::splat(1e-6));
        let (width, height) = (f64::from(width), f64::from(height));
        let scale = (width / reach.x).min(height / reach.y) * 0.5 * FILL;
        let near = -reach.z * (1.0 + 2.0 * DEPTH_MARGIN);
        let depth_range = -2.0 * near;
        Self { frame, centre, unit, scale, width, height, near, depth_range }
    }

    /// Projects a corner; infinite or NaN where it lies too far off.
    pub(crate) fn project(&self, corner: DVec3) -> Projected {
        let from_centre = (self.frame.along(corner) - self.centre) / self.unit;
        Projected {
            x: from_centre.x * self.scale + self.width * 0.5,
            y: self.height * 0.5 - from_centre.y * self.scale,
            depth: (from_centre.z - self.near) / self.depth_range,
        }
    }

    /// The place of the model that a sample shows; the depth as [`Self::project`] gives it.
    pub(crate) fn unproject(&self, x: f64, y: f64, depth: f64) -> DVec3 {
        let from_centre = DVec3::new(
            (x - self.width * 0.5) / self.scale,
            (self.height * 0.5 - y) / self.scale,
            depth * self.depth_range + self.near,
        );
        let along = self.centre + from_centre * self.unit;
        let Frame { right, up, forward } = self.frame;
        right * along.x + up * along.y + forward * along.z
    }

    /// The length of the depth range in samples.
    pub(crate) fn depth_samples(&self) -> f64 {
        self.depth_range * self.scale
    }

    /// A normal as the viewer sees it: x right, y up, z towards the viewer.
    pub(crate) fn turn(&self, normal: DVec3) -> DVec3 {
        self.frame.along(normal) * DVec3::new(1.0, 1.0, -1.0)
    }

    /// The distance from the near end of the depth range, in model units.
    pub(crate) fn distance_world(&self, depth: f32) -> f32 {
        (f64::from(depth) * self.depth_range * self.unit) as f32
    }
}

/// Where a viewer stands.
struct Stand {
    name: &'static str,
    /// Along right, top and front of the model.
    towards: [f64; 3],
}

const fn stand(name: &'static str, towards: [f64; 3]) -> Stand {
    Stand { name, towards }
}

/// All stands: those along the axes, then those at the corners of a cube.
const STANDS: [Stand; 14] = [
    stand("front", [0.0, 0.0, 1.0]),
    stand("back", [0.0, 0.0, -1.0]),
    stand("right", [1.0, 0.0, 0.0]),
    stand("left", [-1.0, 0.0, 0.0]),
    stand("top", [0.0, 1.0, 0.0]),
    stand("bottom", [0.0, -1.0, 0.0]),
    stand("front-right-top", [1.0, 1.0, 1.0]),
    stand("front-left-top", [-1.0, 1.0, 1.0]),
    stand("front-right-bottom", [1.0, -1.0, 1.0]),
    stand("front-left-bottom", [-1.0, -1.0, 1.0]),
    stand("back-right-top", [1.0, 1.0, -1.0]),
    stand("back-left-top", [-1.0, 1.0, -1.0]),
    stand("back-right-bottom", [1.0, -1.0, -1.0]),
    stand("back-left-bottom", [-1.0, -1.0, -1.0]),
];

/// Numbers of the stands of all views, row by row.
fn stands_of(views: Views) -> &'static [usize] {
    match views {
        Views::Isometric => &[6],
        Views::Four => &[0, 1, 4, 6],
        Views::Six => &[0, 1, 2, 3, 4, 5],
        Views::Fourteen => &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13],
    }
}

/// The names of all views, in the order of [`Frame::all`].
pub(crate) fn names_of(views: Views) -> impl Iterator<Item = &'static str> {
    stands_of(views).iter().map(|&number| STANDS[number].name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(frame: Frame, triangles: &[[DVec3; 3]]) -> Camera {
        let mut bounds = Bounds::EMPTY;
        assert!(triangles.iter().all(|corners| bounds.add(&frame, corners)));
        Camera::new(frame, &bounds, (400, 300))
    }

    #[test]
    fn every_view_holds_the_whole_mesh() {
        let thin = [[-1e308, 2.0, 5.0], [1e308, 9.0, 5.0], [0.0, 2.0, 5.0]];
        let usual = [[0.1, 2.0, -5.0], [30.0, 9.0, 5.0], [0.0, -2.0, 5.0]];
        for corners in [thin, usual, [[7.0; 3]; 3]] {
            let corners = corners.map(DVec3::from_array);
            for up in [UpAxis::Y, UpAxis::Z] {
                for frame in Frame::all(Views::Fourteen, up) {
                    let camera = camera(frame, &[corners]);
                    for at in corners.map(|corner| camera.project(corner)) {
                        let again = camera.project(camera.unproject(at.x, at.y, at.depth));
                        let off = (again.x - at.x).abs().max((again.y - at.y).abs());
                        assert!(off.max((again.depth - at.depth).abs()) < 1e-6, "{again:?} {at:?}");
                        assert!(at.x > 0.0 && at.x < 400.0, "{at:?}");
                        assert!(at.y > 0.0 && at.y < 300.0, "{at:?}");
                        assert!(at.depth > 0.0 && at.depth < 1.0, "{at:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn up_is_up_and_right_is_right_in_the_front_view() {
        let camera =
            camera(Frame::all(Views::Four, UpAxis::Z)[0], &[[DVec3::ZERO, DVec3::ONE, DVec3::X]]);
        let origin = camera.project(DVec3::ZERO);
        assert!(camera.project(DVec3::X).x > origin.x);
        assert!(camera.project(DVec3::Z).y < origin.y);
        assert!(camera.project(DVec3::Y).depth > origin.depth);
    }
}
