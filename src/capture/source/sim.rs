//! In: a simulated station's seed, its motion and speed. Out: the rendered picture of the present moment; the
//! position at any time, for the pairing by clock.
//! Frame and unit: base_from_flange, mm, or counts; the device's clock is the host's plus the stated delay, ns.

use crate::camera::Readout;
use crate::capture::clock::{RoundTrip, now_ns};
use crate::capture::feature::{Feature, Range, Value};
use crate::capture::format::Format;
use crate::capture::picture::{Event, Picture, PictureSource};
use crate::fault::{Fault, Result};
use crate::geometry::{AxisKind, Camera, Rigid};
use crate::raster::Image;
use crate::recording::{Motion, Stand};
use crate::simulate::{
    Canvas, DEFAULT_SCENE, InScene, Ride, Scene, SceneSpec, Station, View, base_from_scene, expose, flange,
    riding_board, scan, scene_from_board,
};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Settings of a simulated camera.
#[derive(Clone, Debug, PartialEq)]
pub struct SimSpec {
    /// Specimen; `sheetlight simulate --seed` makes the same one.
    pub seed: u64,
    /// Pictures a second.
    pub rate_hz: f64,
    /// Speed of the motion, mm/s; degrees/s for a turntable.
    pub speed: f64,
    /// Nothing moves: everything rests at this share of the path. `None`: the position on the path depends on the
    /// time of day.
    pub still: Option<f64>,
    /// Number of places of the path, evenly apart, at which it stops; none: it stops nowhere.
    pub stops: Option<u32>,
    /// Time that it stands at each of them, s.
    pub rest_s: f64,
    /// Columns and rows, px.
    pub size: [u32; 2],
    /// The axis that moves the parts; none: a robot moves the sensor.
    pub axis: Option<AxisKind>,
    /// A scene file; the built-in board with parts if not stated.
    pub scene: Option<PathBuf>,
    /// Delay of the pictures' times, ms.
    pub delay_ms: f64,
    /// Exposure, us.
    pub exposure_us: f64,
    /// Whether an axis moves the board of its calibration in room light, instead of the scene under the laser.
    pub board: bool,
}

impl Default for SimSpec {
    fn default() -> Self {
        SimSpec {
            seed: 1,
            rate_hz: 10.0,
            speed: 20.0,
            still: None,
            stops: None,
            rest_s: 1.0,
            size: [640, 480],
            axis: None,
            scene: None,
            delay_ms: 0.0,
            exposure_us: 1000.0,
            board: false,
        }
    }
}

/// Time of acceleration and deceleration at the path's ends, s.
const RAMP: f64 = 0.1;
/// Number of steps that an axis' turn or path is divided into; only the ends are used.
const STEPS: usize = 200;
/// Rays along each side of a pixel, for pictures in room light.
const RAYS: u32 = 3;
const WHITE: f64 = 0.85;
const BLACK: f64 = 0.06;

/// A simulated station whose parts or robot move: back and forth along a scan, or continuously around.
#[derive(Clone)]
pub struct SimMotion {
    /// The true station.
    pub station: Arc<Station>,
    scene: Arc<Scene>,
    way: Way,
    speed: f64,
    /// Share of the path at which it rests, if it does not move.
    still: Option<f64>,
    /// Number of stops, and the rest at each, s.
    stops: Option<(u64, f64)>,
    /// Whether the board is shown.
    board: bool,
}

#[derive(Clone)]
enum Way {
    /// The camera's first and last pose over the scene.
    Robot([Rigid<InScene, Camera>; 2]),
    /// The first and the last count.
    Axis(Arc<Ride>, [f64; 2]),
}

