//! Stitching of seams: the least change of the texels by which fetches on both sides of a seam agree
//! (Iwanicki 2013), by conjugate gradients. Texels of wide intervals give way to those of narrow ones.

use super::map::LightMap;
use super::seams::Seam;
use glam::DVec2;
use halflight_core::Rgb;
use halflight_core::light::luminance;

/// Weight of the change of a texel, of the mean interval, beside the square of a difference between fetches.
const STAY: f64 = 0.01;

/// Least and most weight of a texel by its interval, in weights of the mean one.
const WEIGHTS: [f64; 2] = [0.1, 10.0];

/// Fetches for each texel of the longer side of a seam.
const FETCHES: f64 = 2.0;

/// Most rows beside one for each seam, in texels of the map: so many have the memory of its picture.
const MOST_ROWS: f64 = 0.25;

/// Most steps of the conjugate gradients, and the part of the first residual at which they end.
const MOST_STEPS: usize = 64;
const RESIDUAL: f64 = 1e-3;

/// Fetches on both sides of a seam: texels with their weights, negative on the second side.
type Row = [(u32, f32); 8];

/// Differences between the fetches at all seams.
struct Differences {
    /// Texels that the rows read, ascending.
    texels: Vec<u32>,
    /// Rows of numbers of `texels`.
    rows: Vec<Row>,
    /// Weights of the changes.
    stay: Vec<f64>,
    /// Inverse diagonal of the equations.
    scale: Vec<f64>,
}

impl LightMap {
    /// Stitches `seams` between texels of which `is_known` holds, until `watch` returns false. Changes are
    /// added to the half-widths: an interval of a texel has the one that it had before.
    pub(super) fn stitch(&mut self, seams: &[Seam], is_known: &[bool], watch: &dyn Fn() -> bool) {
        let Some(differences) = Differences::new(self, seams, is_known) else { return };
        let mut changes = vec![0.0; differences.texels.len()];
        for layer in &mut self.layers {
            let mut changed = vec![Rgb::ZERO; changes.len()];
            for channel in 0..3 {
                let value = |texel: &u32| f64::from(layer[*texel as usize][channel]);
                let values: Vec<f64> = differences.texels.iter().map(value).collect();
                differences.solve(&values, &mut changes, watch);
                for ((texel, change), changed) in differences.texels.iter().zip(&changes).zip(&mut changed) {
                    let value = &mut layer[*texel as usize][channel];
                    let after = *value + *change as f32;
                    // Light is positive, gradients have both signs.
                    let after = if *value >= 0.0 { after.max(0.0) } else { after };
                    changed[channel] = after - *value;
                    *value = after;
                }
            }
            for (texel, changed) in differences.texels.iter().zip(changed) {
                self.half_widths[*texel as usize] += luminance(changed).abs();
            }
        }
    }
}

impl Differences {
    fn new(map: &LightMap, seams: &[Seam], is_known: &[bool]) -> Option<Self> {
        let size = map.size.map(|side| side as usize);
        let mut rows = Vec::new();
        let wanted = FETCHES * seams.iter().map(Seam::length).sum::<f64>();
        let density = FETCHES * (MOST_ROWS * is_known.len() as f64 / wanted).min(1.0);
        for seam in seams {
            let count = (density * seam.length()).ceil().max(1.0);
            let fetches = (0..count as usize).map(|number| seam.at((number as f64 + 0.5) / count));
            let row = |[a, b]: [DVec2; 2]| {
                let ([a, b, c, d], [e, f, g, h]) = (fetch(a, size), fetch(b, size).map(|(t, w)| (t, -w)));
                [a, b, c, d, e, f, g, h]
            };
            let is_whole = |row: &Row| row.iter().all(|(texel, _)| is_known[*texel as usize]);
            rows.extend(fetches.map(row).filter(is_whole));
        }
        let mut texels: Vec<u32> = rows.iter().flatten().map(|(texel, _)| *texel).collect();
        texels.sort_unstable();
        texels.dedup();
        for (texel, _) in rows.iter_mut().flatten() {
            *texel = texels.binary_search(texel).unwrap_or_default() as u32;
        }
        let square = |texel: &u32| f64::from(map.half_widths[*texel as usize]).powi(2);
        let mean = texels.iter().map(square).filter(|square| square.is_finite()).sum::<f64>();
        let mean = mean / texels.len() as f64;
        let stay = |texel| match mean / square(texel) {
            weight if weight.is_finite() && mean > 0.0 => STAY * weight.clamp(WEIGHTS[0], WEIGHTS[1]),
            _ => STAY,
        };
        let stay: Vec<f64> = texels.iter().map(stay).collect();
        let mut scale = stay.clone();
        rows.iter()
            .flatten()
            .for_each(|(place, weight)| scale[*place as usize] += f64::from(weight * weight));
        scale.iter_mut().for_each(|scale| *scale = scale.recip());
        (!rows.is_empty()).then_some(Self { texels, rows, stay, scale })
    }

    /// The changes of `values` that minimise the sum of the squares of differences and weighted changes.
    fn solve(&self, values: &[f64], changes: &mut [f64], watch: &dyn Fn() -> bool) {
        let count = values.len();
        let (mut residual, mut product, mut direction) =
            (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
        changes.fill(0.0);
        self.add_squares(values, &mut residual);
        residual.iter_mut().for_each(|residual| *residual = -*residual);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let scaled = |residual: &[f64]| {
            residual.iter().zip(&self.scale).map(|(residual, scale)| residual * residual * scale).sum::<f64>()
        };
        let (first, mut before) = (scaled(&residual), f64::INFINITY);
        for _ in 0..MOST_STEPS {
            let now = scaled(&residual);
            if now <= first * RESIDUAL * RESIDUAL || !watch() {
                return;
            }
            for ((direction, residual), scale) in direction.iter_mut().zip(&residual).zip(&self.scale) {
                *direction = residual * scale + now / before * *direction;
            }
            before = now;
            for ((product, direction), stay) in product.iter_mut().zip(&direction).zip(&self.stay) {
                *product = stay * direction;
            }
            self.add_squares(&direction, &mut product);
            let step = now / dot(&direction, &product);
            if !step.is_finite() {
                return;
            }
            changes.iter_mut().zip(&direction).for_each(|(change, direction)| *change += step * direction);
            residual.iter_mut().zip(&product).for_each(|(residual, product)| *residual -= step * product);
        }
    }

    /// Adds the gradient of half the sum of the squared differences at `values` to `sum`.
    fn add_squares(&self, values: &[f64], sum: &mut [f64]) {
        for row in &self.rows {
            let each = |(place, weight): &(u32, f32)| f64::from(*weight) * values[*place as usize];
            let difference = row.iter().map(each).sum::<f64>();
            row.iter().for_each(|(place, weight)| sum[*place as usize] += f64::from(*weight) * difference);
        }
    }
}

/// The texels of a bilinear fetch and their weights. Those outside of the map are those of its border.
fn fetch(place: DVec2, size: [usize; 2]) -> [(u32, f32); 4] {
    let corner = (place - 0.5).floor();
    let part = place - 0.5 - corner;
    [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|offset| {
        let offset = DVec2::from(offset);
        let texel = (corner + offset).clamp(DVec2::ZERO, DVec2::new(size[0] as f64, size[1] as f64) - 1.0);
        let weight = DVec2::ONE - (part - offset).abs();
        ((texel.y * size[0] as f64 + texel.x) as u32, (weight.x * weight.y) as f32)
    })
}
