//! The part of its sensor that a camera sends, its resolution, and the camera model for it.

use super::Intrinsics;

/// How a camera reads its sensor: it combines pixels (binning), skips pixels (decimation), and cuts a region out of
/// the result. Columns come before rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Readout {
    /// Left and top of the region, px of the pictures: counted after binning and decimation, like GenICam's OffsetX
    /// and OffsetY.
    #[serde(default)]
    pub offset_px: [u32; 2],
    /// Number of sensor pixels combined into one pixel of the picture, which lies at their middle.
    #[serde(default = "each")]
    pub binning: [u32; 2],
    /// One pixel in this many is read; the picture's pixel lies where that one does.
    #[serde(default = "each")]
    pub decimation: [u32; 2],
    /// Whether the picture is mirrored.
    #[serde(default)]
    pub reversed: [bool; 2],
    /// Size of the whole sensor, px; none if the camera does not state it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor_px: Option<[u32; 2]>,
    /// The picture shows the view of the calibration's pictures at another resolution: a camera that scales its
    /// pictures, or two modes of one sensor. It excludes the other keys: a region or binning would change the view.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub same_view: bool,
}

impl Intrinsics {
    /// The readout of pictures that show this camera's entire sensor.
    pub fn whole_sensor(&self) -> Readout {
        Readout { sensor_px: Some([self.width, self.height]), ..Readout::default() }
    }
}

fn each() -> [u32; 2] {
    [1; 2]
}

impl Default for Readout {
    /// The whole sensor, every pixel.
    fn default() -> Readout {
        Readout {
            offset_px: [0; 2],
            binning: each(),
            decimation: each(),
            reversed: [false; 2],
            sensor_px: None,
            same_view: false,
        }
    }
}

impl std::fmt::Display for Readout {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.same_view {
            f.write_str("the same view at another resolution, ")?;
        }
        let ([x, y], [bx, by], [dx, dy]) = (self.offset_px, self.binning, self.decimation);
        write!(f, "offset {x}, {y}, binning {bx}x{by}, decimation {dx}x{dy}")?;
        if self.reversed != [false; 2] {
            f.write_str(", mirrored")?;
        }
        self.sensor_px.map_or(Ok(()), |[w, h]| write!(f, ", of {w}x{h}"))
    }
}

impl Readout {
    /// Distance on the sensor from one pixel of the picture to the next, sensor px.
    pub fn step(&self) -> [u32; 2] {
        [0, 1].map(|i| self.binning[i].saturating_mul(self.decimation[i]))
    }

    /// Extent of the sensor that pictures of this size cover, counted from its first pixel, px.
    pub fn reach(&self, size: [u32; 2]) -> [u64; 2] {
        let step = self.step();
        [0, 1].map(|i| (u64::from(self.offset_px[i]) + u64::from(size[i])) * u64::from(step[i]))
    }

    /// Converts the camera model of the fully read sensor into that of pictures of this size.
    pub fn of_whole(&self, whole: &Intrinsics, [width, height]: [u32; 2]) -> Intrinsics {
        let [x, y] = self.axes();
        Intrinsics {
            fx: whole.fx / x.step,
            fy: whole.fy / y.step,
            cx: x.picture(whole.cx),
            cy: y.picture(whole.cy),
            skew: whole.skew / x.step,
            width,
            height,
            ..*whole
        }
    }

    /// Converts the camera model of pictures with this readout into that of the fully read sensor. Its size is the
    /// sensor's, or if that is unknown the part that the pictures reach.
    pub fn to_whole(&self, camera: &Intrinsics) -> Intrinsics {
        let [x, y] = self.axes();
        let reach = self.reach([camera.width, camera.height]).map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        let [width, height] = self.sensor_px.unwrap_or(reach);
        Intrinsics {
            fx: camera.fx * x.step,
            fy: camera.fy * y.step,
            cx: x.sensor(camera.cx),
            cy: y.sensor(camera.cy),
            skew: camera.skew * x.step,
            width,
            height,
            ..*camera
        }
    }

