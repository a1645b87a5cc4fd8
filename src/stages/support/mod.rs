//! In: the points of one shot after another. Out: the same shots, one shot later; points without neighbours in the
//! shots before and after are marked. Frame and unit: base frame, mm. A surface continues from shot to shot. A
//! reflection does not, because it moves differently from the light that caused it. A speck stays in its place in the
//! picture while the robot moves.

use super::peak::found::Peak;
use super::stripe::point::Point;
use super::support::params::SupportParams;
use crate::fault::Result;
use crate::geometry::Vec3;
use crate::gpu::Device;
pub mod ends;
mod gpu;
mod gradient;
mod line;
pub mod params;
pub mod sigma;
pub(in crate::stages) mod stage;
mod steps;

pub use stage::{STAGE, cases, stage_twin};

use gpu::OnGpu;
use stage::{Neighbourhood, Site, SupportFrame, whole};

/// One shot: its peaks and their points, with the same index.
#[derive(Clone, Debug)]
pub struct Profile<T = ()> {
    /// Number of the shot in its scan.
    pub shot: u32,
    /// Returned with the shot.
    pub cargo: T,
    /// Peaks of all skeleton pixels, also rejected ones.
    pub peaks: Vec<Peak>,
    /// One point for each peak, base frame, mm; NaN if the peak was rejected.
    pub points: Vec<Point>,
    /// Three places of the light, corresponding ones in every shot, in the base frame. The distance of two shots is the
    /// largest move of these places. They are where the laser plane meets the optical axis and, on a turntable, also
    /// the stripe's ends.
    pub anchors: [Vec3; 3],
    /// Distance between neighbouring points along the stripe at the anchor, mm.
    pub pitch: f32,
}

/// A shot that waits for the next shot.
struct Held<T> {
    profile: Profile<T>,
    /// One place for each peak; zeros if the peak was rejected.
    places: Vec<Site>,
    /// Places of the peaks that were kept, sorted along the line.
    sites: Vec<Site>,
}

/// Judges points by the shots around them. In the steady state three shots are in memory, for any length of the scan.
pub struct Support<T = ()> {
    params: SupportParams,
    /// Half of the chord, mm.
    radius: f32,
    frame: SupportFrame,
    /// Direction along the laser line, base frame. It only orders the points, so the first shot's direction is used for
    /// all.
    axis: Vec3,
    /// Anchors and sites of the last judged shot.
    before: Option<([Vec3; 3], Vec<Site>)>,
    now: Option<Held<T>>,
    gpu: Option<OnGpu>,
}

impl<T> Support<T> {
    /// `axis` is the unit vector along the laser line in the base frame, `width_px` the stripe's Gaussian sigma.
    /// `field_mm` is the length that the picture's longer side covers where the sheet meets the optical axis. Without a
    /// device the twin judges, with the same result.
    pub fn new(
        params: SupportParams,
        width_px: f32,
        field_mm: f32,
        axis: &Vec3,
        device: Option<&Device>,
    ) -> Result<Support<T>> {
        let gpu = device.map(OnGpu::new).transpose()?;
        let radius = params.radius_mm.unwrap_or(field_mm / 540.0);
        Ok(Support {
            params,
            radius,
            frame: SupportFrame::new(&params, width_px),
            axis: *axis,
            before: None,
            now: None,
            gpu,
        })
    }

    /// Takes shots in order and returns those that are judged: all but the last, which waits for its neighbour; with
    /// `end` all.
    pub fn take(&mut self, profiles: Vec<Profile<T>>, end: bool) -> Result<Vec<Profile<T>>> {
        let mut run: Vec<Held<T>> = self.now.take().into_iter().collect();
        run.extend(profiles.into_iter().map(|p| self.held(p)));
        if !end {
            self.now = run.pop();
        }
        if self.params.on && !run.is_empty() {
            self.judge(&mut run)?;
        }
        if let Some(last) = run.last_mut() {
            self.before = Some((last.profile.anchors, std::mem::take(&mut last.sites)));
        }
        Ok(run.into_iter().map(|h| h.profile).collect())
    }

    fn held(&self, profile: Profile<T>) -> Held<T> {
        let place = |(k, p): (&Peak, &Point)| {
            if !k.kept() {
                return [0; 4];
            }
            let [x, y, z] = p.position.as_dvec3().to_array();
            [x, y, z, self.axis.dot(&Vec3::new(x, y, z))].map(whole)
        };
        let places: Vec<Site> = profile.peaks.iter().zip(&profile.points).map(place).collect();
        let mut sites: Vec<Site> =
            profile.peaks.iter().zip(&places).filter(|(k, _)| k.kept()).map(|(_, s)| *s).collect();
        sites.sort_unstable_by_key(|s| s[3]);
        Held { profile, places, sites }
    }

