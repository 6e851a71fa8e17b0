//! Every lane operation at every level against the scalar operation, to the bit.

use crate::numbers::coordinate;
use arbitrary::{Result, Unstructured};
use halflight_simd::{Kernel, Lanes, Level, Mask, Simd};

/// One input.
pub fn run(data: &[u8]) {
    let _ = attempt(&mut Unstructured::new(data));
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    let mut numbers = [[0.0; 16]; 2];
    for number in numbers.as_flattened_mut() {
        *number = coordinate(input)?;
    }
    let [a, b] = numbers;
    let operands =
        Operands { a, b, first: input.arbitrary::<u32>()? % 9, chosen: input.arbitrary::<u16>()?.into() };
    for level in Level::detect().and_below() {
        let (eight, sixteen) = level.dispatch(operands);
        check(level, &operands, (1 << operands.first) - 1, &eight);
        check(level, &operands, operands.chosen, &sixteen);
    }
    Ok(())
}

/// Sixteen pairs of numbers, of which eight lanes take the first eight.
#[derive(Clone, Copy, Debug)]
struct Operands {
    a: [f32; 16],
    b: [f32; 16],
    first: u32,
    chosen: u32,
}

/// What the operations gave, in the order of [`NUMBERS`] and [`MASKS`].
struct Results<A> {
    numbers: [A; NUMBERS.len()],
    picked: A,
    masks: [u32; MASKS.len()],
}

type Binary<T> = (&'static str, fn(f32, f32) -> T);

const NUMBERS: [Binary<f32>; 8] = [
    ("add", |a, b| a + b),
    ("sub", |a, b| a - b),
    ("mul", |a, b| a * b),
    ("div", |a, b| a / b),
    ("neg", |a, _| -a),
    ("abs", |a, _| a.abs()),
    ("min", f32::min),
    ("max", f32::max),
];

const MASKS: [Binary<bool>; 6] = [
    ("lt", |a, b| a < b),
    ("le", |a, b| a <= b),
    ("eq", |a, b| a == b),
    ("not lt", |a, b| !matches!(a.partial_cmp(&b), Some(core::cmp::Ordering::Less))),
    ("lt or eq", |a, b| a <= b),
    ("le and eq", |a, b| a == b),
];

#[inline(always)]
fn operate<L: Lanes>(a: L, b: L, chosen: L::Mask) -> Results<L::Array> {
    let numbers = [a + b, a - b, a * b, a / b, -a, a.abs(), a.min(b), a.max(b)];
    let masks = [a.lt(b), a.le(b), a.eq(b), !a.lt(b), a.lt(b) | a.eq(b), a.le(b) & a.eq(b)];
    Results {
        numbers: numbers.map(L::to_array),
        picked: a.select(chosen, b).to_array(),
        masks: masks.map(|mask| {
            assert_eq!(mask.any(), mask.bits() != 0);
            mask.bits()
        }),
    }
}

impl Kernel for Operands {
    type Out = (Results<[f32; 8]>, Results<[f32; 16]>);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Out {
        let low = |from: &[f32; 16]| core::array::from_fn(|i| from[i]);
        let eight = operate(simd.load8(&low(&self.a)), simd.load8(&low(&self.b)), simd.first8(self.first));
        let sixteen = operate(simd.load16(&self.a), simd.load16(&self.b), simd.mask16(self.chosen));
        (eight, sixteen)
    }
}

fn check<const N: usize>(level: Level, operands: &Operands, chosen: u32, results: &Results<[f32; N]>) {
    let lanes = || operands.a.into_iter().zip(operands.b).take(N).enumerate();
    for (i, (a, b)) in lanes() {
        for ((name, scalar), lanes) in NUMBERS.iter().zip(&results.numbers) {
            let (expected, got) = (scalar(a, b), lanes[i]);
            let unspecified = ["min", "max"].contains(name) && (a.is_nan() || b.is_nan());
            // Of zeros, min and max may give either.
            let same = expected.to_bits() == got.to_bits()
                || expected.is_nan() && got.is_nan()
                || ["min", "max"].contains(name) && expected == got;
            assert!(
                same || unspecified,
                "{level:?} ×{N} {name}({a:e}, {b:e}) = {got:e}, scalar {expected:e}"
            );
        }
        for ((name, scalar), bits) in MASKS.iter().zip(results.masks) {
            assert_eq!(bits >> i & 1 == 1, scalar(a, b), "{level:?} ×{N} {name}({a:e}, {b:e})");
        }
        let expected = if chosen >> i & 1 == 1 { a } else { b };
        assert_eq!(
            results.picked[i].to_bits(),
            expected.to_bits(),
            "{level:?} ×{N} select, lane {i} of {chosen:b}"
        );
    }
    assert!(
        results.masks.iter().all(|&bits| u64::from(bits) < 1 << N),
        "{level:?} ×{N}: bits beyond the lanes"
    );
}
