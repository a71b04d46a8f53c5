//! Numbers of an accessor by index, once it was checked to lie in its buffers.

use crate::io::error::IoError;
use crate::io::gltf::buffers::Buffers;
use crate::io::gltf::model::{AccessorRecord, Model, NONE};

/// A number type, by its code in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    pub(crate) fn of_code(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    pub(crate) fn size_bytes(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The largest value, which stands for 1 where numbers are normalised.
    pub(crate) fn most(self) -> f64 {
        match self {
            Self::I8 => f64::from(i8::MAX),
            Self::U8 => f64::from(u8::MAX),
            Self::I16 => f64::from(i16::MAX),
            Self::U16 => f64::from(u16::MAX),
            Self::U32 => f64::from(u32::MAX),
            Self::F32 => 1.0,
        }
    }

    #[inline]
    fn decode(self, bytes: &[u8; 4]) -> f64 {
        let [a, b, ..] = *bytes;
        match self {
            Self::I8 => f64::from(a.cast_signed()),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::U32 => f64::from(u32::from_le_bytes(*bytes)),
            Self::F32 => f64::from(f32::from_le_bytes(*bytes)),
        }
    }
}

/// Where elements of a fixed size lie.
#[derive(Clone, Copy, Debug)]
struct Array {
    buffer: u32,
    start: u64,
    stride: u64,
    component: Component,
    lanes: u32,
}

/// Elements that stand in for others.
#[derive(Clone, Copy, Debug)]
struct Replaced {
    count: u64,
    indices: Array,
    values: Array,
}

/// An accessor whose elements can be read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Field {
    pub(crate) count: u64,
    /// Without it, all is zero.
    array: Option<Array>,
    replaced: Option<Replaced>,
    component: Component,
    /// What a whole number stands for.
    unit: Option<f64>,
}

/// What a field is read for: which accessors do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Demand {
    pub(crate) what: &'static str,
    pub(crate) lanes: [u32; 2],
    pub(crate) is_index: bool,
    /// Whether whole numbers stand for parts of one, also where the file does not say so.
    pub(crate) is_part: bool,
}

impl Field {
    /// An array of floats or indices in a buffer of our own.
    pub(crate) fn decoded(buffer: u32, start: u64, count: u64, lanes: u32, is_index: bool) -> Self {
        let component = if is_index { Component::U32 } else { Component::F32 };
        let array = Array { buffer, start, stride: 4 * u64::from(lanes), component, lanes };
        Self { count, array: Some(array), replaced: None, component, unit: None }
    }

    /// The accessor of a number in the file, checked from end to end.
    pub(crate) fn open(
        model: &mut Model,
        buffers: &mut Buffers,
        number: u32,
        demand: &Demand,
    ) -> Result<Self, IoError> {
        let record = model.accessor(number)?;
        let component = component_of(model, number, &record, demand)?;
        let lanes = record.lanes;
        let array = match record.view {
            NONE => None,
            view => {
                let array = Stretch { view, offset: record.offset, count: record.count };
                Some(array.locate(model, buffers, (number, component, lanes, true))?)
            }
        };
        let replaced = match record.sparse_count {
            0 => None,
            _ => Some(open_replaced(model, buffers, number, &record, component)?),
        };
        let is_part = record.is_normalized != 0 || demand.is_part;
        let unit = (is_part && component != Component::F32).then(|| component.most());
        Ok(Self { count: record.count, array, replaced, component, unit })
    }

    /// Bytes of all elements, without what lies between them.
    pub(crate) fn size_bytes(&self) -> u64 {
        let lanes = self.array.map_or(0, |array| u64::from(array.lanes));
        self.count.saturating_mul(self.component.size_bytes() * lanes)
    }

    /// The element at `index`, which is below the count; lanes that it has not are zero.
    #[inline]
    pub(crate) fn get(
        &self,
        model: &mut Model,
        buffers: &mut Buffers,
        index: u64,
    ) -> Result<[f64; 4], IoError> {
        let mut lanes = [0.0; 4];
        let place = match &self.replaced {
            None => None,
            Some(replaced) => replaced.find(model, buffers, index)?,
        };
        match (place, &self.replaced, &self.array) {
            (Some(place), Some(replaced), _) => {
                replaced.values.get(model, buffers, place, &mut lanes)?;
            }
            (_, _, Some(array)) => array.get(model, buffers, index, &mut lanes)?,
            _ => {}
        }
        if let Some(unit) = self.unit {
            lanes = lanes.map(|lane| (lane / unit).max(-1.0));
        }
        Ok(lanes)
    }
}

/// The number type of an accessor, if it can be what it is used for.
fn component_of(
    model: &Model,
    number: u32,
    record: &AccessorRecord,
    demand: &Demand,
) -> Result<Component, IoError> {
    let component = Component::of_code(record.component).filter(|&component| {
        let is_unsigned = matches!(component, Component::U8 | Component::U16 | Component::U32);
        if demand.is_index { is_unsigned } else { component != Component::U32 }
    });
    match component {
        Some(component) if demand.lanes.contains(&record.lanes) => Ok(component),
        _ => {
            let AccessorRecord { component, lanes, .. } = *record;
            let found = format!("{lanes} of component type {component} in an element");
            Err(model.wrong(("accessor", number), demand.what, found))
        }
    }
}

