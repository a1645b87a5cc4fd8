//! The camera model for pictures of another size, or of another part of the sensor, than the calibrated one.

use super::Calibration;
use crate::camera::{Intrinsics, Readout};
use crate::fault::{Fault, Result};

impl Calibration<Intrinsics> {
    /// The camera model for pictures of this size (columns, rows) and of the stated part of the sensor. It is the
    /// calibrated one if size and part are those of the calibration.
    ///
    /// # Errors
    /// Another size than the calibrated one without a statement of what the pictures show; pictures that this camera
    /// cannot send.
    pub fn for_pictures(&self, size: [u32; 2], readout: Option<&Readout>) -> Result<Intrinsics> {
        let (camera, same_size) = (&self.value, size == self.size());
        if let Some(stated) = readout.filter(|r| r.same_view) {
            return self.rescaled(size, stated);
        }
        let known = match (self.readout.as_ref(), readout) {
            (Some(known), Some(stated)) if !same_size || !same(known, stated) => *known,
            // Made before calibrations recorded their readout: they used the whole sensor, or pictures like these.
            (None, Some(_)) if !same_size => Readout { sensor_px: Some(self.size()), ..Readout::default() },
            (_, None) if !same_size => return Err(self.another(size).next(UNSTATED)),
            _ => return Ok(*camera),
        };
        let stated = readout.expect("all others are answered above");
        if stated.reversed != known.reversed {
            return Err(self
                .another(size)
                .cause("the pictures are mirrored, or those of the calibration were")
                .next("set ReverseX and ReverseY of the camera as at its calibration, or calibrate it again"));
        }
        let whole = known.to_whole(camera);
        let (sensor, reach) = (known.sensor_px.or(stated.sensor_px), stated.reach(size));
        let [step, own] = [stated.step(), known.step()].map(|[x, y]| x.max(y));
        // Columns or rows that do not fill a binned pixel are not read.
        let another =
            stated.sensor_px.zip(sensor).is_some_and(|(a, b)| (0..2).any(|i| a[i].abs_diff(b[i]) >= step.max(own)));
        if another || sensor.is_some_and(|[w, h]| reach[0] > u64::from(w) || reach[1] > u64::from(h)) {
            return Err(self
                .another(size)
                .cause(format!("the pictures are of another sensor, or their part of it is wrong: {stated}"))
                .next("use the station of this camera, or calibrate it with pictures of the same kind"));
        }
        Ok(stated.of_whole(&whole, size))
    }

    /// The camera model for pictures that show the calibrated view at another resolution.
    fn rescaled(&self, [w, h]: [u32; 2], stated: &Readout) -> Result<Intrinsics> {
        if *stated != (Readout { same_view: true, ..Readout::default() }) {
            return Err(Fault::input(format!("the readout contradicts itself: {stated}"))
                .cause("a region, binning or mirroring changes the view")
                .next("state 'same_view' alone, or the other keys of 'readout' without it"));
        }
        let [width, height] = self.size();
        // One side is rounded to whole pixels.
        let expected = f64::from(w) * f64::from(height) / f64::from(width);
        if (expected - f64::from(h)).abs() > 1.0 {
            return Err(self
                .another([w, h])
                .cause(format!("the same view would be {expected:.0} px high, these pictures are {h}"))
                .next("say what the pictures show: --region X,Y or --binned N"));
        }
        Ok(self.value.scaled_to(w, h))
    }

    /// Refuses pictures that differ from those of the calibration, for work that needs the calibrated camera
    /// unchanged.
    ///
    /// # Errors
    /// Another size, another part of the sensor.
    pub fn same_pictures(&self, size: [u32; 2], readout: Option<&Readout>) -> Result<()> {
        if size == self.size() && self.for_pictures(size, readout)? == self.value {
            return Ok(());
        }
        Err(self.another(size))
    }

    fn size(&self) -> [u32; 2] {
        [self.value.width, self.value.height]
    }

    fn another(&self, [w, h]: [u32; 2]) -> Fault {
        let ([width, height], readout) = (self.size(), self.readout.map_or(String::new(), |r| format!(" ({r})")));
        Fault::input(format!("pictures are {w}x{h}, the camera was calibrated at {width}x{height}{readout}"))
            .cause("another camera, or another region, binning or decimation set in it")
            .next("set the camera as at its calibration, or calibrate it with pictures of the same kind")
    }
}

const UNSTATED: &str = "say what the pictures show: --region X,Y, --binned N or --same-view, or 'readout' in meta.json \
     (docs/file-formats.md); or record with the settings that the camera was calibrated with";

