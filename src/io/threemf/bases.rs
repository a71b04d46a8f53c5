//! Base materials of a written model: names and colours, one more for the patches of each.
//!
//! Memory: one material.

use crate::io::error::IoError;
use crate::io::palette::Palette;
use crate::io::threemf::zip_file::ZipFile;
use crate::mesh::{Material, Surface};

/// How surfaces are numbered among the base materials.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bases {
    pub(super) count: u64,
    /// Whether each material is followed by one for its patches.
    has_patches: bool,
}

impl Bases {
    /// Writes all materials of the palette.
    pub(super) fn write(
        zip: &mut ZipFile,
        palette: &Palette,
        has_patches: bool,
    ) -> Result<Self, IoError> {
        let (mut count, mut text) = (0, Vec::new());
        palette.for_each(|_, material| {
            if count == 0 {
                zip.write(b"<basematerials id=\"1\">\n")?;
            }
            for ending in ["", Surface::PATCH_ENDING].into_iter().take(1 + usize::from(has_patches))
            {
                text.clear();
                push_base(&mut text, &material, ending);
                zip.write(&text)?;
                count += 1;
            }
            Ok(())
        })?;
        if count > 0 {
            zip.write(b"</basematerials>\n")?;
        }
        Ok(Self { count, has_patches })
    }

    /// The base material of a surface, if there is one.
    pub(super) fn index(&self, surface: Surface) -> Option<u64> {
        let material = u64::from(surface.material());
        let index =
            if self.has_patches { 2 * material + u64::from(surface.is_patch()) } else { material };
        (index < self.count).then_some(index)
    }
}

fn push_base(text: &mut Vec<u8>, material: &Material, ending: &str) {
    text.extend_from_slice(b"<base name=\"");
    push_escaped(text, &material.name);
    text.extend_from_slice(ending.as_bytes());
    let [r, g, b, alpha] = material.rgba();
    // Readers take no alpha for an alpha of 0, and light passes or it does not.
    let alpha = if material.transparent { alpha.clamp(1, 254) } else { 255 };
    let colour = format!("\" displaycolor=\"#{r:02X}{g:02X}{b:02X}{alpha:02X}\"/>\n");
    text.extend_from_slice(colour.as_bytes());
}

/// Appends a name as the value of an attribute; what XML cannot say is replaced.
pub(super) fn push_escaped(text: &mut Vec<u8>, name: &str) {
    for c in name.chars() {
        match c {
            '&' => text.extend_from_slice(b"&amp;"),
            '<' => text.extend_from_slice(b"&lt;"),
            '>' => text.extend_from_slice(b"&gt;"),
            '"' => text.extend_from_slice(b"&quot;"),
            // Numbers of characters are XML too, but not to every reader of 3MF.
            '\t' | '\n' | '\r' => text.push(b' '),
            '\0'..' ' | '\u{fffe}' | '\u{ffff}' => text.extend_from_slice("\u{fffd}".as_bytes()),
            c => text.extend_from_slice(c.encode_utf8(&mut [0; 4]).as_bytes()),
        }
    }
}
