//! Groups of properties, tag by tag, as definitions of materials.
//!
//! Memory: the materials that one group of composites is mixed of.

use crate::io::error::{IoError, shown};
use crate::io::numbers::parse_number;
use crate::io::threemf::model::parse_id;
use crate::io::threemf::properties::{Group, NOTHING, colour_name, parse_colour};
use crate::io::threemf::scene::{Kind, Scene};
use crate::io::threemf::vocabulary::{Element, Space};
use crate::io::threemf::xml::Tag;

/// Reads the group that is open.
pub(super) struct GroupParser {
    part: u32,
    /// What composites are mixed of, by definition.
    ingredients: Vec<u32>,
    /// The first layer of multiproperties that has materials, and which one it is.
    layer: Option<(usize, Group)>,
    /// The first that has texture coordinates, likewise.
    texture_layer: Option<(usize, Group)>,
    /// The material of an image whose coordinates are listed.
    texture: u32,
}

impl GroupParser {
    pub(super) fn new(part: u32) -> Self {
        Self { part, ingredients: Vec::new(), layer: None, texture_layer: None, texture: NOTHING }
    }

    /// Takes a tag, if it belongs to a group.
    pub(super) fn start(
        &mut self,
        scene: &mut Scene,
        element: Element,
        tag: &Tag,
    ) -> Result<(), IoError> {
        match element {
            Element::BaseMaterials => self.define(scene, tag, Kind::Materials, false),
            Element::ColourGroup => self.define(scene, tag, Kind::Materials, true),
            Element::Texture => self.texture(scene, tag),
            Element::TextureGroup => {
                self.texture_group(scene, tag)?;
                self.define(scene, tag, Kind::Bare, false)
            }
            Element::Composites => {
                self.composites(scene, tag)?;
                self.define(scene, tag, Kind::Materials, false)
            }
            Element::Multiproperties => {
                self.multiproperties(scene, tag)?;
                self.define(scene, tag, Kind::Materials, false)
            }
            Element::Resource => self.define(scene, tag, Kind::Foreign, false),
            Element::Base | Element::Colour => base(scene, tag),
            Element::TextureCoordinate => self.coordinate(scene, tag),
            Element::Composite => self.composite(scene, tag),
            Element::Multi => self.multi(scene, tag),
            _ => Ok(()),
        }
    }

    /// Starts a group, or what has no more than an id.
    fn define(
        &self,
        scene: &mut Scene,
        tag: &Tag,
        kind: Kind,
        is_colours: bool,
    ) -> Result<(), IoError> {
        let mut id = None;
        tag.attributes(|space, name, value| {
            // An element that is none of ours may have an id that is no number.
            if (space, name) == (Space::None, "id") {
                id = match kind {
                    Kind::Foreign => value.trim_ascii().parse().ok(),
                    _ => Some(parse_id(tag, value)?),
                };
            }
            Ok(())
        })?;
        let row = match kind {
            Kind::Foreign => 0,
            _ => scene.properties.start_group(is_colours)?,
        };
        let Some(id) = id else {
            return match kind {
                Kind::Foreign => Ok(()),
                _ => Err(tag.at.unreadable("a group with an id", "none")),
            };
        };
        let resource = scene.resource_number(self.part, id, tag.at)?;
        scene.define(resource, kind, row, tag.at)
    }

    /// An image, by the name of its part.
    fn texture(&self, scene: &mut Scene, tag: &Tag) -> Result<(), IoError> {
        let (mut id, mut path) = (None, String::new());
        tag.attributes(|space, name, value| {
            match (space, name) {
                (Space::None, "id") => id = value.trim_ascii().parse().ok(),
                (Space::None, "path") => value.clone_into(&mut path),
                _ => {}
            }
            Ok(())
        })?;
        let Some(id) = id else { return Ok(()) };
        let image = scene.images.number(path.as_bytes())?;
        let resource = scene.resource_number(self.part, id, tag.at)?;
        scene.define(resource, Kind::Texture, image, tag.at)
    }

    /// Notes which image the coordinates of a group are of.
    fn texture_group(&mut self, scene: &mut Scene, tag: &Tag) -> Result<(), IoError> {
        let mut id: Option<u32> = None;
        tag.attributes(|space, name, value| {
            if (space, name) == (Space::None, "texid") {
                id = value.trim_ascii().parse().ok();
            }
            Ok(())
        })?;
        let image = match id {
            Some(id) => scene.image(self.part, id)?,
            None => None,
        };
        self.texture = match image {
            Some(image) => scene.properties.define("", None, Some(image))?,
            None => NOTHING,
        };
        Ok(())
    }

    fn coordinate(&self, scene: &mut Scene, tag: &Tag) -> Result<(), IoError> {
        let mut uv = [0.0; 2];
        tag.attributes(|space, name, value| {
            let axis = match (space, name) {
                (Space::None, "u") => 0,
                (Space::None, "v") => 1,
                _ => return Ok(()),
            };
            // A coordinate that is none costs the triangle its image's place, never the model.
            uv[axis] = parse_number(value.trim_ascii().as_bytes()).unwrap_or_default() as f32;
            Ok(())
        })?;
        Ok(scene.properties.push(self.texture, Some(uv))?)
    }

