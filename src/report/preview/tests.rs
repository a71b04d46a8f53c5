//! Previews of small meshes, read back from their files.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::cell::Cell;
use std::fs::{self, File};
use std::io::{self, BufReader};
use std::path::Path;

use exr::prelude::{ReadChannels, ReadLayers};

use crate::mesh::{Discarded, Material, MeshSource, TriangleBatch};
use crate::monitor::{Monitor, Void};
use crate::report::preview::legend::WIDTH_PX;
use crate::report::preview::panels::SEPARATOR_PX;
use crate::report::preview::texels::NO_PART;
use crate::report::preview::{
    Measuring, OpenSource, PatchRule, PreviewError, PreviewOptions, PreviewStats, Scene, Side,
    Views, write_preview,
};
use crate::store::Scratch;

type Triangles = Vec<[[f64; 3]; 3]>;

/// Delivers its triangles in batches of five, numbered as parts.
struct Listed {
    left: std::vec::IntoIter<[[f64; 3]; 3]>,
    parts: u32,
}

impl MeshSource for Listed {
    type Error = io::Error;

    fn next_batch(&mut self, batch: &mut TriangleBatch) -> Result<bool, io::Error> {
        batch.clear();
        for corners in self.left.by_ref().take(5) {
            // What closes the top of the cube is another material.
            let is_lid = corners.iter().all(|corner| corner[1] == 1.0);
            batch.push(corners, self.parts, u32::from(is_lid), self.parts);
            self.parts += 1;
        }
        Ok(!batch.is_empty())
    }
    fn part_count(&self) -> u64 {
        self.parts.into()
    }
    fn material(&mut self, number: u32) -> Result<Material, io::Error> {
        let name = if number == 1 { "wood.patch" } else { "wood" };
        Ok(Material { name: name.to_owned(), ..Material::default() })
    }
    fn discarded(&self) -> Discarded {
        Discarded::default()
    }
    fn bytes_read(&self) -> u64 {
        0
    }
    fn vertex_count(&self) -> Option<u64> {
        None
    }
}

fn open(triangles: &Triangles) -> Result<Box<dyn MeshSource<Error = io::Error> + '_>, io::Error> {
    Ok(Box::new(Listed { left: triangles.clone().into_iter(), parts: 0 }))
}

/// The unit cube with normals outwards.
fn cube() -> Triangles {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for high in [false, true] {
            let place = |u: f64, v: f64| {
                let mut corner = [0.0; 3];
                corner[axis] = f64::from(u8::from(high));
                corner[(axis + 1) % 3] = u;
                corner[(axis + 2) % 3] = v;
                corner
            };
            let mut rim = [place(0.0, 0.0), place(1.0, 0.0), place(1.0, 1.0), place(0.0, 1.0)];
            if !high {
                rim.reverse();
            }
            triangles.push([rim[0], rim[1], rim[2]]);
            triangles.push([rim[0], rim[2], rim[3]]);
        }
    }
    triangles
}

fn small() -> PreviewOptions {
    PreviewOptions { width_px: 120, height_px: 100, ..PreviewOptions::default() }
}

