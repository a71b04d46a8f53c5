//! The walk over everything that is built: every object in every place where it stands.
//!
//! In: the scene. Out: objects, in the order of the items and of the components in them, each with
//! its transforms. Objects that only a printer needs are left out with all that is
//! in them. Memory: one frame a level, at most [`MOST_LEVELS`]. Fails: objects inside of
//! themselves, too many levels or instances.

use std::path::Path;

use crate::io::error::IoError;
use crate::io::threemf::scene::{Kind, Object, Scene};
use crate::io::threemf::transform::Transform;

/// The most objects inside of one another.
const MOST_LEVELS: usize = 128;
/// The most objects in all their places, those that hold others as well.
const MOST_INSTANCES: u64 = 1 << 20;

/// An object in its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    pub(super) object: Object,
    /// Its row among the objects.
    pub(super) row: u32,
    /// Into the build.
    pub(super) transform: Transform,
    /// Into the object that it is a part of.
    pub(super) local: Transform,
    /// The place of that one, in the order of the walk.
    pub(super) parent: Option<u32>,
}

impl Instance {
    pub(super) fn has_mesh(&self) -> bool {
        self.object.vertices + self.object.triangles > 0
    }
}

/// An object whose components are not done.
struct Frame {
    resource: u32,
    /// Its place in the order of the walk.
    place: u32,
    transform: Transform,
    next: u64,
    end: u64,
}

/// Where the walk stands.
#[derive(Default)]
pub(super) struct Walk {
    next_root: u64,
    frames: Vec<Frame>,
    visited: u64,
    /// Of these, the ones that were shown.
    entered: u32,
}

/// What a whole walk yields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Totals {
    pub(super) vertices: u64,
    pub(super) triangles: u64,
}

impl Totals {
    /// Walks once without reading a mesh.
    pub(super) fn of(scene: &mut Scene, path: &Path) -> Result<Self, IoError> {
        let (mut walk, mut totals) = (Walk::default(), Self::default());
        while let Some(Instance { object, .. }) = walk.next(scene, path)? {
            totals.vertices += object.vertices;
            totals.triangles += object.triangles;
            let limit = u64::from(u32::MAX);
            for (count, what) in [(totals.vertices, "vertices"), (totals.triangles, "polygons")] {
                if count >= limit {
                    return Err(IoError::too_many(path, what, limit));
                }
            }
        }
        Ok(totals)
    }
}

impl Walk {
    /// The next object.
    pub(super) fn next(
        &mut self,
        scene: &mut Scene,
        path: &Path,
    ) -> Result<Option<Instance>, IoError> {
        loop {
            let (resource, local, transform, parent) = match self.frames.last_mut() {
                Some(frame) if frame.next == frame.end => {
                    self.frames.pop();
                    continue;
                }
                Some(frame) => {
                    let component = scene.components.get(frame.next)?;
                    frame.next += 1;
                    let transform = component.transform.then(&frame.transform);
                    let parent = Some(frame.place);
                    (component.resource as u32, component.transform, transform, parent)
                }
                None => match self.root(scene)? {
                    Some((root, transform)) => (root, transform, transform, None),
                    None => return Ok(None),
                },
            };
            let object = self.enter(scene, path, resource, transform)?;
            if let Some((row, object)) = object {
                return Ok(Some(Instance { object, row, transform, local, parent }));
            }
        }
    }

    /// The next item. Where nothing is to be built, the next object that is part of no other: a
    /// library of objects is shown as a whole.
    fn root(&mut self, scene: &mut Scene) -> Result<Option<(u32, Transform)>, IoError> {
        if !scene.items.is_empty() {
            if self.next_root == scene.items.len() {
                return Ok(None);
            }
            let item = scene.items.get(self.next_root)?;
            self.next_root += 1;
            return Ok(Some((item.resource as u32, item.transform)));
        }
        while self.next_root < scene.resource_count() {
            let number = self.next_root as u32;
            self.next_root += 1;
            let resource = scene.resource(number)?;
            if resource.kind() == Kind::Object && !resource.is_component() {
                return Ok(Some((number, Transform::IDENTITY)));
            }
        }
        Ok(None)
    }

    /// Opens an object; its row and what it is, unless it is there for the printer alone.
    fn enter(
        &mut self,
        scene: &mut Scene,
        path: &Path,
        number: u32,
        transform: Transform,
    ) -> Result<Option<(u32, Object)>, IoError> {
        let resource = scene.resource(number)?;
        if resource.kind() != Kind::Object {
            let at = scene.place(number)?;
            return Err(at.unreadable("an object, to be built", "another resource"));
        }
        self.visited += 1;
        if self.visited > MOST_INSTANCES {
            return Err(IoError::too_many(path, "instances of objects", MOST_INSTANCES));
        }
        if self.frames.iter().any(|frame| frame.resource == number) {
            let at = scene.place(number)?;
            return Err(at.unreadable("objects that are no part of themselves", "one that is"));
        }
        let object = scene.objects.get(resource.row.into())?;
        if object.is_support != 0 {
            return Ok(None);
        }
        let place = self.entered;
        self.entered += 1;
        if object.components > 0 {
            if self.frames.len() == MOST_LEVELS {
                return Err(IoError::too_many(path, "levels of components", MOST_LEVELS as u64));
            }
            let next = object.first_component;
            let end = next + object.components;
            self.frames.push(Frame { resource: number, place, transform, next, end });
        }
        Ok(Some((resource.row, object)))
    }
}
