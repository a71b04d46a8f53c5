//! Colours, texture coordinates, normals and images: what writers make of them, and what our own
//! readers find again.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::io::tests::{Content, read_all};
use crate::io::{
    Format, IoError, Palette, PaletteWriter, ReadOptions, Sink, Source, WriteOptions, create,
    images_beside, lost_of_materials, open, reopen, write_library,
};
use crate::mesh::{
    Attributes, CornerForm, CornerValues, Maps, Material, SinkState, SinkTriangles, Surface,
    Texture, VertexValues,
};
use crate::store::{Scratch, SpoolWriter};

const PNG: &[u8] = b"\x89PNG\r\n\x1a\nnot really";
const JPEG: &[u8] = b"\xff\xd8\xff\xe0neither";
const NORMAL: [f32; 3] = [0.0, 0.6, 0.8];
const FORMATS: [(Format, &str); 4] =
    [(Format::Obj, "obj"), (Format::Glb, "glb"), (Format::ThreeMf, "3mf"), (Format::Ply, "ply")];

/// A model, and everything that its images are.
struct Model {
    content: Content,
    palette: Palette,
    images: Vec<Option<Vec<u8>>>,
}

fn image_of(source: &mut Source, number: u32) -> Vec<u8> {
    let (mut bytes, mut block) = (Vec::new(), Vec::new());
    loop {
        source.image_block(number, bytes.len() as u64, &mut block).expect("readable");
        if block.is_empty() {
            return bytes;
        }
        bytes.append(&mut block);
    }
}

fn load(path: &Path, scratch: &Scratch) -> Model {
    let mut source = open(path, scratch, &ReadOptions::in_scene(1 << 20)).expect("opens");
    let mut content = read_all(source.as_mut()).expect("readable");
    let mut writer = PaletteWriter::create(scratch).expect("spools");
    let mut images = Vec::new();
    for material in &mut content.materials {
        images.push(match &mut material.texture {
            None => None,
            Some(Texture::Beside(name)) => {
                std::fs::read(path.with_file_name(name.replace('\\', "/"))).ok()
            }
            Some(Texture::Inside(image)) => {
                let bytes = image_of(&mut source, image.number);
                if !writer.place(image).expect("asked") {
                    writer.push_image(image.number, &bytes).expect("pushed");
                    writer.place(image).expect("asked");
                }
                Some(bytes)
            }
        });
        writer.push(material).expect("pushed");
    }
    let [materials, kept] = writer.finish().expect("finished");
    let palette = Palette::new(scratch, &materials).with_images(&kept, path);
    Model { content, palette, images }
}

fn options(model: &Model, attributes: Attributes, output: &Path) -> WriteOptions {
    let library = crate::io::library_name(output);
    let (palette, output) = (Some(model.palette.clone()), output.to_path_buf());
    WriteOptions { palette, attributes, output, library, ..WriteOptions::default() }
}

/// Hands over a range of the triangles, each with vertices of its own.
fn push(sink: &mut Sink, content: &Content, range: std::ops::Range<usize>) {
    let batch = &content.batch;
    let has_uvs = !batch.uvs.is_empty();
    let uvs = if has_uvs { &batch.uvs[range.clone()] } else { &[] };
    let colours = batch.colours.get(range.clone()).unwrap_or_default().as_flattened();
    sink.vertices(batch.corners[range.clone()].as_flattened()).expect("written");
    let normals = vec![NORMAL; 3 * range.len()];
    let is_of_vertices = sink.corner_form() == CornerForm::OfVertices;
    sink.vertex_values(&VertexValues {
        colours,
        uvs: if is_of_vertices { uvs.as_flattened() } else { &[] },
        normals: if is_of_vertices { &normals } else { &[] },
    })
    .expect("written");
    let number = |at: usize| [0, 1, 2].map(|corner| (3 * at + corner) as u32);
    let indices: Vec<_> = range.clone().map(number).collect();
    let surfaces: Vec<_> =
        range.clone().map(|at| Surface::new(batch.materials[at], false)).collect();
    let mut triangles =
        SinkTriangles { indices: &indices, surfaces: &surfaces, ..SinkTriangles::default() };
    let all_normals = vec![[NORMAL; 3]; range.len()];
    if !is_of_vertices {
        sink.list_normals(&normals).expect("written");
        triangles.normals = CornerValues { numbers: &indices, values: &all_normals };
        if has_uvs {
            sink.list_uvs(uvs.as_flattened()).expect("written");
            triangles.uvs = CornerValues { numbers: &indices, values: uvs };
        }
    }
    sink.triangles(&triangles).expect("written");
}

