//! In: the size of a pyramid level and of a model. Out: the layout that the stages of the coarse shape search share
//! with their test cases. Frame and unit: cells of the level, x right, y down; strided places are 4 cells apart.

pub(crate) const SHARED: &str = include_str!("../../../shaders/shared/shape.wgsl");
/// WGSL name, members and bytes of [`ShapeFrame`], for the contract tests.
pub const UNIFORM: (&str, &[crate::gpu::Field], usize) = crate::stages::frame::uniform_fields!(ShapeFrame: width,
    height, margin,
    columns, rows, words, first, ignore, features, least, turns, capacity);

/// Number of directions in a full turn.
pub const BINS: usize = 16;
/// Distance in cells between searched places of a level, and size of the window over which directions are spread.
pub const STRIDE: usize = 4;

/// The WGSL struct of the same name, shaders/shared/shape.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ShapeFrame {
    /// Width of the level, cells.
    pub width: u32,
    /// Height of the level, cells.
    pub height: u32,
    /// Empty border on every side of the level, cells, a multiple of [`STRIDE`].
    pub margin: u32,
    /// Strided places in a row, including the border.
    pub columns: u32,
    /// Rows of strided places, including the border.
    pub rows: u32,
    /// Words in one row of strided places; a word has four places.
    pub words: u32,
    /// Words of the responses of all layers before this one.
    pub first: u32,
    /// 1 if rising and falling edges count as the same, else 0.
    pub ignore: u32,
    /// Features of the model at one turn, at most 63.
    pub features: u32,
    /// Least sum of a hit, 0..=255.
    pub least: u32,
    /// Number of turns of the model in this run.
    pub turns: u32,
    /// Capacity of the list of hits.
    pub capacity: u32,
}

impl ShapeFrame {
    /// `margin` is rounded up to whole strides.
    pub fn new(width: usize, height: usize, margin: usize) -> ShapeFrame {
        let margin = margin.next_multiple_of(STRIDE);
        let (columns, rows) = ((width + 2 * margin).div_ceil(STRIDE), (height + 2 * margin).div_ceil(STRIDE));
        ShapeFrame {
            width: width as u32,
            height: height as u32,
            margin: margin as u32,
            columns: columns as u32,
            rows: rows as u32,
            words: columns.div_ceil(4) as u32,
            ..Default::default()
        }
    }
    /// Words of one turn's sums, which is also the size of one direction and phase of the responses.
    pub fn plane(&self) -> usize {
        (self.words * self.rows) as usize
    }
    /// Words of all directions and phases of one layer.
    pub fn layer_words(&self) -> usize {
        BINS * STRIDE * STRIDE * self.plane()
    }
    /// Where a feature that lies `dx`, `dy` cells from the model's place reads the responses of `layer`: first word,
    /// shift in columns, shift in rows, 0.
    pub fn feature(&self, layer: usize, want: usize, dx: i64, dy: i64) -> [i32; 4] {
        let t = STRIDE as i64;
        let phase = (dy.rem_euclid(t) * t + dx.rem_euclid(t)) as usize;
        let first = layer * self.layer_words() + (want * STRIDE * STRIDE + phase) * self.plane();
        [first as i32, dx.div_euclid(t) as i32, dy.div_euclid(t) as i32, 0]
    }
    /// The block from a binding's words.
    pub fn read(binding: &[u32]) -> ShapeFrame {
        *bytemuck::from_bytes(bytemuck::cast_slice(binding))
    }
}
