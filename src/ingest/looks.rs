//! Looks: sets of triangles over which texture coordinates and colours run on without a seam.
//!
//! Two triangles of one material have one look where they share an edge, and at both of its ends
//! texture coordinates and nearly the colours. Where the image is folded along the edge, so that
//! both lie on one side of it there, they have two. So they have on both sides of a seam, also where
//! one can walk around it, as around a tube (`charts.rs`). A look stands in the place of the material
//! wherever triangles are told apart, so seams stay where they were as borders of materials do.
//!
//! Materials that show no image are one look each, so that texture coordinates without a use part
//! nothing; if no material shows any, the image may be known elsewhere, and all are looked at.
//! Colours part looks where they jump, not where they differ.
//!
//! In:         the finite triangles with their attributes, and the materials.
//! Out:        by triangle its look, by look its material.
//! Invariant:  looks are numbered in the order in which triangles use them, whatever the share.
//! Memory:     the share; 40 bytes for each triangle of one material on one edge.

use bytemuck::{Pod, Zeroable};

use crate::geom::mix;
use crate::ingest::charts::Charts;
use crate::io::{IoError, Palette};
use crate::octree::{AttributeRecord, CLOSES, SoupSpool, SoupTriangle, TRANSPARENT};
use crate::store::{
    Labels, Record, Resources, Sorter, Spool, SpoolPeek, SpoolWriter, StoreError, Table,
};

/// Spool of the looks of triangles, in the order of the soup; empty where there are none.
pub const LOOKS: &str = "looks.spool";
/// Spool of the materials of looks.
pub const LOOK_MATERIALS: &str = "looks.materials";

/// Colours of one corner that differ by more in a channel are told apart, of 255.
const COLOUR_JUMP: u8 = 48;
/// A number of a look has to leave room for two bits.
const MOST_LOOKS: u64 = CLOSES as u64;

/// What parts texture coordinates and colours.
pub struct Looks {
    /// The look of every finite triangle, in file order.
    pub of_triangles: Spool<u32>,
    /// The material of every look.
    pub materials: Spool<u32>,
}

impl Looks {
    /// Whether the materials of triangles stay.
    pub(super) fn is_none(&self) -> bool {
        self.of_triangles.is_empty()
    }

    /// Gives triangles, which are those of the soup from `first` on, their looks in place of their
    /// materials; `looks` is room for them.
    pub(super) fn put_on(
        &self,
        first: u64,
        triangles: &mut [SoupTriangle],
        looks: &mut Vec<u32>,
    ) -> Result<(), StoreError> {
        self.of_triangles.read(first, triangles.len(), looks)?;
        for (triangle, look) in triangles.iter_mut().zip(looks) {
            triangle.material = *look | triangle.material & TRANSPARENT;
        }
        Ok(())
    }
}

/// One side of a triangle, as the sort sees it. 88 bytes.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Side {
    /// Positions of its ends, exactly; the smaller one first.
    ends: [[u64; 3]; 2],
    /// Texture coordinates at both.
    uvs: [[u32; 2]; 2],
    material: u32,
    /// On which side of it the triangle lies in the image: 0 none, 1 left, 2 right.
    facing: u32,
    colours: [[u8; 4]; 2],
    /// Number in the soup.
    triangle: u32,
    /// A hash of the third corner: copies of a triangle have the same.
    third: u32,
}

impl Record for Side {
    type Key = ([[u64; 3]; 2], u32, [[u32; 2]; 2], u32, u32);
    fn key(&self) -> Self::Key {
        (self.ends, self.material, self.uvs, self.facing, self.triangle)
    }
}

/// No looks, as files: where neither texture coordinates nor colours are wanted, or there are none.
pub(super) fn no_looks(resources: &Resources) -> Result<Looks, StoreError> {
    Ok(Looks {
        of_triangles: SpoolWriter::create(resources.scratch, LOOKS)?.finish()?,
        materials: SpoolWriter::create(resources.scratch, LOOK_MATERIALS)?.finish()?,
    })
}

