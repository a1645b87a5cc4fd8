//! In: nothing. Out: the record of one peak, and the reasons for rejecting one. Frame and unit: px, grey levels.

/// Why a peak is rejected; the low 8 bits of `Peak::flags`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Reject {
    /// Not rejected.
    Kept = 0,
    /// Outside the image of the working volume.
    Region = 1,
    /// Too little light.
    Faint = 2,
    /// Narrower than the laser can be: a hot pixel, a glint, or a spot cut by an edge.
    Narrow = 3,
    /// Wider than one stripe: two stripes in one, scattered light.
    Wide = 4,
    /// Its own standard deviation is too large.
    Uncertain = 5,
    /// The stripe runs along the direction of depth.
    Steep = 6,
    /// Much weaker than another peak on the same line across the stripe: a reflection.
    Echo = 7,
    /// No neighbour in the shots before and after, or none on its own line: a reflection or a speck.
    Unsupported = 8,
    /// The ray does not meet the laser plane in front of the camera, or the lens model has no ray there.
    NoPoint = 9,
    /// Light of two surfaces: at a line's end, and too wide or in a glow.
    Mixed = 10,
}

impl Reject {
    /// All reasons, in the order of their numbers.
    pub const ALL: [Reject; 11] = [
        Reject::Kept,
        Reject::Region,
        Reject::Faint,
        Reject::Narrow,
        Reject::Wide,
        Reject::Uncertain,
        Reject::Steep,
        Reject::Echo,
        Reject::Unsupported,
        Reject::NoPoint,
        Reject::Mixed,
    ];
    /// Name for reports and legends.
    pub fn words(self) -> &'static str {
        match self {
            Reject::Kept => "kept",
            Reject::Region => "outside the working volume",
            Reject::Faint => "faint",
            Reject::Narrow => "narrow",
            Reject::Wide => "wide",
            Reject::Uncertain => "uncertain",
            Reject::Steep => "steep",
            Reject::Echo => "echo",
            Reject::Unsupported => "unsupported",
            Reject::NoPoint => "no point",
            Reject::Mixed => "mixed",
        }
    }
}

/// A bit of `Peak::flags`: at least one pixel of the fit was saturated.
pub const SATURATED: u32 = 1 << 8;
/// The bits of [`Peak::flags`] that hold the number of its [`Reject`].
pub const REASON: u32 = 0xff;

/// One peak, 12 words, with the same layout on the GPU.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Peak {
    /// Centre, px from the middle of the left column.
    pub u: f32,
    /// Centre, px from the middle of the top row.
    pub v: f32,
    /// Unit vector across the stripe; v component positive, or u where v is 0.
    pub normal_u: f32,
    /// The v component of that vector, 0..=1.
    pub normal_v: f32,
    /// Height of the profile above the background, grey levels; may exceed full scale when saturated.
    pub amplitude: f32,
    /// Level beside the stripe, grey levels of the picture's depth.
    pub background: f32,
    /// Gaussian sigma of the profile, px.
    pub width_px: f32,
    /// Standard deviation of the centre along the normal, px.
    pub sigma_px: f32,
    /// Amplitude over the standard deviation of a background pixel's noise.
    pub snr: f32,
    /// Low 8 bits: [`Reject`]; bit 8: [`SATURATED`].
    pub flags: u32,
    /// Skeleton pixel, x | y << 16.
    pub pixel: u32,
    /// Number of the shot; on the GPU within its batch.
    pub shot: u32,
}

impl Peak {
    /// Whether no test has rejected it.
    pub fn kept(&self) -> bool {
        self.flags & REASON == 0
    }
    /// Why it was rejected; [`Reject::Kept`] if it was not.
    pub fn reject(&self) -> Reject {
        Reject::ALL[(self.flags & REASON).min(10) as usize]
    }
    /// Sets the reason, unless one is already set: the first test that fails determines it.
    pub fn refuse(&mut self, why: Reject) {
        if self.kept() {
            self.flags |= why as u32;
        }
    }
}
