//! The pictures and the page of a model that was repaired.

use std::path::Path;

use brickmend::contour::SurfaceDetail;
use brickmend::io::ReadOptions;
use brickmend::monitor::Void;
use brickmend::repair::{Limits, Outcome};
use brickmend::report::{
    MapOptions, Measuring, ModelPage, OpenSource, PageOptions, PatchRule, PreviewOptions,
    ReportError, Scene, Views, write_model_page, write_preview,
};
use brickmend::store::Scratch;

/// Width and height of a view where there are many.
const VIEW_PX: u32 = 512;

/// A model before and after.
pub(crate) struct Pictured<'a> {
    pub(crate) input: &'a Path,
    pub(crate) output: &'a Path,
    /// `None` where it was copied, or has an outcome for each of its parts.
    pub(crate) outcome: Option<&'a Outcome>,
    pub(crate) limits: Limits,
    pub(crate) share_bytes: u64,
    /// Whether a map of deviations is wanted.
    pub(crate) is_measured: bool,
    pub(crate) tags_patches: bool,
}

impl Pictured<'_> {
    /// How it is known what closes an opening: by the output itself where it tells.
    fn patch_rule(&self) -> PatchRule {
        let told = self.outcome.map(|outcome| outcome.transfer.surfaces);
        let is_told = match told {
            Some(detail) => detail == SurfaceDetail::MaterialAndPatch,
            None => self.tags_patches,
        };
        if is_told {
            return PatchRule::Tagged;
        }
        let deviation = self.outcome.and_then(|outcome| outcome.deviation.as_ref());
        deviation.map_or(PatchRule::Unknown, |found| PatchRule::Beyond(found.tolerance))
    }
}

/// How a preview is drawn.
pub(crate) struct DrawOptions {
    pub(crate) has_edges: bool,
    /// From where the model is seen, if it is said.
    pub(crate) views: Option<Views>,
}

/// Draws input, output and the map; a sixth of the memory budget is for all of them.
pub(crate) fn draw_preview(
    path: &Path,
    pictured: &Pictured,
    drawn: &DrawOptions,
) -> Result<(), String> {
    let scratch =
        Scratch::new(path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")));
    let share_bytes = pictured.share_bytes;
    let options = ReadOptions::in_scene(share_bytes);
    let open = |path: &Path| -> Result<Box<dyn brickmend::mesh::MeshSource<Error = _>>, _> {
        let source = brickmend::io::open(path, &scratch, &options)?;
        Ok(source as Box<dyn brickmend::mesh::MeshSource<Error = _>>)
    };
    let input: &OpenSource<brickmend::io::IoError> = &|| open(pictured.input);
    let output: &OpenSource<brickmend::io::IoError> = &|| open(pictured.output);
    let drawing =
        PreviewOptions { share_bytes, edges: drawn.has_edges, ..PreviewOptions::default() };
    let is_exr = has_extension(path, "exr");
    let options = match drawn.views.or(is_exr.then_some(Views::Six)) {
        Some(views) => PreviewOptions { width_px: VIEW_PX, height_px: VIEW_PX, views, ..drawing },
        None => drawing,
    };
    let options = match is_exr {
        true => PreviewOptions { patches: pictured.patch_rule(), ..options },
        false => options,
    };
    let threads = pictured.limits.threads;
    let measuring = pictured.is_measured.then_some(Measuring { scratch: &scratch, threads });
    let scene = Scene { input, output: Some(output), measuring, monitor: &Void };
    write_preview(path, &scene, &options).map(|_| ()).map_err(|error| error.to_string())
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

/// Writes the page of the model; a sixth of the memory budget is for pictures and meshes, another one
/// for measuring.
pub(crate) fn write_page(path: &Path, pictured: &Pictured) -> Result<(), ReportError> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = pictured.input.file_name().unwrap_or_default().to_string_lossy();
    let model = ModelPage {
        name: &name,
        input: pictured.input,
        output: pictured.output,
        outcome: pictured.outcome,
        parts: None,
        back: None,
    };
    let share_bytes = pictured.share_bytes;
    let threads = pictured.limits.threads;
    let map = pictured.is_measured.then_some(MapOptions { threads, share_bytes });
    let options = PageOptions { map, ..PageOptions::large(share_bytes) };
    write_model_page(path, &model, &options, &Scratch::new(folder), &Void)
}
