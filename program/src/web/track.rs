//! In: poses of the flange as they are read. Out: its pose when a picture was taken, and how far it moved around
//! that time.
//! Frame and unit: base_from_flange, mm; ns of the host's clock.

use sheetlight::geometry::{Base, Flange, Rigid};
use std::collections::VecDeque;

/// Most readings that are stored: a minute of motion; while the arm stands still one reading is extended.
const MOST: usize = 600;
/// Readings that differ by no more than this count as the same, mm and radians.
const STANDS: f64 = 1e-3;

/// One reading, or several equal ones.
#[derive(Clone, Copy, Debug)]
struct Stood {
    from_ns: u64,
    to_ns: u64,
    pose: Rigid<Base, Flange>,
}

/// The flange's poses over time.
#[derive(Debug, Default)]
pub struct Track(VecDeque<Stood>);

impl Track {
    /// Adds a reading.
    pub fn add(&mut self, at_ns: u64, pose: Rigid<Base, Flange>) {
        match self.0.back_mut() {
            Some(last) if same(&last.pose, &pose) => last.to_ns = at_ns,
            _ => self.0.push_back(Stood { from_ns: at_ns, to_ns: at_ns, pose }),
        }
        while self.0.len() > MOST {
            self.0.pop_front();
        }
    }

    /// Time of the newest reading, ns.
    pub fn newest_ns(&self) -> Option<u64> {
        self.0.back().map(|s| s.to_ns)
    }

    /// The newest reading.
    pub fn newest(&self) -> Option<Rigid<Base, Flange>> {
        self.0.back().map(|s| s.pose)
    }

    /// The readings before and after a time; twice the same if the arm stood still. `None` if nothing was read
    /// before or after it.
    pub fn about(&self, at_ns: u64) -> Option<[Rigid<Base, Flange>; 2]> {
        let after = self.0.partition_point(|s| s.to_ns < at_ns);
        let next = self.0.get(after)?;
        if next.from_ns <= at_ns {
            return Some([next.pose; 2]);
        }
        Some([self.0.get(after.checked_sub(1)?)?.pose, next.pose])
    }
}

fn same(a: &Rigid<Base, Flange>, b: &Rigid<Base, Flange>) -> bool {
    (a.translation - b.translation).norm() < STANDS && (a.rotation - b.rotation).norm() < STANDS
}

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight::geometry::Vec3;

    fn at(x: f64) -> Rigid<Base, Flange> {
        Rigid::from_vectors(&Vec3::zeros(), Vec3::new(x, 0.0, 0.0))
    }

    #[test]
    fn a_picture_gets_the_pose_of_its_moment_and_not_a_later_one() {
        let mut track = Track::default();
        for (t, x) in [(10, 0.0), (20, 0.0), (30, 5.0), (40, 9.0), (50, 9.0)] {
            track.add(t, at(x));
        }
        let x = |t| track.about(t).map(|[a, b]| [a.translation.x, b.translation.x]);
        assert_eq!(x(15), Some([0.0, 0.0]), "it stood");
        assert_eq!(x(25), Some([0.0, 5.0]), "it moved");
        assert_eq!(x(45), Some([9.0, 9.0]));
        assert_eq!((x(5), x(51)), (None, None), "nothing was read then");
        assert_eq!((track.newest_ns(), track.newest().map(|p| p.translation.x)), (Some(50), Some(9.0)));
        (0..2000).for_each(|k| track.add(100 + k, at(k as f64)));
        assert!(track.0.len() == MOST && track.about(100).is_none());
    }
}
