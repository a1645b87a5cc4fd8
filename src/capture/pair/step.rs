//! In: the pose before and after a picture of something at rest. Out: whether it was at rest.
//! Frame and unit: base_from_flange, mm and degrees; counts.

use crate::recording::Stand;

/// Largest motion that counts as rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Still {
    /// Translation, mm.
    pub mm: f64,
    /// Rotation, degrees.
    pub deg: f64,
    /// Motion of an axis, counts.
    pub counts: f64,
}

impl Default for Still {
    /// Encoder noise of an arm at rest: a hundredth of a millimetre and of a degree; a count.
    fn default() -> Self {
        Still { mm: 0.01, deg: 0.01, counts: 1.0 }
    }
}

impl Still {
    /// `Err` states by how much it moved.
    pub fn check(&self, before: &Stand, after: &Stand) -> Result<(), String> {
        match (before, after) {
            (Stand::Robot(a), Stand::Robot(b)) => {
                let (rad, mm) = a.difference(b);
                if mm <= self.mm && rad.to_degrees() <= self.deg {
                    return Ok(());
                }
                let deg = rad.to_degrees();
                Err(format!(
                    "it moved by {mm:.3} mm and {deg:.3} degrees during the picture, limits {} and {}",
                    self.mm, self.deg
                ))
            }
            (Stand::Count(a), Stand::Count(b)) if (a - b).abs() <= self.counts => Ok(()),
            (Stand::Count(a), Stand::Count(b)) => {
                Err(format!("the axis moved by {} counts during the picture, limit {}", (a - b).abs(), self.counts))
            }
            _ => Err("poses of a robot and counts of an axis".into()),
        }
    }
}
