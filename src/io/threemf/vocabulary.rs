//! The words of 3MF: namespaces, elements and where they may stand, extensions that may be
//! required.

/// The relationship of a package to its model.
pub(super) const MODEL_RELATIONSHIP: &str =
    "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
/// The relationship of a model to its images.
pub(super) const TEXTURE_RELATIONSHIP: &str =
    "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dtexture";
/// The namespace of everything in this file that has no other.
pub(super) const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
pub(super) const RELATIONSHIPS: &str =
    "http://schemas.openxmlformats.org/package/2006/relationships";
/// The namespace of colours and textures.
pub(super) const MATERIALS: &str = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02";
const PRODUCTION: &str = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";
const TRIANGLE_SETS: &str = "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07";

/// A namespace, as far as we know it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Space {
    None,
    Core,
    Materials,
    Production,
    Relationships,
    Other,
}

impl Space {
    pub(super) fn of(namespace: &str) -> Self {
        match namespace {
            CORE => Self::Core,
            MATERIALS => Self::Materials,
            PRODUCTION => Self::Production,
            RELATIONSHIPS => Self::Relationships,
            _ => Self::Other,
        }
    }
}

/// Whether a file that requires this extension is understood without more. All others may change
/// what the surface is.
pub(super) fn is_understood(extension: &str) -> bool {
    [CORE, MATERIALS, PRODUCTION, TRIANGLE_SETS].contains(&extension)
}

/// Units that a model may state.
pub(super) const UNIT_NAMES: &str = "micron, millimeter, centimeter, inch, foot or meter";

/// An element that means something to us, or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Element {
    Model,
    Resources,
    BaseMaterials,
    Base,
    ColourGroup,
    Colour,
    Texture,
    TextureGroup,
    TextureCoordinate,
    Composites,
    Composite,
    Multiproperties,
    Multi,
    /// A resource that is none of ours.
    Resource,
    Object,
    Mesh,
    Vertices,
    Vertex,
    Triangles,
    Triangle,
    Components,
    Component,
    Build,
    Item,
    /// What stands in an object and is none of ours.
    Foreign,
    Other,
}

impl Element {
    /// What `name` is inside of `parent`.
    pub(super) fn of(parent: Option<Self>, space: Space, name: &str) -> Self {
        let Some(parent) = parent else {
            let is_model = (space, name) == (Space::Core, "model");
            return if is_model { Self::Model } else { Self::Other };
        };
        match (parent, space, name) {
            (Self::Triangles, Space::Core, "triangle") => Self::Triangle,
            (Self::Vertices, Space::Core, "vertex") => Self::Vertex,
            (Self::Model, Space::Core, "resources") => Self::Resources,
            (Self::Model, Space::Core, "build") => Self::Build,
            (Self::Build, Space::Core, "item") => Self::Item,
            (Self::Resources, Space::Core, "object") => Self::Object,
            (Self::Resources, Space::Core, "basematerials") => Self::BaseMaterials,
            (Self::Resources, Space::Materials, "colorgroup") => Self::ColourGroup,
            (Self::Resources, Space::Materials, "texture2d") => Self::Texture,
            (Self::Resources, Space::Materials, "texture2dgroup") => Self::TextureGroup,
            (Self::Resources, Space::Materials, "compositematerials") => Self::Composites,
            (Self::Resources, Space::Materials, "multiproperties") => Self::Multiproperties,
            (Self::Resources, ..) => Self::Resource,
            (Self::BaseMaterials, Space::Core, "base") => Self::Base,
            // Some writers forget the prefix inside of a group.
            (Self::ColourGroup, _, "color") => Self::Colour,
            (Self::TextureGroup, _, "tex2coord") => Self::TextureCoordinate,
            (Self::Composites, _, "composite") => Self::Composite,
            (Self::Multiproperties, _, "multi") => Self::Multi,
            (Self::Object, Space::Core, "mesh") => Self::Mesh,
            (Self::Object, Space::Core, "components") => Self::Components,
            (Self::Object, Space::Core, "metadatagroup") => Self::Other,
            (Self::Object, ..) => Self::Foreign,
            (Self::Mesh, Space::Core, "vertices") => Self::Vertices,
            (Self::Mesh, Space::Core, "triangles") => Self::Triangles,
            (Self::Components, Space::Core, "component") => Self::Component,
            _ => Self::Other,
        }
    }
}