fn write(
    path: &Path,
    input: &Triangles,
    output: Option<&Triangles>,
    options: &PreviewOptions,
) -> Result<PreviewStats, PreviewError<io::Error>> {
    let open_output = output.map(|output| move || open(output));
    let open_output: Option<&OpenSource<'_, io::Error>> =
        open_output.as_ref().map(|open| open as &OpenSource<'_, io::Error>);
    let scene =
        Scene { input: &|| open(input), output: open_output, measuring: None, monitor: &Void };
    write_preview(path, &scene, options)
}

/// The same with a map, by so many threads.
fn write_map(
    path: &Path,
    (input, output): (&Triangles, &Triangles),
    options: &PreviewOptions,
    threads: usize,
) -> Result<PreviewStats, PreviewError<io::Error>> {
    let scratch = Scratch::new(path.parent().unwrap());
    let measuring = Some(Measuring { scratch: &scratch, threads });
    let (input, output): (&OpenSource<'_, io::Error>, &OpenSource<'_, io::Error>) =
        (&|| open(input), &|| open(output));
    let scene = Scene { input, output: Some(output), measuring, monitor: &Void };
    write_preview(path, &scene, options)
}

/// The cube without its top (y = 1).
fn open_cube() -> Triangles {
    let mut open = cube();
    open.retain(|corners| corners.iter().any(|corner| corner[1] < 0.5));
    open
}

struct Picture {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
}

impl Picture {
    fn read(path: &Path) -> Self {
        let file = BufReader::new(File::open(path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut bytes).unwrap();
        assert_eq!(frame.color_type, png::ColorType::Rgb);
        Self { width: frame.width as usize, height: frame.height as usize, bytes }
    }

    fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        let at = 3 * (y * self.width + x);
        [self.bytes[at], self.bytes[at + 1], self.bytes[at + 2]]
    }

    /// The share of pixels, in columns `first..end`, that show no background.
    fn coverage(&self, first: usize, end: usize) -> f64 {
        let background = self.pixel(0, 0);
        let places = (0..self.height).flat_map(|y| (first..end).map(move |x| (x, y)));
        let shown = places.filter(|&(x, y)| self.pixel(x, y) != background).count();
        shown as f64 / (self.height * (end - first)) as f64
    }
}

#[test]
fn the_front_view_of_a_cube_is_a_square_without_a_back_face() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.png");
    let options = PreviewOptions { views: Views::Four, ..small() };
    let stats = write(&path, &cube(), Some(&cube()), &options).unwrap();
    let picture = Picture::read(&path);
    assert_eq!(picture.width, 2 * 2 * 120 + SEPARATOR_PX as usize);
    assert_eq!(picture.height, 2 * 100);
    assert_eq!((stats.width_px as usize, stats.height_px as usize), (picture.width, 200));
    assert_eq!(stats.bytes, fs::metadata(&path).unwrap().len());
    assert_eq!(stats.input.triangles, 12);
    assert_eq!((stats.input.back_samples, stats.output.back_samples), (0, 0));
    // Three squares of 92 pixels, and the hexagon of a cube: its height is the diagonal of the
    // projected cube, 2 sqrt(2/3) edges; its area is sqrt(3) square edges.
    let edge = 2.0 * 92.0 / (2.0 * (2.0_f64 / 3.0).sqrt());
    let expected = 4.0 * (3.0 * 92.0 * 92.0 + 3.0_f64.sqrt() * edge * edge / 4.0);
    let samples = stats.output.front_samples as f64;
    assert!((samples / expected - 1.0).abs() < 0.01, "{samples} of {expected}");
    assert!(picture.coverage(0, 240) > 0.5);
}

#[test]
fn the_three_visible_faces_of_a_cube_differ_in_brightness() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.png");
    write(&path, &cube(), Some(&cube()), &small()).unwrap();
    let picture = Picture::read(&path);
    let left = 120 + SEPARATOR_PX as usize;
    let [top, front, right] =
        [(60, 25), (40, 65), (80, 65)].map(|(x, y)| picture.pixel(left + x, y)[0]);
    assert!(top > right + 20 && right > front + 5 || top > front + 20 && front > right + 5);
}

#[test]
fn the_file_is_the_same_for_any_share() {
    let folder = tempfile::tempdir().unwrap();
    let mut input = cube();
    input.truncate(9);
    let pictures = [64 << 10, 64 << 20].map(|share_bytes| {
        let path = folder.path().join(format!("{share_bytes}.png"));
        let options = PreviewOptions { share_bytes, edges: true, views: Views::Four, ..small() };
        let stats = write(&path, &input, Some(&cube()), &options).unwrap();
        let bands = stats.bands;
        (PreviewStats { bands: 0, ..stats }, bands, fs::read(path).unwrap())
    });
    assert_eq!(pictures[0].0, pictures[1].0);
    assert!(pictures[0].1 > 10 && pictures[1].1 == 2, "{} bands", pictures[0].1);
    assert!(pictures[0].2 == pictures[1].2);
}

