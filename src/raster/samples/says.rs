//! What a picture file states about its samples.

/// Statements of a file about its samples; only the orientation is applied to them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Says {
    /// Orientation that the file had, one of the eight of TIFF and Exif; the samples are upright.
    pub orientation: Option<u16>,
    /// The sample of a pixel without a value (GDAL_NODATA).
    pub missing: Option<f64>,
    /// The sample of a pixel means `scale[0] * sample + scale[1]`.
    pub scale: Option<[f64; 2]>,
    /// Distance of columns and rows, in a unit that the file does not name (ModelPixelScale).
    pub spacing: Option<[f64; 2]>,
    /// The largest level that the header of a PGM states (MAXVAL).
    pub most: Option<u32>,
    /// The smallest sample is the brightest one.
    pub white_is_zero: bool,
    /// Compression changed the samples (JPEG).
    pub lossy: bool,
    /// A picture of two levels, which are shades and not numbers.
    pub two_levels: bool,
    /// Facts that may surprise, a sentence each.
    pub notes: Vec<String>,
}
