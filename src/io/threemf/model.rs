//! A model part, tag by tag, into the scene.
//!
//! In: the XML of a part. Out: resources, meshes, components and items in [`Scene`]. Elements that
//! are none of ours are passed over, unless the file requires them. Memory: one tag.

use crate::io::error::{IoError, shown};
use crate::io::numbers::parse_number;
use crate::io::polygon::checked_index;
use crate::io::threemf::archive::Members;
use crate::io::threemf::groups::GroupParser;
use crate::io::threemf::part_name::part_key;
use crate::io::threemf::scene::{Face, Kind, Object, Placed, Scene};
use crate::io::threemf::transform::Transform;
use crate::io::threemf::vocabulary::{Element, Space, UNIT_NAMES, is_understood};
use crate::io::threemf::xml::{Markup, Tag, Where};
use crate::mesh::LengthUnit;

/// The longest namespace in a message.
const LONGEST_SHOWN: usize = 100;

/// A property that triangles have where they state none.
#[derive(Clone, Copy, Debug, Default)]
struct DefaultProperty {
    resource: Option<u32>,
    property: Option<u32>,
}

/// An object whose end was not seen yet.
struct OpenObject {
    resource: u32,
    object: Object,
    property: DefaultProperty,
    /// What stands in it that is none of ours.
    foreign: Option<String>,
}

/// Fills the scene.
pub(super) struct ModelParser<'s> {
    scene: &'s mut Scene,
    members: &'s Members,
    part: u32,
    open: Vec<Element>,
    object: Option<OpenObject>,
    groups: GroupParser,
    /// The last id that a triangle named, and its resource.
    last: Option<(u32, u32)>,
}

impl<'s> ModelParser<'s> {
    /// A parser for part number `part`; 0 is the root.
    pub(super) fn new(scene: &'s mut Scene, members: &'s Members, part: u32) -> Self {
        let groups = GroupParser::new(part);
        Self { scene, members, part, open: Vec::new(), object: None, groups, last: None }
    }

    pub(super) fn take(&mut self, markup: &Markup) -> Result<(), IoError> {
        match markup {
            Markup::Start(tag) => self.start(tag),
            Markup::End(at) => match self.open.pop() {
                Some(Element::Object) => self.end_object(at),
                _ => Ok(()),
            },
        }
    }

    fn start(&mut self, tag: &Tag) -> Result<(), IoError> {
        let (space, name) = tag.name();
        let parent = self.open.last().copied();
        let element = Element::of(parent, space, name);
        self.open.push(element);
        match element {
            Element::Vertex => self.vertex(tag),
            Element::Triangle => self.triangle(tag),
            Element::Model => self.model(tag),
            Element::Object => self.start_object(tag),
            Element::Component => self.component(tag),
            Element::Item => self.item(tag),
            Element::Foreign => {
                if let Some(object) = &mut self.object {
                    object.foreign = Some(tag.shown());
                }
                Ok(())
            }
            Element::Other if parent.is_none() => {
                Err(tag.at.unreadable("the model of a 3MF file", &tag.shown()))
            }
            element => self.groups.start(self.scene, element, tag),
        }
    }

    fn model(&mut self, tag: &Tag) -> Result<(), IoError> {
        let is_root = self.part == 0;
        let unit = &mut self.scene.unit;
        tag.attributes(|space, name, value| match (space, name) {
            (Space::None, "unit") => {
                let Some(stated) = LengthUnit::of(value.trim()) else {
                    return Err(tag.at.unreadable(UNIT_NAMES, &shown(value.as_bytes())));
                };
                if !is_root && stated != *unit {
                    let expected = format!("the unit of the root model, {unit:?}");
                    return Err(tag.at.unreadable(expected, &format!("{stated:?}")));
                }
                *unit = stated;
                Ok(())
            }
            (Space::None, "requiredextensions") => {
                value.split_ascii_whitespace().try_for_each(|prefix| check_extension(tag, prefix))
            }
            _ => Ok(()),
        })
    }

