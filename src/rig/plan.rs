//! The resolution of a planned rig, from the data sheets of camera, lens and laser (docs/hardware.md). Lengths in
//! mm.

use crate::fault::{Fault, Result};

/// A camera that looks squarely at the parts, and a laser sheet that crosses the camera's axis at the working
/// distance.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct RigPlan {
    /// Size of the picture, px; the first number is along the stripe.
    pub pixels: [u32; 2],
    /// Edge of a pixel, µm.
    pub pixel_um: f64,
    /// Focal length, mm.
    pub focal_mm: f64,
    /// Distance from the projection centre to the parts, mm.
    pub distance_mm: f64,
    /// Angle between the camera's axis and the laser sheet, degrees.
    pub angle_deg: f64,
    /// f-number of the lens.
    pub f_number: f64,
}

/// The predicted resolution of a [`RigPlan`].
#[derive(Clone, Debug, serde::Serialize)]
pub struct RigForecast {
    /// Width on the parts that a pixel covers, mm.
    pub pixel_mm: f64,
    /// Field of view at the working distance, mm.
    pub view_mm: [f64; 2],
    /// Change of depth that moves the stripe by a pixel, for a surface square to the camera, mm.
    pub depth_per_pixel_mm: f64,
    /// Scatter of a point on a clean stripe, mm, for stripe centres found to 0.02 px and to 0.05 px.
    pub scatter_mm: [f64; 2],
    /// Nearest and farthest distance at which the stripe is in the picture, mm; `None`: no farthest distance.
    pub stripe_mm: (f64, Option<f64>),
    /// Nearest and farthest distance at which a point is blurred by less than a pixel, mm; `None`: no farthest
    /// distance.
    pub sharp_mm: (f64, Option<f64>),
    /// Length of the shadow behind a step of 1 mm, mm.
    pub shadow_mm: f64,
}

/// Stripe centres are found to this many pixels, 1 sigma, at best and at worst, on a clean stripe.
const CENTRE_PX: [f64; 2] = [0.02, 0.05];
/// Accepted angles between camera and laser sheet, degrees.
const ANGLE_DEG: [f64; 2] = [3.0, 80.0];

impl RigForecast {
    /// Nearest and farthest distance at which the stripe is in the picture and sharp, mm.
    pub fn works_mm(&self) -> (f64, Option<f64>) {
        let far = [self.stripe_mm.1, self.sharp_mm.1].into_iter().flatten().reduce(f64::min);
        (self.stripe_mm.0.max(self.sharp_mm.0), far)
    }
}

impl RigPlan {
    /// The focal length, mm, with which `pixels` of this edge see a view of `view_mm` at `distance_mm`.
    pub fn focal_for(view_mm: f64, pixels: u32, pixel_um: f64, distance_mm: f64) -> f64 {
        distance_mm * f64::from(pixels) * pixel_um / 1000.0 / view_mm
    }

    /// The plan with the smallest angle at which a point on a clean stripe scatters by `scatter_mm` at most, mm, 1
    /// sigma.
    ///
    /// # Errors
    /// A scatter that no angle up to 80 degrees gives; values that [`RigPlan::forecast`] refuses.
    pub fn with_scatter(self, scatter_mm: f64) -> Result<RigPlan> {
        if !(scatter_mm > 0.0 && scatter_mm.is_finite()) {
            return Err(Fault::usage(format!("scatter_mm is {scatter_mm}; a length above 0 mm is needed"))
                .next("state how far a point may scatter, 1 sigma"));
        }
        let pixel_mm = RigPlan { angle_deg: 45.0, ..self }.forecast()?.pixel_mm;
        let angle_deg = (CENTRE_PX[1] * pixel_mm / scatter_mm).atan().to_degrees();
        if angle_deg > ANGLE_DEG[1] {
            return Err(Fault::refused(format!(
                "a scatter of {scatter_mm} mm needs an angle of {angle_deg:.1} degrees; {} is the limit",
                ANGLE_DEG[1]
            ))
            .cause(format!("a pixel sees {pixel_mm:.4} mm, which is too coarse"))
            .next("take a camera with more pixels, a longer focal length or a shorter distance"));
        }
        Ok(RigPlan { angle_deg: angle_deg.max(ANGLE_DEG[0]), ..self })
    }

