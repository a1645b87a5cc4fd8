//! Marks or removes profile points whose z means "not measured", reports a z that seems to mean it, and lets z grow
//! away from the sensor.

use crate::raster::Kind;
use crate::recording::profiles::{Profile, measured};
use crate::solve::repeated;

/// Profiles, the suspected z values, and warnings about both.
pub struct Cleaned {
    /// The profiles.
    pub profiles: Vec<Profile>,
    /// The z that most points share, mm. If many points share it, it may stand for "not measured".
    pub suspects: Vec<f64>,
    /// One sentence per warning, and the effect that points of such a z have.
    pub warnings: Vec<String>,
}

/// What a user states about the z of profiles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Heights {
    /// The z that means "not measured", mm.
    pub missing: Option<f64>,
    /// z grows towards the sensor; it is negated.
    pub up: bool,
}

/// Profiles without the points that were not measured, or whose z is the missing one.
pub fn cleaned(profiles: Vec<Profile>, stated: Heights) -> Cleaned {
    let mut found = marked(profiles, stated, "they are excluded from the depth of the stated error");
    found.profiles.iter_mut().for_each(|p| p.points.retain(measured));
    found
}

/// The same with such points in their places, marked by numbers that are not finite. `effect` says what a suspected z
/// does.
pub fn marked(mut profiles: Vec<Profile>, stated: Heights, effect: &str) -> Cleaned {
    let count = |profiles: &[Profile]| profiles.iter().flat_map(|p| &p.points).filter(|p| measured(p)).count();
    let all = count(&profiles);
    let mut warnings = vec![];
    if let Some(z) = stated.missing {
        for point in profiles.iter_mut().flat_map(|p| &mut p.points).filter(|point| Kind::Text.same(point[1], z)) {
            *point = [f64::NAN; 2];
        }
        if count(&profiles) == all {
            warnings.push(format!("no point has the z {z} that --missing names"));
        }
    }
    let left = count(&profiles);
    let found = repeated(profiles.iter().flat_map(|p| &p.points).filter(|p| measured(p)).map(|point| point[1]));
    warnings.extend(found.iter().map(|(z, n)| {
        format!(
            "{n} of {left} points have exactly the z {z}: if that means 'not measured', give --missing {z}; {effect}"
        )
    }));
    let mut suspects: Vec<f64> = found.into_iter().map(|f| f.0).collect();
    if stated.up {
        suspects.iter_mut().for_each(|z| *z = -*z);
        profiles.iter_mut().flat_map(|p| &mut p.points).for_each(|point| point[1] = -point[1]);
    }
    Cleaned { profiles, suspects, warnings }
}
