//! Colours: flat shading under two lights that stand beside the viewer.
//!
//! In:     unit normals as the viewer sees them (z towards the viewer), side and facing.
//! Out:    linear light 0..1 per channel, or bytes in the sRGB encoding.

use glam::DVec3;

use crate::report::preview::Side;

/// Behind the model: near white.
pub(crate) const BACKGROUND: [f32; 3] = [0.90, 0.91, 0.93];
/// Between the two sides: near black.
pub(crate) const SEPARATOR: [f32; 3] = [0.02, 0.02, 0.02];

const AMBIENT: f64 = 0.10;
const KEY: (DVec3, f64) = (DVec3::new(-0.45, 0.75, 0.49), 0.75);
const FILL: (DVec3, f64) = (DVec3::new(0.70, -0.10, 0.71), 0.28);
/// How much of the light a line along an edge keeps.
const LINE: f32 = 0.15;

/// How bright a face is lit, 0 to 1; `seen` is its normal, turned towards the viewer if it is a back
/// face.
pub(crate) fn light(side: Side, back: bool, seen: DVec3) -> f32 {
    let lit = |(towards, strength): (DVec3, f64)| strength * seen.dot(towards).max(0.0);
    let light = (AMBIENT + lit(KEY) + lit(FILL)).min(1.0) as f32;
    // A wrong face of the output must be seen even in the shade.
    if side == Side::Output && back { light.max(0.5) } else { light }
}

/// The colour of a face in that light.
pub(crate) fn shade(side: Side, back: bool, light: f32) -> [f32; 3] {
    let base: [f32; 3] = match (side, back) {
        (Side::Input, false) => [0.58, 0.64, 0.72],
        (Side::Input, true) => [0.72, 0.30, 0.24],
        (Side::Output, false) => [0.66, 0.66, 0.66],
        (Side::Output, true) => [1.00, 0.02, 0.02],
    };
    base.map(|channel| channel * light)
}

/// The colour of a line on a face of that colour.
pub(crate) fn line(face: [f32; 3]) -> [f32; 3] {
    face.map(|channel| channel * LINE)
}

/// Linear light to bytes in the sRGB encoding.
pub(crate) fn to_srgb(linear: [f32; 3]) -> [u8; 3] {
    linear.map(|channel| {
        let encoded = if channel <= 0.003_130_8 {
            12.92 * channel
        } else {
            1.055 * channel.powf(1.0 / 2.4) - 0.055
        };
        (encoded.clamp(0.0, 1.0) * 255.0).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_and_the_middle_of_srgb_are_right() {
        assert_eq!(to_srgb([0.0, 1.0, 0.214_04]), [0, 255, 127]);
    }

    #[test]
    fn a_back_face_of_the_output_is_red_in_any_light() {
        for seen in [DVec3::Z, DVec3::X, DVec3::NEG_Y] {
            let [red, green, blue] =
                to_srgb(shade(Side::Output, true, light(Side::Output, true, seen)));
            assert!(red > 150 && green < 60 && blue < 60);
        }
    }
}
