//! The page of a model: what was found, decided and done, to be compared and turned.
//!
//! In:         input and output as files that are in place, and the outcome of the repair.
//! Out:        one HTML file that holds all it shows; in a batch two small pictures beside it.
//! Invariant:  readable without script: then both pictures stand side by side, and nothing turns.
//! Memory:     the share: pictures, light meshes and bands; the readers have as much again, and measuring
//!             deviations has a share of its own.
//! Fails:      [`ReportError`]; then no page is put in place.

mod carried;
mod facts;
mod gallery;
mod part_table;
mod plot;

pub use gallery::Gallery;
pub use part_table::PartsPage;

use std::cell::{Cell, RefCell};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::io::{IoError, ReadOptions};
use crate::mesh::{LengthUnit, MeshSource};
use crate::monitor::Monitor;
use crate::repair::Outcome;
use crate::report::ReportError;
use crate::report::error::Halt;
use crate::report::html::{Frame, write_page};
use crate::report::image_staged::StagedFile;
use crate::report::light_mesh::{Cube, Known, LightMesh, Lightening, Overheard};
use crate::report::pictures::{Picture, colour_map, draw_pair};
use crate::report::preview::map::Map;
use crate::report::preview::measuring::Ruler;
use crate::report::preview::scale::Scale;
use crate::report::preview::{Measuring, OpenSource, PreviewError, PreviewOptions, Scene, Side};
use crate::store::Scratch;

const COMPARE: &str = include_str!("../html/assets/compare.js");
const VIEWER: &str = include_str!("../html/assets/viewer.js");

/// Pictures are no smaller than this, however small the share is.
const LEAST_PX: u32 = 128;
/// What a triangle of a light mesh takes while that comes to be.
const TRIANGLE_BYTES: u64 = 150;

/// What a page tells of.
#[derive(Clone, Copy, Debug)]
pub struct ModelPage<'p> {
    /// In the heading.
    pub name: &'p str,
    /// The model.
    pub input: &'p Path,
    /// Its result.
    pub output: &'p Path,
    /// What came of it; `None` where it was copied since nothing is wrong with it, or its parts were
    /// kept apart.
    pub outcome: Option<&'p Outcome>,
    /// What came of its parts, where each was repaired for itself.
    pub parts: Option<PartsPage<'p>>,
    /// Address of the page of the catalogue, if it is part of one.
    pub back: Option<&'p str>,
}

/// How large what a page shows may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageOptions {
    /// Width and height of the pictures.
    pub picture_px: u32,
    /// Triangles of each of the two meshes that turn, at most.
    pub mesh_triangles: usize,
    /// Memory for pictures and meshes; readers take as much again.
    pub share_bytes: u64,
    /// How deviations are measured; there is no map if `None`.
    pub map: Option<MapOptions>,
}

/// What measuring deviations for a page may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapOptions {
    /// Threads that measure; they change no number.
    pub threads: usize,
    /// Memory.
    pub share_bytes: u64,
}

impl PageOptions {
    /// For one page; smaller where the share is.
    #[must_use]
    pub fn large(share_bytes: u64) -> Self {
        Self::within(share_bytes, 1024, 20_000)
    }

    /// For thousands of pages; smaller where the share is.
    #[must_use]
    pub fn small(share_bytes: u64) -> Self {
        Self::within(share_bytes, 512, 12_000)
    }

    /// Half of the share is for the pictures at most, half for the meshes.
    fn within(share_bytes: u64, picture_px: u32, mesh_triangles: u64) -> Self {
        // Both pictures, and that of a map.
        let pair_bytes = |px: u32| 9 * u64::from(px) * u64::from(px);
        let mut picture_px = picture_px;
        while picture_px > LEAST_PX && 2 * pair_bytes(picture_px) > share_bytes {
            picture_px /= 2;
        }
        let most = share_bytes / (4 * TRIANGLE_BYTES);
        let mesh_triangles = mesh_triangles.min(most) as usize;
        Self { picture_px, mesh_triangles, share_bytes, map: None }
    }
}

/// What a page shows.
struct Shown {
    pictures: [Picture; 2],
    has_meshes: bool,
    meshes: [LightMesh; 2],
    map: Option<ShownMap>,
}

/// A map of deviations.
struct ShownMap {
    picture: Picture,
    scale: Scale,
    unit: Option<LengthUnit>,
    /// How far up the scale the vertices of the light mesh are, of 255.
    vertices: Vec<u8>,
}

/// Writes the page of a model to `path`. Readers spill into the folder of `scratch`.
///
/// # Errors
/// A file cannot be read, the page cannot be written, the share is too small, or the monitor asks to
/// stop.
pub fn write_model_page(
    path: &Path,
    model: &ModelPage,
    options: &PageOptions,
    scratch: &Scratch,
    monitor: &dyn Monitor,
) -> Result<(), ReportError> {
    let shown = look(model, options, scratch, monitor)?;
    write_shown(path, model, &shown)
}