#[test]
fn triangles_that_are_not_finite_are_left_out_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let [clean, broken] = ["clean.png", "broken.png"].map(|name| folder.path().join(name));
    let mut input = cube();
    write(&clean, &input, Some(&cube()), &small()).unwrap();
    input.insert(3, [[f64::NAN, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    input.push([[0.0, 0.0, 0.0], [1.0, f64::INFINITY, 0.0], [0.0, 1.0, 0.0]]);
    let stats = write(&broken, &input, Some(&cube()), &small()).unwrap();
    assert_eq!((stats.input.triangles, stats.input.skipped_triangles), (14, 2));
    assert_eq!(fs::read(clean).unwrap(), fs::read(broken).unwrap());
}

#[test]
fn an_outlier_of_the_input_does_not_move_the_camera() {
    let folder = tempfile::tempdir().unwrap();
    let [clean, broken] = ["clean.png", "broken.png"].map(|name| folder.path().join(name));
    let mut input = cube();
    write(&clean, &input, Some(&cube()), &small()).unwrap();
    // One far behind, one far in front, one that cannot even be projected.
    input.push([[-1e9, -1e9, -1e9], [-1e9, 1e9, -1e9], [1e9, -1e9, -1e9]]);
    input.push([[50.0, 50.0, 50.0], [50.0, 60.0, 50.0], [60.0, 50.0, 50.0]]);
    input.push([[1e308, 1e308, 1e308], [-1e308, 1e308, 1e308], [0.0, 0.0, -1e308]]);
    let stats = write(&broken, &input, Some(&cube()), &small()).unwrap();
    let (clean, broken) = (Picture::read(&clean), Picture::read(&broken));
    assert_eq!(stats.input.triangles, 15);
    let left = 120 + SEPARATOR_PX as usize;
    for y in 0..100 {
        for x in left..left + 120 {
            assert_eq!(clean.pixel(x, y), broken.pixel(x, y));
        }
    }
}

#[test]
fn holes_and_turned_faces_show_their_backs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("open.png");
    let inside_out: Triangles = cube().into_iter().map(|[a, b, c]| [a, c, b]).collect();
    let stats = write(&path, &cube(), Some(&inside_out), &small()).unwrap();
    assert_eq!((stats.output.front_samples, stats.input.back_samples), (0, 0));
    assert_eq!(stats.output.back_samples, stats.input.front_samples);
    let [red, green, blue] = Picture::read(&path).pixel(120 + SEPARATOR_PX as usize + 80, 65);
    assert!(red > 150 && green < 60 && blue < 60);
}

#[test]
fn without_an_output_only_the_input_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    for (name, output) in [("empty.png", Some(Vec::new())), ("none.png", None)] {
        let path = folder.path().join(name);
        let stats = write(&path, &cube(), output.as_ref(), &small()).unwrap();
        let picture = Picture::read(&path);
        assert!(picture.coverage(0, 120) > 0.3);
        assert_eq!(picture.coverage(120 + SEPARATOR_PX as usize, picture.width), 0.0);
        assert_eq!((stats.output.triangles, stats.output.front_samples), (0, 0));
    }
}

#[test]
fn two_empty_meshes_give_an_empty_picture() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["empty.png", "empty.exr"] {
        let path = folder.path().join(name);
        let stats = write(&path, &Vec::new(), None, &small()).unwrap();
        assert_eq!((stats.input.triangles, stats.input.front_samples), (0, 0));
        assert!(stats.bytes > 0);
    }
}

#[test]
fn edges_darken_pixels_along_the_edges_only() {
    let folder = tempfile::tempdir().unwrap();
    let [plain, lined] = [false, true].map(|edges| {
        let path = folder.path().join(format!("{edges}.png"));
        write(&path, &cube(), None, &PreviewOptions { edges, ..small() }).unwrap();
        Picture::read(&path)
    });
    let places = (0..100).flat_map(|y| (0..120).map(move |x| (x, y)));
    let changed: Vec<_> = places.filter(|&(x, y)| plain.pixel(x, y) != lined.pixel(x, y)).collect();
    assert!(changed.len() > 300 && changed.len() < 1500, "{}", changed.len());
    assert!(changed.iter().all(|&(x, y)| lined.pixel(x, y)[0] <= plain.pixel(x, y)[0]));
}

#[test]
fn the_map_is_hot_where_a_lid_was_put_on_and_grey_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lid.png");
    let stats = write_map(&path, (&open_cube(), &cube()), &small(), 2).unwrap();
    let picture = Picture::read(&path);
    let map = 2 * (120 + SEPARATOR_PX as usize);
    assert_eq!(picture.width, map + 120 + WIDTH_PX as usize);
    // The middle of the lid is half an edge from the walls.
    let largest = stats.largest_deviation.unwrap();
    assert!((0.48..=0.5).contains(&largest), "{largest}");
    let spread = |[red, green, blue]: [u8; 3]| red.max(green).max(blue) - red.min(green).min(blue);
    for (x, y) in [(40, 65), (80, 65), (35, 60), (85, 70)] {
        assert!(spread(picture.pixel(map + x, y)) < 16, "a wall has not moved");
    }
    let [red, green, blue] = picture.pixel(map + 60, 25);
    assert!(red > green + 60 && red > blue, "{red} {green} {blue}");
}

