//! Accessors: typed arrays in buffers, with stride, normalisation and sparse substitutes. Ranges are checked
//! once; a look-up then cannot leave its buffer.

use super::json::{Accessor, BufferView, Document, Sparse};
use crate::load::bytes::Bytes;
use crate::load::error::LoadError;
use std::path::Path;

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// Buffers of a file, and its description of them.
pub(super) struct Buffers<'a> {
    pub(super) file: &'a Path,
    pub(super) document: &'a Document,
    pub(super) bytes: Vec<Bytes>,
}

/// Rows of `N` numbers.
pub(super) struct Rows<const N: usize> {
    pub(super) count: usize,
    /// `None`: zeros.
    dense: Option<Array<N>>,
    sparse: Option<Substitutes<N>>,
}

/// Rows that replace others, by ascending index.
struct Substitutes<const N: usize> {
    count: usize,
    indices: Array<1>,
    values: Array<N>,
}

impl<const N: usize> Substitutes<N> {
    fn row(&self, row: usize) -> Option<[f64; N]> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low.midpoint(high);
            if self.indices.row(middle)[0] < row as f64 { low = middle + 1 } else { high = middle }
        }
        (low < self.count && self.indices.row(low)[0] == row as f64).then(|| self.values.row(low))
    }
}

/// Rows in a buffer, all of which exist.
struct Array<const N: usize> {
    bytes: Bytes,
    stride: usize,
    component: Component,
}

#[derive(Clone, Copy)]
struct Component {
    kind: u32,
    size: usize,
    normalized: bool,
}

impl Component {
    fn new(kind: u32, normalized: bool) -> Option<Self> {
        let size = match kind {
            BYTE | UNSIGNED_BYTE => 1,
            SHORT | UNSIGNED_SHORT => 2,
            UNSIGNED_INT | FLOAT => 4,
            _ => return None,
        };
        Some(Self { kind, size, normalized })
    }

    /// The number at the start of `bytes`.
    #[inline]
    fn number(self, bytes: &[u8]) -> f64 {
        let [a, b, c, d] = core::array::from_fn(|i| bytes.get(i).copied().unwrap_or_default());
        let (number, most) = match self.kind {
            BYTE => (f64::from(a as i8), 127.0),
            UNSIGNED_BYTE => (f64::from(a), 255.0),
            SHORT => (f64::from(i16::from_le_bytes([a, b])), 32767.0),
            UNSIGNED_SHORT => (f64::from(u16::from_le_bytes([a, b])), 65535.0),
            UNSIGNED_INT => (f64::from(u32::from_le_bytes([a, b, c, d])), f64::from(u32::MAX)),
            _ => return f64::from(f32::from_le_bytes([a, b, c, d])),
        };
        if self.normalized { (number / most).max(-1.0) } else { number }
    }
}

impl<const N: usize> Array<N> {
    #[inline]
    fn row(&self, row: usize) -> [f64; N] {
        let Component { size, .. } = self.component;
        let bytes = self.bytes.get(row * self.stride..).unwrap_or_default();
        core::array::from_fn(|i| self.component.number(bytes.get(i * size..).unwrap_or_default()))
    }
}

impl<const N: usize> Rows<N> {
    /// Row number `row`; zeros beyond the end.
    #[inline]
    pub(super) fn row(&self, row: usize) -> [f64; N] {
        let dense = || self.dense.as_ref().map_or([0.0; N], |array| array.row(row));
        self.sparse.as_ref().and_then(|sparse| sparse.row(row)).unwrap_or_else(dense)
    }
}

impl Buffers<'_> {
    pub(super) fn error(&self, problem: impl Into<String>) -> LoadError {
        LoadError::of_file(self.file, problem, "the file may be damaged: export it again")
    }

    /// The rows of an accessor, which must have one of these types.
    pub(super) fn rows<const N: usize>(&self, number: usize) -> Result<Rows<N>, LoadError> {
        let error = |problem: &str| self.error(format!("accessor {number} {problem}"));
        let accessor = self.document.accessors.get(number).ok_or_else(|| error("does not exist"))?;
        let Accessor { component_type, normalized, .. } = *accessor;
        let width = match &accessor.kind[..] {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 0,
        };
        if width != N {
            return Err(error(&format!("has the type `{}`, and {N} numbers are needed", accessor.kind)));
        }
        let component = Component::new(component_type, normalized).ok_or_else(|| {
            error(&format!("has the component type {component_type}, which does not exist"))
        })?;
        let count = u32::try_from(accessor.count)
            .map_err(|_| error(&format!("claims {} elements", accessor.count)))?;
        let dense = accessor.buffer_view.map(|view| {
            self.array::<N>(view, accessor.byte_offset, component, count.into()).map_err(|why| error(&why))
        });
        let sparse = accessor
            .sparse
            .as_ref()
            .map(|sparse| self.substitutes::<N>(sparse, component, count).map_err(|why| error(&why)));
        Ok(Rows { count: count as usize, dense: dense.transpose()?, sparse: sparse.transpose()? })
    }

    /// Substitutes for rows of `count`, whose indices must ascend.
    fn substitutes<const N: usize>(
        &self,
        sparse: &Sparse,
        component: Component,
        count: u32,
    ) -> Result<Substitutes<N>, String> {
        let Sparse { count: own, indices, values } = sparse;
        let index = Component::new(indices.component_type, false).ok_or("has unknown sparse indices")?;
        let indices = self.array::<1>(indices.buffer_view, indices.byte_offset, index, *own)?;
        let values = self.array::<N>(values.buffer_view, values.byte_offset, component, *own)?;
        let mut least = 0.0;
        for i in 0..*own as usize {
            let [index] = indices.row(i);
            if !(least..f64::from(count)).contains(&index) {
                return Err(format!("substitutes element {index} of {count}, or in no order"));
            }
            least = index + 1.0;
        }
        Ok(Substitutes { count: *own as usize, indices, values })
    }

    /// `count` rows of a buffer view.
    fn array<const N: usize>(
        &self,
        view: usize,
        offset: u64,
        component: Component,
        count: u64,
    ) -> Result<Array<N>, String> {
        let row = (N * component.size) as u64;
        let (bytes, stride) = self.view(view)?;
        let stride = stride.unwrap_or(row);
        if stride < row {
            return Err(format!("has elements of {row} bytes, {stride} bytes apart"));
        }
        let end = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(row));
        let part = end.and_then(|length| bytes.part(offset, length));
        let bytes = part.ok_or_else(|| {
            format!("has {count} elements, which reach beyond the {} bytes of its buffer view", bytes.len())
        })?;
        Ok(Array { bytes, stride: stride as usize, component })
    }

    /// Bytes of a buffer view, and its stride.
    pub(super) fn view(&self, number: usize) -> Result<(Bytes, Option<u64>), String> {
        let view = self.document.buffer_views.get(number);
        let &BufferView { buffer, byte_offset, byte_length, byte_stride } =
            view.ok_or_else(|| format!("refers to buffer view {number}, which does not exist"))?;
        let bytes = self.bytes.get(buffer).and_then(|bytes| bytes.part(byte_offset, byte_length));
        let bytes =
            bytes.ok_or_else(|| format!("refers to buffer view {number}, which leaves its buffer"))?;
        Ok((bytes, byte_stride))
    }
}