    /// Judges every shot of a run by its two neighbours; the neighbour after the last shot is `now`.
    fn judge(&mut self, run: &mut [Held<T>]) -> Result<()> {
        let beside = self.before.iter().map(|(anchors, sites)| (anchors, sites));
        let beside = beside.chain(run.iter().chain(&self.now).map(|h| (&h.profile.anchors, &h.sites)));
        let (mut sites, mut ranges): (Vec<Site>, Vec<([Vec3; 3], u32, u32)>) = Default::default();
        for (anchors, some) in beside {
            let first = sites.len() as u32;
            sites.extend_from_slice(some);
            ranges.push((*anchors, first, sites.len() as u32));
        }
        let skip = usize::from(self.before.is_some());
        let shots: Vec<Neighbourhood> = (run.iter().enumerate())
            .map(|(i, h)| {
                let at = i + skip;
                self.neighbourhood(&h.profile, [at.checked_sub(1), Some(at + 1)].map(|n| ranges.get(n?)))
            })
            .collect();
        let Some(gpu) = &mut self.gpu else {
            for (h, shot) in run.iter_mut().zip(&shots) {
                for (k, place) in h.profile.peaks.iter_mut().zip(&h.places) {
                    k.flags = stage::judge(&self.frame, shot, &sites, place, k);
                }
            }
            return Ok(());
        };
        let (mut places, mut peaks): (Vec<Site>, Vec<Peak>) = Default::default();
        for (i, h) in run.iter().enumerate() {
            places.extend_from_slice(&h.places);
            // The stage counts shots within the run.
            peaks.extend(h.profile.peaks.iter().map(|k| Peak { shot: i as u32, ..*k }));
        }
        let frame = SupportFrame { peaks: peaks.len() as u32, ..self.frame };
        let flags = gpu.judge(&frame, &shots, &sites, &places, &peaks)?;
        let all = run.iter_mut().flat_map(|h| &mut h.profile.peaks);
        all.zip(flags).for_each(|(k, flags)| k.flags = flags);
        Ok(())
    }

    fn neighbourhood(&self, profile: &Profile<T>, beside: [Option<&([Vec3; 3], u32, u32)>; 2]) -> Neighbourhood {
        let p = &self.params;
        let mut out = Neighbourhood { usual: usual_background(&profile.peaks), ..Neighbourhood::default() };
        let mut expected = 0.0;
        for (side, (anchors, first, end)) in beside.into_iter().enumerate().filter_map(|(i, b)| Some((i, b?))) {
            let moved = anchors.iter().zip(&profile.anchors).map(|(a, b)| (a - b).norm());
            let step = moved.fold(0.0, f64::max) as f32;
            let reach2 = self.radius * self.radius + p.slope * p.slope * step * step;
            expected += 2.0 * (reach2 - step * step).sqrt() / profile.pitch;
            (out.first[side], out.end[side]) = (*first, *end);
            (out.reach[side], out.drop[side]) = stage::reach(f64::from(reach2.sqrt()));
        }
        let need = |share: f32| (expected * share).ceil().max(0.0) as u32;
        (out.clean, out.doubtful, out.hazy) = (need(p.clean), need(p.doubtful), need(p.hazy));
        out
    }
}

/// Median level beside the kept peaks: it is room light, not a sign of a reflection.
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
    use crate::stages::peak::found::Reject;

    /// A flat surface of 21 points per shot, 0.25 mm apart, in shots 0.35 mm apart; `stray` adds one point 3 mm above
    /// the middle.
    fn shot(index: u32, width_px: f32, stray: bool) -> Profile {
        let mut peaks = vec![Peak { width_px, amplitude: 100.0, sigma_px: 0.05, shot: index, ..Peak::default() }; 21];
        let mut points: Vec<Point> = (0..21)
            .map(|i| Point { position: [0.25 * i as f32, 0.35 * index as f32, 0.0].into(), sigma_mm: 0.02 })
            .collect();
        if stray {
            peaks.push(peaks[10]);
            points.push(Point { position: [2.5, 0.35 * index as f32, 3.0].into(), sigma_mm: 0.02 });
        }
        Profile {
            shot: index,
            cargo: (),
            peaks,
            points,
            anchors: [Vec3::new(0.0, 0.35 * f64::from(index), 0.0); 3],
            pitch: 0.25,
        }
    }
    fn scan(width_px: f32, strays: &[u32]) -> Vec<Profile> {
        let mut support = Support::new(SupportParams::default(), 1.0, 162.0, &Vec3::x(), None).unwrap();
        let mut out = Vec::new();
        for i in 0..6 {
            out.extend(support.take(vec![shot(i, width_px, strays.contains(&i))], false).unwrap());
        }
        out.extend(support.take(Vec::new(), true).unwrap());
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
        // The same two points at 1.5 times the stripe's width are doubtful and need more support than one neighbour.
        let out = scan(1.5, &[2, 3]);
        assert!(!out[2].peaks[21].kept() && !out[3].peaks[21].kept());
        assert!(out[2].peaks[..21].iter().all(Peak::kept));
    }

    #[test]
    fn one_shot_alone_is_not_judged() {
        let mut support = Support::new(SupportParams::default(), 1.0, 162.0, &Vec3::x(), None).unwrap();
        assert!(support.take(vec![shot(0, 1.0, true)], false).unwrap().is_empty());
        assert!(support.take(Vec::new(), true).unwrap()[0].peaks.iter().all(Peak::kept));
    }

    /// One shot at a time or several at once, on the twin or on a GPU: every peak gets the same flags.
    #[test]
    fn runs_of_any_length_are_judged_alike() {
        let odd = |i| i == 2 || i == 3;
        let shots = || (0..6).map(|i| shot(i, if odd(i) { 1.5 } else { 1.0 }, odd(i))).collect::<Vec<_>>();
        let fates = |device: Option<&Device>, run: usize| {
            let mut support = Support::new(SupportParams::default(), 1.0, 162.0, &Vec3::x(), device).unwrap();
            let mut out = Vec::new();
            for part in shots().chunks(run) {
                out.extend(support.take(part.to_vec(), false).unwrap());
            }
            out.extend(support.take(Vec::new(), true).unwrap());
            out.iter().flat_map(|p| p.peaks.iter().map(|k| (p.shot, k.flags))).collect::<Vec<_>>()
        };
        let one = fates(None, 1);
        assert!(one.iter().any(|f| f.1 != 0) && one.len() == 6 * 21 + 2);
        assert_eq!(fates(None, 4), one);
        if let Some(device) = Device::for_tests() {
            assert_eq!(fates(Some(&device), 4), one);
        }
    }
}
