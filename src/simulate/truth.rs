//! In: `truth.json` of a simulated recording. Out: the exact surface and poses, and the distances of measured points
//! from them.
//! Frame and unit: the cloud's frame (base, or the axis frame for a part that rides on an axis), mm. Keys named
//! `A_T_b` map coordinates in frame b to frame A.

use super::light::InScene;
use super::scene::{Scene, SceneSpec, part_pose};
use super::station::Station;
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Axis, Base, Board, Camera, Part, Plane, Rigid, Vec3};
use crate::rig::HandEye;
use std::path::Path;

/// Content of `truth.json` (docs/file-formats.md).
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthFile {
    /// Name of the simulated set.
    pub set: String,
    /// Always "mm".
    pub units: String,
    /// Seed of the station.
    pub seed: u64,
    /// Camera and lens.
    pub intrinsics: Intrinsics,
    /// The hand-eye transform, mm.
    #[serde(rename = "flange_T_camera")]
    pub flange_from_camera: HandEye,
    /// The sheet of light, camera frame, mm.
    pub laser_plane_camera: Plane<Camera>,
    /// Apex of the fan, camera frame, mm.
    pub laser_source_camera_mm: Vec3,
    /// The pointer's beam, camera frame.
    pub pointer_camera: PointerTruth,
    /// The axis that moves the part, if no robot moves the sensor; `base` in other keys then stands for the axis
    /// frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<Axis>,
    /// Pose of the scene, mm; for sets that show it.
    #[serde(rename = "base_T_scene", default, skip_serializing_if = "Option::is_none")]
    pub base_from_scene: Option<Rigid<Base, InScene>>,
    /// The scene; for sets that show it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<SceneSpec>,
    /// The scene's parts with their poses.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<PartTruth>,
    /// Pose of the board, mm; for hand-eye sets.
    #[serde(rename = "base_T_board", default, skip_serializing_if = "Option::is_none")]
    pub base_from_board: Option<Rigid<Base, Board>>,
    /// One board pose a frame, mm; for sets that show boards.
    #[serde(rename = "camera_T_board", default, skip_serializing_if = "Vec::is_empty")]
    pub camera_from_board: Vec<Rigid<Camera, Board>>,
    /// Distances of the pointer's plate along the optical axis, mm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub distances_mm: Vec<f64>,
    /// Position error of the reported poses, 1 sigma per axis, mm.
    pub pose_noise_mm: f64,
    /// Orientation error of the reported poses, 1 sigma per axis, degrees.
    pub pose_noise_deg: f64,
}

/// The pointer's beam: a point on it, mm, and its direction.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointerTruth {
    /// The source, camera frame, mm.
    pub origin: Vec3,
    /// Direction of the beam, camera frame; unit vector.
    pub direction: Vec3,
}

/// A part of the scene with its pose.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartTruth {
    /// Its name in the scene file.
    pub name: String,
    /// Pose of the part, mm.
    #[serde(rename = "base_T_part")]
    pub base_from_part: Rigid<Base, Part>,
}

impl TruthFile {
    /// The true values of the station alone; the caller adds those of the set.
    pub fn of(station: &Station, set: &str) -> TruthFile {
        TruthFile {
            set: set.into(),
            units: "mm".into(),
            seed: station.seed,
            intrinsics: station.camera,
            flange_from_camera: station.flange_from_camera,
            laser_plane_camera: station.laser.plane(),
            laser_source_camera_mm: station.laser.source,
            pointer_camera: PointerTruth { origin: station.pointer.source, direction: station.pointer.axis },
            axis: None,
            base_from_scene: None,
            scene: None,
            parts: vec![],
            base_from_board: None,
            camera_from_board: vec![],
            distances_mm: vec![],
            pose_noise_mm: 0.0,
            pose_noise_deg: 0.0,
        }
    }

    /// The same with a scene and its parts.
    pub fn with_scene(mut self, scene: &Scene, base_from_scene: Rigid<Base, InScene>) -> TruthFile {
        let name = |p: &super::scene::PartSpec| p.name.clone();
        self.parts = scene
            .spec
            .part
            .iter()
            .map(|p| PartTruth { name: name(p), base_from_part: base_from_scene * part_pose::<InScene>(p) })
            .collect();
        self.scene = Some(scene.spec.clone());
        self.base_from_scene = Some(base_from_scene);
        self
    }
}

/// The exact surface of a simulated scan.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Content of the file.
    pub file: TruthFile,
    scene: Scene,
    scene_from_base: Rigid<InScene, Base>,
}

