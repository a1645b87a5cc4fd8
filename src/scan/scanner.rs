//! In: shots in order, a calibrated rig, settings. Out: their profiles in order: peaks with their rejection reason,
//! points with their standard deviation.
//! Frame and unit: points in the carrier's frame (mostly the robot's base), mm (docs/math.md, Stripe peak; the
//! paper's eq. 5 and 6).

use super::engine::{Engine, Measured, Optical, StripeSeen};
use super::{Along, Ambient, Carrier, CloudPoint, Extraction, Pictures, Place, Processor, Shot};
use crate::camera::Intrinsics;
use crate::fault::Result;
use crate::geometry::{Base, Camera, Plane, Rigid, Vec2, Vec3};
use crate::gpu::Device;
use crate::raster::{HotPixels, Image};
use crate::rig::{Rig, Volume};
use crate::stages::peak::Stripe;
use crate::stages::peak::found::{Peak, SATURATED};
use crate::stages::peak::params::PeakParams;
use crate::stages::stripe::point::{Optics, Point};
use crate::stages::support::{self, Support};
use rayon::prelude::*;

/// The result of one shot.
#[derive(Clone, Debug)]
pub struct Profile {
    /// Index of the shot in the recording, from 0.
    pub shot: u32,
    /// All peaks; rejected ones carry their reason.
    pub peaks: Vec<Peak>,
    /// One point per accepted peak.
    pub points: Vec<CloudPoint>,
    /// Pose of the camera, cloud's frame, mm.
    pub from_camera: Rigid<Base, Camera>,
}

/// Number of shots used to measure the stripe's width before the first profile is ready.
const MEASURED_SHOTS: usize = 8;
/// A scan that begins beside the part waits for its stripe: at most this many shots, and this many bytes of pictures
/// if that is more than [`MEASURED_SHOTS`] shots. Earlier dark shots are measured with the assumed width.
const HELD_SHOTS: usize = 64;
const HELD_BYTES: usize = 256 << 20;
/// The picture is sampled at this many positions in each direction to find where the sheet is visible.
const SEEN_PLACES: u32 = 16;

/// Takes a shot from picture to points, a few shots at a time; memory does not grow with the scan.
pub struct Scanner {
    engine: Engine,
    ambient: Option<Ambient>,
    carrier: Carrier,
    optics: Optics,
    /// Where the laser plane meets the optical axis, or comes closest to it; camera frame, mm.
    anchor: Vec3,
    extraction: Extraction,
    /// Shots held until the stripe is measured.
    waiting: Vec<Shot>,
    stripe: Option<Stripe>,
    hot: HotPixels,
    /// Hot pixels of the camera's calibration; empty if its pictures are read out in another way, which is reported.
    known_hot: HotPixels,
    /// Size of the pictures, px.
    size: [u32; 2],
    /// The stripe that the engine is built for; the assumed one while all pictures were dark.
    built: Option<Stripe>,
    support: Option<Support<Place>>,
    /// Profiles done before the engine was rebuilt.
    early: Vec<Profile>,
    up: Vec3,
    /// Camera pose at the scan's first shot.
    first: Option<Rigid<Base, Camera>>,
}

impl Scanner {
    /// `carrier` gives the camera pose at a shot; `ambient` is subtracted from every shot. Refuses a rig without
    /// camera or laser plane, and pictures that the camera's calibration does not cover.
    pub fn new(
        rig: &Rig,
        carrier: Carrier,
        pictures: impl Into<Pictures>,
        extraction: &Extraction,
        volume: Option<&Volume>,
        ambient: Option<Image>,
        processor: Processor,
    ) -> Result<Scanner> {
        extraction.check()?;
        let pictures: Pictures = pictures.into();
        let calibrated = rig.need_camera()?;
        let camera = calibrated.for_pictures(pictures.size(), pictures.readout.as_ref())?;
        let read_alike = camera == calibrated.value;
        let known_hot = HotPixels::stored(if read_alike { rig.hot_pixels() } else { &[] });
        let format = pictures.format;
        let laser = rig.need_laser_plane()?.value;
        let optics = Optics::new(&camera, &laser);
        let depth_mm = Volume::depths(volume);
        let optical = Optical { camera, laser, depth_mm };
        let ambient = ambient.map(|image| Ambient::new(image, format)).transpose()?;
        Ok(Scanner {
            engine: Engine::new(format, &optical, extraction, ambient.clone(), processor),
            ambient,
            carrier,
            optics,
            anchor: anchor(&camera, &laser, depth_mm),
            extraction: extraction.clone(),
            waiting: Vec::new(),
            stripe: None,
            hot: HotPixels::default(),
            known_hot,
            size: pictures.size(),
            built: None,
            support: None,
            early: Vec::new(),
            up: Vec3::z(),
            first: None,
        })
    }

