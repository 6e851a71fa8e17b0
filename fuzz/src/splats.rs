//! Splats of any tasks on a film of any size, added in strips: the bits of one sequential list. Only splats
//! beyond the film are lost.

use crate::numbers::coordinate;
use arbitrary::{Result, Unstructured};
use halflight_core::film::{STRIPS, Splat, add_strip, sort_by_strip, strip_length};

/// One input.
pub fn run(data: &[u8]) {
    let _ = attempt(&mut Unstructured::new(data));
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    let pixels = usize::from(input.arbitrary::<u16>()? % 5000);
    let mut tasks: Vec<Vec<Splat>> = vec![Vec::new(); usize::from(input.arbitrary::<u8>()? % 8)];
    for splats in &mut tasks {
        for _ in 0..input.arbitrary::<u8>()? {
            let pixel = match input.arbitrary::<u16>()? {
                u16::MAX => u32::MAX,
                near => u32::from(near) % (pixels as u32 + 4),
            };
            let radiance = [coordinate(input)?, coordinate(input)?, coordinate(input)?];
            splats.push(Splat { pixel, radiance });
        }
    }
    let mut expected = vec![[0.0f32; 3]; pixels];
    for splat in tasks.iter().flatten() {
        if let Some(pixel) = expected.get_mut(splat.pixel as usize) {
            pixel.iter_mut().zip(splat.radiance).for_each(|(sum, light)| *sum += light);
        }
    }

    let mut sorted = tasks.clone();
    let lists = tasks.iter().zip(&mut sorted);
    let offsets: Vec<_> = lists.map(|(list, sorted)| sort_by_strip(list, pixels, sorted)).collect();
    let (length, mut found) = (strip_length(pixels), vec![[9.0; 3]; pixels]);
    assert!(found.chunks(length).count() <= STRIPS, "{pixels}");
    for (strip, pixels) in found.chunks_mut(length).enumerate() {
        add_strip(strip, length, sorted.iter().map(|list| &list[..]).zip(&offsets), pixels);
    }
    // All NaNs count as equal.
    let same = |a: f32, b: f32| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
    let mut values = found.iter().flatten().zip(expected.iter().flatten());
    assert!(values.all(|(a, b)| same(*a, *b)), "{pixels} pixels");
    Ok(())
}
