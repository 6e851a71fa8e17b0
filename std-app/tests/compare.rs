//! Difference pictures.

use halflight::compare::{Shown, compare, false_colours};
use halflight::save::Image;

#[test]
fn mean_square_of_the_relative_difference_is_relmse() {
    let picture = |values: [f32; 3]| Image { width: 3, height: 1, pixels: values.map(|v| [v; 3]).into() };
    let (a, b) = (picture([1.0, 2.0, 0.0]), picture([2.0, 1.5, 0.0]));
    let comparison = compare(&a, &b).unwrap();
    let of = |shown| comparison.values(&a, &b, shown).pixels.iter().map(|p| p[0]).collect::<Vec<_>>();
    assert_eq!(of(Shown::Signed), [-1.0, 0.5, 0.0]);
    assert_eq!(of(Shown::Absolute), [1.0, 0.5, 0.0]);
    let squares = of(Shown::Relative).iter().map(|&v| f64::from(v * v)).sum::<f64>() / 3.0;
    assert!((squares - comparison.linear.relmse).abs() < 1e-7);
    assert!(of(Shown::Flip).iter().all(|error| (0.0..=1.0).contains(error)));
}

#[test]
fn false_colours_have_signs_and_ignore_outliers() {
    let mut values = Image { width: 1000, height: 1, pixels: vec![[0.5; 3]; 1000] };
    values.pixels[0] = [1e9; 3];
    values.pixels[1] = [f32::NAN; 3];
    values.pixels[2] = [-0.5; 3];
    let (colours, end) = false_colours(&values, Shown::Signed);
    assert_eq!(end, 0.5);
    let [red, _, blue] = colours.pixels[3];
    assert!(red > blue, "above zero is red");
    let [red, _, blue] = colours.pixels[2];
    assert!(blue > red, "below zero is blue");
    let flat = false_colours(&Image::black(2, 2), Shown::Absolute);
    assert!(flat.1 == 0.0 && flat.0.pixels.iter().flatten().all(|c| c.is_finite()));
}
