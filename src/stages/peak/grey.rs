//! In: a picture. Out: its grey levels by column and row, for any depth. Frame and unit: px, grey levels.

/// Grey levels of a picture.
pub(crate) trait Grey: Copy + Sync {
    /// The level of a pixel that lies in the picture.
    fn inside(&self, x: i32, y: i32) -> i32;
    /// The level of a pixel; beyond the border the border pixel repeats.
    fn whole(&self, x: i32, y: i32) -> i32;
    /// Whether both are the same picture.
    fn is(&self, other: &Self) -> bool;
    /// The level of a pixel by its number, row by row.
    fn stored(&self, number: i32) -> i32;
    /// Four neighbours in a row, as they are stored.
    type Four: Copy;
    /// Those from a pixel on, by its number.
    fn four(&self, number: i32) -> Self::Four;
    /// The level of one of them, 0..4.
    fn of_four(four: Self::Four, which: usize) -> i32;

    /// As `whole`.
    #[inline(always)]
    fn level(&self, x: i32, y: i32) -> f32 {
        self.whole(x, y) as f32
    }
}

/// A skeleton pixel of a picture, x | y << 16.
#[derive(Clone, Copy)]
pub(crate) struct Place<G> {
    pub(crate) image: G,
    pub(crate) pixel: u32,
    pub(crate) shot: u32,
}

impl<G> Place<G> {
    #[inline(always)]
    pub(super) fn at(&self) -> (i32, i32) {
        ((self.pixel & 0xffff) as i32, (self.pixel >> 16) as i32)
    }
}

/// A picture as it is stored: rows from the top, sizes in px.
#[derive(Clone, Copy)]
pub(crate) struct View<'a, T> {
    pub(crate) pixels: &'a [T],
    pub(crate) width: i32,
    pub(crate) height: i32,
}

/// A level as it is stored, and four of them in one word.
pub(crate) trait Level: Copy + Sync + Into<i32> {
    type Four: Copy;
    fn four(levels: [Self; 4]) -> Self::Four;
    fn of_four(four: Self::Four, which: usize) -> i32;
}

macro_rules! level {
    ($($level:ty, $four:ty);*) => {$(
        impl Level for $level {
            type Four = $four;
            /// The first one lies in the lowest bits. On most processors this is one load.
            #[inline(always)]
            fn four(levels: [Self; 4]) -> $four {
                (0..4).fold(0, |four, i| four | <$four>::from(levels[i]) << (<$level>::BITS * i as u32))
            }
            #[inline(always)]
            fn of_four(four: $four, which: usize) -> i32 {
                i32::from((four >> (<$level>::BITS * which as u32)) as $level)
            }
        }
    )*};
}
level!(u8, u32; u16, u64);

impl<T: Level> Grey for View<'_, T> {
    #[inline(always)]
    fn inside(&self, x: i32, y: i32) -> i32 {
        self.pixels[(y * self.width + x) as usize].into()
    }
    #[inline(always)]
    fn whole(&self, x: i32, y: i32) -> i32 {
        self.inside(x.clamp(0, self.width - 1), y.clamp(0, self.height - 1))
    }
    #[inline(always)]
    fn is(&self, other: &Self) -> bool {
        std::ptr::eq(self.pixels, other.pixels)
    }
    #[inline(always)]
    fn stored(&self, number: i32) -> i32 {
        self.pixels[number as usize].into()
    }
    type Four = T::Four;
    #[inline(always)]
    fn four(&self, number: i32) -> T::Four {
        let from = &self.pixels[number as usize..];
        T::four(*from.first_chunk().expect("four pixels in the picture"))
    }
    #[inline(always)]
    fn of_four(four: T::Four, which: usize) -> i32 {
        T::of_four(four, which)
    }
}

/// The same picture for places whose neighbourhood lies in it, so that no border is checked.
#[derive(Clone, Copy)]
pub(super) struct Inner<G>(pub G);

impl<G: Grey> Grey for Inner<G> {
    #[inline(always)]
    fn inside(&self, x: i32, y: i32) -> i32 {
        self.0.inside(x, y)
    }
    #[inline(always)]
    fn whole(&self, x: i32, y: i32) -> i32 {
        self.0.inside(x, y)
    }
    #[inline(always)]
    fn is(&self, other: &Self) -> bool {
        self.0.is(&other.0)
    }
    #[inline(always)]
    fn stored(&self, number: i32) -> i32 {
        self.0.stored(number)
    }
    type Four = G::Four;
    #[inline(always)]
    fn four(&self, number: i32) -> G::Four {
        self.0.four(number)
    }
    #[inline(always)]
    fn of_four(four: G::Four, which: usize) -> i32 {
        G::of_four(four, which)
    }
}