    /// # Errors
    /// A value that no camera, lens or laser has.
    pub fn forecast(&self) -> Result<RigForecast> {
        let limits = [
            ("pixel_um", self.pixel_um, 0.5, 50.0),
            ("focal_mm", self.focal_mm, 0.5, 2000.0),
            ("distance_mm", self.distance_mm, 1.0, 20_000.0),
            ("angle_deg", self.angle_deg, ANGLE_DEG[0], ANGLE_DEG[1]),
            ("f_number", self.f_number, 0.5, 64.0),
        ];
        for (name, value, least, most) in limits {
            if !(least..=most).contains(&value) {
                return Err(Fault::usage(format!("{name} is {value}; allowed: {least} to {most}"))
                    .cause("another unit, or a slipped decimal point")
                    .next("take the value from the data sheet"));
            }
        }
        if self.distance_mm <= self.focal_mm {
            return Err(Fault::usage(format!("distance_mm is {} and focal_mm {}", self.distance_mm, self.focal_mm))
                .cause("a lens forms no picture of what is closer than its focal length")
                .next("take the distance from the lens to the parts"));
        }
        let edge = self.pixel_um / 1000.0;
        let (z, f) = (self.distance_mm, self.focal_mm);
        let pixel_mm = z * edge / f;
        let tan = self.angle_deg.to_radians().tan();
        let depth_per_pixel_mm = pixel_mm / tan;
        // The stripe leaves the picture at half its height: |z - Z| tan t = z h a / 2f.
        let half = 0.5 * f64::from(self.pixels[1]) * edge / f;
        let far = |d: f64, near: f64| (d > 0.0).then(|| near / d);
        let stripe_mm = (z * tan / (tan + half), far(tan - half, z * tan));
        // A circle of confusion of one pixel: Z f² / (f² ± N a (Z - f)).
        let blur = self.f_number * edge * (z - f);
        let sharp_mm = (z * f * f / (f * f + blur), far(f * f - blur, z * f * f));
        Ok(RigForecast {
            pixel_mm,
            view_mm: self.pixels.map(|n| f64::from(n) * pixel_mm),
            depth_per_pixel_mm,
            scatter_mm: CENTRE_PX.map(|px| px * depth_per_pixel_mm),
            stripe_mm,
            sharp_mm,
            shadow_mm: tan,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GUIDE: RigPlan = RigPlan {
        pixels: [640, 480],
        pixel_um: 8.3,
        focal_mm: 5.08,
        distance_mm: 155.0,
        angle_deg: 28.0,
        f_number: 8.0,
    };

    /// Row of a point of the sheet at depth z, px from the picture's middle, computed directly from the ray and the
    /// plane.
    fn row(plan: &RigPlan, z: f64) -> f64 {
        let aside = (plan.distance_mm - z) * plan.angle_deg.to_radians().tan();
        aside / z * plan.focal_mm / (plan.pixel_um / 1000.0)
    }

    #[test]
    fn the_forecast_is_what_ray_and_plane_give() {
        let found = GUIDE.forecast().unwrap();
        assert!((found.pixel_mm - 0.253).abs() < 5e-4 && (found.view_mm[0] - 162.1).abs() < 0.1, "{found:?}");
        // A small step of the surface moves the stripe by the predicted amount.
        let step = 1e-3;
        let moved = row(&GUIDE, GUIDE.distance_mm - step) - row(&GUIDE, GUIDE.distance_mm);
        assert!((step / moved - found.depth_per_pixel_mm).abs() < 1e-4, "{found:?}");
        // At the ends of the range the stripe is at the picture's border.
        let (near, far) = (found.stripe_mm.0, found.stripe_mm.1.unwrap());
        assert!((row(&GUIDE, near) - 240.0).abs() < 1e-6 && (row(&GUIDE, far) + 240.0).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_point_at_the_end_of_the_sharp_range_is_blurred_by_a_pixel() {
        let plan = RigPlan { focal_mm: 50.0, distance_mm: 400.0, f_number: 4.0, ..GUIDE };
        let found = plan.forecast().unwrap();
        for z in [found.sharp_mm.0, found.sharp_mm.1.unwrap()] {
            // Thin lens: the image of depth z lies at v, the sensor at v0; the aperture f / N defines the cone of
            // light.
            let image = |z: f64| 1.0 / (1.0 / plan.focal_mm - 1.0 / z);
            let (v, v0) = (image(z), image(plan.distance_mm));
            let blur = plan.focal_mm / plan.f_number * (v - v0).abs() / v;
            assert!((blur - 0.0083).abs() < 1e-6, "{z}: {blur}");
        }
    }

    #[test]
    fn a_wanted_view_and_scatter_give_the_lens_and_the_angle() {
        let focal_mm = RigPlan::focal_for(162.1, 640, 8.3, 155.0);
        assert!((focal_mm - 5.08).abs() < 1e-3, "{focal_mm}");
        let plan = RigPlan { angle_deg: 10.0, ..GUIDE }.with_scatter(0.0238).unwrap();
        assert!((plan.angle_deg - 28.0).abs() < 0.1, "{plan:?}");
        assert!((plan.forecast().unwrap().scatter_mm[1] - 0.0238).abs() < 1e-9);
        let works = GUIDE.forecast().unwrap().works_mm();
        assert!((works.0 - 111.9).abs() < 0.1 && (works.1.unwrap() - 252.3).abs() < 0.1, "{works:?}");
        let fine = GUIDE.with_scatter(0.001).unwrap_err();
        assert!(fine.what.contains("85.5 degrees") && fine.cause.contains("0.2532 mm"), "{fine}");
        assert!(GUIDE.with_scatter(f64::NAN).is_err());
        assert_eq!(GUIDE.with_scatter(10.0).unwrap().angle_deg, 3.0);
    }

    #[test]
    fn a_stripe_or_a_lens_may_reach_however_far() {
        let flat = RigPlan { angle_deg: 10.0, distance_mm: 1000.0, ..GUIDE }.forecast().unwrap();
        assert!(flat.stripe_mm.1.is_none() && flat.sharp_mm.1.is_none(), "{flat:?}");
    }

    #[test]
    fn what_no_data_sheet_has_is_refused_with_the_limit() {
        let refused = |plan: RigPlan| plan.forecast().unwrap_err().to_string();
        assert!(refused(RigPlan { angle_deg: 90.0, ..GUIDE }).contains("angle_deg is 90; allowed: 3 to 80"));
        assert!(refused(RigPlan { pixel_um: f64::NAN, ..GUIDE }).contains("pixel_um is NaN"));
        assert!(refused(RigPlan { focal_mm: 200.0, ..GUIDE }).contains("focal_mm 200"));
    }
}
