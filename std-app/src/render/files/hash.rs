//! 64-bit hash: checksum of files and fingerprint of scenes. Detects accidents, not manipulation.

use halflight_core::sampling::mix;

/// Hash over sections of bytes and their lengths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::render) struct Hash(u64);

impl Hash {
    /// Adds a section.
    pub(in crate::render) fn section(&mut self, bytes: &[u8]) {
        self.word(bytes.len() as u64);
        let (words, rest) = bytes.as_chunks::<8>();
        words.iter().for_each(|word| self.word(u64::from_le_bytes(*word)));
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        self.word(u64::from_le_bytes(last));
    }

    /// The hash value.
    pub(in crate::render) fn value(self) -> u64 {
        self.0
    }

    fn word(&mut self, word: u64) {
        // A zero word would not change a zero hash.
        self.0 = mix(self.0 ^ word).wrapping_add(0x9e37_79b9_7f4a_7c15);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash(sections: &[&[u8]]) -> u64 {
        let mut hash = Hash::default();
        sections.iter().for_each(|section| hash.section(section));
        hash.value()
    }

    #[test]
    fn every_bit_and_every_border_counts() {
        let plain = hash(&[b"half a light", b""]);
        for other in [
            hash(&[b"half a light"]),
            hash(&[b"half a ", b"light"]),
            hash(&[b"half a lighu", b""]),
            hash(&[b"half a light\0", b""]),
        ] {
            assert_ne!(plain, other);
        }
        assert_eq!(plain, hash(&[b"half a light", b""]));
    }
}
