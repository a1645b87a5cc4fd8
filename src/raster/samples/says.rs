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
    /// Distance of columns and rows, with its unit and the name of the statement as words.
    pub spacing: Option<([f64; 2], String)>,
    /// mm in the unit of the heights, after `scale`, with the unit and the name of the statement as words.
    pub unit: Option<(f64, String)>,
    /// Number of pictures in the file, if it is stated beside its list of pages.
    pub pictures: Option<usize>,
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

/// The names of units of length that programs write, with their length, mm.
const UNITS: &[(f64, &[&str])] = &[
    (1e-6, &["nm", "nanometre", "nanometer"]),
    (1e-3, &["um", "µm", "μm", "\\u00b5m", "micron", "micrometre", "micrometer"]),
    (1.0, &["mm", "millimetre", "millimeter"]),
    (10.0, &["cm", "centimetre", "centimeter"]),
    (100.0, &["dm", "decimetre", "decimeter"]),
    (25.4, &["in", "inch", "inche"]),
    (304.8, &["ft", "foot", "feet"]),
    (1000.0, &["m", "metre", "meter"]),
];

/// Length of a unit by its name, mm.
pub fn unit_mm(name: &str) -> Option<f64> {
    let name = name.trim().to_lowercase();
    let one = name.strip_suffix('s').unwrap_or(&name);
    UNITS.iter().find(|(_, names)| names.contains(&one)).map(|u| u.0)
}