/// Writes a model; with `stop`, in two runs of which the first gets lost a little later.
fn write(
    model: &Model,
    (format, path): (Format, &Path),
    stop: Option<usize>,
    scratch: &Scratch,
) -> WriteOptions {
    let batch = &model.content.batch;
    let (uvs, colours) = (!batch.uvs.is_empty(), !batch.colours.is_empty());
    let options = options(model, Attributes { uvs, colours, normals: true }, path);
    let mut sink = create(path, format, scratch, &options).expect("creates");
    let mut start = 0;
    if let Some(stop) = stop {
        push(&mut sink, &model.content, 0..stop);
        let state = serde_json::to_string(&sink.checkpoint().expect("tells")).expect("text");
        push(&mut sink, &model.content, stop..batch.len());
        sink.checkpoint().expect("tells");
        drop(sink);
        let state: SinkState = serde_json::from_str(&state).expect("a state");
        sink = reopen(path, format, scratch, &options, &state).expect("goes on");
        start = stop;
    }
    push(&mut sink, &model.content, start..batch.len());
    sink.finish().expect("finishes");
    images_beside(
        format,
        &options,
        scratch,
        |error| error,
        |image| image.write(&image.path, scratch),
    )
    .expect("written");
    if format == Format::Obj {
        let library = path.with_file_name(&options.library);
        write_library(&library, &model.palette, &options, scratch).expect("written");
    }
    options
}

/// By triangle: texture coordinates, colours, and the image.
type Shown = BTreeMap<Vec<u64>, (Option<[[f32; 2]; 3]>, Option<[[u8; 4]; 3]>, Option<Vec<u8>>)>;

fn shown(model: &Model) -> Shown {
    let batch = &model.content.batch;
    let entry = |at: usize| {
        let place = batch.corners[at].as_flattened().iter().map(|x| x.to_bits()).collect();
        let image = model.images[batch.materials[at] as usize].clone();
        (place, (batch.uvs.get(at).copied(), batch.colours.get(at).copied(), image))
    };
    (0..batch.len()).map(entry).collect()
}

fn check_same(found: &Shown, expected: &Shown, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for ((place, found), (other, expected)) in found.iter().zip(expected) {
        assert_eq!(place, other, "{what}");
        assert_eq!((&found.1, &found.2), (&expected.1, &expected.2), "{what}");
        // A triangle without image has no place in one.
        let uvs = expected.0.filter(|_| expected.2.is_some());
        for (a, b) in found.0.iter().flatten().flatten().zip(uvs.iter().flatten().flatten()) {
            assert!((a - b).abs() <= f32::EPSILON, "{what}: {a} for {b}");
        }
        assert!(found.0.is_some() || uvs.is_none(), "{what}");
    }
}

/// A strip of triangles with two images, and some without; or with colours.
fn strip(folder: &Path, has_colours: bool) -> PathBuf {
    std::fs::create_dir_all(folder.join("maps")).expect("a folder");
    std::fs::write(folder.join("maps/a skin.png"), PNG).expect("a file");
    std::fs::write(folder.join("b.jpg"), JPEG).expect("a file");
    let library = "newmtl bare\nKd 0.25 0.5 1\nnewmtl a\nmap_Kd maps\\a skin.png\nnewmtl b\n\
                   Kd 1 1 1\nmap_Kd -s 1 1 1 b.jpg\n";
    std::fs::write(folder.join("m.mtl"), library).expect("a file");
    let mut obj = "mtllib m.mtl\n".to_owned();
    for i in 0..300 {
        obj += &format!("v {i} {} 0.5", i % 2);
        obj += &if has_colours { format!(" 0.{:03} 1 0\n", i % 250) } else { "\n".to_owned() };
        obj += &format!("vt 0.{i:03} {}\n", 0.001 * f64::from(i * i % 1009) - 0.25);
    }
    for i in 1..299 {
        if !has_colours {
            obj += ["usemtl a\n", "usemtl b\n", "usemtl bare\n"][i as usize / 7 % 3];
        }
        let [a, b, c] = [i, i + 1, i + 2];
        obj += &match has_colours {
            true => format!("f {a} {b} {c}\n"),
            false => format!("f {a}/{a} {b}/{c} {c}/{b}\n"),
        };
    }
    if has_colours {
        obj = obj.lines().filter(|line| !line.starts_with("vt")).collect::<Vec<_>>().join("\n");
    }
    let path = folder.join("in.obj");
    std::fs::write(&path, obj + "\n").expect("a file");
    path
}