impl SimMotion {
    /// # Errors
    /// A scene that cannot be read; numbers out of range.
    pub fn new(spec: &SimSpec) -> Result<SimMotion> {
        let [w, h] = spec.size;
        let ranges = [
            ("size", f64::from(w), 64.0..=8192.0),
            ("size", f64::from(h), 64.0..=8192.0),
            ("rate", spec.rate_hz, 0.0..=1e3),
            ("speed", spec.speed, 1e-3..=1e4),
            ("still", spec.still.unwrap_or(0.0), 0.0..=1.0),
            ("stops", spec.stops.map_or(2.0, f64::from), 2.0..=1e6),
            ("rest", spec.rest_s, 1e-3..=1e3),
            ("delay_ms", spec.delay_ms, -1e3..=1e3),
            ("exposure_us", spec.exposure_us, 1.0..=1e6),
        ];
        if let Some((name, value, range)) = ranges.iter().find(|(_, value, range)| !range.contains(value)) {
            let (least, most) = (range.start(), range.end());
            return Err(Fault::usage(format!("sim:{}: {name} is {value:e}; allowed: {least} to {most}", spec.seed))
                .next("correct the camera's address (docs/live.md)"));
        }
        let station = Station::random(spec.seed).with_size(w, h);
        let scene = match &spec.scene {
            Some(path) => SceneSpec::load(path)?,
            None => SceneSpec::parse(DEFAULT_SCENE)?,
        };
        let mut scene = Scene::new(scene)?;
        let way = match spec.axis {
            None if spec.board => {
                return Err(Fault::usage("a simulated board rides on an axis, but no axis is simulated").next(
                    "name one, axis=linear or axis=turntable; a robot over a board is a cell's: sheetlight \
                           cell simulate",
                ));
            }
            None => {
                let ends = scan(&station, &scene, 2);
                Way::Robot([ends[0], ends[1]])
            }
            Some(kind) => {
                let board = riding_board(&station.rig);
                let ride = Ride::new(kind, &station, &scene, &board, STEPS);
                let ends = |counts: &[f64]| [counts[0], counts[counts.len() - 1]];
                let mut range = ends(&ride.counts);
                if spec.board {
                    let stops: Vec<f64> = ride.stops(&station, &board)?.into_iter().map(|s| s.0).collect();
                    (range, scene) = (ends(&stops), Scene::of_board(&board, WHITE, BLACK)?);
                }
                Way::Axis(Arc::new(ride), range)
            }
        };
        let (speed, still, board) = (spec.speed, spec.still, spec.board);
        let stops = spec.stops.map(|n| (u64::from(n), spec.rest_s));
        Ok(SimMotion { station: station.into(), scene: scene.into(), way, speed, still, stops, board })
    }

    /// What moves, as meta.json states it.
    pub fn motion(&self) -> Motion {
        match &self.way {
            Way::Robot(_) => Motion::default(),
            Way::Axis(ride, _) => ride.motion(),
        }
    }

    /// Share of the path at a host's time: back and forth, with acceleration and deceleration within [`RAMP`].
    fn share(&self, ns: u64, length: f64) -> f64 {
        if let Some(share) = self.still {
            return share;
        }
        if let Some((n, rest)) = self.stops {
            // There and back, one stop after the other.
            let (ways, moves) = (n - 1, length / (n - 1) as f64 / self.speed);
            let period = ((rest + moves) * 1e9) as u64;
            let at = |k: u64| {
                let k = k % (2 * ways);
                k.min(2 * ways - k) as f64 / ways as f64
            };
            let (k, t) = (ns / period, (ns % period) as f64 * 1e-9);
            let done = ((t - rest) / moves).clamp(0.0, 1.0);
            return at(k) + done * (at(k + 1) - at(k));
        }
        let ramp = RAMP.min(0.5 * length / self.speed);
        let once = length / self.speed + ramp;
        // Whole periods are subtracted in integer ns: f64 cannot hold a time of day exactly enough.
        let t = (ns % (2.0 * once * 1e9) as u64) as f64 * 1e-9;
        let t = if t > once { 2.0 * once - t } else { t };
        let from_end = |t: f64| 0.5 * self.speed / ramp * t * t;
        let s = if t < ramp {
            from_end(t)
        } else if t > once - ramp {
            length - from_end((once - t).max(0.0))
        } else {
            self.speed * (t - 0.5 * ramp)
        };
        s / length
    }

    /// Pose of the camera over the scene, and the position that a robot or an encoder would report.
    fn at(&self, ns: u64) -> (Rigid<InScene, Camera>, Stand) {
        match &self.way {
            Way::Robot([from, to]) => {
                let way = to.translation - from.translation;
                let at = from.translation + way * self.share(ns, way.norm());
                let scene_from_camera = Rigid::new(from.rotation, at);
                let base_from_camera = base_from_scene(&self.station) * scene_from_camera;
                (scene_from_camera, Stand::Robot(flange(&self.station, &base_from_camera)))
            }
            Way::Axis(ride, [from, to]) => {
                let per_count = match ride.axis.kind {
                    AxisKind::Linear => ride.axis.pitch,
                    AxisKind::Turntable => ride.axis.pitch.to_degrees(),
                };
                let length = (to - from).abs() * per_count.abs();
                let count = (from + (to - from) * self.share(ns, length)).round();
                let scene_from_camera = if self.board {
                    scene_from_board() * ride.board_from_camera(count)
                } else {
                    ride.scene_from_camera(count)
                };
                (scene_from_camera, Stand::Count(count))
            }
        }
    }

    /// The position that a robot or an encoder reports at a host's time.
    pub fn stand(&self, ns: u64) -> Stand {
        self.at(ns).1
    }
}

/// The simulated station's camera.
pub struct SimCamera {
    motion: SimMotion,
    spec: SimSpec,
    hot: Vec<(usize, f32)>,
    start: u64,
    next: u64,
    /// Pictures that began before this host's time, ns, have this earlier exposure, us.
    former: (u64, f64),
}

