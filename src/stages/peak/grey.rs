//! In: a picture. Out: its grey levels by column and row, whatever its depth.
//! Frame and unit: px, grey levels.

/// Grey levels with the border repeated, as f32.
pub(crate) trait Grey: Copy + Sync {
    fn at(&self, x: i32, y: i32) -> f32;
}

/// A picture as it lies in memory: rows from the top, sizes in px.
#[derive(Clone, Copy)]
pub(crate) struct View<'a, T> {
    pub(crate) pixels: &'a [T],
    pub(crate) width: i32,
    pub(crate) height: i32,
}

impl<T: Copy + Sync + Into<f32>> Grey for View<'_, T> {
    #[inline(always)]
    fn at(&self, x: i32, y: i32) -> f32 {
        let (x, y) = (x.clamp(0, self.width - 1), y.clamp(0, self.height - 1));
        self.pixels[(y * self.width + x) as usize].into()
    }
}