    /// Continues a scan whose earlier part measured the stripe and had the first shot. Everything derived from these
    /// stays unchanged.
    pub fn resumed(mut self, stripe: Option<Stripe>, hot: HotPixels, first: Option<Rigid<Base, Camera>>) -> Scanner {
        (self.stripe, self.hot, self.first) = (stripe, hot, first);
        self
    }

    /// Camera pose at the scan's first shot; `None` before it.
    pub fn first(&self) -> Option<Rigid<Base, Camera>> {
        self.first
    }

    /// Takes the next shot. Profiles become ready some shots later.
    pub fn push(&mut self, shot: Shot) -> Result<()> {
        if self.first.is_none() {
            self.first = Some(self.carrier.place(&shot.stand, shot.slip.as_ref(), &self.anchor)?.from_camera);
        }
        if self.built.is_none()
            && self.waiting.is_empty()
            && let Some(ambient) = &self.ambient
        {
            ambient.suits(&shot.image, &shot.name)?;
        }
        self.waiting.push(shot);
        if let Some(stripe) = self.stripe {
            return self.release(stripe);
        }
        if !self.extraction.measure_stripe {
            return self.settle(StripeSeen::assumed(self.assumed()));
        }
        // Examined again only when the number of shots has doubled.
        let held = self.waiting.len();
        let full = held >= self.most_held();
        if held < MEASURED_SHOTS || !held.is_power_of_two() && !full {
            return Ok(());
        }
        match self.look() {
            Some(seen) if seen.enough || full => self.settle(seen),
            None if full || self.built.is_some() => self.release(self.assumed()),
            _ => Ok(()),
        }
    }

    /// What the waiting shots show of the stripe.
    fn look(&self) -> Option<StripeSeen> {
        let images: Vec<_> = self.waiting.iter().map(|s| &s.image).collect();
        self.engine.measure(&images)
    }

    fn settle(&mut self, seen: StripeSeen) -> Result<()> {
        seen.hot.otherwise(&self.known_hot, self.size).map(|otherwise| otherwise.remark()).transpose()?;
        (self.stripe, self.hot) = (Some(seen.stripe), seen.hot);
        self.release(seen.stripe)
    }

    /// A remark if the pictures contradict the camera's calibration, once their hot pixels are known.
    pub fn remark(&self) -> Option<String> {
        self.hot.otherwise(&self.known_hot, self.size)?.remark().ok()
    }

    fn assumed(&self) -> Stripe {
        let PeakParams { width_px, speckle, .. } = self.extraction.peak;
        Stripe { width_px, speckle, ..Stripe::default() }
    }

    /// Most shots that may wait for a stripe.
    fn most_held(&self) -> usize {
        let bytes =
            self.waiting.first().map_or(1, |s| s.image.pixel_count().max(1) * usize::from(s.image.bits.div_ceil(8)));
        (HELD_BYTES / bytes).clamp(MEASURED_SHOTS, HELD_SHOTS)
    }

    /// Profiles that are done, in order.
    pub fn ready(&mut self) -> Result<Vec<Profile>> {
        self.collect(false)
    }