impl SimCamera {
    /// # Errors
    /// Those of [`SimMotion::new`].
    pub fn open(spec: &SimSpec) -> Result<SimCamera> {
        let motion = SimMotion::new(spec)?;
        let station = &motion.station;
        let hot = station.hot_pixels();
        Ok(SimCamera { motion, spec: spec.clone(), hot, start: now_ns(), next: 0, former: (0, 0.0) })
    }

    /// Exposure of a picture that begins at `begun`, ns: a setting applies to pictures that begin after it.
    fn exposure(&self, begun: u64) -> u64 {
        let (until, former) = self.former;
        (1e3 * if begun < until { former } else { self.spec.exposure_us }) as u64
    }

    fn render(&self, scene_from_camera: Rigid<InScene, Camera>, exposure: u64) -> Image {
        let station = &*self.motion.station;
        let view = View { station, scene: &self.motion.scene, scene_from_camera };
        let (w, h) = (station.camera.width, station.camera.height);
        // The sensor's light levels are stated for an exposure of a millisecond.
        let longer = (1e-6 * exposure as f64) as f32;
        let (mut light, leak) = (Canvas::new(w, h), station.sensor.ambient_leak);
        let (room, gain) = if self.motion.board {
            (view.ambient(RAYS), station.sensor.ambient_white as f32)
        } else {
            view.sheet(&mut light);
            let room = if leak > 0.0 { view.faint_ambient() } else { Canvas::new(w, h) };
            (room, leak as f32)
        };
        light.pixels.iter_mut().for_each(|p| *p *= longer);
        expose(&station.sensor, &light, &room, gain * longer, &self.hot, &mut station.rng("sim", self.next))
    }
}

impl PictureSource for SimCamera {
    fn format(&self) -> Format {
        let camera = &self.motion.station.camera;
        Format { width: camera.width, height: camera.height, bits: self.motion.station.sensor.bits }
    }

    fn readout(&self) -> Option<Readout> {
        Some(self.motion.station.camera.whole_sensor())
    }

    fn next(&mut self, within: Duration) -> Event {
        let period = if self.spec.rate_hz > 0.0 { (1e9 / self.spec.rate_hz) as u64 } else { 0 };
        let now = now_ns();
        if period > 0 {
            let due = self.start + self.next * period;
            let exposure = self.exposure(due);
            if due + exposure > now {
                std::thread::sleep(Duration::from_nanos(due + exposure - now).min(within));
                if due + exposure > now_ns() {
                    return Event::Quiet;
                }
            }
            // The sensor exposes whether or not pictures are requested: those not requested in time are lost.
            self.next = self.next.max((now_ns() - exposure - self.start) / period);
        }
        let begun = if period > 0 { self.start + self.next * period } else { now };
        let exposure = self.exposure(begun);
        let (scene_from_camera, stand) = self.motion.at(begun + exposure / 2);
        let image = self.render(scene_from_camera, exposure);
        let delay = (1e6 * self.spec.delay_ms) as i64;
        let id = self.next;
        self.next += 1;
        let picture = Picture {
            image,
            id,
            device_ns: Some(begun.saturating_add_signed(delay)),
            host_ns: now_ns(),
            exposure_ns: Some(exposure),
            count: None,
            stand: Some(stand),
            profiles: None,
        };
        Event::Picture(Box::new(picture))
    }

    fn sent(&self) -> Option<u64> {
        Some(self.next)
    }

    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        let now = now_ns();
        Ok(Some(RoundTrip { before_ns: now, there_ns: now, after_ns: now }))
    }

    fn features(&mut self) -> Result<Vec<Feature>> {
        let feature = |name: &str, value, unit: &str, low, high| Feature {
            name: name.into(),
            value: Some(Value::Float(value)),
            unit: unit.into(),
            range: Range::Between(low, high),
            writable: true,
        };
        let rate = feature("AcquisitionFrameRate", self.spec.rate_hz, "Hz", 0.1, 1000.0);
        Ok(vec![rate, feature("ExposureTime", self.spec.exposure_us, "us", 1.0, 1e6)])
    }

    fn set(&mut self, name: &str, value: &str) -> Result<()> {
        let found = self.features()?.into_iter().find(|f| f.name == name);
        let wanted = value.parse::<f64>().ok();
        let (Some(Range::Between(low, high)), Some(v)) = (found.map(|f| f.range), wanted) else {
            return Err(Fault::usage(format!("{name} = {value}: the simulated camera has no such feature or value"))
                .next("set ExposureTime (us) or AcquisitionFrameRate (Hz) to a number"));
        };
        if !(low..=high).contains(&v) {
            return Err(Fault::usage(format!("{name} = {value}: allowed is {low} to {high}")).next("set it within"));
        }
        if name == "ExposureTime" {
            (self.former, self.spec.exposure_us) = ((now_ns(), self.spec.exposure_us), v);
        } else {
            (self.spec.rate_hz, self.start, self.next) = (v, now_ns(), 0);
        }
        Ok(())
    }

    fn name(&self) -> String {
        format!("sim:{}", self.spec.seed)
    }
}