#[test]
fn attributes_and_images_survive_every_format_one_after_another() {
    for has_colours in [false, true] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let mut path = strip(folder.path(), has_colours);
        let first = load(&path, &scratch);
        assert_eq!(first.content.batch.len(), 298);
        let expected = shown(&first);
        let images = expected.values().filter(|shown| shown.2.is_some()).count();
        assert_eq!(images > 0, !has_colours);
        for (format, ending) in
            [FORMATS[1], FORMATS[2], FORMATS[3], FORMATS[0], FORMATS[2], FORMATS[1], FORMATS[0]]
        {
            let model = load(&path, &scratch);
            let next = folder.path().join(format!("out.{ending}"));
            // No format is written onto what it was read from.
            let next = if next == path { next.with_file_name("more.obj") } else { next };
            let options = write(&model, (format, &next), None, &scratch);
            let lost = lost_of_materials(&model.palette, format, &options, &scratch);
            assert_eq!(lost.expect("told"), [""; 0]);
            check_same(&shown(&load(&next, &scratch)), &expected, ending);
            path = next;
        }
    }
}

#[test]
fn writers_go_on_from_any_checkpoint_to_the_same_bytes() {
    for has_colours in [false, true] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path());
        let model = load(&strip(folder.path(), has_colours), &scratch);
        for (format, ending) in FORMATS {
            let path = folder.path().join(format!("twin.{ending}"));
            let [whole, other] = [None, Some(101)].map(|stop| {
                // Groups of one call are sorted, so both have the same calls.
                match stop {
                    None => {
                        let batch = &model.content.batch;
                        let (uvs, colours) = (!batch.uvs.is_empty(), !batch.colours.is_empty());
                        let attributes = Attributes { uvs, colours, normals: true };
                        let options = options(&model, attributes, &path);
                        let mut sink = create(&path, format, &scratch, &options).expect("creates");
                        push(&mut sink, &model.content, 0..101);
                        push(&mut sink, &model.content, 101..batch.len());
                        sink.finish().expect("finishes");
                    }
                    stop => drop(write(&model, (format, &path), stop, &scratch)),
                }
                std::fs::read(&path).expect("the file")
            });
            assert!(whole == other, "{ending}");
        }
    }
}

#[test]
fn obj_names_corners_by_their_lists_and_looks_by_their_material() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let mut model = load(&strip(folder.path(), false), &scratch);
    let mut looks = SpoolWriter::create(&scratch, "looks").expect("a spool");
    [1_u32, 1, 0].iter().try_for_each(|&material| looks.push(material)).expect("pushed");
    model.palette = model.palette.with_looks(looks.finish().expect("finished").state());
    model.content.batch.materials = (0..298).map(|i| i % 3).collect();
    model.content.batch.colours = vec![[[255, 0, 51, 7]; 3]; 298];
    let path = folder.path().join("looks.obj");
    write(&model, (Format::Obj, &path), None, &scratch);
    let text = std::fs::read_to_string(&path).expect("text");
    let used: Vec<_> = text.lines().filter(|line| line.starts_with("usemtl")).collect();
    assert_eq!(used, ["usemtl a", "usemtl b"]);
    assert!(text.contains("\nv 0 0 0.5 1 0 0.2\n") && text.contains("\nvn 0 0.6 0.8\n"));
    assert!(text.contains("\nf 1/1/1 2/2/2 3/3/3\n"));
    let library = std::fs::read_to_string(folder.path().join("looks.mtl")).expect("text");
    assert!(library.contains("\nmap_Kd maps/a skin.png\n"), "{library}");
    // What is read there replaces the materials that were read before.
    let other = tempfile::tempdir().expect("a temporary folder");
    for (format, ending) in FORMATS {
        let path = folder.path().join(format!("looks2.{ending}"));
        write(&model, (format, &path), None, &scratch);
        let found = shown(&load(&path, &Scratch::new(other.path())));
        let jpegs = found.values().filter(|shown| shown.2.as_deref() == Some(JPEG)).count();
        assert_eq!(jpegs, 199, "{ending}");
    }
}

