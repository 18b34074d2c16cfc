//! SIMD: several cells at once, in registers as wide as the processor has (found out at run time). In: a task. Out: its result. All widths do
//! the same operations on each cell, without fused multiply-add, so results are equal to the bit.
//!
//! The crate pulp chooses the width; here its values get operators, so that formulas read like formulas.

#![allow(clippy::inline_always)] // lanes are registers only where all is inlined

use pulp::{Arch, Simd, WithSimd};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// A task over lanes; what it calls is to be `#[inline(always)]`, or it stays narrow.
pub trait Task {
    /// What it returns.
    type Out;
    /// The task.
    fn run<S: Simd>(self, simd: S) -> Self::Out;
}

struct Run<T>(T);

impl<T: Task> WithSimd for Run<T> {
    type Output = T::Out;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> T::Out {
        self.0.run(simd)
    }
}

/// Runs a task in the widest registers there are.
#[inline]
pub fn widest<T: Task>(task: T) -> T::Out {
    Arch::new().dispatch(Run(task))
}

/// One number a lane.
#[derive(Clone, Copy)]
pub struct Lanes<S: Simd> {
    simd: S,
    /// The numbers.
    pub value: S::f32s,
}

/// One truth a lane.
#[derive(Clone, Copy)]
pub struct Which<S: Simd> {
    simd: S,
    mask: S::m32s,
}

/// Most lanes there may be.
pub const MOST_LANES: usize = 8;
const COUNT: [f32; MOST_LANES] = [0., 1., 2., 3., 4., 5., 6., 7.];
impl<S: Simd> Lanes<S> {
    /// Numbers in a register.
    #[inline(always)]
    pub fn new(simd: S, value: S::f32s) -> Self {
        Self { simd, value }
    }
    /// 0, 1, 2 and so on.
    #[inline(always)]
    pub fn counting(simd: S) -> Self {
        Self::new(simd, simd.partial_load_f32s(&COUNT[..S::F32_LANES]))
    }
    /// The same number in every lane.
    #[inline(always)]
    pub fn of(self, x: f32) -> Self {
        Self::new(self.simd, self.simd.splat_f32s(x))
    }
    /// The larger.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.max_f32s(self.value, other.value))
    }
    /// The smaller.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.min_f32s(self.value, other.value))
    }
    /// Without sign.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self::new(self.simd, self.simd.abs_f32s(self.value))
    }
    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self::new(self.simd, self.simd.sqrt_f32s(self.value))
    }
    /// Where it is below the other.
    #[inline(always)]
    pub fn below(self, other: Self) -> Which<S> {
        Which { simd: self.simd, mask: self.simd.less_than_f32s(self.value, other.value) }
    }
    /// Where it is at most the other.
    #[inline(always)]
    pub fn at_most(self, other: Self) -> Which<S> {
        Which { simd: self.simd, mask: self.simd.less_than_or_equal_f32s(self.value, other.value) }
    }
    /// Where it is the other.
    #[inline(always)]
    pub fn is(self, other: Self) -> Which<S> {
        Which { simd: self.simd, mask: self.simd.equal_f32s(self.value, other.value) }
    }
    /// Writes the lanes into the first places of a slice.
    #[inline(always)]
    pub fn store(self, into: &mut [f32; MOST_LANES]) {
        self.simd.partial_store_f32s(&mut into[..S::F32_LANES], self.value);
    }
}
impl<S: Simd> Which<S> {
    /// Any of them?
    #[inline(always)]
    pub fn any(self) -> bool {
        self.simd.first_true_m32s(self.mask) < S::F32_LANES
    }
    /// `yes` where it holds, else `no`.
    #[inline(always)]
    pub fn pick(self, yes: Lanes<S>, no: Lanes<S>) -> Lanes<S> {
        Lanes::new(self.simd, self.simd.select_f32s(self.mask, yes.value, no.value))
    }
    /// `yes` where it holds, else what is there.
    #[inline(always)]
    pub fn put(self, yes: u32, there: &mut S::u32s) {
        *there = self.simd.select_u32s(self.mask, self.simd.splat_u32s(yes), *there);
    }
}

macro_rules! operator {
    ($name:ident, $call:ident, $of:ident) => {
        impl<S: Simd> $name for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $call(self, other: Self) -> Self {
                Self::new(self.simd, self.simd.$of(self.value, other.value))
            }
        }
        impl<S: Simd> $name<f32> for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $call(self, other: f32) -> Self {
                self.$call(self.of(other))
            }
        }
    };
}

operator!(Add, add, add_f32s);
operator!(Sub, sub, sub_f32s);
operator!(Mul, mul, mul_f32s);
operator!(Div, div, div_f32s);
impl<S: Simd> BitAnd for Which<S> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self { simd: self.simd, mask: self.simd.and_m32s(self.mask, other.mask) }
    }
}
impl<S: Simd> BitOr for Which<S> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self { simd: self.simd, mask: self.simd.or_m32s(self.mask, other.mask) }
    }
}
