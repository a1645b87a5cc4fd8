//! In: points, poses, pictures, cameras and figures of a scan, with frame and time. Out: the ROS 2 messages that
//! contain them.
//! Frame and unit: the frame that each message names; metres, in the messages and in a cloud's fields; pixels.

use super::cdr::Cdr;
use sheetlight::camera::Intrinsics;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Frame, Rigid};
use sheetlight::raster::{Image, Pixels};
use sheetlight::robot::Convention;
use sheetlight::scan::CloudPoint;

/// A moment, ns since 1970 (UTC).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stamp(pub u64);

/// A transform from a frame to its parent.
pub struct Link {
    /// Name of the frame in which the child's pose is stated.
    pub parent: String,
    /// Name of the child frame.
    pub child: String,
    /// x y z, metres, and the quaternion x y z w.
    numbers: [f64; 7],
}

impl Link {
    /// `parent_from_child`, mm.
    pub fn new<To: Frame, From: Frame>(parent: &str, child: &str, parent_from_child: &Rigid<To, From>) -> Link {
        Link { parent: parent.to_owned(), child: child.to_owned(), numbers: numbers(parent_from_child) }
    }
}

/// Position in metres, and the quaternion with its real part last.
fn numbers<To: Frame, From: Frame>(pose: &Rigid<To, From>) -> [f64; 7] {
    Convention::Ros.write(pose).try_into().expect("a position and a quaternion")
}

fn header(m: &mut Cdr, at: Stamp, frame: &str) {
    m.i32((at.0 / 1_000_000_000) as i32);
    m.u32((at.0 % 1_000_000_000) as u32);
    m.string(frame);
}

/// `tf2_msgs/msg/TFMessage`.
pub fn transforms(at: Stamp, links: &[Link]) -> Cdr {
    let mut m = Cdr::default();
    m.count(links.len());
    for link in links {
        header(&mut m, at, &link.parent);
        m.string(&link.child);
        m.f64s(&link.numbers);
    }
    m
}

/// `geometry_msgs/msg/PoseStamped` of `frame_from_part`, mm.
pub fn pose<To: Frame, From: Frame>(at: Stamp, frame: &str, frame_from_part: &Rigid<To, From>) -> Cdr {
    let mut m = Cdr::default();
    header(&mut m, at, frame);
    m.f64s(&numbers(frame_from_part));
    m
}

/// Numbers of the data types of `sensor_msgs/msg/PointField`.
const UINT32: u8 = 6;
const FLOAT32: u8 = 7;

/// The fields of a point, 4 bytes each, in the order of [`record`].
const FIELDS: [(&str, u8); 9] = [
    ("x", FLOAT32),
    ("y", FLOAT32),
    ("z", FLOAT32),
    ("intensity", FLOAT32),
    ("sigma", FLOAT32),
    ("quality", FLOAT32),
    ("u", FLOAT32),
    ("v", FLOAT32),
    ("shot", UINT32),
];

/// Size of a point, bytes.
const RECORD: usize = 4 * FIELDS.len();

/// Most points of one message, because its lengths are counted in 32 bits.
pub const MOST_POINTS: u64 = u32::MAX as u64 / RECORD as u64;

fn record(p: &CloudPoint) -> [u8; RECORD] {
    // Divided in f64 and rounded once.
    let metres = |mm: f32| (f64::from(mm) / 1000.0) as f32;
    let [x, y, z] = p.position.to_array().map(metres);
    let floats = [x, y, z, p.intensity, metres(p.sigma_mm), p.quality, p.u, p.v].map(f32::to_bits);
    let mut bytes = [0; RECORD];
    let words = floats.into_iter().chain([p.shot]);
    bytes.chunks_exact_mut(4).zip(words).for_each(|(b, w)| b.copy_from_slice(&w.to_le_bytes()));
    bytes
}

/// `sensor_msgs/msg/PointCloud2` whose points are added one after the other: only the message itself is in memory.
pub struct Points {
    message: Cdr,
    left: usize,
}

