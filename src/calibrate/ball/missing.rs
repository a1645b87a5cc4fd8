//! Removes profile points whose z means "not measured", and reports a z that seems to mean it.

use super::profile::Profile;
use crate::raster::Kind;
use crate::solve::repeated;

/// Profiles without unmeasured points, the suspected z values, and warnings about both.
pub struct Cleaned {
    /// The profiles.
    pub profiles: Vec<Profile>,
    /// The z that most points share, mm. If many points share it, it may stand for "not measured".
    pub suspects: Vec<f64>,
    /// One sentence per warning.
    pub warnings: Vec<String>,
}

/// Removes the points whose z equals `missing`.
pub fn cleaned(mut profiles: Vec<Profile>, missing: Option<f64>) -> Cleaned {
    let count = |profiles: &[Profile]| profiles.iter().map(|p| p.points.len()).sum::<usize>();
    let all = count(&profiles);
    let mut warnings = vec![];
    if let Some(z) = missing {
        profiles.iter_mut().for_each(|p| p.points.retain(|point| !Kind::Text.same(point[1], z)));
        if count(&profiles) == all {
            warnings.push(format!("no point has the z {z} that --missing names"));
        }
    }
    let left = count(&profiles);
    let found = repeated(profiles.iter().flat_map(|p| &p.points).map(|point| point[1]));
    warnings.extend(found.iter().map(|(z, n)| {
        format!(
            "{n} of {left} points have exactly the z {z}: if that means 'not measured', give --missing {z}; they \
             are excluded from the depth of the stated error"
        )
    }));
    Cleaned { profiles, suspects: found.into_iter().map(|f| f.0).collect(), warnings }
}
