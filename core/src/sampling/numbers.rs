//! Random numbers of a light path by dimension. A [`Sampler`] gives points of a sequence; a Markov chain
//! gives points that differ by a [`Mutation`](super::Mutation).

use super::Sampler;

/// Numbers in [0, 1). A dimension gives the same numbers at every call; [`Numbers::single`] is the first of
/// the pair.
pub trait Numbers {
    /// One number.
    fn single(&self, dimension: u32) -> f32;

    /// Two numbers.
    fn pair(&self, dimension: u32) -> [f32; 2];
}

impl Numbers for Sampler {
    #[inline]
    fn single(&self, dimension: u32) -> f32 {
        Sampler::single(self, dimension)
    }

    #[inline]
    fn pair(&self, dimension: u32) -> [f32; 2] {
        Sampler::pair(self, dimension)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_is_the_first_of_two() {
        for index in 0..100 {
            let sampler = Sampler::replicate(3, 7, 1, index);
            assert_eq!(Numbers::single(&sampler, index), Numbers::pair(&sampler, index)[0]);
        }
    }
}
