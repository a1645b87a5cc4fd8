//! In: finished profiles of a running scan. Out: the shots that repeat a picture or a pose.
//! Frame and unit: places of the camera in the cloud's frame, mm.

use crate::scan::Profile;
use std::collections::VecDeque;

/// Number of shots with which each one is compared: copies of a picture follow it, in a folder or from a camera.
const COMPARED: usize = 32;

/// Shots that show the stripe in the picture, or at the pose, of a shot shortly before.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Repeats {
    /// The last shots: index, fingerprint of the picture, camera pose as rows.
    last: VecDeque<(u32, u32, [f64; 16])>,
    /// Number of shots with the picture of another one at another pose, and the first two such shots.
    pictures: (u64, Option<[u32; 2]>),
    /// Number of shots with another picture at the pose of the shot before, and the first two such shots.
    poses: (u64, Option<[u32; 2]>),
}

impl Repeats {
    /// Compares a finished profile, made from a picture of this fingerprint. Without points there is nothing to repeat:
    /// dark pictures may well be equal.
    pub(super) fn add(&mut self, profile: &Profile, picture: u32) {
        if profile.points.is_empty() {
            return;
        }
        let (shot, place) = (profile.shot, profile.from_camera.to_rows());
        if let Some((first, _, _)) = self.last.iter().find(|(_, p, at)| *p == picture && *at != place) {
            self.pictures = (self.pictures.0 + 1, self.pictures.1.or(Some([*first, shot])));
        } else if let Some((first, _, _)) = self.last.back().filter(|(_, p, at)| *p != picture && *at == place) {
            self.poses = (self.poses.0 + 1, self.poses.1.or(Some([*first, shot])));
        }
        self.last.push_back((shot, picture, place));
        if self.last.len() > COMPARED {
            self.last.pop_front();
        }
    }

    /// What a reader of the report must know of them.
    pub fn remarks(&self) -> Vec<String> {
        let more = |n: u64| if n > 1 { format!(" (and {} more)", n - 1) } else { String::new() };
        let pictures = self.pictures.1.map(|[a, b]| {
            format!(
                "shots {a} and {b}{} have the same picture at two poses, so one of them is in the wrong place: a \
                 picture was copied or delivered twice; exclude it, or record again",
                more(self.pictures.0)
            )
        });
        let poses = self.poses.1.map(|[a, b]| {
            format!(
                "shots {a} and {b}{} have two pictures at the same pose: if the camera or the part moved between them, \
                 a pose is wrong; if not, the second adds nothing",
                more(self.poses.0)
            )
        });
        pictures.into_iter().chain(poses).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Rigid, Vec3};

    #[test]
    fn repeated_pictures_and_poses_are_named() {
        let mut repeats = Repeats::default();
        let mut add = |shot: u32, picture: u32, y: f64, points: usize| {
            let from_camera = Rigid::from_vectors(&Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.0, y, 3.0));
            let points = vec![crate::scan::CloudPoint::default(); points];
            repeats.add(&Profile { shot, from_camera, peaks: Vec::new(), points }, picture);
            repeats.remarks().join("; ")
        };
        // Dark pictures are alike; the same picture at the same pose puts no line in a wrong place.
        for (shot, picture, y, points) in [(0, 7, 0.0, 0), (1, 7, 1.0, 0), (2, 8, 2.0, 5), (3, 8, 2.0, 5)] {
            assert_eq!(add(shot, picture, y, points), "", "{shot}");
        }
        let said = add(4, 9, 2.0, 5);
        assert!(said.starts_with("shots 3 and 4 have two pictures at the same pose"), "{said}");
        add(5, 10, 5.0, 5);
        let said = add(6, 9, 6.0, 5);
        assert!(said.starts_with("shots 4 and 6 have the same picture at two poses"), "{said}");
        assert!(add(7, 9, 7.0, 5).starts_with("shots 4 and 6 (and 1 more) have the same picture"));
    }
}
