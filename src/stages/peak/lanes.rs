//! In: numbers of eight fits that run side by side. Out: arithmetic on all of them at once, with the rounding of a
//! single fit. Frame and unit: none.

use std::array::from_fn;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// As many as a vector register of most processors holds. If it holds fewer, two registers take turns.
pub(in crate::stages) const LANES: usize = 8;

/// One number for each fit.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(in crate::stages) struct Lanes(pub [f32; LANES]);

impl Lanes {
    pub const ZERO: Lanes = Lanes::all(0.0);

    #[inline(always)]
    pub const fn all(value: f32) -> Lanes {
        Lanes([value; LANES])
    }
    #[inline(always)]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Lanes {
        Lanes(from_fn(|i| f(self.0[i])))
    }
    #[inline(always)]
    pub fn with(self, other: Lanes, f: impl Fn(f32, f32) -> f32) -> Lanes {
        Lanes(from_fn(|i| f(self.0[i], other.0[i])))
    }
    /// The larger; `other` if this is not a number. One instruction, unlike `f32::max`.
    #[inline(always)]
    pub fn max(self, other: Lanes) -> Lanes {
        self.with(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    pub fn min(self, other: Lanes) -> Lanes {
        self.with(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    pub fn sqrt(self) -> Lanes {
        self.map(f32::sqrt)
    }
    #[inline(always)]
    pub fn clamp(self, low: Lanes, high: Lanes) -> Lanes {
        self.max(low).min(high)
    }
    /// `self` in the lanes that still run, `other` in those that have ended.
    #[inline(always)]
    pub fn or(self, runs: &[bool; LANES], other: Lanes) -> Lanes {
        Lanes(from_fn(|i| if runs[i] { self.0[i] } else { other.0[i] }))
    }
}

/// Whole numbers up to this one stand in the lowest bits of their sum with [`bits`]' constant.
const MOST: f32 = 4_194_304.0;

/// A whole number from -[`MOST`] to `MOST` in the lowest bits, as the exponent of the sum leaves room for no fraction.
#[inline(always)]
fn bits(whole: f32) -> u32 {
    (whole + 3.0 * MOST).to_bits()
}

/// One whole number for each fit.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(in crate::stages) struct Whole(pub [i32; LANES]);

impl Whole {
    pub const ZERO: Whole = Whole::all(0);

    #[inline(always)]
    pub const fn all(value: i32) -> Whole {
        Whole([value; LANES])
    }
    /// The largest whole numbers that are not above these numbers, which lie between -[`MOST`] and `MOST`. A cast of
    /// the language looks for larger ones lane by lane.
    #[inline(always)]
    pub fn floor(of: Lanes) -> Whole {
        Whole(from_fn(|i| bits(of.0[i].floor()).wrapping_sub(bits(0.0)) as i32))
    }
    #[inline(always)]
    pub fn float(self) -> Lanes {
        Lanes(from_fn(|i| self.0[i] as f32))
    }
    #[inline(always)]
    pub fn with(self, other: Whole, f: impl Fn(i32, i32) -> i32) -> Whole {
        Whole(from_fn(|i| f(self.0[i], other.0[i])))
    }
}

macro_rules! by_lane {
    ($($name:ident $call:ident $sign:tt),*) => {$(
        impl $name for Lanes {
            type Output = Lanes;
            #[inline(always)]
            fn $call(self, other: Lanes) -> Lanes {
                self.with(other, |a, b| a $sign b)
            }
        }
        impl $name for Whole {
            type Output = Whole;
            #[inline(always)]
            fn $call(self, other: Whole) -> Whole {
                self.with(other, |a, b| a $sign b)
            }
        }
        impl $name<Lanes> for f32 {
            type Output = Lanes;
            #[inline(always)]
            fn $call(self, other: Lanes) -> Lanes {
                Lanes::all(self) $sign other
            }
        }
    )*};
}
by_lane!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Neg for Lanes {
    type Output = Lanes;
    #[inline(always)]
    fn neg(self) -> Lanes {
        self.map(|a| -a)
    }
}

// The same digits as in the shader.
#[allow(clippy::approx_constant)]
/// e to the power of x from -80 to 80, with a relative error of 2e-7. Every machine has its own `exp`; this one is the
/// shader's.
#[inline(always)]
pub(in crate::stages) fn exponential(x: Lanes) -> Lanes {
    let t = (x * Lanes::all(std::f32::consts::LOG2_E)).clamp(Lanes::all(-120.0), Lanes::all(120.0));
    let whole = (t + Lanes::all(0.5)).map(f32::floor);
    let f = t - whole;
    let p = Lanes::all(0.009_618_129) + f * (Lanes::all(0.001_333_356) + 0.000_154_035_3 * f);
    let p = Lanes::all(0.240_226_5) + f * (Lanes::all(0.055_504_11) + f * p);
    let p = Lanes::all(1.0) + f * (Lanes::all(0.693_147_2) + f * p);
    // Whole numbers from -120 to 120, which fit into the exponent's bits.
    p.with(whole, |p, whole| p * f32::from_bits(bits(whole).wrapping_add(127) << 23))
}
