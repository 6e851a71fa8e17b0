//! Maps of values per pixel, in false colours on a logarithmic scale.

use super::picture::{img, reduced};
use crate::compare::heat::{HEAT, SIGNED, heat};
use crate::compare::{Shown, false_colours};
use crate::report::quantity::{grouped, number};
use crate::save::{Image, from_srgb};
use maud::{Markup, html};

/// Limits of the ratio of the ends of a scale.
const MAX_RANGE: f32 = 1e6;
const MIN_RANGE: f32 = 10.0;

/// Value for each pixel.
pub(super) struct Map {
    /// Pixels per row.
    pub(super) width: u32,
    /// Values, row by row.
    pub(super) values: Vec<f32>,
}

impl Map {
    /// Means over squares of `2 * radius + 1` pixels around each pixel.
    pub(super) fn smoothed(&self, radius: usize) -> Map {
        let width = self.width as usize;
        let rows = blurred(&self.values, width, radius);
        let columns = transposed(&rows, width);
        let height = self.values.len() / width.max(1);
        Map { values: transposed(&blurred(&columns, height, radius), height), ..*self }
    }

    /// Figure on a scale from the 1 % quantile to the 99.5 % quantile of the positive values.
    pub(super) fn figure(&self, title: &str, text: &str) -> Markup {
        let mut sorted: Vec<f32> =
            self.values.iter().copied().filter(|&v| v > 0.0 && v.is_finite()).collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let last = sorted.len().saturating_sub(1);
        let quantile = |order: f64| sorted.get(last.min((sorted.len() as f64 * order) as usize));
        let (Some(&low), Some(&high)) = (quantile(0.01), quantile(0.995)) else {
            return html! { figure { figcaption { h3 { (title) } p { "Zero everywhere." } } } };
        };
        let low = low.max(high / MAX_RANGE).min(high / MIN_RANGE);
        let scale = |value: f32| if value > 0.0 { (value / low).ln() / (high / low).ln() } else { 0.0 };
        let labels = [low, (low * high).sqrt(), high].map(|value| number(value.into(), 2));
        figure(&self.coloured(scale), title, text, &HEAT, &labels)
    }

    /// Figure of counts, on a linear scale.
    pub(super) fn counts_figure(&self, title: &str, text: &str, least: u32, most: u32) -> Markup {
        let (low, high) = (least as f32, most as f32);
        let labels = [least, least + (most - least) / 2, most].map(|count| grouped(count.into()));
        figure(&self.coloured(|value| (value - low) / (high - low)), title, text, &HEAT, &labels)
    }

    fn coloured(&self, scale: impl Fn(f32) -> f32) -> Image {
        let height = (self.values.len() / self.width.max(1) as usize) as u32;
        let pixels = self.values.iter().map(|&value| heat(scale(value)).map(from_srgb)).collect();
        Image { width: self.width, height, pixels }
    }
}

/// Figure of a difference from a reference.
pub(super) fn difference(values: &Image, shown: Shown, title: &str, text: &str) -> Markup {
    let (colours, end) = false_colours(values, shown);
    let end = f64::from(end);
    let (labels, stops) =
        if shown.is_signed() { ([-end, 0.0, end], &SIGNED) } else { ([0.0, 0.5 * end, end], &HEAT) };
    figure(&colours, title, text, stops, &labels.map(|value| number(value, 2)))
}

/// Figure with its scale.
fn figure(colours: &Image, title: &str, text: &str, stops: &[[f32; 3]], labels: &[String; 3]) -> Markup {
    let stop = |colour: &[f32; 3]| {
        let [r, g, b] = colour.map(|channel| (channel * 255.0 + 0.5) as u8);
        format!("rgb({r} {g} {b})")
    };
    let gradient = stops.iter().map(stop).collect::<Vec<_>>().join(",");
    let alt = format!("{title} in false colours, from {} to {}", labels[0], labels[2]);
    html! {
        figure {
            (img(&reduced(colours).0, &alt))
            figcaption {
                div.scale style={ "--colours:" (gradient) } { @for label in labels { span { (label) } } }
                h3 { (title) }
                p { (text) }
            }
        }
    }
}

/// Means of each row over `2 * radius + 1` values.
fn blurred(values: &[f32], width: usize, radius: usize) -> Vec<f32> {
    let row = |row: &[f32]| -> Vec<f32> {
        let mean = |x: usize| {
            let near = &row[x.saturating_sub(radius)..(x + radius + 1).min(row.len())];
            near.iter().sum::<f32>() / near.len() as f32
        };
        (0..row.len()).map(mean).collect()
    };
    values.chunks(width.max(1)).flat_map(row).collect()
}

/// Transposed matrix.
fn transposed(values: &[f32], width: usize) -> Vec<f32> {
    let height = values.len() / width.max(1);
    (0..width).flat_map(|x| (0..height).map(move |y| values[y * width + x])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_keeps_flat_maps_and_spreads_points() {
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
    fn maps_without_positive_values_have_no_picture() {
        let nothing = Map { width: 4, values: vec![0.0; 16] };
        assert!(nothing.figure("Variance", "").into_string().contains("Zero everywhere"));
        let odd = Map { width: 2, values: vec![f32::NAN, f32::INFINITY, 1.0, 1.0] };
        assert!(odd.figure("Variance", "").into_string().contains("<img"));
    }
}