    /// All profiles still in flight, after the last shot.
    pub fn finish(&mut self) -> Result<Vec<Profile>> {
        if !self.waiting.is_empty() {
            let known = self.stripe.map(|stripe| StripeSeen { hot: self.hot.clone(), ..StripeSeen::assumed(stripe) });
            let seen = known.or_else(|| self.look()).unwrap_or(StripeSeen::assumed(self.assumed()));
            self.settle(seen)?;
        }
        self.stripe = self.stripe.or(self.built);
        self.collect(true)
    }

    /// The stripe's width and speckle, once measured or assumed; needed to resume the scan.
    pub fn stripe(&self) -> Option<Stripe> {
        self.stripe
    }

    /// Pixels of the sensor that are bright without light, once looked for; needed to resume the scan.
    pub fn hot(&self) -> &HotPixels {
        &self.hot
    }

    /// The image axis that the stripe runs along.
    pub fn stripe_along(&self) -> Along {
        Along::crossed(self.optics.across())
    }

    /// Direction towards the camera at the first shot; on a turntable along its axis. Cloud's frame.
    pub fn up_in_base(&self) -> Vec3 {
        self.up
    }

    /// Skeleton pixels that did not fit into the GPU's list.
    pub fn cut(&self) -> u64 {
        self.engine.cut()
    }

    /// The GPU, if it has dedicated processors. Work that is light on the CPU pays off only there.
    pub fn device(&self) -> Option<&Device> {
        self.engine.device().filter(|d| d.has_own_processors())
    }

    /// Adapter and driver, or this machine's processor with the reason for it.
    pub fn ran_on(&self) -> String {
        self.engine.ran_on()
    }

    /// Passes the waiting shots to the engine, built for this stripe.
    fn release(&mut self, stripe: Stripe) -> Result<()> {
        if self.built != Some(stripe) {
            self.build(stripe)?;
        }
        for shot in std::mem::take(&mut self.waiting) {
            let place = self.carrier.place(&shot.stand, shot.slip.as_ref(), &self.anchor)?;
            self.engine.submit(shot.index, shot.image, place)?;
        }
        Ok(())
    }

    fn build(&mut self, stripe: Stripe) -> Result<()> {
        if self.built.is_some() {
            self.early = self.collect(true)?;
        }
        self.engine.set_stripe(&stripe)?;
        self.engine.set_hot(self.hot.clone());
        self.built = Some(stripe);
        let base_from_camera = self.first.expect("a shot was taken");
        let towards = -base_from_camera.direction(&Vec3::z());
        // Seen from the camera a turntable's part rotates, so its map lies parallel to the table.
        self.up = if self.carrier.turns() { Vec3::z() * towards.z.signum() } else { towards };
        let axis = base_from_camera.direction(&self.along());
        let field = self.pitch() * self.engine.longer_side() as f32;
        self.support = Some(Support::new(self.extraction.support, stripe.width_px, field, &axis, self.device())?);
        Ok(())
    }

    /// Direction of the stripe, camera frame.
    fn along(&self) -> Vec3 {
        let [nx, ny, _] = self.optics.normal.as_dvec3().to_array();
        Vec3::new(ny, -nx, 0.0).try_normalize(1e-9).unwrap_or(Vec3::x())
    }

    /// Points between which the distance of two shots is measured, camera frame. On a turntable the middle hardly
    /// moves, so the ends are included.
    fn anchors(&self) -> [Vec3; 3] {
        if !self.carrier.turns() {
            return [self.anchor; 3];
        }
        let half = self.along() * (0.5 * f64::from(self.pitch()) * f64::from(self.engine.along_px()));
        [self.anchor - half, self.anchor, self.anchor + half]
    }

    /// Size that a pixel covers where the sheet meets the optical axis, mm.
    fn pitch(&self) -> f32 {
        (self.anchor.z / f64::from(self.optics.pinhole[0])) as f32
    }

