//! Alias table (Walker 1977): a discrete distribution sampled in constant time.

use crate::memory::{Arena, Footprint, OutOfMemory};
use bytemuck::{Pod, Zeroable};

/// Bin: `keep` of 2^32 selects its own item, the rest selects `alias`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct AliasEntry {
    keep: u32,
    alias: u32,
    pdf: f32,
}

/// Distribution over items in proportion to their weights.
#[derive(Clone, Copy, Debug)]
pub struct AliasTable<'m> {
    entries: &'m [AliasEntry],
}

impl<'m> AliasTable<'m> {
    /// Bytes that [`AliasTable::build`] takes.
    pub fn footprint(count: usize) -> Footprint {
        Footprint::default().slice::<AliasEntry>(count)
    }

    /// Table of `count` items. Weights that are negative or not finite count as zero; if all are zero, the
    /// distribution is uniform.
    ///
    /// Two sweeps fill the bins without a work list (Hübschle-Schneider and Sanders 2019, "Parallel Weighted
    /// Random Sampling", PSA): `light` advances over the items below the average, `heavy` over the others,
    /// and the remainder of the heavy item is carried.
    pub fn build(
        count: usize,
        weight: impl Fn(usize) -> f32,
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        let entries: &mut [AliasEntry] = arena.slice(count)?;
        let clean = |i| {
            let w = weight(i);
            if w > 0.0 && w.is_finite() { f64::from(w) } else { 0.0 }
        };
        let total: f64 = (0..count).map(clean).sum();
        let scaled = |i| if total > 0.0 { clean(i) * (count as f64 / total) } else { 1.0 };
        for (i, entry) in entries.iter_mut().enumerate() {
            let pdf = (scaled(i) / count as f64) as f32;
            *entry = AliasEntry { keep: u32::MAX, alias: i as u32, pdf };
        }
        let next = |from: usize, is_light: bool| (from..count).find(|&i| (scaled(i) < 1.0) == is_light);
        let mut light = next(0, true);
        let mut heavy = next(0, false);
        let mut left = heavy.map_or(0.0, scaled);
        while let Some(h) = heavy {
            if left >= 1.0 {
                let Some(l) = light else { break };
                entries[l] = AliasEntry { keep: fraction(scaled(l)), alias: h as u32, ..entries[l] };
                left -= 1.0 - scaled(l);
                light = next(l + 1, true);
            } else {
                heavy = next(h + 1, false);
                let Some(following) = heavy else { break };
                entries[h] = AliasEntry { keep: fraction(left), alias: following as u32, ..entries[h] };
                left += scaled(following) - 1.0;
            }
        }
        // Rounding can leave a light item over: its weight is zero, or within rounding of the average.
        while let (Some(l), true) = (light, total > 0.0) {
            if scaled(l) == 0.0 {
                let any = (0..count).find(|&i| scaled(i) > 0.0).unwrap_or(l);
                entries[l] = AliasEntry { keep: 0, alias: any as u32, ..entries[l] };
            }
            light = next(l + 1, true);
        }
        Ok(Self { entries })
    }

    /// Samples an item at `u` in [0, 1). Returns the item, its probability, and the remainder of `u` rescaled
    /// to [0, 1). `None` from an empty table.
    #[inline]
    pub fn sample(&self, u: f32) -> Option<(usize, f32, f32)> {
        let scaled = u * self.entries.len() as f32;
        let bin = (scaled as usize).min(self.entries.len().wrapping_sub(1));
        let entry = self.entries.get(bin)?;
        let within = ((scaled - bin as f32).clamp(0.0, super::ONE_MINUS_EPSILON) * TWO_POW_32) as u32;
        let (item, start, width) = if within < entry.keep {
            (bin, 0.0, entry.keep as f32)
        } else {
            (entry.alias as usize, entry.keep as f32, TWO_POW_32 - entry.keep as f32)
        };
        let rest = ((within as f32 - start) / width).clamp(0.0, super::ONE_MINUS_EPSILON);
        Some((item, self.pdf(item), rest))
    }

    /// Probability of `item`; zero if it does not exist.
    #[inline]
    pub fn pdf(&self, item: usize) -> f32 {
        self.entries.get(item).map_or(0.0, |e| e.pdf)
    }
}

const TWO_POW_32: f32 = 4_294_967_296.0;

/// Number of 0 … 1 in units of 2^-32.
fn fraction(x: f64) -> u32 {
    (x * f64::from(TWO_POW_32)) as u32
}