    fn start_object(&mut self, tag: &Tag) -> Result<(), IoError> {
        let (mut id, mut pid, mut property) = (None, None, None);
        let (mut is_support, mut title) = (false, String::new());
        tag.attributes(|space, name, value| {
            match (space, name) {
                (Space::None, "id") => id = Some(parse_id(tag, value)?),
                (Space::None, "pid") => pid = Some(parse_id(tag, value)?),
                (Space::None, "pindex") => property = Some(parse_id(tag, value)?),
                (Space::None, "name") => value.clone_into(&mut title),
                (Space::None, "type") => {
                    is_support = ["support", "solidsupport", "other"].contains(&value.trim());
                }
                _ => {}
            }
            Ok(())
        })?;
        let id = id.ok_or_else(|| tag.at.unreadable("an object with an id", "none"))?;
        let resource = self.scene.resource_number(self.part, id, tag.at)?;
        let row = self.scene.objects.len() as u32;
        self.scene.define(resource, Kind::Object, row, tag.at)?;
        let object = Object {
            first_vertex: self.scene.vertices.len(),
            first_triangle: self.scene.faces.len(),
            first_component: self.scene.components.len(),
            name: self.scene.names.number(title.as_bytes())?,
            is_support: is_support.into(),
            ..Object::default()
        };
        // Its ranges grow until its end.
        self.scene.objects.push(object)?;
        let pid = pid.map(|pid| self.scene.resource_number(self.part, pid, tag.at)).transpose()?;
        let property = DefaultProperty { resource: pid, property };
        self.object = Some(OpenObject { resource, object, property, foreign: None });
        Ok(())
    }

    fn end_object(&mut self, at: &Where) -> Result<(), IoError> {
        let Some(OpenObject { resource, mut object, foreign, .. }) = self.object.take() else {
            return Ok(());
        };
        object.vertices = self.scene.vertices.len() - object.first_vertex;
        object.triangles = self.scene.faces.len() - object.first_triangle;
        object.components = self.scene.components.len() - object.first_component;
        let is_empty = object.vertices + object.triangles + object.components == 0;
        if let Some(foreign) = foreign.filter(|_| is_empty && object.is_support == 0) {
            let expected = "an object of vertices and triangles, or of components";
            return Err(at.unreadable(expected, &foreign));
        }
        let row = self.scene.resource(resource)?.row;
        Ok(self.scene.objects.set(row.into(), object)?)
    }

    fn vertex(&mut self, tag: &Tag) -> Result<(), IoError> {
        let mut position = [None; 3];
        tag.attributes(|space, name, value| {
            let axis = match (space, name) {
                (Space::None, "x") => 0,
                (Space::None, "y") => 1,
                (Space::None, "z") => 2,
                _ => return Ok(()),
            };
            position[axis] = Some(number(tag, value)?);
            Ok(())
        })?;
        let [Some(x), Some(y), Some(z)] = position else {
            return Err(tag.at.unreadable("x, y and z of a vertex", "fewer"));
        };
        let first = self.object.as_ref().map_or(0, |open| open.object.first_vertex);
        if self.scene.vertices.len() - first >= u64::from(u32::MAX) {
            let limit = u64::from(u32::MAX);
            return Err(IoError::too_many(&tag.at.path, "vertices in an object", limit));
        }
        Ok(self.scene.vertices.push([x, y, z])?)
    }

    fn triangle(&mut self, tag: &Tag) -> Result<(), IoError> {
        let mut vertices = [None; 3];
        let (mut pid, mut property, mut others) = (None, None, [None; 2]);
        tag.attributes(|space, name, value| {
            let corner = match (space, name) {
                (Space::None, "v1") => 0,
                (Space::None, "v2") => 1,
                (Space::None, "v3") => 2,
                (Space::None, "pid") => {
                    pid = Some(parse_id(tag, value)?);
                    return Ok(());
                }
                (Space::None, "p1") => {
                    property = Some(parse_id(tag, value)?);
                    return Ok(());
                }
                // Those that are no numbers were never looked at by many readers.
                (Space::None, "p2") => {
                    others[0] = value.trim_ascii().parse().ok();
                    return Ok(());
                }
                (Space::None, "p3") => {
                    others[1] = value.trim_ascii().parse().ok();
                    return Ok(());
                }
                _ => return Ok(()),
            };
            let index = checked_index(number(tag, value)?, u64::from(u32::MAX));
            vertices[corner] = Some(index.unwrap_or(u32::MAX));
            Ok(())
        })?;
        let [Some(a), Some(b), Some(c)] = vertices else {
            return Err(tag.at.unreadable("v1, v2 and v3 of a triangle", "fewer"));
        };
        let stated = pid.map(|id| self.property_resource(id, tag.at)).transpose()?;
        let default = self.object.as_ref().map(|open| open.property).unwrap_or_default();
        let resource = stated.or(default.resource);
        let mut face = Face { vertices: [a, b, c], resource: 0, properties: [0; 3] };
        if let (Some(resource), Some(first)) = (resource, property.or(default.property)) {
            // Corners have properties of their own where the first has one.
            let [second, third] = others.map(|other| other.filter(|_| property.is_some()));
            face.resource = resource + 1;
            face.properties = [first, second.unwrap_or(first), third.unwrap_or(first)];
            if !self.scene.has_colours && face.properties[1..] != [first; 2] {
                let group = self.scene.group_of(resource)?;
                self.scene.has_colours = group.is_some_and(|group| group.is_colours());
            }
        }
        Ok(self.scene.faces.push(face)?)
    }