    fn composites(&mut self, scene: &mut Scene, tag: &Tag) -> Result<(), IoError> {
        let (mut id, mut indices) = (None, Vec::new());
        tag.attributes(|space, name, value| {
            match (space, name) {
                (Space::None, "matid") => id = Some(parse_id(tag, value)?),
                (Space::None, "matindices") => indices = parse_list(tag, value)?,
                _ => {}
            }
            Ok(())
        })?;
        let id = id.ok_or_else(|| tag.at.unreadable("a matid", "none"))?;
        let Some(group) = self.group(scene, tag, id)? else {
            return Err(tag.at.unreadable("base materials above, to mix", "others, or none"));
        };
        self.ingredients.clear();
        for index in indices {
            let definition = scene.properties.definition(group, index.into())?;
            self.ingredients.push(definition.ok_or_else(|| wild_property(tag, index))?);
        }
        Ok(())
    }

    /// What a mixture has most of; of equals the first.
    fn composite(&mut self, scene: &mut Scene, tag: &Tag) -> Result<(), IoError> {
        let (mut most, mut definition) = (f64::NEG_INFINITY, NOTHING);
        tag.attributes(|space, name, value| {
            if (space, name) == (Space::None, "values") {
                for (&ingredient, word) in
                    self.ingredients.iter().zip(value.split_ascii_whitespace())
                {
                    let share = parse_number(word.as_bytes());
                    let found = || shown(word.as_bytes());
                    let share = share.ok_or_else(|| tag.at.unreadable("a number", &found()))?;
                    if share > most {
                        (most, definition) = (share, ingredient);
                    }
                }
            }
            Ok(())
        })?;
        Ok(scene.properties.push(definition, None)?)
    }

    fn multiproperties(&mut self, scene: &mut Scene, tag: &Tag) -> Result<(), IoError> {
        let mut ids = Vec::new();
        tag.attributes(|space, name, value| {
            if (space, name) == (Space::None, "pids") {
                ids = parse_list(tag, value)?;
            }
            Ok(())
        })?;
        (self.layer, self.texture_layer) = (None, None);
        for (layer, id) in ids.into_iter().enumerate() {
            let resource = scene.resource_number(self.part, id, tag.at)?;
            let group = scene.group_of(resource)?.map(|group| (layer, group));
            match scene.resource(resource)?.kind() {
                Kind::Bare => self.texture_layer = self.texture_layer.or(group),
                _ => self.layer = self.layer.or(group),
            }
        }
        Ok(())
    }

    fn multi(&mut self, scene: &mut Scene, tag: &Tag) -> Result<(), IoError> {
        let mut indices = Vec::new();
        tag.attributes(|space, name, value| {
            if (space, name) == (Space::None, "pindices") {
                indices = parse_list(tag, value)?;
            }
            Ok(())
        })?;
        let definition = match self.layer {
            Some((layer, group)) => {
                // Indices that are left out at the end are 0.
                let index = indices.get(layer).copied().unwrap_or_default();
                let definition = scene.properties.definition(group, index.into())?;
                definition.ok_or_else(|| wild_property(tag, index))?
            }
            None => NOTHING,
        };
        let Some((layer, group)) = self.texture_layer else {
            return Ok(scene.properties.push(definition, None)?);
        };
        let index = indices.get(layer).copied().unwrap_or_default();
        let texture = scene.properties.definition(group, index.into())?;
        let texture = texture.ok_or_else(|| wild_property(tag, index))?;
        let uv = scene.properties.uv(group, index.into())?;
        let definition = scene.properties.with_image(definition, texture)?;
        Ok(scene.properties.push(definition, Some(uv))?)
    }

    /// The group of a resource that has materials; others, or one further down, give none.
    fn group(&self, scene: &mut Scene, tag: &Tag, id: u32) -> Result<Option<Group>, IoError> {
        let resource = scene.resource_number(self.part, id, tag.at)?;
        let resource = scene.resource(resource)?;
        match resource.kind() {
            Kind::Materials => Ok(Some(scene.properties.group(resource.row)?)),
            _ => Ok(None),
        }
    }
}

/// A base material, or a colour that is its own name.
fn base(scene: &mut Scene, tag: &Tag) -> Result<(), IoError> {
    let (mut title, mut colour) = (None, None);
    tag.attributes(|space, name, value| {
        match (space, name) {
            (Space::None, "name") => title = Some(value.to_owned()),
            // A colour that is none costs the material its colour, never the model.
            (Space::None, "displaycolor" | "color") => colour = parse_colour(value),
            _ => {}
        }
        Ok(())
    })?;
    let title = title.or(colour.map(colour_name)).unwrap_or_default();
    let definition = scene.properties.define(&title, colour, None)?;
    Ok(scene.properties.push(definition, None)?)
}

fn wild_property(tag: &Tag, index: u32) -> IoError {
    tag.at.unreadable("the number of a property that is there", &index.to_string())
}

/// Natural numbers between blanks.
fn parse_list(tag: &Tag, value: &str) -> Result<Vec<u32>, IoError> {
    value.split_ascii_whitespace().map(|word| parse_id(tag, word)).collect()
}
