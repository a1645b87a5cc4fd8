//! In: the points of shot after shot. Out: the same shots one later, points without neighbours in the shots before
//! and after marked. Frame and unit: base frame, mm. A surface goes on from shot to shot; a reflection does not: it
//! moves otherwise than the light that made it, and a speck stays in the picture while the robot moves.

use super::peak::{Peak, Reject};
use super::point::Point;
use crate::fault::{Fault, Result};
use crate::geometry::Vec3;

/// How much of a neighbourhood a point needs. A point on a flat surface has, in each of the two neighbouring shots, a
/// chord of points within the radius; support is the number found over the number expected there.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SupportParams {
    /// Whether points are judged by their neighbours at all.
    pub on: bool,
    /// Half of the chord on a neighbouring shot's line, 0.01..=10 mm: what a point may be wrong by and still be
    /// useful; smaller removes more at corners.
    pub radius_mm: f32,
    /// How much farther than the distance of the shots a neighbour may lie, 1..=3; 1.2 is a slope of 33 degrees.
    pub slope: f32,
    /// Support that a peak of the right width needs, 0..=1.
    pub clean: f32,
    /// Support that any other peak needs, 0..=1.
    pub doubtful: f32,
    /// Share of the amplitude, 0..=10, by which the level beside a peak may exceed the shot's usual level there.
    /// A reflection lies in the glow of what it reflects.
    pub haze: f32,
    /// Support that a peak in such a glow needs, 0..=1.
    pub hazy: f32,
    /// Widths over the stripe's that count as right.
    pub right_width: [f32; 2],
    /// Largest standard deviation of a clean peak's centre over the stripe's sigma, 0.01..=2; others are doubtful.
    pub sure: f32,
}

impl Default for SupportParams {
    fn default() -> Self {
        SupportParams {
            on: true,
            radius_mm: 0.3,
            slope: 1.2,
            clean: 0.1,
            doubtful: 0.3,
            haze: 0.05,
            hazy: 0.7,
            right_width: [0.88, 1.22],
            sure: 0.43,
        }
    }
}

impl SupportParams {
    pub fn check(&self) -> Result<()> {
        for (name, value, low, high) in [
            ("radius_mm", self.radius_mm, 0.01, 10.0),
            ("slope", self.slope, 1.0, 3.0),
            ("clean", self.clean, 0.0, 1.0),
            ("doubtful", self.doubtful, 0.0, 1.0),
            ("haze", self.haze, 0.0, 10.0),
            ("hazy", self.hazy, 0.0, 1.0),
            ("sure", self.sure, 0.01, 2.0),
            ("right_width[0]", self.right_width[0], 0.0, 1.0),
            ("right_width[1]", self.right_width[1], 1.0, 3.0),
        ] {
            if !(low..=high).contains(&value) {
                return Err(Fault::usage(format!("support {name} is {value}, it must be in {low}..={high}")));
            }
        }
        Ok(())
    }
}

/// One shot: peaks and their points, entry by entry.
#[derive(Clone, Debug)]
pub struct Profile {
    pub shot: u32,
    pub peaks: Vec<Peak>,
    pub points: Vec<Point>,
    /// Where the laser plane meets the optical axis at this shot, base frame: the distance of two shots.
    pub anchor: Vec3,
    /// Distance of neighbouring points along the stripe at the anchor, mm.
    pub pitch: f32,
}

/// A kept point and its place along the line.
#[derive(Clone, Copy)]
struct Site {
    along: f32,
    position: [f32; 3],
}

struct Held {
    profile: Profile,
    /// Kept points, sorted along the line.
    sites: Vec<Site>,
}

/// Holds three shots at a time, whatever the length of the scan.
pub struct Support {
    params: SupportParams,
    /// The stripe's Gaussian sigma, px.
    width_px: f32,
    /// Direction along the laser line, base frame; only orders the points, so the first shot's serves the scan.
    axis: [f32; 3],
    before: Option<Held>,
    now: Option<Held>,
}

impl Support {
    /// `axis`: unit vector along the laser line, base frame.
    pub fn new(params: SupportParams, width_px: f32, axis: &Vec3) -> Support {
        Support { params, width_px, axis: [axis.x as f32, axis.y as f32, axis.z as f32], before: None, now: None }
    }
    /// Takes a shot and gives the one before it, judged.
    pub fn push(&mut self, profile: Profile) -> Option<Profile> {
        let sites = self.sites(&profile);
        self.turn(Some(Held { profile, sites }))
    }
    /// Gives the last shot, judged.
    pub fn finish(&mut self) -> Option<Profile> {
        self.turn(None)
    }
    fn turn(&mut self, after: Option<Held>) -> Option<Profile> {
        let now = std::mem::replace(&mut self.now, after);
        let mut done = now?;
        if self.params.on {
            let others: Vec<&Held> = self.before.iter().chain(self.now.iter()).collect();
            judge(&mut done.profile, &others, self.width_px, &self.axis, &self.params);
        }
        let out = done.profile.clone();
        self.before = Some(done);
        Some(out)
    }
    fn sites(&self, profile: &Profile) -> Vec<Site> {
        let mut sites: Vec<Site> = (profile.peaks.iter().zip(&profile.points))
            .filter(|(k, _)| k.kept())
            .map(|(_, p)| Site { along: dot(&self.axis, &p.position), position: p.position })
            .collect();
        sites.sort_by(|a, b| a.along.total_cmp(&b.along));
        sites
    }
}

