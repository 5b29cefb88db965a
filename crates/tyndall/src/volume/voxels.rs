//! The samples themselves, in the file's type.

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

    /// Replaces NaN, and the infinity with the smaller data value, by the finite sample with the smallest data
    /// value, and the other infinity by the one with the largest (0 if no sample is finite); returns how many
    /// were replaced. The sign of `slope` decides which end of the stored samples has the smallest data value.
    pub(super) fn mend_non_finite(&mut self, slope: f64) -> u64 {
        match self {
            Self::F32(data) => fix(data, f32::is_finite, f32::INFINITY.copysign(cast::single(slope)), 0.0),
            Self::F64(data) => fix(data, f64::is_finite, f64::INFINITY.copysign(slope), 0.0),
            _ => 0,
        }
    }
}

fn fix<T: Voxel>(data: &mut [T], finite: impl Fn(T) -> bool, largest: T, zero: T) -> u64 {
    let mut bad = 0;
    let mut range: Option<[T; 2]> = None;
    for &v in data.iter() {
        if !finite(v) {
            bad += 1;
            continue;
        }
        let [lo, hi] = range.unwrap_or([v, v]);
        range = Some([if v < lo { v } else { lo }, if v > hi { v } else { hi }]);
    }
    if bad > 0 {
        let [lo, hi] = range.unwrap_or([zero, zero]);
        let [smallest_value, largest_value] = if largest > zero { [lo, hi] } else { [hi, lo] };
        for v in data.iter_mut().filter(|v| !finite(**v)) {
            *v = if *v == largest { largest_value } else { smallest_value };
        }
    }
    bad
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_becomes_the_smallest_value() {
        let mut v = Voxels::F32(vec![3.0, f32::NAN, -2.0, f32::INFINITY, f32::NEG_INFINITY]);
        assert_eq!(v.mend_non_finite(1.0), 3);
        assert_eq!(v, Voxels::F32(vec![3.0, -2.0, -2.0, 3.0, -2.0]));
        let mut turned = Voxels::F64(vec![3.0, f64::NAN, -2.0, f64::INFINITY]);
        assert_eq!(turned.mend_non_finite(-1.0), 2);
        assert_eq!(turned, Voxels::F64(vec![3.0, 3.0, -2.0, 3.0]));
        let mut none = Voxels::F64(vec![f64::NAN]);
        assert_eq!(none.mend_non_finite(1.0), 1);
        assert_eq!(none, Voxels::F64(vec![0.0]));
    }
}
