//! Reading from many addresses at once: the only code here that the compiler cannot check.
//!
//! Every public function clamps its addresses to the slice, so that no call can be unsound.

use crate::math::cast;
use fearless_simd::prelude::*;
use fearless_simd::{Fallback, Simd};

/// The SIMD lanes that kernels are generic over.
pub(crate) trait Lanes:
    Simd<f32s: SimdFloat<Self, Bits = <Self as Simd>::u32s>, i32s: Bytes<Bytes = Self::u8s>>
{
    /// Four bytes from each address `base + SCALE * index`, as a little-endian word.
    ///
    /// # Safety
    /// `SCALE` is 1, 2, 4 or 8, every index is below 2^31, and four bytes can be read at every address.
    unsafe fn gather_words<const SCALE: i32>(self, base: *const u8, index: Self::u32s) -> Self::u32s;

    /// As many bytes as there are lanes, one in each.
    ///
    /// # Safety
    /// So many bytes can be read at the address.
    unsafe fn widen_bytes(self, bytes: *const u8) -> Self::u32s;

    /// Lanes of a vector.
    const WIDTH: usize = <Self::f32s as SimdBase<Self>>::LEN;

    /// Gathers single-precision numbers; an index past the end reads the last one.
    ///
    /// # Panics
    /// If there is none.
    #[inline(always)]
    fn numbers(self, table: &[f32], index: Self::u32s) -> Self::f32s {
        assert!(!table.is_empty(), "no number to read");
        let index = self.at_most(index, table.len() - 1);
        // SAFETY: the index is at most that of the last number, and each number has four bytes.
        let words = unsafe { self.gather_words::<4>(table.as_ptr().cast(), index) };
        words.bitcast()
    }

    /// The words that begin at the `index`-th number, where each number has `size` bytes; a word that would reach past
    /// the end is read from the last index where it fits.
    ///
    /// # Panics
    /// If all numbers together are shorter than a word.
    #[inline(always)]
    fn words<T: bytemuck::Pod>(self, numbers: &[T], index: Self::u32s) -> Self::u32s {
        const { assert!(matches!(size_of::<T>(), 1 | 2 | 4)) };
        assert!(numbers.len() >= 4 / size_of::<T>(), "no word to read");
        let index = self.at_most(index, numbers.len() - 4 / size_of::<T>());
        let base = numbers.as_ptr().cast();
        // SAFETY: after the clamped index there are enough numbers for four bytes.
        unsafe {
            match size_of::<T>() {
                1 => self.gather_words::<1>(base, index),
                2 => self.gather_words::<2>(base, index),
                _ => self.gather_words::<4>(base, index),
            }
        }
    }

    /// Consecutive bytes from the `first` on, one in each lane; 0 in all lanes if there are not so many.
    #[inline(always)]
    fn bytes(self, numbers: &[u8], first: usize) -> Self::u32s {
        match numbers.get(first..first + Self::WIDTH) {
            // SAFETY: the slice has as many bytes as there are lanes.
            Some(bytes) => unsafe { self.widen_bytes(bytes.as_ptr()) },
            None => Self::u32s::splat(self, 0),
        }
    }

    /// Clamps indices to the last valid one, which is below 2^31.
    #[inline(always)]
    fn at_most(self, index: Self::u32s, last: usize) -> Self::u32s {
        index.min(Self::u32s::splat(self, cast::fit_u32(last.min(i32::MAX as usize))))
    }
}

impl Lanes for Fallback {
    #[inline(always)]
    unsafe fn widen_bytes(self, bytes: *const u8) -> Self::u32s {
        // SAFETY: guaranteed by the caller.
        unsafe { widen_one_by_one(self, bytes) }
    }

    #[inline(always)]
    unsafe fn gather_words<const SCALE: i32>(self, base: *const u8, index: Self::u32s) -> Self::u32s {
        // SAFETY: guaranteed by the caller.
        unsafe { one_by_one::<Self, SCALE>(self, base, index) }
    }
}

#[cfg(target_arch = "aarch64")]
impl Lanes for fearless_simd::Neon {
    #[inline(always)]
    unsafe fn widen_bytes(self, bytes: *const u8) -> Self::u32s {
        // SAFETY: guaranteed by the caller.
        unsafe { widen_one_by_one(self, bytes) }
    }

