//! The samples themselves, in the file's type.

use super::ValueMap;
use crate::math::cast;

/// Samples in memory order, x fastest, in one of eight types.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "each variant is named for the type it holds")]
pub enum Voxels {
    U8(Vec<u8>),
    I8(Vec<i8>),
    U16(Vec<u16>),
    I16(Vec<i16>),
    U32(Vec<u32>),
    I32(Vec<i32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// Runs the same expression on the slice inside, whatever its type.
macro_rules! with_voxels {
    ($voxels:expr, $data:ident => $body:expr) => {
        match $voxels {
            $crate::volume::Voxels::U8($data) => $body,
            $crate::volume::Voxels::I8($data) => $body,
            $crate::volume::Voxels::U16($data) => $body,
            $crate::volume::Voxels::I16($data) => $body,
            $crate::volume::Voxels::U32($data) => $body,
            $crate::volume::Voxels::I32($data) => $body,
            $crate::volume::Voxels::F32($data) => $body,
            $crate::volume::Voxels::F64($data) => $body,
        }
    };
}
pub(crate) use with_voxels;

/// A sample type.
pub trait Voxel: Copy + Default + Send + Sync + PartialOrd {
    /// As a single-precision number; wide types round to nearest.
    fn to_f32(self) -> f32;
    /// As a double-precision number, exactly.
    fn to_f64(self) -> f64;
}

macro_rules! exact_voxel {
    ($($t:ty)*) => {$(
        impl Voxel for $t {
            #[inline]
            fn to_f32(self) -> f32 { f32::from(self) }
            #[inline]
            fn to_f64(self) -> f64 { f64::from(self) }
        }
    )*};
}
exact_voxel!(u8 i8 u16 i16 f32);

macro_rules! wide_voxel {
    ($($t:ty)*) => {$(
        impl Voxel for $t {
            #[inline]
            fn to_f32(self) -> f32 { cast::single(f64::from(self)) }
            #[inline]
            fn to_f64(self) -> f64 { f64::from(self) }
        }
    )*};
}
wide_voxel!(u32 i32 f64);

impl Voxels {
    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        with_voxels!(self, data => data.len())
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The sample type's short name: `u8`, `i8`, `u16`, `i16`, `u32`, `i32`, `f32`, `f64`.
    #[must_use]
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::U8(_) => "u8",
            Self::I8(_) => "i8",
            Self::U16(_) => "u16",
            Self::I16(_) => "i16",
            Self::U32(_) => "u32",
            Self::I32(_) => "i32",
            Self::F32(_) => "f32",
            Self::F64(_) => "f64",
        }
    }

    /// The stored sample at a linear index, before slope and intercept.
    ///
    /// # Panics
    /// If the index is out of range.
    #[must_use]
    pub fn get(&self, index: usize) -> f64 {
        with_voxels!(self, data => data[index].to_f64())
    }

    /// Replaces each infinity by the nearest finite sample (0 if no sample is finite), and NaN, which is no data, by a number far below
    /// all data values; `slope` not zero.
    pub(super) fn mend_non_finite(&mut self, values: ValueMap) -> Mended {
        match self {
            Self::F32(data) => mend(data, values, cast::single),
            Self::F64(data) => mend(data, values, |x| x),
            _ => Mended::default(),
        }
    }

    /// Puts NaN back where a sample is `filler`.
    pub(super) fn unmend(&mut self, filler: f64) {
        match self {
            Self::F32(data) => {
                data.iter_mut().filter(|v| f64::from(**v) == filler).for_each(|v| *v = f32::NAN);
            }
            Self::F64(data) => data.iter_mut().filter(|v| **v == filler).for_each(|v| *v = f64::NAN),
            _ => {}
        }
    }
}

/// What was replaced among samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Mended {
    /// Samples that were NaN or infinite.
    pub non_finite: u64,
    /// Samples that were NaN.
    pub nan: u64,
    /// What stands for NaN.
    pub gap: Option<Gap>,
}

/// What stands for NaN among samples: a number so far below all data that what is interpolated between the two is below them too, but
/// within a four-thousandth of a voxel of the data. So no kernel needs to know of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gap {
    /// The stored sample.
    pub filler: f64,
    /// A data value above it and below all data, or the smallest of them: nothing below it is data.
    pub border: f64,
}