/// Draws both sides. The light meshes come to be when each side is read for the first time.
fn look(
    model: &ModelPage,
    options: &PageOptions,
    scratch: &Scratch,
    monitor: &dyn Monitor,
) -> Result<Shown, ReportError> {
    let share_bytes = options.share_bytes;
    let open = |path: &Path| {
        let source = crate::io::open(path, scratch, &ReadOptions::in_scene(share_bytes))?;
        Ok(source as Box<dyn MeshSource<Error = IoError>>)
    };
    let cube = match model.outcome.and_then(|outcome| outcome.output.proof.bounds) {
        _ if options.mesh_triangles == 0 => None,
        Some([lo, hi]) => Cube::of(lo.into(), hi.into()),
        None => Cube::around(Side::Output, &|| open(model.output), monitor)?,
    };
    let lightenings = known(model).map(|known| {
        cube.map(|cube| RefCell::new(Lightening::new(cube, options.mesh_triangles, known)))
    });
    let heard = [Cell::new(false), Cell::new(false)];
    let overhear = |side: usize, path: &Path| {
        let source = open(path)?;
        Ok(match &lightenings[side] {
            Some(lightening) if !heard[side].replace(true) => {
                Box::new(Overheard { source, lightening }) as Box<dyn MeshSource<Error = IoError>>
            }
            _ => source,
        })
    };
    let (width_px, height_px) = (options.picture_px, options.picture_px);
    let creases = options.mesh_triangles > 0;
    let preview =
        PreviewOptions { width_px, height_px, share_bytes, creases, ..PreviewOptions::default() };
    let measuring = options.map.map(|MapOptions { threads, .. }| Measuring { scratch, threads });
    let (pictures, ruler, map) = {
        let input: &OpenSource<IoError> = &|| overhear(0, model.input);
        let output: &OpenSource<IoError> = &|| overhear(1, model.output);
        let scene = Scene { input, output: Some(output), measuring, monitor };
        let map_bytes = options.map.map_or(0, |map| map.share_bytes);
        let ruler = Ruler::read(&scene, (measuring, monitor), &Side::ALL, map_bytes)?;
        let (pictures, map) = draw_pair(&scene, &preview, ruler.as_ref())?;
        (pictures, ruler, map)
    };
    let meshes = lightenings.map(|lightening| {
        lightening.map_or_else(LightMesh::default, |lightening| lightening.into_inner().finish())
    });
    let map = match ruler.zip(map) {
        Some((ruler, map)) => Some(colour(&ruler, &map, (cube, &meshes[1]), width_px)?),
        None => None,
    };
    Ok(Shown { pictures, has_meshes: cube.is_some(), meshes, map })
}

/// Puts a picture and the vertices of the light mesh on one scale.
fn colour(
    ruler: &Ruler,
    map: &Map,
    (cube, mesh): (Option<Cube>, &LightMesh),
    width_px: u32,
) -> Result<ShownMap, PreviewError<IoError>> {
    let places = mesh.vertices.iter().filter_map(|&steps| Some(cube?.place(steps)));
    let distances = ruler.distances_at_output(&places.collect::<Vec<_>>())?;
    let largest = distances.iter().copied().fold(map.largest(), f64::max);
    let scale = Scale::reaching(largest, ruler.diagonal());
    let shares = distances.iter().map(|&distance| (255.0 * scale.share(distance)).round() as u8);
    let picture = colour_map(map, &scale, width_px)?;
    Ok(ShownMap { picture, scale, unit: ruler.unit(), vertices: shares.collect() })
}

/// What the outcome says of both sides.
fn known(model: &ModelPage) -> [Option<Known>; 2] {
    let Some(outcome) = model.outcome else { return [None, None] };
    let (input, proof) = (&outcome.input, &outcome.output.proof);
    let before = Known { triangles: input.stats.triangles, area: input.measure.area };
    let after = Known { triangles: proof.triangles, area: proof.area };
    [Some(before), Some(after)]
}

fn write_shown(path: &Path, model: &ModelPage, shown: &Shown) -> Result<(), ReportError> {
    let staged = StagedFile::create::<IoError>(path)?;
    let mut out = BufWriter::new(staged.file());
    let frame = Frame { title: model.name, back: model.back, scripts: &[COMPARE, VIEWER] };
    let written = write_page(&mut out, &frame, |html| {
        facts::write_verdict(html, model)?;
        html.element("div", &[("class", "looks")], |html| {
            carried::write_pictures(html, &shown.pictures)?;
            if let Some(map) = &shown.map {
                carried::write_map(html, map)?;
            }
            let map = shown.map.as_ref();
            if shown.has_meshes { carried::write_viewer(html, &shown.meshes, map) } else { Ok(()) }
        })?;
        if shown.has_meshes {
            carried::write_meshes(html, &shown.meshes, shown.map.as_ref())?;
        }
        if let Some(parts) = &model.parts {
            part_table::write_parts(html, parts)?;
        }
        let Some(outcome) = model.outcome else { return Ok(()) };
        facts::write_facts(html, outcome)?;
        plot::write_stages(html, outcome)?;
        facts::write_settings(html, outcome)
    });
    let flushed = written.and_then(|()| out.flush());
    flushed.map_err(|error: io::Error| Halt::from(error).at(path))?;
    drop(out);
    staged.put_in_place::<IoError>()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_share_gives_a_small_page() {
        let plenty = PageOptions::small(1 << 30);
        assert_eq!((plenty.picture_px, plenty.mesh_triangles), (512, 12_000));
        let little = PageOptions::small(2 << 20);
        assert_eq!((little.picture_px, little.mesh_triangles), (256, 3_495));
        assert_eq!(PageOptions::large(0).picture_px, LEAST_PX);
    }
}