    #[inline(always)]
    unsafe fn gather_words<const SCALE: i32>(self, base: *const u8, index: Self::u32s) -> Self::u32s {
        // SAFETY: guaranteed by the caller.
        unsafe { one_by_one::<Self, SCALE>(self, base, index) }
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for fearless_simd::Avx2 {
    #[inline(always)]
    unsafe fn widen_bytes(self, bytes: *const u8) -> Self::u32s {
        use std::arch::x86_64::{_mm_loadl_epi64, _mm256_cvtepu8_epi32};
        // SAFETY: the token proves that the instructions exist; the caller guarantees the eight bytes.
        unsafe { _mm256_cvtepu8_epi32(_mm_loadl_epi64(bytes.cast())) }.simd_into(self)
    }

    #[inline(always)]
    unsafe fn gather_words<const SCALE: i32>(self, base: *const u8, index: Self::u32s) -> Self::u32s {
        // SAFETY: the token proves that the instructions exist; the caller guarantees the addresses.
        let words = unsafe { std::arch::x86_64::_mm256_i32gather_epi32::<SCALE>(base.cast(), index.into()) };
        words.simd_into(self)
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for fearless_simd::Avx512 {
    #[inline(always)]
    unsafe fn widen_bytes(self, bytes: *const u8) -> Self::u32s {
        use std::arch::x86_64::{_mm_loadu_si128, _mm512_cvtepu8_epi32};
        // SAFETY: the token proves that the instructions exist; the caller guarantees the sixteen bytes.
        unsafe { _mm512_cvtepu8_epi32(_mm_loadu_si128(bytes.cast())) }.simd_into(self)
    }

    #[inline(always)]
    unsafe fn gather_words<const SCALE: i32>(self, base: *const u8, index: Self::u32s) -> Self::u32s {
        // SAFETY: the token proves that the instructions exist; the caller guarantees the addresses.
        let words = unsafe { std::arch::x86_64::_mm512_i32gather_epi32::<SCALE>(index.into(), base.cast()) };
        words.simd_into(self)
    }
}

/// Widening for processors without an instruction for it, or whose compiler finds it.
///
/// # Safety
/// As [`Lanes::widen_bytes`].
#[inline(always)]
unsafe fn widen_one_by_one<S: Lanes>(simd: S, bytes: *const u8) -> S::u32s {
    // SAFETY: the caller guarantees as many bytes as there are lanes.
    S::u32s::from_fn(simd, |lane| u32::from(unsafe { bytes.add(lane).read() }))
}

/// The gather for processors without a gather instruction.
///
/// # Safety
/// As [`Lanes::gather_words`].
#[inline(always)]
unsafe fn one_by_one<S: Lanes, const SCALE: i32>(simd: S, base: *const u8, index: S::u32s) -> S::u32s {
    let index = index.as_slice();
    S::u32s::from_fn(simd, |lane| {
        let offset = index[lane] as usize * SCALE.cast_unsigned() as usize;
        // SAFETY: the caller guarantees that four bytes can be read there; any alignment is allowed.
        u32::from_le_bytes(unsafe { base.add(offset).cast::<[u8; 4]>().read() })
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Kernel, Level};
    use super::*;

    struct Read<'a> {
        bytes: &'a [u8],
        shorts: &'a [u16],
        numbers: &'a [f32],
        index: [u32; 16],
    }

    impl Kernel for Read<'_> {
        type Output = Vec<(u32, u32, f32)>;

        #[inline(always)]
        fn run<S: Lanes>(self, simd: S) -> Self::Output {
            let index = S::u32s::from_fn(simd, |lane| self.index[lane]);
            let bytes = simd.words(self.bytes, index);
            let shorts = simd.words(self.shorts, index);
            let numbers = simd.numbers(self.numbers, index);
            let run = simd.bytes(self.bytes, 3);
            assert!((0..S::WIDTH).all(|lane| run.as_slice()[lane] == u32::from(self.bytes[3 + lane])));
            let past = simd.bytes(self.bytes, self.bytes.len() - S::WIDTH + 1);
            assert!(past.as_slice().iter().all(|&byte| byte == 0));
            (0..S::WIDTH)
                .map(|i| (bytes.as_slice()[i], shorts.as_slice()[i], numbers.as_slice()[i]))
                .collect()
        }
    }

    #[test]
    fn where_there_is_nothing_to_read_it_panics() {
        struct Numbers;
        struct Words;
        impl Kernel for Numbers {
            type Output = f32;

            #[inline(always)]
            fn run<S: Lanes>(self, simd: S) -> f32 {
                simd.numbers(&[], S::u32s::splat(simd, 0)).as_slice()[0]
            }
        }
        impl Kernel for Words {
            type Output = u32;

            #[inline(always)]
            fn run<S: Lanes>(self, simd: S) -> u32 {
                simd.words(&[1_u8, 2, 3], S::u32s::splat(simd, 0)).as_slice()[0]
            }
        }
        for level in Level::available() {
            let panics =
                |read: &dyn Fn()| std::panic::catch_unwind(std::panic::AssertUnwindSafe(read)).is_err();
            assert!(panics(&|| assert_eq!(level.run(Numbers), 0.0)), "{level:?}");
            assert!(panics(&|| assert_eq!(level.run(Words), 0x30201)), "{level:?}");
        }
    }

    #[test]
    fn every_level_reads_the_same_and_never_past_the_end() {
        let bytes: Vec<u8> = (0..40).map(|i| i * 5).collect();
        let shorts: Vec<u16> = (0..40).map(|i| i * 999).collect();
        let numbers: Vec<f32> = (0..40_u8).map(|i| f32::from(i) * 0.5).collect();
        let index = [0, 3, 36, 37, 39, 40, 1000, u32::MAX, 1 << 31, 5, 6, 7, 8, 9, 10, 38];
        for level in Level::available() {
            let read = Read { bytes: &bytes, shorts: &shorts, numbers: &numbers, index };
            for (lane, found) in level.run(read).into_iter().enumerate() {
                let i = index[lane] as usize;
                let byte = |k: usize| u32::from(bytes[i.min(36) + k]) << (8 * k);
                let word = byte(0) | byte(1) | byte(2) | byte(3);
                let pair = u32::from(shorts[i.min(38)]) | u32::from(shorts[i.min(38) + 1]) << 16;
                assert_eq!(found, (word, pair, numbers[i.min(39)]), "{level:?}, index {i}");
            }
        }
    }
}