/// A part of a view, before it is known to be there.
struct Stretch {
    view: u32,
    offset: u64,
    count: u64,
}

impl Stretch {
    /// Finds the elements, and checks that all of them are in the view and the view is in its
    /// buffer.
    fn locate(
        &self,
        model: &mut Model,
        buffers: &mut Buffers,
        (number, component, lanes, strides): (u32, Component, u32, bool),
    ) -> Result<Array, IoError> {
        let view = model.view(self.view)?;
        let buffer = buffers.locate(model, view.buffer)?;
        let element = component.size_bytes() * u64::from(lanes);
        let stride = if view.stride == 0 || !strides { element } else { view.stride };
        let view_end = view.offset.checked_add(view.length);
        if view_end.is_none_or(|end| end > buffer.length) {
            let expected = format!("a part of a buffer of {} bytes", buffer.length);
            let found = format!("{} bytes from byte {}", view.length, view.offset);
            return Err(model.wrong(("buffer view", self.view), expected, found));
        }
        let end = match self.count {
            0 => Some(0),
            count => (count - 1)
                .checked_mul(stride)
                .and_then(|bytes| bytes.checked_add(self.offset))
                .and_then(|bytes| bytes.checked_add(element)),
        };
        if end.is_none_or(|end| end > view.length) {
            let expected = format!("elements in a view of {} bytes", view.length);
            let (count, offset) = (self.count, self.offset);
            let found = format!("{count}, each {stride} bytes behind the last, from byte {offset}");
            return Err(model.wrong(("accessor", number), expected, found));
        }
        // An empty one may start anywhere, and is never read.
        let start = view.offset.saturating_add(self.offset);
        Ok(Array { buffer: view.buffer, start, stride, component, lanes })
    }
}

impl Array {
    #[inline]
    fn get(
        &self,
        model: &mut Model,
        buffers: &mut Buffers,
        index: u64,
        lanes: &mut [f64; 4],
    ) -> Result<(), IoError> {
        let mut bytes = [0; 16];
        let size = self.component.size_bytes() as usize;
        let bytes = &mut bytes[..size * self.lanes as usize];
        buffers.read(model, self.buffer, self.start + index * self.stride, bytes)?;
        for (lane, bytes) in lanes.iter_mut().zip(bytes.chunks_exact(size)) {
            let mut whole = [0; 4];
            whole[..size].copy_from_slice(bytes);
            *lane = self.component.decode(&whole);
        }
        Ok(())
    }
}

/// Finds what replaces elements, and checks that its indices ascend and are in range.
fn open_replaced(
    model: &mut Model,
    buffers: &mut Buffers,
    number: u32,
    record: &AccessorRecord,
    component: Component,
) -> Result<Replaced, IoError> {
    let indices = Component::of_code(record.sparse_indices_component)
        .filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32));
    let Some(index) = indices else {
        let found = format!("component type {}", record.sparse_indices_component);
        return Err(model.wrong(("accessor", number), "whole numbers as sparse indices", found));
    };
    let count = record.sparse_count;
    let stretch =
        Stretch { view: record.sparse_indices_view, offset: record.sparse_indices_offset, count };
    let indices = stretch.locate(model, buffers, (number, index, 1, false))?;
    let stretch =
        Stretch { view: record.sparse_values_view, offset: record.sparse_values_offset, count };
    let values = stretch.locate(model, buffers, (number, component, record.lanes, false))?;
    if record.is_checked != 0 {
        return Ok(Replaced { count, indices, values });
    }
    let mut last = None;
    for at in 0..count {
        let mut lanes = [0.0; 4];
        indices.get(model, buffers, at, &mut lanes)?;
        let index = lanes[0] as u64;
        if last.is_some_and(|last| last >= index) || index >= record.count {
            let expected = format!("ascending sparse indices below {}", record.count);
            return Err(model.wrong(("accessor", number), expected, format!("{index}")));
        }
        last = Some(index);
    }
    model.accessors.set(number.into(), AccessorRecord { is_checked: 1, ..*record })?;
    Ok(Replaced { count, indices, values })
}

impl Replaced {
    /// The place of the value for `index`, if there is one.
    fn find(
        &self,
        model: &mut Model,
        buffers: &mut Buffers,
        index: u64,
    ) -> Result<Option<u64>, IoError> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low + (high - low) / 2;
            let mut lanes = [0.0; 4];
            self.indices.get(model, buffers, middle, &mut lanes)?;
            match (lanes[0] as u64).cmp(&index) {
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Equal => return Ok(Some(middle)),
                std::cmp::Ordering::Greater => high = middle,
            }
        }
        Ok(None)
    }
}
