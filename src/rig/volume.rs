//! In: nearest and farthest depth, and who stated them. Out: the range in which a rig works or is judged, with its
//! wording in messages.
//! Frame and unit: along the camera's optical axis (for a profile sensor its z), mm.

/// A range of depths with its origin: the program never assumes a range.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Volume {
    /// Nearest depth, mm.
    pub near_mm: f64,
    /// Farthest depth, mm.
    pub far_mm: f64,
    /// Who stated it, in words: "station.toml", "where the boards stood".
    pub from: String,
}

impl Volume {
    /// `from` says in words who stated the depths.
    pub fn new(near_mm: f64, far_mm: f64, from: &str) -> Volume {
        Volume { near_mm, far_mm, from: from.into() }
    }
    /// The range that some depths span; `None` without a depth.
    pub fn spanned(depths: impl Iterator<Item = f64>, from: &str) -> Option<Volume> {
        let (near, far) =
            depths.filter(|z| z.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        (near <= far).then(|| Volume::new(near, far, from))
    }
    /// The two depths; if no volume is stated, all depths from 0 to infinity.
    pub fn depths(volume: Option<&Volume>) -> [f64; 2] {
        volume.map_or([0.0, f64::INFINITY], |v| [v.near_mm, v.far_mm])
    }
    /// Depth halfway, mm.
    pub fn middle(&self) -> f64 {
        (self.near_mm + self.far_mm) / 2.0
    }
    /// Distance from the nearest depth to the farthest, mm.
    pub fn length(&self) -> f64 {
        self.far_mm - self.near_mm
    }
    /// The same range extended by its length at both ends, but not nearer than half of the nearest depth.
    pub fn extended(&self) -> Volume {
        let near = f64::max(self.near_mm - self.length(), self.near_mm / 2.0);
        let from = format!("{} and as far again to both sides", self.from);
        Volume { near_mm: near, far_mm: self.far_mm + self.length(), from }
    }
    /// The two depths in words, with enough digits to distinguish them.
    pub fn words(&self) -> String {
        format!("{} to {} mm", self.depth(self.near_mm), self.depth(self.far_mm))
    }
    /// One depth of this range, with enough digits to distinguish the range's ends.
    pub fn depth(&self, mm: f64) -> String {
        let length = if self.length() > 0.0 { self.length() } else { mm.abs().max(1.0) };
        let digits = (2.0 - length.log10()).ceil().clamp(0.0, 4.0) as usize;
        format!("{mm:.digits$}")
    }
}

impl std::fmt::Display for Volume {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.words(), self.from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_range_and_the_extension_stays_before_the_camera() {
        let v = Volume::spanned([411.3, 504.2, 450.0].into_iter(), "where the boards stood").unwrap();
        assert_eq!(v.to_string(), "411.3 to 504.2 mm (where the boards stood)");
        assert_eq!(Volume::new(58.123, 59.456, "x").words(), "58.12 to 59.46 mm");
        assert_eq!(Volume::new(1200.0, 1800.4, "x").words(), "1200 to 1800 mm");
        assert_eq!(v.depth(v.middle()), "457.8");
        let e = v.extended();
        assert!((e.near_mm - 318.4).abs() < 1e-9 && (e.far_mm - 597.1).abs() < 1e-9);
        assert_eq!(Volume::new(50.0, 300.0, "x").extended().near_mm, 25.0);
        assert!(Volume::spanned([f64::NAN].into_iter(), "x").is_none());
        // A profile sensor's depths run through zero.
        assert_eq!(Volume::new(-23.0, 19.0, "x").middle(), -2.0);
    }
}
