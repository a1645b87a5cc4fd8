//! In: a recording and its true calibration. Out: both as they would be of a camera that is turned about its axis by
//! quarter turns, or of a mirrored world: the scene, its light and its noise are exactly the same.
//! Frame and unit: pixels, mm. A camera's x' = A x; where A mirrors, the base's x' = M x does as well, so that poses
//! stay proper.

use serde_json::{Value, json};
use sheetlight::geometry::Mat3;
use sheetlight::raster::{Channel, Image, Pixels, load, save_png};
use std::path::Path;

/// What is done to a picture, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Left to right.
    Mirror,
    /// Clockwise.
    Quarter,
}

impl Step {
    fn camera(self) -> Mat3 {
        match self {
            Step::Mirror => mirror(),
            Step::Quarter => Mat3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
        }
    }
    fn picture(self, image: &Image) -> Image {
        let (w, h) = (image.width, image.height);
        let (width, height) = if self == Step::Quarter { (h, w) } else { (w, h) };
        let from = |u: u32, v: u32| match self {
            Step::Mirror => image.get(w - 1 - u, v),
            Step::Quarter => image.get(v, h - 1 - u),
        };
        let pixels = (0..height).flat_map(|v| (0..width).map(move |u| (u, v))).map(|(u, v)| from(u, v));
        match image.pixels {
            Pixels::U8(_) => Image::from_u8(width, height, pixels.map(|p| p as u8).collect()),
            Pixels::U16(_) => Image::from_u16(width, height, image.bits, pixels.collect()),
        }
    }
    /// The lens [k1, k2, p1, p2, k3] is the same glass; its tangential terms turn with the axes.
    fn intrinsics(self, i: &Value) -> Value {
        let n = |key: &str| i[key].as_f64().expect("a number");
        let [k1, k2, p1, p2, k3] =
            std::array::from_fn(|k| i["distortion_k1_k2_p1_p2_k3"][k].as_f64().expect("a number"));
        let (w, h) = (n("width"), n("height"));
        assert_eq!(n("skew"), 0.0, "rows of sensors are square");
        match self {
            Step::Mirror => json!({"fx": n("fx"), "fy": n("fy"), "cx": w - 1.0 - n("cx"), "cy": n("cy"), "skew": 0.0,
                "width": w as u32, "height": h as u32, "distortion_k1_k2_p1_p2_k3": [k1, k2, p1, -p2, k3]}),
            Step::Quarter => json!({"fx": n("fy"), "fy": n("fx"), "cx": h - 1.0 - n("cy"), "cy": n("cx"), "skew": 0.0,
                "width": h as u32, "height": w as u32, "distortion_k1_k2_p1_p2_k3": [k1, k2, p2, -p1, k3]}),
        }
    }
}

fn mirror() -> Mat3 {
    Mat3::from_diagonal(&[-1.0, 1.0, 1.0].into())
}

/// A and M of all steps.
fn axes(steps: &[Step]) -> (Mat3, Mat3) {
    let camera = steps.iter().fold(Mat3::identity(), |a, s| s.camera() * a);
    (camera, base_axes(steps))
}

/// What is done to the points of the cloud, too: x' = M x.
pub fn base_axes(steps: &[Step]) -> Mat3 {
    if steps.contains(&Step::Mirror) { mirror() } else { Mat3::identity() }
}

/// L T R of a 4x4 matrix, row by row.
fn between(left: &Mat3, t: &Value, right: &Mat3) -> Value {
    let wide = |m: &Mat3| m.to_homogeneous();
    let at = |k: usize| t.get(k).unwrap_or_else(|| &t[k / 4][k % 4]).as_f64().expect("a number");
    let t = nalgebra::Matrix4::from_fn(|i, j| at(4 * i + j));
    let turned = wide(left) * t * wide(right);
    json!(turned.transpose().as_slice())
}

/// The file that `station import` reads.
pub fn calibration(truth: &Value, steps: &[Step]) -> Value {
    let (a, m) = axes(steps);
    let laser = &truth["laser_plane_camera"];
    let normal = nalgebra::Vector3::from_fn(|i, _| laser["normal"][i].as_f64().expect("a number"));
    json!({
        "intrinsics": steps.iter().fold(truth["intrinsics"].clone(), |i, s| s.intrinsics(&i)),
        "flange_T_camera": between(&m, &truth["flange_T_camera"], &a.transpose()),
        "laser_plane_camera": {"normal": (a * normal).as_slice(), "offset_mm": laser["offset_mm"]},
    })
}

/// The recording's shots `shots` (all where `None`), pictures and poses, in the folder `to`.
pub fn recording(from: &Path, to: &Path, steps: &[Step], shots: Option<std::ops::Range<usize>>) {
    std::fs::create_dir_all(to).unwrap();
    let read = |name: &str| -> Value { serde_json::from_slice(&std::fs::read(from.join(name)).unwrap()).unwrap() };
    let mut meta = read("meta.json");
    let bits = meta["image"]["bits"].as_u64().unwrap() as u8;
    if let Some(shots) = shots {
        meta["frames"] = json!(meta["frames"].as_array().unwrap()[shots]);
    }
    let mut names: Vec<&str> = meta["frames"].as_array().unwrap().iter().filter_map(|f| f["laser"].as_str()).collect();
    names.extend(meta["ambient"]["file"].as_str());
    for name in names {
        let image = load(&from.join(name), Channel::default(), bits).unwrap();
        save_png(&steps.iter().fold(image, |image, s| s.picture(&image)), &to.join(name)).unwrap();
    }
    if steps.iter().filter(|s| **s == Step::Quarter).count() % 2 == 1 {
        let image = &mut meta["image"];
        (image["width"], image["height"]) = (image["height"].clone(), image["width"].clone());
    }
    std::fs::write(to.join("meta.json"), meta.to_string()).unwrap();
    let m = base_axes(steps);
    let mut poses = read("poses.json");
    for pose in poses["poses"].as_array_mut().unwrap() {
        pose["matrix"] = between(&m, &pose["matrix"], &m);
    }
    std::fs::write(to.join("poses.json"), poses.to_string()).unwrap();
}
