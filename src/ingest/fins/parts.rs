//! The sheets of a soup: how large and flat each is, and how it is held; which of them go.
//!
//! Memory:  8 bytes a triangle and 80 a sheet that has a border, in tables that spill.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::ingest::fins::{FinStats, SheetRule};
use crate::octree::points::{is_owned, length_of, unpack_ends};
use crate::octree::{BorderUse, Domain, MOST_USES, SoupTriangle, each_border};
use crate::store::{Labels, Resources, Scratch, Sorter, Spool, SpoolWriter, StoreError, Table};

/// Share of the squared area that the squared moments of the normals make up in a flat sheet: all
/// of it in a plane, half in the walls of a box or a tube.
const FLAT_SHARE: f64 = 2.0 / 3.0;

/// A sheet with more of the soup's area is a part of its own, however it is held.
const MOST_AREA_SHARE: f64 = 0.1;

/// A sheet of more triangles was made on purpose, as the end of a roll of paper is.
const MOST_TRIANGLES: u32 = 64;

/// Spool of the borders of sheets.
const BORDERS: &str = "borders.spool";

/// What is known of a sheet that has a border.
#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
struct Sheet {
    area: f64,
    /// Sums of area times products of the unit normal: xx, xy, xz, yy, yz, zz.
    moments: [f64; 6],
    /// Length of the border that is open, and of the one by which the sheet is held.
    open: f64,
    held: f64,
    triangles: u32,
    state: u32,
}

/// No sheet that could go: it meets an edge of three or more twice.
const STAYS: u32 = 1;
/// It goes unless that opens something.
const MAY_GO: u32 = 2;

impl Sheet {
    fn is_flat(&self) -> bool {
        let [xx, xy, xz, yy, yz, zz] = self.moments;
        let squares = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz);
        squares >= FLAT_SHARE * self.area * self.area
    }

    /// Whether its borders allow that it goes.
    fn may_be_taken_out(&self, rule: SheetRule) -> bool {
        let hangs = 0.0 < self.held && self.held < self.open;
        let is_free = self.held == 0.0 && self.open > 0.0;
        self.state & STAYS == 0 && (hangs || is_free && rule == SheetRule::Remove)
    }

    /// Whether it goes unless that opens something.
    fn may_go(&self, rule: SheetRule, total_area: f64) -> bool {
        let is_small =
            self.area <= MOST_AREA_SHARE * total_area && self.triangles <= MOST_TRIANGLES;
        self.may_be_taken_out(rule) && self.is_flat() && (is_small || self.held == 0.0)
    }
}

/// See the module.
pub struct Parts {
    labels: Labels,
    /// Of each label one more than the number of its sheet; 0 if that has no border.
    numbers: Table<u32>,
    sheets: Table<Sheet>,
    unit: f64,
    /// By edge.
    borders: Option<Spool<BorderUse>>,
    scratch: Scratch,
}

impl Parts {
    /// Sheets whose triangles have these labels.
    pub fn new(labels: Labels, unit: f64, resources: &Resources) -> Result<Self, StoreError> {
        let (scratch, share_bytes) = (resources.scratch, resources.share_bytes / 8);
        let mut numbers = Table::new(scratch, share_bytes);
        for _ in 0..labels.len() {
            numbers.push(0)?;
        }
        let sheets = Table::new(scratch, share_bytes);
        Ok(Self { labels, numbers, sheets, unit, borders: None, scratch: scratch.clone() })
    }

    /// Removes its files that have names.
    pub fn end(&mut self) -> Result<(), StoreError> {
        self.borders = None;
        self.scratch.remove(BORDERS)
    }

    /// Takes in where sheets are open, and where they are held.
    pub fn take_borders(&mut self, borders: Sorter<BorderUse>) -> Result<(), StoreError> {
        let mut spool = SpoolWriter::create(&self.scratch, BORDERS)?;
        let mut sorted = borders.finish()?;
        while let Some(border) = sorted.next()? {
            spool.push(border)?;
        }
        let spool = spool.finish()?;
        each_border(&spool, |uses| self.take_edge(uses))?;
        self.borders = Some(spool);
        Ok(())
    }

    /// The sheet of a triangle; `None` if it has no border.
    fn sheet_of(&mut self, source: u32) -> Result<Option<u64>, StoreError> {
        let label = self.labels.label(source)?;
        Ok(self.numbers.get(u64::from(label))?.checked_sub(1).map(u64::from))
    }

    /// The sheet of a triangle on a border, which is entered when it is met first.
    fn enter(&mut self, source: u32) -> Result<u64, StoreError> {
        let label = u64::from(self.labels.label(source)?);
        if let Some(known) = self.numbers.get(label)?.checked_sub(1) {
            return Ok(u64::from(known));
        }
        self.sheets.push(Sheet::default())?;
        let number = self.sheets.len();
        self.numbers.set(label, number as u32)?;
        Ok(number - 1)
    }