    /// The resource that a triangle names; mostly it is the one before.
    fn property_resource(&mut self, id: u32, at: &Where) -> Result<u32, IoError> {
        match self.last {
            Some((last, resource)) if last == id => Ok(resource),
            _ => {
                let resource = self.scene.resource_number(self.part, id, at)?;
                self.last = Some((id, resource));
                Ok(resource)
            }
        }
    }

    fn component(&mut self, tag: &Tag) -> Result<(), IoError> {
        let placed = self.placed(tag)?;
        self.scene.mark_component(placed.resource as u32)?;
        Ok(self.scene.components.push(placed)?)
    }

    fn item(&mut self, tag: &Tag) -> Result<(), IoError> {
        // Only what the root says is built.
        if self.part > 0 {
            return Ok(());
        }
        let placed = self.placed(tag)?;
        Ok(self.scene.items.push(placed)?)
    }

    /// An object in its place.
    fn placed(&mut self, tag: &Tag) -> Result<Placed, IoError> {
        let (mut id, mut transform, mut part) = (None, Transform::IDENTITY, self.part);
        let (scene, members) = (&mut *self.scene, self.members);
        tag.attributes(|space, name, value| {
            match (space, name) {
                (Space::None, "objectid") => id = Some(parse_id(tag, value)?),
                (Space::None, "transform") => {
                    let found = || shown(value.as_bytes());
                    let parsed = Transform::parse(value);
                    let expected = "a transform of twelve numbers";
                    transform = parsed.ok_or_else(|| tag.at.unreadable(expected, &found()))?;
                }
                (Space::Production, "path") if part > 0 => {
                    let expected = "paths to other parts in the root model alone";
                    return Err(tag.at.unreadable(expected, &shown(value.as_bytes())));
                }
                (Space::Production, "path") => {
                    let Some(&member) = members.get(&part_key(value)) else {
                        let found = format!("{}, which is not there", shown(value.as_bytes()));
                        return Err(tag.at.unreadable("a path to a part of the package", &found));
                    };
                    part = scene.part(value, member);
                }
                _ => {}
            }
            Ok(())
        })?;
        let id = id.ok_or_else(|| tag.at.unreadable("an objectid", "none"))?;
        let resource = self.scene.resource_number(part, id, tag.at)?.into();
        Ok(Placed { transform, resource })
    }
}

/// Refuses an extension without which the surface may be another one.
fn check_extension(tag: &Tag, prefix: &str) -> Result<(), IoError> {
    let namespace = tag.namespace(prefix).unwrap_or_default();
    if is_understood(&namespace) {
        return Ok(());
    }
    let namespace: String = namespace.chars().take(LONGEST_SHOWN).collect();
    let found = format!("{} ({namespace:?})", shown(prefix.as_bytes()));
    let expected = "no required extensions but materials, production and triangle sets";
    Err(tag.at.unreadable(expected, &found))
}

#[inline]
fn number(tag: &Tag, value: &str) -> Result<f64, IoError> {
    let number = parse_number(value.trim_ascii().as_bytes());
    number.ok_or_else(|| tag.at.unreadable("a number", &shown(value.as_bytes())))
}

/// A natural number that names something.
#[inline]
pub(super) fn parse_id(tag: &Tag, value: &str) -> Result<u32, IoError> {
    let id = value.trim_ascii().parse();
    id.map_err(|_| tag.at.unreadable("a number that names something", &shown(value.as_bytes())))
}