/// The bytes of each material's image, and what was told to be lost.
type Outcome = (Vec<Option<Vec<u8>>>, Vec<String>);

/// What an output of materials with these textures shows and what it tells to be lost.
fn outcome(
    textures: &[&str],
    format: Format,
    input: &Path,
    scratch: &Scratch,
) -> Result<Outcome, IoError> {
    let materials: Vec<_> = textures
        .iter()
        .enumerate()
        .map(|(number, texture)| {
            let texture = Some(Texture::Beside((*texture).to_owned()));
            Material { name: number.to_string(), texture, ..Material::default() }
        })
        .collect();
    let (found, lost) = passed(&materials, format, input, scratch)?;
    Ok((found.images, lost))
}

/// Materials as they come back from an output, and what was told to be lost.
fn passed(
    materials: &[Material],
    format: Format,
    input: &Path,
    scratch: &Scratch,
) -> Result<(Model, Vec<String>), IoError> {
    let mut writer = PaletteWriter::create(scratch)?;
    materials.iter().try_for_each(|material| writer.push(material))?;
    let count = materials.len() as u32;
    let [materials, images] = writer.finish()?;
    let palette = Palette::new(scratch, &materials).with_images(&images, input);
    let mut content = Content::default();
    for number in 0..count {
        let x = f64::from(number);
        content.batch.push([[x, 0.0, 0.0], [x, 1.0, 0.0], [x, 0.0, 1.0]], 0, number, number);
        content.batch.uvs.push([[0.5, 0.25]; 3]);
    }
    let model = Model { content, palette, images: Vec::new() };
    let ending = FORMATS.iter().find(|(known, _)| *known == format).expect("known").1;
    let path = input.with_file_name(format!("out.{ending}"));
    let options = write(&model, (format, &path), None, scratch);
    let lost = lost_of_materials(&model.palette, format, &options, scratch)?;
    Ok((load(&path, scratch), lost))
}

#[test]
fn further_maps_are_in_a_glb_and_told_to_be_lost_elsewhere() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let image = |name: &str| Texture::Beside(name.to_owned());
    for (name, bytes) in [("a.png", PNG), ("n.png", &[PNG, b"n"].concat()), ("g.jpg", JPEG)] {
        std::fs::write(folder.path().join(name), bytes).expect("written");
    }
    let maps = Maps {
        normal: Some((image("n.png"), 0.5)),
        gloss: Some(image("g.jpg")),
        emission: Some(image("nowhere.png")),
        occlusion: Some((image("g.jpg"), 0.25)),
    };
    let material = Material {
        name: "wood".to_owned(),
        metallic: Some(0.5),
        roughness: Some(0.75),
        emissive: Some([1.0; 3]),
        texture: Some(image("a.png")),
        maps,
        ..Material::default()
    };
    let input = folder.path().join("input.glb");
    let (found, lost) =
        passed(std::slice::from_ref(&material), Format::Glb, &input, &scratch).expect("written");
    let Material { maps, metallic, roughness, emissive, .. } = &found.content.materials[0];
    assert_eq!((*metallic, *roughness, *emissive), (Some(0.5), Some(0.75), None));
    let names = maps.images().map(|(_, image)| image.map(Texture::name));
    assert_eq!(
        names,
        [Some("n.png"), Some("g.jpg"), None, Some("g.jpg")].map(|n| n.map(String::from))
    );
    let factors = (maps.normal.as_ref().map(|m| m.1), maps.occlusion.as_ref().map(|m| m.1));
    assert_eq!(factors, (Some(0.5), Some(0.25)));
    assert_eq!(lost, ["emission maps"]);
    let mut source =
        open(&folder.path().join("out.glb"), &scratch, &ReadOptions::in_scene(1 << 20))
            .expect("opens");
    let of_maps = [&maps.normal.as_ref().expect("there").0, maps.gloss.as_ref().expect("there")];
    let bytes = of_maps.map(|image| match image {
        Texture::Inside(image) => image_of(&mut source, image.number),
        Texture::Beside(name) => panic!("{name} is beside"),
    });
    assert_eq!(bytes, [[PNG, b"n"].concat(), JPEG.to_vec()]);
    // Factors mean nothing without their maps.
    let (found, lost) = passed(&[material], Format::Obj, &input, &scratch).expect("written");
    let Material { metallic, roughness, emissive, .. } = &found.content.materials[0];
    assert_eq!((*metallic, *roughness, *emissive), (None, None, None));
    let kinds = ["normal maps", "roughness and metalness maps", "emission maps", "occlusion maps"];
    assert_eq!(lost, kinds);
}