    fn axes(&self) -> [Axis; 2] {
        [0, 1].map(|i| {
            let [binning, decimation] = [self.binning[i], self.decimation[i]].map(f64::from);
            // A binned pixel's centre is the middle of its sensor pixels, whose centres are at integers.
            Axis { step: binning * decimation, first: 0.5 * (binning - 1.0), offset: f64::from(self.offset_px[i]) }
        })
    }
}

/// One direction of the picture: pixel k, counted without the offset, lies on the sensor at `first + k * step`.
struct Axis {
    step: f64,
    first: f64,
    offset: f64,
}

impl Axis {
    fn picture(&self, sensor: f64) -> f64 {
        (sensor - self.first) / self.step - self.offset
    }

    fn sensor(&self, picture: f64) -> f64 {
        (picture + self.offset) * self.step + self.first
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    fn camera() -> Intrinsics {
        let distortion = crate::camera::Distortion::from_opencv(&[-0.1, 0.05, 1e-3, -2e-3, 0.01]).unwrap();
        Intrinsics { fx: 900.0, fy: 905.0, cx: 330.2, cy: 236.7, skew: 0.4, distortion, width: 640, height: 480 }
    }

    #[test]
    fn a_point_is_seen_where_its_pixels_of_the_sensor_went() {
        let whole = camera();
        let points = [Vec3::new(12.0, -30.0, 300.0), Vec3::new(-60.0, 41.0, 420.0)];
        for (readout, size, place) in [
            // Two columns are combined, and three rows; then a region is cut out.
            (
                Readout { binning: [2, 3], offset_px: [10, 7], ..Readout::default() },
                [200, 100],
                (|u, v| ((u - 0.5) / 2.0 - 10.0, (v - 1.0) / 3.0 - 7.0)) as fn(f64, f64) -> (f64, f64),
            ),
            // Every second column is read, starting with the first.
            (Readout { decimation: [2, 1], ..Readout::default() }, [320, 480], |u, v| (u / 2.0, v)),
            (Readout { offset_px: [160, 120], ..Readout::default() }, [320, 240], |u, v| (u - 160.0, v - 120.0)),
            // Binned by 2, then every third column of the result.
            (Readout { binning: [2, 2], decimation: [3, 1], ..Readout::default() }, [106, 240], |u, v| {
                ((u - 0.5) / 6.0, (v - 0.5) / 2.0)
            }),
        ] {
            let part = readout.of_whole(&whole, size);
            assert_eq!([part.width, part.height], size);
            for p in &points {
                let (full, seen) = (whole.pixel_from_point(p).unwrap(), part.pixel_from_point(p).unwrap());
                let (u, v) = place(full.x, full.y);
                assert!((seen.x - u).abs() < 1e-9 && (seen.y - v).abs() < 1e-9, "{readout}: {seen:?}, {u} {v}");
                let back = readout.to_whole(&part).pixel_from_point(p).unwrap();
                assert!((back - full).norm() < 1e-9, "{readout}: {back:?} {full:?}");
            }
        }
        // Scaling a picture as a whole is the same as binning it.
        let binned = Readout { binning: [2, 2], ..Readout::default() }.of_whole(&whole, [320, 240]);
        let scaled = whole.scaled_to(320, 240);
        assert!((binned.cx - scaled.cx).abs() < 1e-12 && (binned.fy - scaled.fy).abs() < 1e-12);
    }

    #[test]
    fn what_a_file_leaves_out_is_all_of_the_sensor() {
        let read: Readout = serde_json::from_str(r#"{ "offset_px": [1024, 768] }"#).unwrap();
        assert_eq!(read, Readout { offset_px: [1024, 768], ..Readout::default() });
        assert!(serde_json::from_str::<Readout>(r#"{ "offset": [1, 1] }"#).is_err());
    }
}
