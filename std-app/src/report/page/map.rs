//! Maps of what is known of each pixel, in false colours on a logarithmic scale.

use super::picture::{img, reduced};
use super::{escape, fill};
use crate::compare::heat::{HEAT, SIGNED, heat};
use crate::compare::{Shown, false_colours};
use crate::report::words::{grouped, number};
use crate::save::{Image, from_srgb};

/// Widest scale that is shown.
const MOST_RANGE: f32 = 1e6;
/// Narrowest one.
const LEAST_RANGE: f32 = 10.0;

/// A value for each pixel.
pub(super) struct Map {
    /// Pixels in a row.
    pub(super) width: u32,
    /// Row by row.
    pub(super) values: Vec<f32>,
}

impl Map {
    /// The mean of the square of `2 * reach + 1` pixels around each.
    pub(super) fn smoothed(&self, reach: usize) -> Map {
        let width = self.width as usize;
        let rows = blurred(&self.values, width, reach);
        let turned = transposed(&rows, width);
        let height = self.values.len() / width.max(1);
        Map { values: transposed(&blurred(&turned, height, reach), height), ..*self }
    }

    /// A figure of the map, on a scale from the hundredth part to all but the last of its pixels.
    pub(super) fn figure(&self, title: &str, words: &str) -> String {
        let mut sorted: Vec<f32> =
            self.values.iter().copied().filter(|&v| v > 0.0 && v.is_finite()).collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let part =
            |share: f64| sorted.get((sorted.len().max(1) - 1).min((sorted.len() as f64 * share) as usize));
        let (Some(&low), Some(&high)) = (part(0.01), part(0.995)) else {
            return format!(
                "<figure><figcaption><h3>{title}</h3><p>Zero everywhere.</p></figcaption></figure>"
            );
        };
        let low = low.max(high / MOST_RANGE).min(high / LEAST_RANGE);
        let place = |value: f32| if value > 0.0 { (value / low).ln() / (high / low).ln() } else { 0.0 };
        let labels = [low, (low * high).sqrt(), high].map(|value| number(value.into(), 2));
        figure(&self.coloured(place), title, words, &HEAT, &labels)
    }

    /// A figure of counts, on a linear scale from the least to the most.
    pub(super) fn counts_figure(&self, title: &str, words: &str, least: u32, most: u32) -> String {
        let (low, high) = (least as f32, most as f32);
        let labels = [least, least + (most - least) / 2, most].map(|count| grouped(count.into()));
        figure(&self.coloured(|value| (value - low) / (high - low)), title, words, &HEAT, &labels)
    }

    fn coloured(&self, place: impl Fn(f32) -> f32) -> Image {
        let height = (self.values.len() / self.width.max(1) as usize) as u32;
        let pixels = self.values.iter().map(|&value| heat(place(value)).map(from_srgb)).collect();
        Image { width: self.width, height, pixels }
    }
}

/// A figure of a difference between the picture and a reference.
pub(super) fn difference(values: &Image, shown: Shown, title: &str, words: &str) -> String {
    let (colours, end) = false_colours(values, shown);
    let end = f64::from(end);
    let labels = if shown.is_signed() { [-end, 0.0, end] } else { [0.0, 0.5 * end, end] };
    let stops = if shown.is_signed() { &SIGNED } else { &HEAT };
    figure(&colours, title, words, stops, &labels.map(|value| number(value, 2)))
}

/// A figure with its scale; `words` are HTML.
fn figure(colours: &Image, title: &str, words: &str, stops: &[[f32; 3]], labels: &[String; 3]) -> String {
    let stop = |[r, g, b]: &[f32; 3]| {
        let byte = |c: &f32| (c * 255.0 + 0.5) as u8;
        format!("rgb({} {} {})", byte(r), byte(g), byte(b))
    };
    let gradient: Vec<String> = stops.iter().map(stop).collect();
    let alt = format!("{title} in false colours, from {} to {}", labels[0], labels[2]);
    fill(
        include_str!("map.html"),
        &[
            ("image", &img(&reduced(colours).0, &alt)),
            ("title", &escape(title)),
            ("words", words),
            ("gradient", &gradient.join(",")),
            ("low", &labels[0]),
            ("middle", &labels[1]),
            ("high", &labels[2]),
        ],
    )
}

/// Each value of a row the mean of those at most `reach` away in it.
fn blurred(values: &[f32], width: usize, reach: usize) -> Vec<f32> {
    let row = |row: &[f32]| -> Vec<f32> {
        let mean = |x: usize| {
            let near = &row[x.saturating_sub(reach)..(x + reach + 1).min(row.len())];
            near.iter().sum::<f32>() / near.len() as f32
        };
        (0..row.len()).map(mean).collect()
    };
    values.chunks(width.max(1)).flat_map(row).collect()
}

/// Columns for rows.
fn transposed(values: &[f32], width: usize) -> Vec<f32> {
    let height = values.len() / width.max(1);
    (0..width).flat_map(|x| (0..height).map(move |y| values[y * width + x])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_keeps_flat_maps_and_the_shape() {
        let flat = Map { width: 5, values: vec![2.0; 15] };
        assert_eq!(flat.smoothed(2).values, flat.values);
        let mut values = vec![0.0; 35];
        values[2 * 7 + 3] = 9.0;
        let spread = Map { width: 7, values }.smoothed(1);
        assert_eq!(spread.values.iter().filter(|&&v| v == 1.0).count(), 9);
        assert_eq!(spread.values[7 + 2], 1.0);
        assert_eq!(spread.values[7 + 5], 0.0);
    }

    #[test]
    fn a_map_of_nothing_says_so() {
        let nothing = Map { width: 4, values: vec![0.0; 16] };
        assert!(nothing.figure("Variance", "").contains("Zero everywhere"));
        let odd = Map { width: 2, values: vec![f32::NAN, f32::INFINITY, 1.0, 1.0] };
        assert!(odd.figure("Variance", "").contains("<img"));
    }
}
