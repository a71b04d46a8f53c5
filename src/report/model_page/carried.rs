//! Pictures and meshes that stand in the page itself, as base64.

use std::io::{self, Write};

use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;

use crate::report::html::{Markup, count};
use crate::report::light_mesh::LightMesh;
use crate::report::model_page::ShownMap;
use crate::report::pictures::Picture;
use crate::report::preview::legend::word;
use crate::report::preview::scale::stops;

/// Writes both pictures, which the script lays upon each other.
pub(crate) fn write_pictures(html: &mut Markup, pictures: &[Picture; 2]) -> io::Result<()> {
    html.element("section", &[], |html| {
        html.leaf("h2", &[], "Before and after")?;
        html.element("div", &[("class", "compare"), ("id", "compare")], |html| {
            for (picture, word) in pictures.iter().zip(["before", "after"]) {
                html.element("figure", &[], |html| {
                    write_picture(html, picture, word)?;
                    html.leaf("figcaption", &[], word)
                })?;
            }
            html.leaf("span", &[("class", "cut")], "")
        })?;
        let slider = [
            ("type", "range"),
            ("min", "0"),
            ("max", "100"),
            ("step", "0.5"),
            ("value", "50"),
            ("class", "slider script-only"),
            ("id", "slider"),
            ("aria-label", "How much of the model is shown before the repair"),
        ];
        html.void("input", &slider)?;
        let text = "One camera for both. What faces away from the viewer is red.";
        html.leaf("p", &[("class", "quiet")], text)
    })
}

fn write_picture(html: &mut Markup, picture: &Picture, word: &str) -> io::Result<()> {
    // The only element that is not written as a whole: its picture is streamed into it.
    let (width, height) = (picture.width_px, picture.height_px);
    html.raw(&format!(
        "<img alt=\"{word}\" width=\"{width}\" height=\"{height}\" src=\"data:image/png;base64,"
    ))?;
    write_base64(html, &picture.encode()?)?;
    html.raw("\">")
}

fn write_base64(html: &mut Markup, bytes: &[u8]) -> io::Result<()> {
    let mut encoder = EncoderWriter::new(html.plain(), &STANDARD);
    encoder.write_all(bytes)?;
    encoder.finish().map(|_| ())
}

/// Writes the map of deviations and its scale.
pub(crate) fn write_map(html: &mut Markup, map: &ShownMap) -> io::Result<()> {
    html.element("section", &[("id", "map")], |html| {
        html.leaf("h2", &[], "How far it lies from the input")?;
        html.element("figure", &[("class", "map")], |html| {
            write_picture(html, &map.picture, "deviation")?;
            html.element("figcaption", &[], |html| write_scale(html, map))
        })?;
        let text = "The result once more: from each point of it to the nearest of the input. Grey has \
                    stayed where it was; hot is what the input lacks.";
        html.leaf("p", &[("class", "quiet")], text)
    })
}

/// Writes the colours of the scale, and the numbers beneath them, from left to right.
fn write_scale(html: &mut Markup, map: &ShownMap) -> io::Result<()> {
    let stops = stops().iter().map(|[r, g, b]| format!(",rgb({r} {g} {b})")).collect::<String>();
    let style = format!("background:linear-gradient(to right{stops})");
    html.element("div", &[("class", "scale")], |html| {
        html.leaf("span", &[("class", "bar"), ("style", &style)], "")?;
        let mut marks: Vec<_> = map.scale.marks().map(|(_, text)| text).collect();
        marks.reverse();
        html.element("span", &[("class", "marks")], |html| {
            marks.iter().try_for_each(|mark| html.leaf("span", &[], mark))
        })?;
        html.leaf("span", &[], &format!("deviation in {}", word(map.unit)))
    })
}

/// Writes what turns the meshes.
pub(crate) fn write_viewer(
    html: &mut Markup,
    meshes: &[LightMesh; 2],
    map: Option<&ShownMap>,
) -> io::Result<()> {
    html.element("section", &[("class", "script-only")], |html| {
        html.leaf("h2", &[], "Turn it")?;
        html.element("div", &[("class", "viewer"), ("id", "viewer")], |html| {
            let words = "The model in 3D: drag or use the arrow keys to turn it";
            let canvas = [("tabindex", "0"), ("role", "img"), ("aria-label", words)];
            html.leaf("canvas", &canvas, "")?;
            html.element("div", &[("class", "controls")], |html| {
                html.leaf("button", &[("type", "button"), ("data-side", "before")], "Before")?;
                html.leaf("button", &[("type", "button"), ("data-side", "after")], "After")?;
                if map.is_some() {
                    let button = [("type", "button"), ("data-side", "deviation")];
                    html.leaf("button", &button, "Deviation")?;
                }
                html.leaf("button", &[("type", "button"), ("data-reset", "")], "Reset")?;
                html.leaf("output", &[], "")
            })?;
            map.map_or(Ok(()), |map| write_scale(html, map))
        })?;
        html.leaf("p", &[("class", "quiet")], &note(meshes))
    })
}

/// Writes the meshes as data for the script.
pub(crate) fn write_meshes(
    html: &mut Markup,
    meshes: &[LightMesh; 2],
    map: Option<&ShownMap>,
) -> io::Result<()> {
    html.element("script", &[("type", "application/json"), ("id", "meshes")], |html| {
        html.raw("{")?;
        for (mesh, name) in meshes.iter().zip(["before", "after"]) {
            let comma = if name == "before" { "" } else { "," };
            let is_whole = mesh.triangles.len() as u64 == mesh.of_triangles;
            html.raw(&format!("{comma}\"{name}\":{{\"whole\":{is_whole},\"vertices\":\""))?;
            write_numbers(html, &mesh.vertices)?;
            html.raw("\",\"triangles\":\"")?;
            write_numbers(html, &mesh.triangles)?;
            html.raw("\"}")?;
        }
        if let Some(map) = map {
            html.raw(",\"deviation\":\"")?;
            write_base64(html, &map.vertices)?;
            html.raw(&format!("\",\"ramp\":{:?}", stops()))?;
        }
        html.raw("}")
    })
}

fn note(meshes: &[LightMesh; 2]) -> String {
    let sizes = meshes.each_ref().map(|mesh| {
        let (shown, all) = (mesh.triangles.len() as u64, mesh.of_triangles);
        format!("{} of {} triangles", count(shown), count(all))
    });
    let [before, after] = sizes;
    format!(
        "Made lighter for this page: {before} before, {after} after. Drag to turn, scroll to zoom."
    )
}

/// Little-endian numbers of 16 bits.
fn write_numbers(html: &mut Markup, triples: &[[u16; 3]]) -> io::Result<()> {
    let mut encoder = EncoderWriter::new(html.plain(), &STANDARD);
    for number in triples.iter().flatten() {
        encoder.write_all(&number.to_le_bytes())?;
    }
    encoder.finish().map(|_| ())
}