impl Points {
    /// An unorganised message of `count` points.
    ///
    /// # Errors
    /// More than [`MOST_POINTS`].
    pub fn new(at: Stamp, frame: &str, count: u64) -> Result<Points> {
        if count > MOST_POINTS {
            return Err(Fault::usage(format!("{count} points, at most {MOST_POINTS} fit a message"))
                .cause("ROS 2 counts the bytes of a message in 32 bits")
                .next("exclude the whole cloud with --no-cloud; the profiles have every point"));
        }
        let (points, bytes) = (count as u32, count as usize * RECORD);
        let mut m = Cdr::with_room(bytes + 512);
        header(&mut m, at, frame);
        m.u32(1);
        m.u32(points);
        m.count(FIELDS.len());
        for (i, (name, kind)) in FIELDS.iter().enumerate() {
            m.string(name);
            m.u32(4 * i as u32);
            m.u8(*kind);
            m.u32(1);
        }
        m.bool(false);
        m.u32(RECORD as u32);
        m.u32(points * RECORD as u32);
        m.count(bytes);
        Ok(Points { message: m, left: count as usize })
    }

    /// Adds points, in order.
    pub fn add(&mut self, points: &[CloudPoint]) {
        self.left = self.left.checked_sub(points.len()).expect("no more points than were announced");
        points.iter().for_each(|p| self.message.raw(&record(p)));
    }

    /// The message, after all its points were added. No point is missing or NaN (`is_dense`).
    pub fn finish(mut self) -> Cdr {
        assert_eq!(self.left, 0, "all points that were announced");
        self.message.bool(true);
        self.message
    }
}

/// `sensor_msgs/msg/Image`: mono8, or mono16 (little endian) with unchanged levels, not stretched to 16 bits.
pub fn image(at: Stamp, frame: &str, picture: &Image) -> Cdr {
    let (encoding, size) = if picture.bits > 8 { ("mono16", 2) } else { ("mono8", 1) };
    let bytes = picture.pixel_count() * size;
    let mut m = Cdr::with_room(bytes + 256);
    header(&mut m, at, frame);
    m.u32(picture.height);
    m.u32(picture.width);
    m.string(encoding);
    m.u8(0);
    m.u32(picture.width * size as u32);
    m.count(bytes);
    match &picture.pixels {
        Pixels::U8(levels) => m.raw(levels),
        // Little endian, like every machine that this program runs on.
        Pixels::U16(levels) => m.raw(bytemuck::cast_slice(levels)),
    }
    m
}

/// ROS' name of the lens model, with its terms.
///
/// # Errors
/// A thin prism or a tilted sensor, which ROS cannot describe.
pub fn lens(camera: &Intrinsics) -> Result<(&'static str, &[f64])> {
    match camera.distortion.to_opencv() {
        terms if terms.len() == 5 => Ok(("plumb_bob", terms)),
        terms if terms.len() == 8 => Ok(("rational_polynomial", terms)),
        terms => Err(Fault::refused(format!("the lens has {} terms, CameraInfo has words for 8", terms.len()))
            .cause("a thin prism or a tilted sensor, which image_geometry does not know")
            .next("exclude the pictures, or calibrate the camera with --lens five")),
    }
}