    fn collect(&mut self, all: bool) -> Result<Vec<Profile>> {
        let pitch = self.pitch();
        let mut measured = Vec::new();
        for Measured { shot, place, peaks, points } in self.engine.collect(all)? {
            let anchors = self.anchors().map(|a| place.from_camera.point(&a));
            measured.push(support::Profile { shot, cargo: place, peaks, points, anchors, pitch });
        }
        let mut judged = match &mut self.support {
            Some(support) => support.take(measured, all)?,
            None => Vec::new(),
        };
        let (across, width) = (self.optics.across(), self.width_px());
        let settings = &self.extraction.support;
        judged.par_iter_mut().for_each(|p| {
            support::ends::mark(&mut p.peaks, across, width, settings);
            support::sigma::widen(&mut p.peaks, &mut p.points, across, width);
        });
        let mut done = std::mem::take(&mut self.early);
        done.extend(judged.into_iter().map(|p| self.profile(p)));
        Ok(done)
    }

    /// The stripe's Gaussian sigma.
    fn width_px(&self) -> f32 {
        self.built.map_or(1.0, |s| s.width_px)
    }

    fn profile(&self, judged: support::Profile<Place>) -> Profile {
        let place = &judged.cargo;
        let limit = self.extraction.choose.uncertain * self.width_px();
        let sigma = |p: &Point| with_place(p.sigma_mm, &p.position, place);
        let points = accepted(judged.shot, &judged.peaks, &judged.points, limit, sigma);
        Profile { shot: judged.shot, from_camera: place.from_camera, peaks: judged.peaks, points }
    }
}

/// The points of the accepted peaks. `limit_px` is the largest standard deviation of an accepted peak.
pub(super) fn accepted(
    shot: u32,
    peaks: &[Peak],
    points: &[Point],
    limit_px: f32,
    sigma_mm: impl Fn(&Point) -> f32,
) -> Vec<CloudPoint> {
    let point = |(k, p): (&Peak, &Point)| CloudPoint {
        position: p.position,
        sigma_mm: sigma_mm(p),
        intensity: k.amplitude,
        quality: quality(k, limit_px),
        shot,
        u: k.u,
        v: k.v,
    };
    peaks.iter().zip(points).filter(|(k, _)| k.kept()).map(point).collect()
}

/// The standard deviation along the worst direction, with the pose's contribution.
fn with_place(sigma_mm: f32, position: &glam::Vec3, place: &Place) -> f32 {
    if place.covariance.is_none() {
        return sigma_mm;
    }
    let more = place.variance_at(&Vec3::from(position.as_dvec3().to_array()));
    (f64::from(sigma_mm).powi(2) + more).sqrt() as f32
}

/// The share of the allowed standard deviation that a peak does not use; halved if the peak is saturated.
fn quality(k: &Peak, limit_px: f32) -> f32 {
    let spare = (1.0 - k.sigma_px / limit_px).clamp(0.0, 1.0);
    if k.flags & SATURATED != 0 { 0.5 * spare } else { spare }
}

/// The point where the sheet meets the optical axis if its depth is credible, else the middle one of the points
/// where the sheet is visible.
fn anchor(camera: &Intrinsics, laser: &Plane<Camera>, depth_mm: [f64; 2]) -> Vec3 {
    let [near, far] = depth_mm;
    let z = laser.offset / laser.normal.z;
    if z.is_finite() && (near..=far).contains(&z) {
        return Vec3::new(0.0, 0.0, z);
    }
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    let mut seen: Vec<Vec3> = (0..SEEN_PLACES * SEEN_PLACES)
        .filter_map(|i| {
            let place = |k: u32, size: f64| (f64::from(k) + 0.5) / f64::from(SEEN_PLACES) * size - 0.5;
            let pixel = Vec2::new(place(i % SEEN_PLACES, w), place(i / SEEN_PLACES, h));
            let ray = camera.normalised_from_pixel(&pixel)?.push(1.0);
            let z = laser.offset / laser.normal.dot(&ray);
            (z > 0.0 && (near..=far).contains(&z)).then(|| ray * z)
        })
        .collect();
    seen.sort_by(|a, b| a.z.total_cmp(&b.z));
    seen.get(seen.len() / 2).copied().unwrap_or_else(|| laser.normal * laser.offset)
}
