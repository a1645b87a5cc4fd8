//! In: what to simulate (sets, scene, seed, noise). Out: recording folders, each with `truth.json`, and a station
//! folder with the true calibration.
//! Frame and unit: the recording format of docs/file-formats.md, mm.

use super::light::{Canvas, View};
use super::options::{DEFAULT_SCENE, Set, SimulateOptions};
use super::picture::{expose, fallen, read};
use super::plan;
use super::ride::Ride;
use super::scene::{Scene, SceneSpec};
use super::sets::{Plan, Shot, riding_board};
use super::station::{Station, TRUE_VALUES};
use crate::fault::{Fault, Result};
use crate::geometry::{AxisKind, Vec3};
use crate::raster::{Image, MOST_EXPOSURES, save_png};
use crate::recording::{AmbientRef, Beam, FrameRef, ImageSpec, Meta, save_poses};
use crate::rig::{Calibration, Covariance, Kind, Quality, Rig, Verdict};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// The written folders.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Simulated {
    /// Folder of the station, with its true calibration.
    pub station: PathBuf,
    /// Name, folder and number of pictures of each set.
    pub recordings: Vec<(String, PathBuf, usize)>,
}

/// Writes the recordings and the station under `out`; `progress(done, of)` counts pictures.
pub fn simulate(out: &Path, options: &SimulateOptions, progress: &(dyn Fn(usize, usize) + Sync)) -> Result<Simulated> {
    options.check()?;
    let station = options.station();
    let spec = match (&options.scene, &options.rig) {
        (Some(path), _) => SceneSpec::load(path)?,
        (None, None) => SceneSpec::parse(DEFAULT_SCENE)?,
        (None, Some(rig)) => rig.scene(),
    };
    let scene = Scene::new(spec)?;
    let folder = out.join("station");
    crate::files::make_folder(&folder)?;
    station.store(&folder)?;
    let ride = options.motion.map(|kind| {
        let board = options.board.clone().unwrap_or_else(|| riding_board(&station.rig));
        (Ride::new(kind, &station, &scene, &board, options.shots), board)
    });
    if let Some((ride, _)) = &ride {
        store_axis(ride, &folder)?;
    }
    if let (None, Some(rig)) = (&options.scene, &options.rig) {
        crate::files::write(&out.join("notched.toml"), rig.recipe(options.shots).as_bytes())?;
    }
    let plans: Vec<Plan> = options
        .sets
        .iter()
        .map(|set| Plan::new(*set, &station, &scene, options, ride.as_ref()))
        .collect::<Result<_>>()?;
    let total = plans.iter().map(Plan::pictures).sum();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let count = || progress(1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed), total);
    let mut recordings = Vec::new();
    for plan in &plans {
        let folder = out.join(plan.set.name());
        let pictures = plan.write(&folder, &station, options, &count)?;
        recordings.push((plan.set.name().to_owned(), folder, pictures));
    }
    Ok(Simulated { station: folder, recordings })
}

/// Writes the true axis as a calibration of the station.
fn store_axis(ride: &Ride, station: &Path) -> Result<()> {
    let kind = match ride.axis.kind {
        AxisKind::Linear => Kind::LinearAxis,
        AxisKind::Turntable => Kind::Turntable,
    };
    let quality = Quality {
        verdict: Verdict::Good,
        reasons: vec![TRUE_VALUES.into()],
        advice: vec![],
        figures: Default::default(),
        per_picture: vec![],
    };
    let names = kind.parameters().0;
    let covariance = Covariance::new(names, &nalgebra::DMatrix::zeros(names.len(), names.len()));
    let camera = Rig::load_camera(station)?.camera;
    Rig::store(station, &Calibration::new(kind, ride.axis, camera.as_ref(), covariance, quality), None).map(|_| ())
}

/// Name of a shot's picture at exposure `k`, counted from the shortest.
fn laser_name(shot: usize, k: usize) -> String {
    if k == 0 { format!("laser_{shot:04}.png") } else { format!("laser_{shot:04}_{}.png", k + 1) }
}