/// `sensor_msgs/msg/CameraInfo` of pictures of the camera's size; fails as [`lens`] does.
pub fn camera_info(at: Stamp, frame: &str, camera: &Intrinsics) -> Result<Cdr> {
    let (model, terms) = lens(camera)?;
    let Intrinsics { fx, fy, cx, cy, skew, .. } = *camera;
    let mut m = Cdr::default();
    header(&mut m, at, frame);
    m.u32(camera.height);
    m.u32(camera.width);
    m.string(model);
    m.count(terms.len());
    m.f64s(terms);
    m.f64s(&[fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    m.f64s(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    m.f64s(&[fx, skew, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]);
    // Binning and region are included in the matrix already.
    [0; 6].into_iter().for_each(|n| m.u32(n));
    m.bool(false);
    Ok(m)
}

/// One status of `diagnostic_msgs/msg/DiagnosticArray`.
pub struct Status {
    /// Whether the status is a warning.
    pub warn: bool,
    /// Name of the component that it describes.
    pub name: String,
    /// Summary in one line.
    pub message: String,
    /// The station, identified by its calibration.
    pub hardware: String,
    /// Figures with the unit in the name.
    pub values: Vec<(String, String)>,
}

/// `diagnostic_msgs/msg/DiagnosticArray` of one status.
pub fn diagnostics(at: Stamp, status: &Status) -> Cdr {
    let mut m = Cdr::default();
    header(&mut m, at, "");
    m.count(1);
    m.u8(u8::from(status.warn));
    m.string(&status.name);
    m.string(&status.message);
    m.string(&status.hardware);
    m.count(status.values.len());
    for (key, value) in &status.values {
        m.string(key);
        m.string(value);
    }
    m
}

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight::geometry::{Base, Camera, Vec3};

    #[test]
    fn a_point_is_metres_rounded_once() {
        let p = CloudPoint {
            position: [123.456, -0.001, 1e5].into(),
            sigma_mm: 0.02,
            intensity: 99.0,
            quality: 0.5,
            shot: 7,
            u: 1.25,
            v: 2.5,
        };
        let bytes = record(&p);
        let float = |i: usize| f32::from_le_bytes(bytes[4 * i..4 * i + 4].try_into().unwrap());
        assert_eq!([float(0), float(1), float(2)], [0.123456, -0.000001, 100.0]);
        assert_eq!([float(3), float(4), float(5), float(6), float(7)], [99.0, 0.00002, 0.5, 1.25, 2.5]);
        assert_eq!(bytes[32..], [7, 0, 0, 0]);
    }

    /// A cloud of one point, byte by byte up to its data.
    #[test]
    fn a_cloud_has_the_layout_that_was_worked_out() {
        let mut points = Points::new(Stamp(2_000_000_003), "map", 1).unwrap();
        points.add(&[CloudPoint::default()]);
        let bytes = points.finish().bytes().to_vec();
        let mut expected: Vec<u8> = vec![0, 1, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0, b'm', b'a', b'p', 0];
        expected.extend([1, 0, 0, 0, 1, 0, 0, 0, 9, 0, 0, 0]);
        // x: the text takes 6 bytes and 2 padding bytes; offset, type, 3 padding bytes, count.
        expected.extend([2, 0, 0, 0, b'x', 0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0]);
        expected.extend([2, 0, 0, 0, b'y', 0, 0, 0, 4, 0, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!(bytes[..expected.len()], expected);
        // The bool is padded to a multiple of 4 after the last field's count; point_step, row_step, size of data,
        // data, is_dense.
        let tail = [[0, 0, 0, 0], [36, 0, 0, 0], [36, 0, 0, 0], [36, 0, 0, 0]].concat();
        let end = bytes.len() - 37;
        assert_eq!(bytes[end - 16..end], tail);
        assert_eq!(bytes[bytes.len() - 1], 1);
        assert!(Points::new(Stamp(0), "map", MOST_POINTS + 1).err().unwrap().what.contains("119304647"));
    }

    #[test]
    fn a_transform_is_in_metres_with_the_real_part_last() {
        let quarter: Rigid<Base, Camera> =
            Rigid::from_vectors(&Vec3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2), Vec3::new(100.0, -200.0, 300.0));
        let link = Link::new("base", "camera", &quarter);
        let root = std::f64::consts::FRAC_1_SQRT_2;
        let expected = [0.1, -0.2, 0.3, 0.0, 0.0, root, root];
        assert!(link.numbers.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{:?}", link.numbers);
    }

    #[test]
    fn a_lens_without_words_in_ros_is_refused() {
        let with = |terms: &[f64]| Intrinsics {
            fx: 900.0,
            fy: 900.0,
            cx: 320.0,
            cy: 240.0,
            skew: 0.0,
            distortion: sheetlight::camera::Distortion::from_opencv(terms).unwrap(),
            width: 640,
            height: 480,
        };
        assert_eq!(lens(&with(&[0.1, 0.0, 0.0, 0.0])).unwrap().0, "plumb_bob");
        assert_eq!(lens(&with(&[0.1, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0])).unwrap().0, "rational_polynomial");
        let prism = with(&[0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0]);
        assert!(lens(&prism).unwrap_err().what.contains("12 terms"));
    }
}
