//! Shells: sheets whose rims cover each other, and what is known of each.
//!
//! In:         rims and their contacts; the bins, to measure.
//! Out:        [`Shells`].
//! Units:      model units; places are about the middle of the grid.
//! Memory:     some 100 bytes a sheet with a rim, 8 a rim edge, in tables that spill.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::bridge::MendOptions;
use crate::bridge::contacts::{Contact, GLAZED, LYING, ON_FACE};
use crate::bridge::rims::{HELD, RimEdge};
use crate::bridge::samples::samples_of;
use crate::bridge::sheets::Sheets;
use crate::octree::points::is_owned;
use crate::octree::{BinnedSoup, Domain};
use crate::store::{Record, Resources, Sorter, Spool, StoreError, Table, Unite};

/// What is known of a sheet, or of all sheets of a shell. 80 bytes.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Measure {
    /// Sums of area, of area times place, of area times normal, and of area times normal . place,
    /// on the side of the sheet's first triangle.
    pub area: f64,
    pub moment: [f64; 3],
    pub normal: [f64; 3],
    pub volume: f64,
    pub triangles: u64,
    /// A [`Fate`], as a number.
    pub fate: u32,
    /// Of a sheet that becomes a wall: source number of a triangle of its shell.
    pub member: u32,
}

impl Measure {
    fn add_triangle(&mut self, corners: [DVec3; 3], is_turned: bool) {
        let [p, q, r] = corners;
        let cross = (q - p).cross(r - p) * if is_turned { -0.5 } else { 0.5 };
        let (area, middle) = (cross.length(), (p + q + r) / 3.0);
        if !area.is_finite() {
            return;
        }
        self.area += area;
        self.moment = (DVec3::from(self.moment) + middle * area).to_array();
        self.normal = (DVec3::from(self.normal) + cross).to_array();
        self.volume += cross.dot(middle);
        self.triangles += 1;
    }

    fn add(&mut self, other: &Self) {
        self.area += other.area;
        self.moment = (DVec3::from(self.moment) + DVec3::from(other.moment)).to_array();
        self.triangles += other.triangles;
    }

    /// Area times height over `about`, positive where the sheet looks away from it.
    fn height_about(&self, about: DVec3) -> f64 {
        self.volume - DVec3::from(self.normal).dot(about)
    }
}

/// Shares of a rim edge, 0 to 1. 40 bytes.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Cover {
    /// Other rims face it.
    pub faced: f64,
    /// The nearest of them is farther than a cell: a crack that the scan would see.
    pub wide: f64,
    /// It ends on a face.
    pub on_face: f64,
    /// It lies on a face.
    pub lying: f64,
    /// A pane is beside it, and nothing else.
    pub glazed: f64,
}

/// What becomes of a sheet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fate {
    /// It stays as it is.
    #[default]
    Stays,
    /// It becomes a wall on both of its sides.
    Centred,
    /// It becomes a wall behind the side of its first triangle.
    Behind,
    /// It becomes a wall in front of that side.
    Before,
}

impl Fate {
    const ALL: [Self; 4] = [Self::Stays, Self::Centred, Self::Behind, Self::Before];
}

/// A rim edge of a shell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct RimOfShell {
    pub shell: u32,
    pub rim: u32,
}

impl Record for RimOfShell {
    type Key = (u32, u32);
    fn key(&self) -> Self::Key {
        (self.shell, self.rim)
    }
}

/// See the module.
pub struct Shells<'d> {
    pub domain: &'d Domain,
    measures: Table<Measure>,
    covers: Table<Cover>,
    /// By shell.
    rims: Option<Sorter<RimOfShell>>,
    thickness: f64,
}

