//! Cryptomatte (Friedman and Jones, Psyop, 2015; specification 1.2.0): numbers of materials and objects by
//! the hashes of their names, with the fractions of the pixel that they cover, two in each layer of four
//! channels.

use crate::save::{Attribute, ExrFile};
use halflight_core::reconstruction::{Coverage, RANKS};
use serde_json::{Map, Value};

/// MurmurHash3, the variant of 32 bits for x86 (Appleby 2011), with seed 0.
pub fn hash(bytes: &[u8]) -> u32 {
    let mixed = |block: u32| block.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let (blocks, tail) = bytes.as_chunks::<4>();
    let mut hash = blocks.iter().fold(0u32, |hash, block| {
        (hash ^ mixed(u32::from_le_bytes(*block))).rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64)
    });
    let mut last = [0; 4];
    last[..tail.len()].copy_from_slice(tail);
    hash ^= mixed(u32::from_le_bytes(last));
    hash ^= bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

/// Number of a name, as the bits of a normal float.
pub fn id(name: &str) -> f32 {
    let hash = hash(name.as_bytes());
    let exponent = hash >> 23 & 0xff;
    f32::from_bits(if exponent == 0 || exponent == 0xff { hash ^ 1 << 23 } else { hash })
}

/// Adds a Cryptomatte called `layer` of things with `names`, which cover the pixel of an index by `coverage`.
pub(super) fn add<'r>(
    file: &mut ExrFile<'r>,
    layer: &str,
    names: &[String],
    coverage: impl Fn(usize) -> [Coverage; RANKS] + Sync + Clone + 'r,
) {
    let ids: std::sync::Arc<[f32]> = names.iter().map(|name| id(name)).collect();
    for rank in 0..RANKS {
        let letters = if rank % 2 == 0 { ["R", "G"] } else { ["B", "A"] };
        let name = |letter| format!("{layer}{:02}.{letter}", rank / 2);
        let (ids, of_pixel) = (ids.clone(), coverage.clone());
        // Empty slots have the number of nothing, which is 0.
        let id = move |at: usize| ids.get(of_pixel(at)[rank].id as usize).copied().unwrap_or(0.0);
        file.add_channel(name(letters[0]), id);
        let of_pixel = coverage.clone();
        file.add_channel(name(letters[1]), move |at| of_pixel(at)[rank].fraction);
    }
    let entry = |name: &String| (name.clone(), Value::from(format!("{:08x}", id(name).to_bits())));
    let manifest: Map<String, Value> = names.iter().map(entry).collect();
    let key = &format!("{:08x}", hash(layer.as_bytes()))[..7];
    let values = [
        ("name", layer.to_owned()),
        ("hash", "MurmurHash3_32".into()),
        ("conversion", "uint32_to_float32".into()),
        ("manifest", Value::Object(manifest).to_string()),
    ];
    for (name, value) in values {
        file.set(format!("cryptomatte/{key}/{name}"), Attribute::Text(value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_of_the_reference() {
        // By `mmh3` 5.3.1, which compiles the reference.
        for (text, expected) in [
            ("", 0u32),
            ("a", 0x3c25_69b2),
            ("aa", 0x3710_91a9),
            ("aaa", 0xb4d0_5fb7),
            ("aaaa", 0x7eee_d987),
            ("hello", 0x248b_fa47),
            ("Ω halflight", 0x77cf_a826),
        ] {
            assert_eq!(hash(text.as_bytes()), expected, "{text}");
        }
    }
}