    fn take_edge(&mut self, uses: &[BorderUse]) -> Result<(), StoreError> {
        let length = length_of(unpack_ends(uses[0].ends), self.unit);
        let sheets = self.sheets_of(uses)?;
        // Nothing that hangs on an edge of so many triangles is told apart.
        let is_crowded = uses.len() == MOST_USES;
        for (i, &number) in sheets.iter().enumerate() {
            let mut sheet = self.sheets.get(number)?;
            let is_twice = sheets.get(i + 1) == Some(&number) || i > 0 && sheets[i - 1] == number;
            if uses.len() == 1 {
                sheet.open += length;
            } else if is_crowded || is_twice {
                sheet.state |= STAYS;
            } else {
                sheet.held += length;
            }
            self.sheets.set(number, sheet)?;
        }
        Ok(())
    }

    /// The sheet of every use, sorted.
    fn sheets_of(&mut self, uses: &[BorderUse]) -> Result<Vec<u64>, StoreError> {
        let mut sheets = Vec::with_capacity(uses.len());
        for border in uses {
            sheets.push(self.enter(border.source)?);
        }
        sheets.sort_unstable();
        Ok(sheets)
    }

    /// Whether the borders leave room for a sheet to go.
    pub fn may_have_fins(&mut self, rule: SheetRule) -> Result<bool, StoreError> {
        for number in 0..self.sheets.len() {
            let sheet = self.sheets.get(number)?;
            if sheet.may_be_taken_out(rule) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Adds a triangle to its sheet, in the brick that owns its lowest corner.
    pub fn add_area(
        &mut self,
        triangle: &SoupTriangle,
        domain: &Domain,
        brick: u64,
    ) -> Result<(), StoreError> {
        if !is_owned(triangle, domain, brick) {
            return Ok(());
        }
        let Some(number) = self.sheet_of(triangle.source)? else { return Ok(()) };
        let mut sheet = self.sheets.get(number)?;
        let [p, q, r] = triangle.corners.map(DVec3::from);
        let cross = (q - p).cross(r - p);
        let area = 0.5 * cross.length();
        if area > 0.0 && area.is_finite() {
            let n = cross.normalize();
            let products = [n.x * n.x, n.x * n.y, n.x * n.z, n.y * n.y, n.y * n.z, n.z * n.z];
            for (sum, product) in sheet.moments.iter_mut().zip(products) {
                *sum += area * product;
            }
            sheet.area += area;
        }
        sheet.triangles += 1;
        self.sheets.set(number, sheet)
    }

    /// Decides which sheets go; nothing else may open by it.
    pub fn decide(&mut self, rule: SheetRule, total_area: f64) -> Result<FinStats, StoreError> {
        for number in 0..self.sheets.len() {
            let mut sheet = self.sheets.get(number)?;
            if sheet.may_go(rule, total_area) {
                sheet.state |= MAY_GO;
                self.sheets.set(number, sheet)?;
            }
        }
        while self.keep_what_would_open()? {}
        let mut stats = FinStats::default();
        for number in 0..self.sheets.len() {
            let sheet = self.sheets.get(number)?;
            if sheet.state & MAY_GO != 0 {
                stats.fins += u64::from(sheet.held > 0.0);
                stats.free_sheets += u64::from(sheet.held == 0.0);
                stats.triangles += u64::from(sheet.triangles);
                stats.area += sheet.area;
            }
        }
        Ok(stats)
    }

    /// Keeps the sheets on edges that would be left open or empty; whether there were any.
    fn keep_what_would_open(&mut self) -> Result<bool, StoreError> {
        let Some(borders) = self.borders.take() else { return Ok(false) };
        let mut has_kept = false;
        each_border(&borders, |uses| {
            has_kept |= self.keep_on(uses)?;
            Ok(())
        })?;
        self.borders = Some(borders);
        Ok(has_kept)
    }

    fn keep_on(&mut self, uses: &[BorderUse]) -> Result<bool, StoreError> {
        if uses.len() < 3 {
            return Ok(false);
        }
        let mut going = Vec::new();
        for number in self.sheets_of(uses)? {
            if self.sheets.get(number)?.state & MAY_GO != 0 {
                going.push(number);
            }
        }
        let left = uses.len() - going.len();
        if going.is_empty() || left > 0 && left.is_multiple_of(2) {
            return Ok(false);
        }
        for number in going {
            let mut sheet = self.sheets.get(number)?;
            sheet.state &= !MAY_GO;
            self.sheets.set(number, sheet)?;
        }
        Ok(true)
    }

    /// Whether a triangle's sheet goes.
    pub fn goes(&mut self, source: u32) -> Result<bool, StoreError> {
        let Some(number) = self.sheet_of(source)? else { return Ok(false) };
        Ok(self.sheets.get(number)?.state & MAY_GO != 0)
    }
}