impl Plan {
    /// The entry of one shot in meta.json.
    fn frame(&self, i: usize) -> FrameRef {
        let shot = &self.shots[i];
        FrameRef {
            laser: shot.laser.map(|_| laser_name(i, 0)),
            longer: (1..self.exposures_us.len()).map(|k| laser_name(i, k)).collect(),
            ambient: (shot.ambient && self.set != Set::Scan).then(|| format!("ambient_{i:04}.png")),
            pose: self.pose(i),
            board: shot.board,
            count: self.counts.get(i).copied(),
            ..FrameRef::default()
        }
    }

    fn pose(&self, i: usize) -> Option<usize> {
        (!self.poses.is_empty()).then_some(i)
    }

    fn meta(&self, station: &Station) -> Meta {
        let single = self.boards.len() == 1 && matches!(self.set, Set::Intrinsics | Set::Handeye | Set::Axis);
        let beam = self.shots.first().and_then(|s| s.laser);
        // A scan has one picture in room light for the whole recording, not one a frame.
        let ambient = self.shots.iter().rposition(|s| s.ambient && self.set == Set::Scan);
        let mut meta = Meta {
            format: 1,
            set: self.set.name().into(),
            units: "mm".into(),
            image: ImageSpec {
                width: station.camera.width,
                height: station.camera.height,
                bits: station.sensor.bits,
                channels: 1,
                response: crate::raster::Response::Linear,
                pixel_centre: "integer coordinates".into(),
                readout: Some(station.camera.whole_sensor()),
            },
            beam,
            board: single.then(|| self.boards[0].clone()),
            boards: if single { vec![] } else { self.boards.clone() },
            ambient: ambient.map(|i| AmbientRef { file: "ambient.png".into(), pose: self.pose(i) }),
            frames: (0..self.shots.len()).map(|i| self.frame(i)).collect(),
            exposures_us: self.exposures_us.clone(),
            black_level: None,
            frames_file: None,
            sources: None,
            motion: self.motion.clone(),
            pose_file: None,
            pose_files: Default::default(),
            part: None,
            model: None,
            target: None,
            distance_definition: None,
        };
        match self.set {
            Set::Handeye => {
                meta.pose_files.insert("poses_exact".into(), "encoder readings without error".into());
                meta.pose_files.insert("poses_noisy".into(), "readings with the errors of a real arm".into());
            }
            Set::Pointer => {
                meta.target = Some("matte flat plate perpendicular to the optical axis".into());
                meta.distance_definition =
                    Some("camera_z: distance from the camera centre to the plate along the optical axis".into());
            }
            Set::Scan => meta.target = Some(self.scenes[0].spec.name.clone()),
            _ => {}
        }
        if !self.poses.is_empty() && self.set != Set::Handeye {
            meta.pose_file = Some("poses".into());
        }
        meta
    }

    fn write(
        &self,
        folder: &Path,
        station: &Station,
        options: &SimulateOptions,
        count: &(dyn Fn() + Sync),
    ) -> Result<usize> {
        crate::files::make_folder(folder)?;
        // A folder with a meta.json counts as complete. The meta.json of an earlier simulation is therefore removed
        // first, and the new one is written last.
        let meta = folder.join("meta.json");
        crate::files::remove(&meta).map_err(|e| Fault::write(&meta, e))?;
        let hot = station.hot_pixels();
        let visible: Vec<Vec<Vec3>> = self
            .shots
            .par_iter()
            .enumerate()
            .map(|(i, shot)| self.take(i, shot, folder, station, &hot, count))
            .collect::<Result<_>>()?;
        let mut truth = self.truth.clone();
        let (mm, deg) = match self.set {
            // Unless noise is requested, the noisy poses of a hand-eye recording have the errors of a real arm.
            Set::Handeye if options.pose_noise_mm == 0.0 && options.pose_noise_deg == 0.0 => (0.05, 0.02),
            _ => (options.pose_noise_mm, options.pose_noise_deg),
        };
        (truth.pose_noise_mm, truth.pose_noise_deg) = (mm, deg);
        if !self.poses.is_empty() {
            let mut rng = station.rng("pose noise", self.set as u64);
            let noisy: Vec<_> = self.poses.iter().map(|p| plan::reported(p, mm, deg, &mut rng)).collect();
            let (exact, shown) = match self.set {
                Set::Handeye => ("poses_exact.json", "poses_noisy.json"),
                _ => ("poses_true.json", "poses.json"),
            };
            save_poses(&folder.join(exact), &self.poses)?;
            save_poses(&folder.join(shown), &noisy)?;
        }
        if let (Set::Scan, Some(base_from_scene)) = (self.set, truth.base_from_scene) {
            let points: Vec<Vec3> = visible.iter().flatten().map(|p| base_from_scene.point(p)).collect();
            crate::files::write(&folder.join("visible.ply"), &points_ply(&points))?;
        }
        let json = |value: serde_json::Result<String>| value.expect("plain data").into_bytes();
        crate::files::write(&folder.join("truth.json"), &json(serde_json::to_string_pretty(&truth)))?;
        crate::files::write(&meta, &json(serde_json::to_string_pretty(&self.meta(station))))?;
        Ok(self.pictures())
    }

