//! The nodes of a file that we write: those of a scene, else one for each part.
//!
//! Memory: one node; tables over nodes, spilled beyond a share.

use crate::io::error::IoError;
use crate::io::gltf::document::{Layout, name_member};
use crate::io::output::Output;
use crate::io::scene::{Links, NONE, SceneTree};
use crate::mesh::{Affine, IDENTITY};

/// Writes scenes and nodes.
pub(crate) fn write_nodes(output: &mut Output, layout: &mut Layout) -> Result<(), IoError> {
    if let Some(scene) = layout.scene.clone().filter(|scene| !scene.is_empty()) {
        return write_scene(output, layout, &scene);
    }
    let scale = scale_member(layout.metres);
    let count = layout.parts.len();
    let all: Vec<_> = (0..count).map(|number| number.to_string()).collect();
    let all = all.join(",");
    output.write(format!(r#""scenes":[{{"nodes":[{all}]}}],"nodes":["#).as_bytes())?;
    for part in 0..count {
        let name = layout.parts.get(part, layout.extent())?.name;
        let (comma, name) = (if part > 0 { "," } else { "" }, name_member(&name));
        output.write(format!(r#"{comma}{{{name}{scale}"mesh":{part}}}"#).as_bytes())?;
    }
    output.write(b"]")
}

/// A member of a node, where numbers are in another unit than metres.
fn scale_member(metres: f64) -> String {
    if metres == 1.0 { String::new() } else { format!(r#""scale":[{metres},{metres},{metres}],"#) }
}

fn write_scene(output: &mut Output, layout: &mut Layout, scene: &SceneTree) -> Result<(), IoError> {
    let mut links = scene.links()?;
    let mut places = layout.parts.places()?;
    // Where numbers are in another unit, one more node holds all that have no parent.
    let has_unit = layout.metres != 1.0;
    output.write(br#""scenes":[{"nodes":["#)?;
    match has_unit {
        true => output.write(scene.len().to_string().as_bytes())?,
        false => write_roots(output, &mut links)?,
    }
    output.write(br#"]}],"nodes":["#)?;
    scene.for_each(|number, node| {
        let mut text = if number > 0 { ",{" } else { "{" }.to_owned();
        text.push_str(&name_member(&node.name));
        if let Some(part) = node.part.map(u64::from).filter(|&part| part < places.len()) {
            let mesh = places.get(part)?;
            if mesh != NONE {
                text.push_str(&format!(r#""mesh":{mesh},"#));
            }
        }
        if node.map != IDENTITY {
            text.push_str(&format!(r#""matrix":{},"#, columns(&node.map)));
        }
        let mut opening = r#""children":["#;
        links.for_each(Some(number), |child| {
            text.push_str(&format!("{opening}{child}"));
            opening = ",";
            Ok::<_, IoError>(())
        })?;
        if opening == "," {
            text.push(']');
        } else if text.ends_with(',') {
            text.pop();
        }
        text.push('}');
        output.write(text.as_bytes())
    })?;
    if has_unit {
        output.write(format!(r#",{{{}"children":["#, scale_member(layout.metres)).as_bytes())?;
        write_roots(output, &mut links)?;
        output.write(b"]}")?;
    }
    output.write(b"]")
}

/// Writes the numbers of nodes without a parent.
fn write_roots(output: &mut Output, links: &mut Links) -> Result<(), IoError> {
    let mut comma = "";
    links.for_each(None, |root| {
        output.write(format!("{comma}{root}").as_bytes())?;
        comma = ",";
        Ok(())
    })
}

/// The sixteen numbers of a map, column by column.
fn columns(map: &Affine) -> String {
    let columns: [[f64; 4]; 4] = [0, 1, 2, 3].map(|column| {
        let [x, y, z] = [0, 1, 2].map(|row| map[row][column]);
        [x, y, z, if column == 3 { 1.0 } else { 0.0 }]
    });
    serde_json::to_string(columns.as_flattened()).expect("numbers serialise")
}
