//! How the corners of a primitive make triangles: one after another, as a strip, or as a fan.

/// A way to join corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    Triangles,
    Strip,
    Fan,
}

/// Whether a mode of the file has triangles; others are points and lines.
pub(crate) fn is_triangles(mode: u32) -> bool {
    Mode::of_code(mode).is_some()
}

impl Mode {
    pub(crate) fn of_code(code: u32) -> Option<Self> {
        Some(match code {
            4 => Self::Triangles,
            5 => Self::Strip,
            6 => Self::Fan,
            _ => return None,
        })
    }

    /// How many triangles so many corners make.
    pub(crate) fn triangles(self, corners: u64) -> u64 {
        match self {
            Self::Triangles => corners / 3,
            Self::Strip | Self::Fan => corners.saturating_sub(2),
        }
    }

    /// Whether some corners are left over.
    pub(crate) fn has_rest(self, corners: u64) -> bool {
        match self {
            Self::Triangles => !corners.is_multiple_of(3),
            Self::Strip | Self::Fan => matches!(corners, 1 | 2),
        }
    }

    /// The corners of a triangle; all triangles of a strip turn like the first.
    #[inline]
    pub(crate) fn corners(self, triangle: u64) -> [u64; 3] {
        match self {
            Self::Triangles => [3 * triangle, 3 * triangle + 1, 3 * triangle + 2],
            Self::Strip if triangle.is_multiple_of(2) => [triangle, triangle + 1, triangle + 2],
            Self::Strip => [triangle, triangle + 2, triangle + 1],
            Self::Fan => [triangle + 1, triangle + 2, 0],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_turn_one_way() {
        assert_eq!(Mode::Strip.corners(0), [0, 1, 2]);
        assert_eq!(Mode::Strip.corners(1), [1, 3, 2]);
        assert_eq!(Mode::Fan.corners(1), [2, 3, 0]);
        assert_eq!([3, 4, 5, 6, 7].map(|n| Mode::Triangles.triangles(n)), [1, 1, 1, 2, 2]);
        assert_eq!([0, 1, 2, 3, 4].map(|n| Mode::Strip.triangles(n)), [0, 0, 0, 1, 2]);
        assert!(Mode::Triangles.has_rest(4) && Mode::Fan.has_rest(2) && !Mode::Strip.has_rest(0));
    }
}