/// Whether two statements describe the same setting.
fn same(a: &Readout, b: &Readout) -> bool {
    Readout { sensor_px: None, ..*a } == Readout { sensor_px: None, ..*b }
        && a.sensor_px.zip(b.sensor_px).is_none_or(|(a, b)| a == b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::{Covariance, Kind, Quality, Verdict};

    fn calibrated(readout: Option<Readout>) -> Calibration<Intrinsics> {
        let camera = Intrinsics {
            fx: 600.0,
            fy: 600.0,
            cx: 320.0,
            cy: 240.0,
            skew: 0.0,
            distortion: Default::default(),
            width: 640,
            height: 480,
        };
        let quality = Quality {
            verdict: Verdict::Good,
            reasons: vec![],
            advice: vec![],
            figures: Default::default(),
            per_picture: vec![],
        };
        Calibration { readout, ..Calibration::new(Kind::Camera, camera, None, Covariance::default(), quality) }
    }

    fn region(x: u32, y: u32) -> Readout {
        Readout { offset_px: [x, y], ..Readout::default() }
    }

    #[test]
    fn a_size_that_nobody_explains_is_refused() {
        for camera in [calibrated(None), calibrated(Some(Readout::default()))] {
            assert_eq!(camera.for_pictures([640, 480], None).unwrap(), camera.value);
            // Sizes with the aspect of the calibrated size and with another one.
            for size in [[320, 240], [640, 240], [1280, 960]] {
                let said = camera.for_pictures(size, None).unwrap_err();
                assert!(said.what.contains("640x480") && said.next.contains("--region"), "{said}");
                assert!(camera.same_pictures(size, None).is_err());
            }
            let cut = camera.for_pictures([320, 240], Some(&region(100, 50))).unwrap();
            assert_eq!((cut.fx, cut.cx, cut.cy, cut.width), (600.0, 220.0, 190.0, 320));
            let wide = camera.for_pictures([640, 100], Some(&region(0, 200))).unwrap();
            assert_eq!((wide.cx, wide.cy, wide.height), (320.0, 40.0, 100));
            let binned = Readout { binning: [2, 2], ..Readout::default() };
            let half = camera.for_pictures([320, 240], Some(&binned)).unwrap();
            assert_eq!((half.fx, half.cx), (300.0, 159.75));
            assert!(camera.same_pictures([320, 240], Some(&binned)).is_err());
        }
    }

    #[test]
    fn the_same_view_at_another_resolution_is_scaled_about_its_corner() {
        let (camera, word) = (calibrated(None), Readout { same_view: true, ..Readout::default() });
        let fine = camera.for_pictures([4096, 3072], Some(&word)).unwrap();
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(close(fine.fx, 6.4 * 600.0) && close(fine.cx, 6.4 * 320.5 - 0.5) && fine.width == 4096);
        assert_eq!(camera.for_pictures([640, 480], Some(&word)).unwrap(), camera.value);
        assert!(camera.for_pictures([4096, 3000], Some(&word)).unwrap_err().cause.contains("3072"));
        let both = Readout { same_view: true, ..region(5, 5) };
        assert!(camera.for_pictures([320, 240], Some(&both)).unwrap_err().what.contains("contradicts itself"));
    }

    #[test]
    fn pictures_that_this_camera_cannot_send_are_refused() {
        let camera = calibrated(None);
        let refused = |size, readout: Readout| camera.for_pictures(size, Some(&readout)).unwrap_err();
        assert!(refused([320, 240], region(400, 0)).cause.contains("another sensor"));
        assert!(refused([1280, 960], Readout::default()).cause.contains("another sensor"));
        assert!(
            refused([320, 240], Readout { sensor_px: Some([4096, 3072]), ..region(9, 9) }).cause.contains("4096x3072")
        );
        assert!(refused([320, 240], Readout { reversed: [true, false], ..region(9, 9) }).cause.contains("mirrored"));
        // 641 columns are 320 binned ones.
        let odd = Readout { binning: [2, 2], sensor_px: Some([641, 480]), ..Readout::default() };
        assert!(camera.for_pictures([320, 240], Some(&odd)).is_ok());
    }

    #[test]
    fn a_calibration_that_says_what_it_was_made_with_is_followed() {
        // Made with the middle of a sensor of 1280x960.
        let camera = calibrated(Some(Readout { sensor_px: Some([1280, 960]), ..region(320, 240) }));
        let moved = Readout { sensor_px: Some([1280, 960]), ..region(330, 200) };
        let same_size = camera.for_pictures([640, 480], Some(&moved)).unwrap();
        assert_eq!((same_size.cx, same_size.cy), (310.0, 280.0));
        assert!(camera.same_pictures([640, 480], Some(&moved)).is_err());
        assert_eq!(camera.for_pictures([640, 480], camera.readout.as_ref()).unwrap(), camera.value);
        assert_eq!(camera.for_pictures([640, 480], Some(&region(320, 240))).unwrap(), camera.value);
        let whole = Readout { sensor_px: Some([1280, 960]), ..Readout::default() };
        assert_eq!(camera.for_pictures([1280, 960], Some(&whole)).unwrap().cx, 640.0);
        // A calibration that does not state its readout is assumed to be of pictures like these.
        assert_eq!(calibrated(None).for_pictures([640, 480], Some(&moved)).unwrap().cx, 320.0);
    }
}