#[test]
fn images_out_of_the_folder_are_told_and_never_read() {
    let outer = tempfile::tempdir().expect("a temporary folder");
    let folder = outer.path().join("inner");
    std::fs::create_dir_all(folder.join("dir.png")).expect("a folder");
    let secret = outer.path().join("secret.png");
    std::fs::write(&secret, PNG).expect("a file");
    std::fs::write(folder.join("here.png"), PNG).expect("a file");
    std::fs::write(folder.join("empty.png"), b"").expect("a file");
    std::fs::write(folder.join("text.png"), b"GIF89a").expect("a file");
    for (name, target) in [("link.png", "../secret.png"), ("loop.png", "loop.png"), ("up", "..")] {
        std::os::unix::fs::symlink(target, folder.join(name)).expect("a link");
    }
    let absolute = secret.to_str().expect("text");
    let bad = [
        "../secret.png",
        "..\\secret.png",
        absolute,
        "link.png",
        "loop.png",
        "up/secret.png",
        "dir.png",
        "empty.png",
        "missing.png",
        "",
        "https://example.org/a.png",
    ];
    let mut textures = bad.to_vec();
    textures.push("./here.png");
    let scratch = Scratch::new(&folder);
    let input = folder.join("in.obj");
    for (format, _) in FORMATS {
        let (images, lost) = outcome(&textures, format, &input, &scratch).expect("written");
        let there: Vec<_> = images.iter().flatten().collect();
        assert_eq!(there, [PNG], "{format:?}");
        assert_eq!(lost.len(), bad.len(), "{format:?}: {lost:?}");
        assert!(lost.iter().any(|lost| lost == "the texture missing.png"), "{lost:?}");
    }
    // What is no image to a format that holds them is lost there, and not where it is referred to.
    for (format, is_held) in
        [(Format::Obj, true), (Format::Ply, true), (Format::Glb, false), (Format::ThreeMf, false)]
    {
        let (_, lost) = outcome(&["text.png"], format, &input, &scratch).expect("written");
        assert_eq!(lost.is_empty(), is_held, "{format:?}");
    }
}

#[test]
fn images_beside_an_output_are_recognised_by_their_content() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scratch = Scratch::new(folder.path());
    let glb = folder.path().join("a.glb");
    write(&load(&strip(folder.path(), false), &scratch), (Format::Glb, &glb), None, &scratch);
    let model = load(&glb, &scratch);
    let path = folder.path().join("out dir/b.obj");
    std::fs::create_dir(folder.path().join("out dir")).expect("a folder");
    let options = write(&model, (Format::Obj, &path), None, &scratch);
    let mut names = Vec::new();
    images_beside(
        Format::Obj,
        &options,
        &scratch,
        |error| error,
        |image| {
            assert!(image.is_there()?);
            names.push(image.path.file_name().expect("a name").to_owned());
            std::fs::write(&image.path, b"\x89PNG another").expect("a file");
            assert!(!image.is_there()?);
            std::fs::remove_file(&image.path).expect("removed");
            assert!(!image.is_there()?);
            Ok(())
        },
    )
    .expect("looked at");
    assert_eq!(names, ["b.texture-0.png", "b.texture-1.jpg"]);
    // An image of the input is referred to by the way from the output's folder.
    let input = load(&folder.path().join("in.obj"), &scratch);
    write(&input, (Format::Obj, &path), None, &scratch);
    let library = std::fs::read_to_string(path.with_file_name("b.mtl")).expect("text");
    assert!(library.contains("\nmap_Kd ../maps/a skin.png\n"), "{library}");
}
