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

/// The box around finite corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    lo: DVec3,
    hi: DVec3,
}

impl Bounds {
    /// The box around one triangle.
    pub(crate) fn of(corners: &[DVec3; 3]) -> Self {
        let [a, b, c] = *corners;
        Self { lo: a.min(b).min(c), hi: a.max(b).max(c) }
    }

    /// The box around both.
    pub(crate) fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
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
    right: DVec3,
    up: DVec3,
    forward: DVec3,
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
    /// The camera of the view in column and row of the grid; sizes in samples.
    pub(crate) fn new(
        bounds: &Bounds,
        (views, up): (Views, UpAxis),
        (column, row): (u32, u32),
        (width, height): (u32, u32),
    ) -> Self {
        let (forward, up) = direction(views, up, column, row);
        let right = forward.cross(up).normalize();
        let up = right.cross(forward);
        // Halves first: the difference of two huge numbers would overflow.
        let half = bounds.hi * 0.5 - bounds.lo * 0.5;
        let centre = bounds.lo * 0.5 + bounds.hi * 0.5;
        let unit = if half.max_element() > 0.0 { half.max_element() } else { 1.0 };
        let half = half / unit;
        let reach = |axis: DVec3| axis.abs().dot(half).max(1e-6);
        let (width, height) = (f64::from(width), f64::from(height));
        let scale = (width / reach(right)).min(height / reach(up)) * 0.5 * FILL;
        let near = -reach(forward) * (1.0 + 2.0 * DEPTH_MARGIN);
        let depth_range = -2.0 * near;
        Self { right, up, forward, centre, unit, scale, width, height, near, depth_range }
    }

    /// Projects a corner; infinite or NaN where it lies too far off.
    pub(crate) fn project(&self, corner: DVec3) -> Projected {
        let from_centre = (corner - self.centre) / self.unit;
        Projected {
            x: self.right.dot(from_centre) * self.scale + self.width * 0.5,
            y: self.height * 0.5 - self.up.dot(from_centre) * self.scale,
            depth: (self.forward.dot(from_centre) - self.near) / self.depth_range,
        }
    }

    /// A normal as the viewer sees it: x right, y up, z towards the viewer.
    pub(crate) fn turn(&self, normal: DVec3) -> DVec3 {
        DVec3::new(self.right.dot(normal), self.up.dot(normal), -self.forward.dot(normal))
    }

    /// The distance from the near end of the depth range, in model units.
    pub(crate) fn distance_world(&self, depth: f32) -> f32 {
        (f64::from(depth) * self.depth_range * self.unit) as f32
    }
}

/// The direction of sight, and a direction that is not parallel to it and points up.
fn direction(views: Views, up: UpAxis, column: u32, row: u32) -> (DVec3, DVec3) {
    let (top, front) = match up {
        UpAxis::Y => (DVec3::Y, DVec3::Z),
        UpAxis::Z => (DVec3::Z, DVec3::NEG_Y),
    };
    match (views, row, column) {
        (Views::Four, 0, 0) => (-front, top),
        (Views::Four, 0, _) => (front, top),
        (Views::Four, _, 0) => (-top, -front),
        (Views::Four, ..) | (Views::Isometric, ..) => (-(DVec3::X + top + front).normalize(), top),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras(bounds: &Bounds) -> Vec<Camera> {
        let mut cameras = Vec::new();
        for up in [UpAxis::Y, UpAxis::Z] {
            for (views, place) in [
                (Views::Isometric, (0, 0)),
                (Views::Four, (0, 0)),
                (Views::Four, (1, 0)),
                (Views::Four, (0, 1)),
                (Views::Four, (1, 1)),
            ] {
                cameras.push(Camera::new(bounds, (views, up), place, (400, 300)));
            }
        }
        cameras
    }

    #[test]
    fn every_view_holds_the_whole_bounds() {
        let bounds = Bounds { lo: DVec3::new(-1e308, 2.0, 5.0), hi: DVec3::new(1e308, 9.0, 5.0) };
        for camera in cameras(&bounds) {
            for corner in 0..8 {
                let pick = |bit: u32, lo, hi| if corner >> bit & 1 == 0 { lo } else { hi };
                let at = camera.project(DVec3::new(
                    pick(0, bounds.lo.x, bounds.hi.x),
                    pick(1, bounds.lo.y, bounds.hi.y),
                    pick(2, bounds.lo.z, bounds.hi.z),
                ));
                assert!(at.x > 0.0 && at.x < 400.0, "{at:?}");
                assert!(at.y > 0.0 && at.y < 300.0, "{at:?}");
                assert!(at.depth > 0.0 && at.depth < 1.0, "{at:?}");
            }
        }
    }

    #[test]
    fn up_is_up_and_right_is_right_in_the_front_view() {
        let bounds = Bounds { lo: DVec3::ZERO, hi: DVec3::ONE };
        let camera = Camera::new(&bounds, (Views::Four, UpAxis::Z), (0, 0), (100, 100));
        let origin = camera.project(DVec3::ZERO);
        assert!(camera.project(DVec3::X).x > origin.x);
        assert!(camera.project(DVec3::Z).y < origin.y);
        assert!(camera.project(DVec3::Y).depth > origin.depth);
    }
}