#[test]
fn where_nothing_can_be_measured_there_is_no_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none.png");
    let stats = write_map(&path, (&vec![[[1.0; 3]; 3]], &cube()), &small(), 1).unwrap();
    assert_eq!((stats.largest_deviation, stats.width_px), (None, 2 * 120 + SEPARATOR_PX));
    let stats = write_map(&path, (&cube(), &Vec::new()), &small(), 1).unwrap();
    assert_eq!(stats.largest_deviation, Some(0.0), "an empty output shows nothing");
}

#[test]
fn a_map_is_the_same_for_any_share_and_any_threads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.png");
    let pictures = [(200 << 10, 1), (200 << 10, 3), (64 << 20, 2)].map(|(share_bytes, threads)| {
        let options = PreviewOptions { share_bytes, views: Views::Four, ..small() };
        write_map(&path, (&open_cube(), &cube()), &options, threads).unwrap();
        fs::read(&path).unwrap()
    });
    assert!(pictures[0] == pictures[1] && pictures[1] == pictures[2]);
}

#[test]
fn creases_are_dark_and_faces_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let [plain, creased] = [false, true].map(|creases| {
        let path = folder.path().join(format!("{creases}.png"));
        write(&path, &cube(), None, &PreviewOptions { creases, ..small() }).unwrap();
        Picture::read(&path)
    });
    let places = (0..100).flat_map(|y| (0..120).map(move |x| (x, y)));
    let changed: Vec<_> =
        places.filter(|&(x, y)| plain.pixel(x, y) != creased.pixel(x, y)).collect();
    // Three edges of the cube meet in the middle of the picture, each 53 pixels long.
    assert!((140..500).contains(&changed.len()), "{}", changed.len());
    assert!(changed.iter().all(|&(x, y)| creased.pixel(x, y)[0] < plain.pixel(x, y)[0]));
    assert!(changed.contains(&(60, 80)), "the edge from the middle down");
}

/// The layers of an EXR file, by name.
struct Layers(
    Vec<(String, exr::prelude::Layer<exr::prelude::AnyChannels<exr::prelude::FlatSamples>>)>,
);

impl Layers {
    fn read(path: &Path) -> Self {
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_file(path)
            .unwrap();
        let name = |layer: &exr::prelude::Layer<_>| layer.attributes.layer_name.clone().unwrap();
        Self(image.layer_data.into_iter().map(|layer| (name(&layer).to_string(), layer)).collect())
    }

    fn names(&self) -> Vec<&str> {
        self.0.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// A value of a pixel in a view of 120 columns.
    fn value(&self, layer: &str, channel: &str, (x, y): (usize, usize)) -> f64 {
        let (_, layer) = self.0.iter().find(|(name, _)| name == layer).unwrap();
        assert_eq!((layer.size.0, layer.size.1), (120, 100));
        let mut channels = layer.channel_data.list.iter();
        let channel = channels.find(|found| found.name.to_string() == channel).unwrap();
        f64::from(channel.sample_data.value_by_flat_index(y * 120 + x).to_f32())
    }
}

#[test]
fn all_views_of_both_sides_come_back_from_the_exr() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.EXR");
    let options = PreviewOptions { views: Views::Four, ..small() };
    write(&path, &cube()[..8].to_vec(), Some(&cube()), &options).unwrap();
    let layers = Layers::read(&path);
    let views = ["front", "back", "top", "front-right-top"];
    let names = ["input", "output"].map(|side| views.map(|view| format!("{side}.{view}")));
    assert_eq!(layers.names(), names.as_flattened());
    let value = |channel: &str, x, y| layers.value("output.front", channel, (x, y));
    // The middle of the front view: the face z = 1, whose triangles are 10, 11.
    let normal = ["normal.X", "normal.Y", "normal.Z"].map(|name| value(name, 60, 45));
    assert_eq!(normal, [0.0, 0.0, 1.0]);
    assert!([10.0, 11.0].contains(&value("part", 60, 45)));
    // The depth range begins a tenth of a half edge before the cube.
    assert!((value("Z", 60, 45) - 0.05).abs() < 1e-5, "{}", value("Z", 60, 45));
    assert!(value("R", 60, 45) > 0.1 && value("G", 60, 45) > 0.1 && value("B", 60, 45) > 0.1);
    assert!(value("deviation", 60, 45).is_nan(), "nothing was measured");
    assert_eq!(value("patch", 60, 45), f64::from(NO_PART as f32), "nor is it known");
    for name in ["Z", "deviation"] {
        assert_eq!(value(name, 1, 1), f64::INFINITY);
    }
    for name in ["part", "material", "patch"] {
        assert_eq!(value(name, 1, 1), f64::from(NO_PART as f32));
    }
}