/// Finds the looks of a soup with these materials.
pub(super) fn find_looks(
    palette: &Palette,
    (soup, attributes): (&SoupSpool, &Spool<AttributeRecord>),
    resources: &Resources,
) -> Result<Looks, IoError> {
    let mut is_mapped = mapped_materials(palette, resources)?;
    let share_bytes = resources.share_bytes / 4;
    let mut sides = Sorter::<Side>::new(resources.scratch, 2 * share_bytes);
    each_triangle(soup, attributes, resources, |number, triangle, record| {
        if is_mapped.get(material_of(triangle).into())? == 0 {
            return Ok(());
        }
        (0..3).try_for_each(|corner| sides.push(side(number, triangle, record, corner)))
    })?;
    let mut charts = Charts::new(soup.len(), resources)?;
    each_pair(sides, resources, |(pair, goes_on)| charts.add(pair, goes_on))?;
    Ok(number_looks(soup, charts.finish()?, &mut is_mapped, resources)?)
}

/// Which materials show an image, or all if none does.
fn mapped_materials(palette: &Palette, resources: &Resources) -> Result<Table<u8>, IoError> {
    let mut is_mapped = Table::new(resources.scratch, resources.share_bytes / 16);
    let mut any = false;
    palette.for_each(|_, material| {
        let shows = material.is_mapped();
        any |= shows;
        Ok(is_mapped.push(u8::from(shows))?)
    })?;
    for number in 0..is_mapped.len() {
        if !any {
            is_mapped.set(number, 1)?;
        }
    }
    Ok(is_mapped)
}

fn material_of(triangle: &SoupTriangle) -> u32 {
    triangle.material & !TRANSPARENT
}

/// Visits the finite triangles with their numbers in the soup and their attributes.
fn each_triangle(
    soup: &SoupSpool,
    attributes: &Spool<AttributeRecord>,
    resources: &Resources,
    mut visit: impl FnMut(u32, &SoupTriangle, &AttributeRecord) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let mut reader = soup.reader(0, soup.len());
    let mut records = SpoolPeek::new(attributes);
    let mut number = 0;
    while let Some(triangles) = reader.next_block()? {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        for triangle in triangles {
            // Triangles that were dropped have attributes all the same.
            records.pass_to(triangle.source.into());
            let record = records.peek()?.expect("every triangle has attributes");
            visit(number, triangle, &record)?;
            number += 1;
        }
    }
    Ok(())
}

/// The side from a corner to the next.
fn side(number: u32, triangle: &SoupTriangle, record: &AttributeRecord, corner: usize) -> Side {
    // -0 and 0 are one place.
    let place = |i: usize| triangle.corners[i].map(|x| (x + 0.0).to_bits());
    let (from, to, third) = (corner, (corner + 1) % 3, (corner + 2) % 3);
    let rank = |i: usize| (place(i), record.uvs[i].map(f32::to_bits), record.colours[i]);
    let [from, to] = if rank(from) <= rank(to) { [from, to] } else { [to, from] };
    let [a, b, c] = [from, to, third].map(|i| record.uvs[i].map(f64::from));
    let turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    Side {
        ends: [from, to].map(place),
        uvs: [from, to].map(|i| record.uvs[i].map(f32::to_bits)),
        material: material_of(triangle),
        facing: if turn > 0.0 { 1 } else { 2 * u32::from(turn < 0.0) },
        colours: [from, to].map(|i| record.colours[i]),
        triangle: number,
        third: place(third).into_iter().fold(0, |hash, bits| mix(hash ^ bits)) as u32,
    }
}

/// A triangle at an edge.
#[derive(Clone, Copy)]
struct Use {
    triangle: u32,
    third: u32,
    facing: u32,
    uvs: [[u32; 2]; 2],
    colours: [[u8; 4]; 2],
}