impl<'d> Shells<'d> {
    /// Joins sheets to shells.
    pub fn new(
        rims: &Spool<RimEdge>,
        contacts: Sorter<Contact>,
        sheets: &mut Sheets,
        options: &MendOptions,
        domain: &'d Domain,
        resources: &Resources,
    ) -> Result<Self, StoreError> {
        let (scratch, share_bytes) = (resources.scratch, resources.share_bytes / 8);
        let mut unite = Unite::new(scratch, share_bytes, sheets.count())?;
        let mut covers = Table::new(scratch, share_bytes);
        let mut contacts = contacts.finish()?;
        let mut next = contacts.next()?;
        let mut reader = rims.reader(0, rims.len());
        while let Some(block) = reader.next_block()? {
            for rim in block {
                let number = covers.len() as u32;
                let all = f64::from(samples_of(rim.length(), domain.cell_size()));
                let mut cover = Cover::default();
                let mut last = None;
                let mut nearest = f32::INFINITY;
                while let Some(contact) = next
                    && contact.rim == number
                {
                    // Of one sample those of rims come first, then the face that it lies on.
                    let is_next = last != Some(contact.index);
                    if is_next {
                        cover.wide += wide_share(nearest, all);
                        nearest = f32::INFINITY;
                    }
                    let share = if is_next { 1.0 / all } else { 0.0 };
                    last = Some(contact.index);
                    match contact.sheet {
                        ON_FACE => cover.on_face += share,
                        LYING => cover.lying += share,
                        GLAZED => cover.glazed += share,
                        sheet => {
                            cover.faced += share;
                            nearest = nearest.min(contact.apart);
                            unite.unite(rim.sheet, sheet)?;
                        }
                    }
                    next = contacts.next()?;
                }
                cover.wide += wide_share(nearest, all);
                if rim.flags & HELD != 0 {
                    cover.on_face = 1.0;
                }
                covers.push(cover)?;
            }
        }
        let mut labels = unite.finish()?;
        let mut by_shell = Sorter::new(scratch, share_bytes);
        let mut number = 0;
        let mut reader = rims.reader(0, rims.len());
        while let Some(block) = reader.next_block()? {
            for rim in block {
                let shell = labels.label(rim.sheet)?;
                by_shell.push(RimOfShell { shell, rim: number })?;
                number += 1;
            }
        }
        let mut measures = Table::new(scratch, share_bytes);
        for _ in 0..sheets.count() {
            measures.push(Measure::default())?;
        }
        let (rims, thickness) = (Some(by_shell), options.thickness);
        Ok(Self { domain, measures, covers, rims, thickness })
    }

    /// Measures the sheets.
    pub fn measure(&mut self, soup: &BinnedSoup, sheets: &mut Sheets) -> Result<(), StoreError> {
        let mut walk = soup.walk();
        while let Some(bin) = walk.next_bin()? {
            bin.each(soup, |triangle| {
                if !is_owned(triangle, self.domain, bin.brick.0) {
                    return Ok(());
                }
                let Some((sheet, side)) = sheets.find(triangle.source)? else { return Ok(()) };
                let mut measure = self.measures.get(sheet.into())?;
                let corners = triangle.corners.map(|c| DVec3::from(c) - self.middle());
                measure.add_triangle(corners, side.is_turned);
                self.measures.set(sheet.into(), measure)
            })?;
        }
        Ok(())
    }

    /// The middle of the grid.
    fn middle(&self) -> DVec3 {
        let half = self.domain.brick_units() * i64::from(self.domain.bricks_per_side()) / 2;
        DVec3::from(self.domain.to_model([half; 3]))
    }

    /// The rim edges of all shells, by shell; once.
    pub fn take_rims(&mut self) -> Option<Sorter<RimOfShell>> {
        self.rims.take()
    }

    /// What covers a rim edge.
    pub fn cover(&mut self, rim: u32) -> Result<Cover, StoreError> {
        self.covers.get(rim.into())
    }

    /// The measures of the sheets with these numbers, together.
    pub fn together(&mut self, sheets: &[u32]) -> Result<Measure, StoreError> {
        let mut sum = Measure::default();
        for &sheet in sheets {
            sum.add(&self.measures.get(sheet.into())?);
        }
        Ok(sum)
    }

    /// Makes walls of the sheets of a shell: behind the side that looks out where the shell holds a
    /// volume and stands free, else on both sides. `member` is one of the shell's triangles.
    pub fn wall(&mut self, sheets: &[u32], is_free: bool, member: u32) -> Result<(), StoreError> {
        let shell = self.together(sheets)?;
        let about = DVec3::from(shell.moment) / shell.area;
        let mut height = 0.0;
        for &sheet in sheets {
            height += self.measures.get(sheet.into())?.height_about(about).abs();
        }
        // Thinner than two walls, it holds none.
        let is_hollow = is_free && height > 2.0 * self.thickness * shell.area;
        for &sheet in sheets {
            let mut measure = self.measures.get(sheet.into())?;
            let fate = match measure.height_about(about) {
                _ if !is_hollow => Fate::Centred,
                height if height > 0.0 => Fate::Behind,
                _ => Fate::Before,
            };
            (measure.fate, measure.member) = (fate as u32, member);
            self.measures.set(sheet.into(), measure)?;
        }
        Ok(())
    }

    /// A triangle of the shell of a sheet that becomes a wall.
    pub fn member(&mut self, sheet: u32) -> Result<u32, StoreError> {
        Ok(self.measures.get(sheet.into())?.member)
    }

    /// What becomes of a sheet.
    pub fn fate(&mut self, sheet: u32) -> Result<Fate, StoreError> {
        Ok(Fate::ALL[self.measures.get(sheet.into())?.fate as usize])
    }
}

/// Samples farther apart than this belong to a crack wider than a cell: they are up to a cell apart
/// along it.
const WIDE_CELLS: f32 = 1.25;

/// The share of one sample, if the nearest rim that faces it is across a wide crack.
fn wide_share(nearest: f32, samples: f64) -> f64 {
    if nearest > WIDE_CELLS && nearest.is_finite() { 1.0 / samples } else { 0.0 }
}
