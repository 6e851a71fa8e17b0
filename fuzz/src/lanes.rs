//! Every lane operation at every level against its scalar operation, to the bit.

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
        let words = operands.a.map(f32::to_bits);
        level.dispatch(Packing { operands, words }).check(level, &operands, &words);
    }
    Ok(())
}

/// Sixteen pairs of numbers; eight lanes use the first eight.
#[derive(Clone, Copy, Debug)]
struct Operands {
    a: [f32; 16],
    b: [f32; 16],
    first: u32,
    chosen: u32,
}

/// Results of the operations in the order of [`NUMBERS`] and [`MASKS`].
struct Results<A> {
    numbers: [A; NUMBERS.len()],
    picked: A,
    product: [A; 2],
    masks: [u32; MASKS.len()],
}

type Binary<T> = (&'static str, fn(f32, f32) -> T);

const NUMBERS: [Binary<f32>; 10] = [
    ("add", |a, b| a + b),
    ("sub", |a, b| a - b),
    ("mul", |a, b| a * b),
    ("div", |a, b| a / b),
    ("neg", |a, _| -a),
    ("abs", |a, _| a.abs()),
    ("min", f32::min),
    ("max", f32::max),
    ("sqrt", |a, _| a.sqrt()),
    ("power of two", |a, _| f32::from_bits(a.to_bits() & f32::INFINITY.to_bits())),
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
    let numbers = [a + b, a - b, a * b, a / b, -a, a.abs(), a.min(b), a.max(b), a.sqrt(), a.power_of_two()];
    let (product, rest) = a.product(b);
    let masks = [a.lt(b), a.le(b), a.eq(b), !a.lt(b), a.lt(b) | a.eq(b), a.le(b) & a.eq(b)];
    Results {
        numbers: numbers.map(L::to_array),
        picked: a.select(chosen, b).to_array(),
        product: [product.to_array(), rest.to_array()],
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
            // min and max may return either of two zeros.
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
        let exact = f64::from(a) * f64::from(b);
        let factor = |x: f32| x == 0.0 || (1e-14..=1e30).contains(&x.abs());
        if factor(a) && factor(b) && (exact == 0.0 || (1e-30..=1e38).contains(&exact.abs())) {
            let [product, rest] = &results.product;
            let sum = f64::from(product[i]) + f64::from(rest[i]);
            assert!(product[i] == a * b && sum == exact, "{level:?} ×{N} product({a:e}, {b:e}) = {sum:e}");
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

/// Operations of photon map kernels: packed lanes, and bit fields of words.
struct Packing {
    operands: Operands,
    words: [u32; 16],
}

struct Packed {
    lanes: [f32; 16],
    numbers: [f32; 16],
    fields: [[f32; 16]; 3],
    bytes: [f32; 16],
    picked: [f32; 16],
    neighbours: [[f32; 16]; 2],
    powers: [f32; 16],
    smallest: f32,
}

/// First bit and width of fields of a word.
const FIELDS: [(u32, u32); 3] = [(0, 12), (22, 10), (8, 24)];

/// Numbers in [0, 16).
fn places(words: &[u32; 16]) -> [f32; 16] {
    words.map(|word| (word >> 8 & 0xffff) as f32 / 4096.0)
}

/// A table that ends below the largest places.
const TABLE: [i16; 11] = [0, 1, -1, i16::MAX, i16::MIN, 7, -300, 2, 9, -4, 5];

fn entry(place: usize, next: usize) -> f32 {
    TABLE[place.min(TABLE.len() - 2) + next].into()
}

fn low_bytes(words: &[u32; 16]) -> [u8; 16] {
    words.map(|word| word as u8)
}

impl Kernel for Packing {
    type Out = Packed;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Packed {
        let Self { operands, words } = self;
        let mut lanes = [0.0; 16];
        simd.pack16(simd.mask16(operands.chosen), simd.load16(&operands.b), &mut lanes);
        Packed {
            lanes,
            numbers: simd.numbers16(words[0]).to_array(),
            fields: FIELDS.map(|(from, width)| simd.field16(&words, from, width).to_array()),
            bytes: simd.bytes16(&low_bytes(&words)).to_array(),
            picked: simd.pick16(simd.load16(&operands.a), simd.load16(&places(&words))).to_array(),
            neighbours: simd
                .load16(&places(&words).map(f32::floor))
                .neighbours(&TABLE)
                .map(|lanes| lanes.to_array()),
            powers: simd.powers16(&words).to_array(),
            smallest: simd.load16(&operands.a).smallest(),
        }
    }
}

impl Packed {
    fn check(&self, level: Level, operands: &Operands, words: &[u32; 16]) {
        let wanted = (0..16).filter(|i| operands.chosen >> i & 1 == 1).map(|i| operands.b[i].to_bits());
        let packed: Vec<u32> = wanted.collect();
        let got: Vec<u32> = self.lanes.iter().take(packed.len()).map(|lane| lane.to_bits()).collect();
        assert_eq!(got, packed, "{level:?} pack of {:b}", operands.chosen);
        let bits = |lanes: &[f32; 16]| lanes.map(f32::to_bits);
        let counted = core::array::from_fn(|i| words[0].wrapping_add(i as u32));
        assert_eq!(bits(&self.numbers), counted, "{level:?} numbers");
        for ((from, width), field) in FIELDS.into_iter().zip(&self.fields) {
            let expected = words.map(|word| ((word >> from) & ((1 << width) - 1)) as f32);
            assert_eq!(*field, expected, "{level:?} field of {width} from {from}");
        }
        assert_eq!(self.bytes, low_bytes(words).map(f32::from), "{level:?} bytes");
        let picked = places(words).map(|place| operands.a[place as usize].to_bits());
        assert_eq!(bits(&self.picked), picked, "{level:?} pick");
        let neighbours = [0, 1].map(|next| places(words).map(|place| entry(place as usize, next)));
        assert_eq!(self.neighbours, neighbours, "{level:?} neighbours");
        assert_eq!(bits(&self.powers), words.map(|word| word >> 24 << 23), "{level:?} powers");
        if operands.a.iter().all(|a| !a.is_nan()) {
            let smallest = operands.a.iter().copied().fold(f32::INFINITY, f32::min);
            assert_eq!(self.smallest, smallest, "{level:?} smallest");
        }
    }
}