/// Visits pairs of triangles at all edges: those that go on into each other, and those that a seam
/// parts.
fn each_pair(
    sides: Sorter<Side>,
    resources: &Resources,
    mut visit: impl FnMut(Pair) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let mut sorted = sides.finish()?;
    let mut next = sorted.next()?;
    let edge_of = |side: &Side| (side.ends, side.material);
    // By mapping, and among these by facing.
    let mut uses: Vec<Use> = Vec::new();
    while let Some(first) = next {
        if resources.monitor.cancelled() {
            return Err(StoreError::Cancelled);
        }
        uses.clear();
        while let Some(side) = next.filter(|side| edge_of(side) == edge_of(&first)) {
            let Side { triangle, third, facing, uvs, colours, .. } = side;
            uses.push(Use { triangle, third, facing, uvs, colours });
            next = sorted.next()?;
        }
        let mut before: Option<&[Use]> = None;
        for mapping in uses.chunk_by(|one, other| one.uvs == other.uvs) {
            pairs_of_mapping(mapping, &mut visit)?;
            if let Some(before) = before {
                part(before, mapping, &mut visit)?;
                part(mapping, before, &mut visit)?;
            }
            before = Some(mapping);
        }
    }
    Ok(())
}

/// Pairs of triangles that have the same texture coordinates at an edge, in the order of their
/// facing.
fn pairs_of_mapping(
    mapping: &[Use],
    visit: &mut impl FnMut(Pair) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let (flat, turned) = mapping.split_at(mapping.partition_point(|one| one.facing == 0));
    let (left, right) = turned.split_at(turned.partition_point(|one| one.facing == 1));
    for (some, others) in [(left, right), (right, left), (flat, left), (flat, right), (flat, flat)]
    {
        pair_up(some, others, visit)?;
    }
    // Folded along the edge.
    [left, right].into_iter().try_for_each(|alike| part(&alike[alike.len().min(1)..], alike, visit))
}

/// Two triangles at an edge, and whether they go on into each other there.
type Pair = ([u32; 2], bool);

/// Pairs each of `some` with the first of `others`: across a seam where the colours jump.
fn pair_up(
    some: &[Use],
    others: &[Use],
    visit: &mut impl FnMut(Pair) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let Some(other) = others.first() else { return Ok(()) };
    for one in some.iter().filter(|one| one.triangle != other.triangle) {
        let (own, colours) = (one.colours.as_flattened(), other.colours.as_flattened());
        let goes_on = own.iter().zip(colours).all(|(a, b)| a.abs_diff(*b) <= COLOUR_JUMP);
        visit(([one.triangle, other.triangle], goes_on))?;
    }
    Ok(())
}

/// Parts each of `some` from the first of `others`, unless it is a copy of it.
fn part(
    some: &[Use],
    others: &[Use],
    visit: &mut impl FnMut(Pair) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let Some(other) = others.first() else { return Ok(()) };
    let some = some.iter().filter(|one| one.third != other.third);
    some.into_iter().try_for_each(|one| visit(([one.triangle, other.triangle], false)))
}

/// Numbers the sets of triangles.
fn number_looks(
    soup: &SoupSpool,
    mut labels: Labels,
    is_mapped: &mut Table<u8>,
    resources: &Resources,
) -> Result<Looks, StoreError> {
    let share_bytes = resources.share_bytes / 4;
    let mut of_triangles = SpoolWriter::create(resources.scratch, LOOKS)?;
    let mut materials = SpoolWriter::<u32>::create(resources.scratch, LOOK_MATERIALS)?;
    // By first triangle, and by material.
    let mut of_sets = Table::<u32>::new(resources.scratch, share_bytes);
    let mut of_materials = Table::<u32>::new(resources.scratch, share_bytes / 4);
    for _ in 0..is_mapped.len() {
        of_materials.push(u32::MAX)?;
    }
    let mut reader = soup.reader(0, soup.len());
    while let Some(triangles) = reader.next_block()? {
        for triangle in triangles {
            let (number, material) = (of_sets.len() as u32, material_of(triangle));
            let first = labels.label(number)?;
            let known = if is_mapped.get(material.into())? == 0 {
                of_materials.get(material.into())?
            } else if first < number {
                of_sets.get(first.into())?
            } else {
                u32::MAX
            };
            let look = if known == u32::MAX { materials.len() as u32 } else { known };
            if known == u32::MAX {
                if materials.len() >= MOST_LOOKS {
                    return Err(StoreError::TooMany { what: "Looks", limit: MOST_LOOKS });
                }
                materials.push(material)?;
                of_materials.set(material.into(), look)?;
            }
            of_sets.push(look)?;
            of_triangles.push(look)?;
        }
    }
    Ok(Looks { of_triangles: of_triangles.finish()?, materials: materials.finish()? })
}
