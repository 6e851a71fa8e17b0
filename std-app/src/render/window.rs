//! Parts of pictures in the window of a render.

use crate::save::Image;
use halflight_core::method::Shard;

/// The part of `values`, row by row of a picture of `width` pixels, in the window of the render.
pub(super) fn values_in_window<T: Copy>(values: Vec<T>, width: u32, shard: Shard) -> Vec<T> {
    let Some(window) = shard.window else { return values };
    let rows = values.chunks(width.max(1) as usize).skip(window.corner()[1] as usize);
    let rows = rows.take(window.size()[1] as usize);
    let [left, across] = [window.corner()[0], window.size()[0]].map(|x| x as usize);
    rows.flat_map(|row| row.iter().skip(left).take(across).copied()).collect()
}

/// The part of `image` in the window of the render.
pub(super) fn image_in_window(image: Image, shard: Shard) -> Image {
    let [width, height] = shard.window.map_or([image.width, image.height], |window| window.size());
    Image { width, height, pixels: values_in_window(image.pixels, image.width, shard) }
}