/// How far a cloud is from the truth, mm.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct CloudErrors {
    /// Number of compared points; without any the other figures are 0.
    pub points: usize,
    /// Root mean square of the distances from the nearest surface, mm.
    pub rms_mm: f64,
    /// Median distance from the nearest surface, mm.
    pub median_mm: f64,
    /// 95th percentile of the distances, mm.
    pub p95_mm: f64,
    /// Largest distance, mm.
    pub largest_mm: f64,
    /// Root mean square distance of the points within 1 mm, mm.
    pub rms_without_outliers_mm: f64,
    /// Share of the points that are more than 1 mm off, 0..=1.
    pub outliers_share: f64,
}

impl Truth {
    /// Reads the file and builds its scene; refuses the truth of a set without one.
    pub fn load(path: &Path) -> Result<Truth> {
        let text = crate::files::read_text(path)?;
        let strange = |what: String| {
            Fault::input(format!("{}: {what}", path.display()))
                .cause("not the truth.json of a simulated scan")
                .next("give the truth.json beside the recording's meta.json")
        };
        let file: TruthFile = serde_json::from_str(&text).map_err(|e| strange(format!("cannot be read: {e}")))?;
        let (Some(spec), Some(pose)) = (file.scene.clone(), file.base_from_scene) else {
            return Err(strange("holds no scene".into()));
        };
        Ok(Truth { scene: Scene::new(spec)?, scene_from_base: pose.inverse(), file })
    }

    /// Distance of a base-frame point from the nearest surface, mm: exact on faces, a lower bound beside the edges
    /// of cut-outs.
    pub fn distance(&self, in_base: &Vec3) -> f64 {
        self.scene.distance(&self.scene_from_base.point(in_base))
    }

    /// Name of the part that is nearest to a base-frame point; `None` if something else is nearer.
    pub fn part_near(&self, in_base: &Vec3) -> Option<&str> {
        let i = self.scene.part_near(&self.scene_from_base.point(in_base))?;
        Some(&self.scene.spec.part[i].name)
    }
}

impl CloudErrors {
    /// Figures computed from distances to the surface, mm.
    pub fn of(mut d: Vec<f64>) -> CloudErrors {
        if d.is_empty() {
            return CloudErrors::default();
        }
        d.sort_unstable_by(f64::total_cmp);
        // The sum of nothing is -0.
        let rms = |d: &[f64]| (d.iter().fold(0.0, |sum, x| sum + x * x) / d.len().max(1) as f64).sqrt();
        let near = d.partition_point(|x| *x <= 1.0);
        let at = |q: f64| d[((d.len() - 1) as f64 * q).round() as usize];
        CloudErrors {
            points: d.len(),
            rms_mm: rms(&d),
            median_mm: at(0.5),
            p95_mm: at(0.95),
            largest_mm: at(1.0),
            rms_without_outliers_mm: rms(&d[..near]),
            outliers_share: (d.len() - near) as f64 / d.len() as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_known_distances() {
        let e = CloudErrors::of(vec![0.1, 0.1, 0.1, 0.1, 3.0]);
        assert!((e.rms_without_outliers_mm - 0.1).abs() < 1e-12 && (e.outliers_share - 0.2).abs() < 1e-12);
        assert_eq!((e.points, e.median_mm, e.largest_mm), (5, 0.1, 3.0));
    }

    #[test]
    fn a_written_truth_measures_the_same_surface() {
        let station = Station::random(4);
        let scene = Scene::new(SceneSpec::parse(crate::simulate::DEFAULT_SCENE).unwrap()).unwrap();
        let pose = crate::simulate::base_from_scene(&station);
        let file = TruthFile::of(&station, "scan").with_scene(&scene, pose);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("truth.json");
        std::fs::write(&path, serde_json::to_string(&file).unwrap()).unwrap();
        let truth = Truth::load(&path).unwrap();
        // The bare board, and a point a tenth of a millimetre above it.
        for (z, want) in [(0.0, 0.0), (0.1, 0.1)] {
            let p = pose.point(&Vec3::new(0.0, -30.0, z));
            assert!((truth.distance(&p) - want).abs() < 1e-9);
        }
        assert_eq!(truth.file.parts.len(), scene.spec.part.len());
        let led = &truth.file.parts[0];
        assert_eq!(truth.part_near(&led.base_from_part.point(&Vec3::new(7.0, 7.6, -0.01))), Some("led"));
    }
}