fn dot(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a[0] * b[0] + (a[1] * b[1] + a[2] * b[2])
}

fn judge(profile: &mut Profile, others: &[&Held], width_px: f32, axis: &[f32; 3], p: &SupportParams) {
    // Per neighbour: reach and the points expected within it.
    let reaches: Vec<(f32, f32)> = others
        .iter()
        .map(|o| {
            let step = (o.profile.anchor - profile.anchor).norm() as f32;
            let reach2 = p.radius_mm * p.radius_mm + p.slope * p.slope * step * step;
            (reach2.sqrt(), 2.0 * (reach2 - step * step).sqrt() / profile.pitch)
        })
        .collect();
    let expected: f32 = reaches.iter().map(|r| r.1).sum();
    if others.is_empty() || expected <= 0.0 {
        return;
    }
    let usual = usual_background(&profile.peaks);
    for (k, point) in profile.peaks.iter_mut().zip(&profile.points).filter(|(k, _)| k.kept()) {
        let ratio = k.width_px / width_px;
        let sure = k.sigma_px <= p.sure * width_px;
        let clean = sure && ratio >= p.right_width[0] && ratio <= p.right_width[1];
        let hazy = k.background - usual > p.haze * k.amplitude;
        let need = expected
            * if hazy {
                p.hazy
            } else if clean {
                p.clean
            } else {
                p.doubtful
            };
        let along = dot(axis, &point.position);
        let found: usize = others
            .iter()
            .zip(&reaches)
            .map(|(o, &(reach, _))| {
                let from = o.sites.partition_point(|s| s.along < along - reach);
                o.sites[from..]
                    .iter()
                    .take_while(|s| s.along <= along + reach)
                    .filter(|s| {
                        let d = [0, 1, 2].map(|i| s.position[i] - point.position[i]);
                        dot(&d, &d) <= reach * reach
                    })
                    .count()
            })
            .sum();
        if (found as f32) < need {
            k.refuse(Reject::Unsupported);
        }
    }
}

/// Median level beside the kept peaks: room light, which is no sign of a reflection.
fn usual_background(peaks: &[Peak]) -> f32 {
    let mut levels: Vec<f32> = peaks.iter().filter(|k| k.kept()).map(|k| k.background).collect();
    if levels.is_empty() {
        return 0.0;
    }
    let middle = levels.len() / 2;
    *levels.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::peak::Peak;

    /// A flat surface of 21 points a shot, 0.25 mm apart, shots 0.35 mm apart; one more point 3 mm above the middle.
    fn shot(index: u32, width_px: f32, stray: bool) -> Profile {
        let mut peaks = vec![Peak { width_px, amplitude: 100.0, sigma_px: 0.05, shot: index, ..Peak::default() }; 21];
        let mut points: Vec<Point> =
            (0..21).map(|i| Point { position: [0.25 * i as f32, 0.35 * index as f32, 0.0], sigma_mm: 0.02 }).collect();
        if stray {
            peaks.push(peaks[10]);
            points.push(Point { position: [2.5, 0.35 * index as f32, 3.0], sigma_mm: 0.02 });
        }
        Profile { shot: index, peaks, points, anchor: Vec3::new(0.0, 0.35 * f64::from(index), 0.0), pitch: 0.25 }
    }
    fn scan(width_px: f32, strays: &[u32]) -> Vec<Profile> {
        let mut support = Support::new(SupportParams::default(), 1.0, &Vec3::x());
        let mut out: Vec<_> = (0..6).filter_map(|i| support.push(shot(i, width_px, strays.contains(&i)))).collect();
        out.extend(support.finish());
        out
    }

    #[test]
    fn a_surface_stays_and_a_stray_point_goes() {
        let out = scan(1.0, &[2]);
        assert_eq!(out.iter().map(|p| p.shot).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5]);
        for p in &out {
            for (i, k) in p.peaks.iter().enumerate() {
                assert_eq!(k.reject(), if i < 21 { Reject::Kept } else { Reject::Unsupported }, "shot {}, {i}", p.shot);
            }
        }
    }

    #[test]
    fn what_goes_on_in_the_next_shot_is_believed() {
        let out = scan(1.0, &[2, 3]);
        assert!(out[2].peaks[21].kept() && out[3].peaks[21].kept());
        // The same two points with the width of two stripes need more company than one neighbour.
        let out = scan(1.5, &[2, 3]);
        assert!(!out[2].peaks[21].kept() && !out[3].peaks[21].kept());
        assert!(out[2].peaks[..21].iter().all(Peak::kept));
    }

    #[test]
    fn one_shot_alone_is_not_judged() {
        let mut support = Support::new(SupportParams::default(), 1.0, &Vec3::x());
        assert!(support.push(shot(0, 1.0, true)).is_none());
        assert!(support.finish().unwrap().peaks.iter().all(Peak::kept));
    }
}
