//! Arrays of numpy as slices of the library, and results as arrays that own their memory.

use crate::error::invalid;
use halflight::save::Image;
use numpy::ndarray::{Array, Dimension, ShapeBuilder};
use numpy::{Element, PyArray, PyArray3, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// Rows of `N` numbers, without a copy.
pub(crate) fn rows<'a, T: Element, const N: usize>(
    py: Python<'_>,
    array: &'a PyReadonlyArray2<'_, T>,
    name: &str,
) -> PyResult<&'a [[T; N]]> {
    let shape = array.shape();
    if shape[1] != N {
        return Err(invalid(py, &format!("{name} have the shape {shape:?}; (n, {N}) is expected")));
    }
    let flat = array.as_slice().map_err(|_| invalid(py, &format!("{name} are not contiguous")))?;
    Ok(flat.as_chunks().0)
}

/// An array of `values` in the order of C, in their memory.
pub(crate) fn array<'py, T: Element, Sh, D: Dimension>(
    py: Python<'py>,
    shape: Sh,
    values: Vec<T>,
) -> PyResult<Bound<'py, PyArray<T, D>>>
where
    Sh: ShapeBuilder<Dim = D>,
{
    let array = Array::from_shape_vec(shape, values).map_err(|error| invalid(py, &error.to_string()))?;
    Ok(PyArray::from_owned_array(py, array))
}

/// The pixels of `image`, rows from top to bottom, in their memory.
pub(crate) fn pixels<'py>(py: Python<'py>, image: Image) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let Image { width, height, pixels } = image;
    array(py, (height as usize, width as usize, 3), pixels.into_flattened())
}

/// A copy of an array (rows, columns, 3).
pub(crate) fn image(py: Python<'_>, array: &PyReadonlyArray3<'_, f32>) -> PyResult<Image> {
    let [height, width, channels] = *array.shape() else { return Err(invalid(py, "no picture")) };
    let side = |side: usize| u32::try_from(side).ok();
    let (Some(width), Some(height), 3) = (side(width), side(height), channels) else {
        let shape = array.shape();
        return Err(invalid(py, &format!("a picture has the shape (rows, columns, 3), not {shape:?}")));
    };
    let flat = array.as_slice().map_err(|_| invalid(py, "the picture is not contiguous"))?;
    Ok(Image { width, height, pixels: flat.as_chunks().0.to_vec() })
}