    /// Takes one shot's pictures; returns the points on the stripe that are bright enough to be measured.
    fn take(
        &self,
        i: usize,
        shot: &Shot,
        folder: &Path,
        station: &Station,
        hot: &[(usize, f32)],
        count: &(dyn Fn() + Sync),
    ) -> Result<Vec<Vec3>> {
        let view = View { station, scene: &self.scenes[shot.scene], scene_from_camera: shot.scene_from_camera };
        let (w, h) = (station.camera.width, station.camera.height);
        let sensor = &station.sensor;
        let save = |name: String, picture: Image| save_png(&picture, &folder.join(name)).map(|()| count());
        if shot.ambient {
            // 3 x 3 rays a pixel at 640; the pixels of a finer sensor sample edges finely enough with one.
            let room = view.ambient(if w > 1600 { 1 } else { 3 });
            let mut rng = station.rng(self.set.name(), 2 * i as u64);
            let gain = sensor.ambient_white as f32;
            let picture = expose(sensor, &Canvas::new(w, h), &room, gain, hot, &mut rng);
            save(if self.set == Set::Scan { "ambient.png".into() } else { format!("ambient_{i:04}.png") }, picture)?;
        }
        let Some(beam) = shot.laser else { return Ok(vec![]) };
        let mut light = Canvas::new(w, h);
        let middle = match beam {
            Beam::Line => view.sheet(&mut light),
            Beam::Pointer => view.spot(&mut light).into_iter().collect(),
        };
        let room = if sensor.ambient_leak > 0.0 { view.faint_ambient() } else { Canvas::new(w, h) };
        let mut rng = station.rng(self.set.name(), 2 * i as u64 + 1);
        let fallen = fallen(sensor, &light, &room, sensor.ambient_leak as f32, hot, &mut rng);
        if self.exposures_us.is_empty() {
            save(laser_name(i, 0), read(sensor, &fallen, 1.0, &mut rng))?;
        }
        // The speckle of a pose is the same in all of its pictures; the sensor's noise is not.
        for (k, us) in self.exposures_us.iter().enumerate() {
            let mut rng = station.rng("exposures", (MOST_EXPOSURES * i + k) as u64);
            save(laser_name(i, k), read(sensor, &fallen, (1e-3 * us) as f32, &mut rng))?;
        }
        let longest = self.exposures_us.last().map_or(1.0, |us| (1e-3 * us) as f32);
        let bright = |u: f64, v: f64| {
            let (x, y) = (u.round(), v.round());
            let inside = x >= 0.0 && y >= 0.0 && x < f64::from(w) && y < f64::from(h);
            // 6 % of full scale: about 15 of 255 grey levels.
            inside && longest * light.pixels[y as usize * w as usize + x as usize] > 0.06
        };
        Ok(middle.iter().filter(|p| bright(p.u, p.v)).map(|p| p.point).collect())
    }
}

/// A point list as binary PLY (x y z, float32).
fn points_ply(points: &[Vec3]) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\ncomment units mm, base frame\nelement vertex {}\nproperty float \
         x\nproperty float y\nproperty float z\nend_header\n",
        points.len()
    )
    .into_bytes();
    for p in points {
        p.iter().for_each(|x| out.extend((*x as f32).to_le_bytes()));
    }
    out
}
