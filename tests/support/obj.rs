//! Triangles as the text of an OBJ file.

use std::collections::HashMap;
use std::fmt::Write;

use brickmend::mesh::shapes::Corners;

/// One vertex for each place.
pub fn welded_obj(triangles: &[Corners]) -> String {
    let mut numbers = HashMap::new();
    let (mut vertices, mut faces) = (String::new(), String::new());
    for corners in triangles {
        faces.push('f');
        for corner in corners {
            let next = numbers.len() + 1;
            // There is one zero.
            let number = *numbers.entry(corner.map(|x| (x + 0.0).to_bits())).or_insert(next);
            if number == next {
                let [x, y, z] = corner;
                writeln!(vertices, "v {x} {y} {z}").expect("text grows");
            }
            write!(faces, " {number}").expect("text grows");
        }
        faces.push('\n');
    }
    vertices + &faces
}

/// Each triangle with vertices of its own.
pub fn unwelded_obj(triangles: &[Corners]) -> String {
    let mut text = String::new();
    for [x, y, z] in triangles.iter().flatten() {
        writeln!(text, "v {x} {y} {z}").expect("text grows");
    }
    for first in (1..=3 * triangles.len()).step_by(3) {
        writeln!(text, "f {first} {} {}", first + 1, first + 2).expect("text grows");
    }
    text
}