#[test]
fn the_face_that_closes_a_box_is_a_patch_and_deviates_and_the_others_do_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lid.exr");
    for patches in [PatchRule::Tagged, PatchRule::Beyond(0.05)] {
        let options = PreviewOptions { views: Views::Fourteen, patches, ..small() };
        write_map(&path, (&open_cube(), &cube()), &options, 2).unwrap();
        let layers = Layers::read(&path);
        assert_eq!(layers.names().len(), 2 * 14);
        let middle = (60, 50);
        for view in ["front", "back", "left", "right", "bottom"] {
            let layer = format!("output.{view}");
            let deviation = layers.value(&layer, "deviation", middle);
            assert!(deviation < 1e-6, "{view} lies {deviation} away");
            let [patch, material] = ["patch", "material"].map(|c| layers.value(&layer, c, middle));
            assert_eq!((patch, material), (0.0, 0.0), "{view}");
        }
        let [deviation, patch, material] = ["deviation", "patch", "material"]
            .map(|channel| layers.value("output.top", channel, middle));
        assert!((deviation - 0.5).abs() < 0.01, "{deviation}");
        assert_eq!((patch, material), (1.0, 1.0));
        // Through the opening the bottom of the input is seen, where the output has one as well.
        let [deviation, patch, depth] =
            ["deviation", "patch", "Z"].map(|channel| layers.value("input.top", channel, middle));
        assert!(deviation < 1e-6 && (depth - 1.05).abs() < 1e-4, "{deviation} {depth}");
        assert_eq!(patch, 0.0);
    }
}

#[test]
fn layers_are_the_same_for_any_share_and_any_threads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("layers.exr");
    let files = [(40 << 10, 1), (40 << 10, 3), (64 << 20, 2)].map(|(share_bytes, threads)| {
        let options = PreviewOptions { share_bytes, views: Views::Six, ..small() };
        let stats = write_map(&path, (&open_cube(), &cube()), &options, threads).unwrap();
        assert_eq!(stats.bands > 50, share_bytes < 1 << 20, "{} bands", stats.bands);
        fs::read(&path).unwrap()
    });
    assert!(files[0] == files[1] && files[1] == files[2]);
}

#[test]
fn what_cannot_be_drawn_is_refused_with_the_number_that_is_needed() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mesh = cube();
    let tight = PreviewOptions { share_bytes: 4000, ..small() };
    for (name, at_least) in [("a.png", 120 * 4 * 8), ("a.exr", 4 * 120 * 44)] {
        let needed = match write(&path(name), &mesh, None, &tight) {
            Err(PreviewError::ShareTooSmall { needed_bytes, share_bytes: 4000, .. }) => {
                needed_bytes
            }
            other => panic!("{other:?}"),
        };
        assert!(needed >= at_least);
        let enough = PreviewOptions { share_bytes: needed, ..tight };
        write(&path(name), &mesh, None, &enough).unwrap();
    }
    let flat = PreviewOptions { height_px: 0, ..small() };
    let refusal = write(&path("b.png"), &mesh, None, &flat);
    assert!(matches!(refusal, Err(PreviewError::SizeUnsupported { height_px: 0, .. })));
    let refusal = write(&path("b.jpg"), &mesh, None, &small());
    assert!(matches!(refusal, Err(PreviewError::UnknownFormat { .. })));
    assert!(!path("b.png").exists() && !path("b.jpg").exists());
}

#[test]
fn a_failing_source_leaves_the_old_picture_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.png");
    fs::write(&path, "old").unwrap();
    let mesh = cube();
    let opened = Cell::new(0);
    // The second look at the mesh fails, when the file has been begun.
    let fading: &OpenSource<'_, io::Error> = &|| {
        opened.set(opened.get() + 1);
        if opened.get() > 1 { Err(io::ErrorKind::NotFound.into()) } else { open(&mesh) }
    };
    let scene = Scene { input: fading, output: None, measuring: None, monitor: &Void };
    let refusal = write_preview(&path, &scene, &small());
    assert!(matches!(refusal, Err(PreviewError::Source { side: Side::Input, .. })));
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_request_to_stop_is_heard() {
    struct Stopping;
    impl Monitor for Stopping {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("never.png");
    let mesh = cube();
    let input: &OpenSource<'_, io::Error> = &|| open(&mesh);
    let scene = Scene { input, output: None, measuring: None, monitor: &Stopping };
    let stopped = write_preview(&path, &scene, &small());
    assert!(matches!(stopped, Err(PreviewError::Cancelled)));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