impl Gap {
    /// Below data from `lo` to `hi`.
    fn below([lo, hi]: [f64; 2], values: ValueMap) -> Self {
        /// In ranges of the data: larger numbers would take bits from the data beside them.
        const DEPTH: f64 = 4096.0;
        /// In ranges of the data.
        const MARGIN: f64 = 1.0 / 256.0;

        let unit = [hi - lo, lo.abs(), 1.0].into_iter().find(|&unit| unit > 0.0).unwrap_or(1.0);
        let deepest = 0.25 * f64::from(f32::MIN);
        let filler = (lo - DEPTH * unit).max(deepest).min(lo);
        Self { filler: values.stored(filler), border: (lo - MARGIN * unit).max(0.5 * filler + 0.5 * lo) }
    }
}

fn mend<T: Voxel>(data: &mut [T], values: ValueMap, from_f64: impl Fn(f64) -> T) -> Mended {
    let mut mended = Mended::default();
    let mut range: Option<[T; 2]> = None;
    for &v in data.iter() {
        let x = v.to_f64();
        if !x.is_finite() {
            mended.non_finite += 1;
            mended.nan += u64::from(x.is_nan());
            continue;
        }
        let [lo, hi] = range.unwrap_or([v, v]);
        range = Some([if v < lo { v } else { lo }, if v > hi { v } else { hi }]);
    }
    if mended.non_finite == 0 {
        return mended;
    }
    let stored = range.unwrap_or([T::default(); 2]);
    let ends = stored.map(|v| values.apply(v.to_f64()));
    let mut gap = Gap::below([ends[0].min(ends[1]), ends[0].max(ends[1])], values);
    let filler = from_f64(gap.filler);
    gap.filler = filler.to_f64();
    for v in data.iter_mut() {
        let x = v.to_f64();
        if x.is_nan() {
            *v = filler;
        } else if x.is_infinite() {
            *v = if x > 0.0 { stored[1] } else { stored[0] };
        }
    }
    mended.gap = (mended.nan > 0).then_some(gap);
    mended
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_is_below_all_data_and_infinities_are_its_ends() {
        let mut v = Voxels::F32(vec![3.0, f32::NAN, -2.0, f32::INFINITY, f32::NEG_INFINITY]);
        let mended = v.mend_non_finite(ValueMap::IDENTITY);
        let Gap { filler, border } = mended.gap.unwrap();
        assert_eq!((mended.non_finite, mended.nan), (3, 1));
        assert_eq!(v, Voxels::F32(vec![3.0, cast::single(filler), -2.0, 3.0, -2.0]));
        assert!(filler < -20_000.0 && -2.1 < border && border < -2.0, "{filler}, {border}");
        v.unmend(filler);
        assert!(v.get(1).is_nan() && v.get(2) == -2.0);
        // With a negative slope the largest stored samples have the smallest data values.
        let values = ValueMap { slope: -1.0, intercept: 0.0 };
        let mut turned = Voxels::F64(vec![3.0, f64::NAN, -2.0, f64::INFINITY]);
        let gap = turned.mend_non_finite(values).gap.unwrap();
        assert_eq!(turned, Voxels::F64(vec![3.0, gap.filler, -2.0, 3.0]));
        assert!(values.apply(gap.filler) < gap.border && gap.border < -3.0, "{gap:?}");
        let mut infinite = Voxels::F64(vec![1.0, f64::INFINITY]);
        assert_eq!(infinite.mend_non_finite(values), Mended { non_finite: 1, nan: 0, gap: None });
        let mut none = Voxels::F64(vec![f64::NAN]);
        assert_eq!(none.mend_non_finite(ValueMap::IDENTITY).nan, 1);
    }

    #[test]
    fn gaps_are_below_data_of_any_scale() {
        for [lo, hi] in
            [[0.0, 0.0], [1e-30, 2e-30], [-3e30, 1e30], [-3e38, 3e38], [7e5, 7e5], [1e6, 1e6 + 1.0]]
        {
            let Gap { filler, border } = Gap::below([lo, hi], ValueMap::IDENTITY);
            assert!(cast::single(filler).is_finite(), "{filler} below {lo}");
            assert!(filler <= border && border <= lo, "{filler}, {border}, {lo}");
            assert!(lo < -8e37 || (filler < border && border < lo), "{filler}, {border}, {lo}");
        }
    }
}
