//! In: plain values. Out: the 32-bit words that a buffer holds, and views of them as plain values.

use bytemuck::{AnyBitPattern, NoUninit, Pod};

/// The content of one binding, as 32-bit words: every type that WGSL shares with the host consists of them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Words(Vec<u32>);

impl Words {
    /// Values in the byte layout of the Rust type; the last word is filled up with zero bytes.
    pub fn of<T: NoUninit>(values: &[T]) -> Words {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        let word = |chunk: &[u8]| {
            let mut four = [0; 4];
            four[..chunk.len()].copy_from_slice(chunk);
            u32::from_ne_bytes(four)
        };
        Words(bytes.chunks(4).map(word).collect())
    }

    /// This many words of zeros.
    pub fn zeros(words: usize) -> Words {
        Words(vec![0; words])
    }

    /// The words as values of `T`.
    ///
    /// # Panics
    ///
    /// If `T` is aligned to more than 4 bytes, or if the words are not a whole number of `T`.
    pub fn get<T: AnyBitPattern>(&self) -> &[T] {
        bytemuck::try_cast_slice(&self.0).unwrap_or_else(|e| panic!("{}", self.refused::<T>(&e)))
    }

    /// The words as values of `T` that can be changed.
    ///
    /// # Panics
    ///
    /// As [`Words::get`].
    pub fn get_mut<T: Pod>(&mut self) -> &mut [T] {
        let bytes = self.bytes();
        bytemuck::try_cast_slice_mut(&mut self.0).unwrap_or_else(|e| panic!("{}", refused::<T>(bytes, &e)))
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        4 * self.0.len()
    }

    pub(crate) fn raw(&self) -> &[u32] {
        &self.0
    }

    fn refused<T>(&self, e: &bytemuck::PodCastError) -> String {
        refused::<T>(self.bytes(), e)
    }
}

fn refused<T>(bytes: usize, e: &bytemuck::PodCastError) -> String {
    let (name, size, align) = (std::any::type_name::<T>(), size_of::<T>(), align_of::<T>());
    format!("a binding of {bytes} bytes is not a slice of {name} ({size} bytes, aligned to {align}, limit 4): {e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_and_the_last_word_is_filled_up() {
        assert_eq!(Words::of(&[1.5f32, -2.0]).get::<f32>(), [1.5, -2.0]);
        let mut words = Words::of(&[1u8, 2, 3, 4, 5]);
        assert_eq!((words.bytes(), words.get::<u8>()), (8, &[1u8, 2, 3, 4, 5, 0, 0, 0][..]));
        words.get_mut::<u16>()[1] = 0xffff;
        assert_eq!(words.get::<u8>()[..4], [1, 2, 255, 255]);
    }

    #[test]
    #[should_panic(expected = "a binding of 4 bytes is not a slice of [u32; 2]")]
    fn a_part_of_a_value_is_refused() {
        Words::zeros(1).get::<[u32; 2]>();
    }
}
