//! In: a station, a scene and the camera's pose in it. Out: the light that the sheet or the pointer sends into each
//! pixel. Beams are followed to the surface, from mirrors on to one more surface, and to the camera.
//! Frame and unit: scene frame, mm; grey as share of full scale, before noise.

use super::scene::{Hit, Scene};
use super::station::Station;
use crate::geometry::{Camera, Frame, Rigid, Vec3};

/// The frame of a scene file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InScene;
impl Frame for InScene {
    const NAME: &'static str = "scene";
}

/// A grey picture under construction.
#[derive(Clone, Debug)]
pub struct Canvas {
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Share of full scale, row by row from the top left; may exceed 1.
    pub pixels: Vec<f32>,
}

impl Canvas {
    /// All dark.
    pub fn new(width: u32, height: u32) -> Canvas {
        Canvas { width, height, pixels: vec![0.0; width as usize * height as usize] }
    }

    /// Adds `energy`, spread by a Gaussian of `sigma` px about (u, v). The pixel's own area is part of
    /// `sigma`: a box of one pixel adds 1/12 px².
    fn splat(&mut self, u: f64, v: f64, energy: f64, sigma: f64) {
        let reach = (3.5 * sigma).ceil() as i64;
        let (u0, v0) = (u.round() as i64, v.round() as i64);
        if u0 + reach < 0 || v0 + reach < 0 || u0 - reach >= self.width.into() || v0 - reach >= self.height.into() {
            return;
        }
        const MOST: usize = 256;
        let n = ((2 * reach + 1) as usize).min(MOST);
        let (mut wu, mut wv) = ([0f32; MOST], [0f32; MOST]);
        let k = -0.5 / (sigma * sigma);
        for i in 0..n {
            let d = i as f64 - reach as f64;
            wu[i] = (k * (d + u0 as f64 - u).powi(2)).exp() as f32;
            wv[i] = (k * (d + v0 as f64 - v).powi(2)).exp() as f32;
        }
        let total: f32 = wu[..n].iter().sum::<f32>() * wv[..n].iter().sum::<f32>();
        let scale = energy as f32 / total;
        for (j, wv) in wv[..n].iter().enumerate() {
            let y = v0 - reach + j as i64;
            if y < 0 || y >= self.height.into() {
                continue;
            }
            let row = y * i64::from(self.width);
            for (i, wu) in wu[..n].iter().enumerate() {
                let x = u0 - reach + i as i64;
                if x >= 0 && x < self.width.into() {
                    self.pixels[(row + x) as usize] += scale * wu * wv;
                }
            }
        }
    }
}

/// One surface point on the middle of the sheet that is visible to the camera.
#[derive(Clone, Copy, Debug)]
pub struct LitPoint {
    /// Position in the scene frame, mm.
    pub point: Vec3,
    /// Its column, px.
    pub u: f64,
    /// Its row, px.
    pub v: f64,
}

/// One moment of the simulation: a station with its camera's pose in a scene.
pub struct View<'a> {
    /// Camera, lasers and sensor.
    pub station: &'a Station,
    /// The scene that is lit.
    pub scene: &'a Scene,
    /// Pose of the camera in the scene, mm.
    pub scene_from_camera: Rigid<InScene, Camera>,
}

impl View<'_> {
    /// Beyond this distance nothing is lit or seen, mm.
    pub(super) fn far(&self) -> f64 {
        13.0 * self.station.working_distance
    }

    fn sigma_px(&self) -> f64 {
        (self.station.blur_px().powi(2) + 1.0 / 12.0).sqrt()
    }

    /// Adds the sheet's light to every pixel; returns the visible points of its middle.
    pub fn sheet(&self, canvas: &mut Canvas) -> Vec<LitPoint> {
        let (s, laser) = (self.station, &self.station.laser);
        let source = self.scene_from_camera.point(&laser.source);
        let [axis, normal] = [laser.axis, laser.normal].map(|d| self.scene_from_camera.direction(&d));
        let side = normal.cross(&axis);
        let reach = laser.half_fan_deg.to_radians().tan();
        let pixel = s.working_distance / s.camera.fx;
        let source_distance = (laser.source - Vec3::new(0.0, 0.0, s.working_distance)).norm();
        // A third of a pixel between beams, along and across (below): the blur hides the raster.
        let along = (2.0 * reach * source_distance / pixel * 3.0).ceil() as usize;
        let gain = self.sheet_gain();
        let mut middle = Vec::new();
        for i in 0..along {
            let slope = reach * (2.0 * (i as f64 + 0.5) / along as f64 - 1.0);
            let direction = (axis + side * slope).normalize();
            // Equal steps of tan φ; the power per angle falls off towards the edges of the fan.
            let dphi = 2.0 * reach / along as f64 / (1.0 + slope * slope);
            let power = gain * dphi * (1.0 - 0.35 * (slope / reach).powi(2));
            let Some(centre) = self.scene.hit(&source, &direction, self.far()) else { continue };
            let radius = laser.radius(centre.t);
            let across = (4.0 * radius / pixel * 3.0).ceil() as usize | 1;
            let mut total = 0.0;
            let weight = |k: usize| {
                let x = 2.0 * (2.0 * (k as f64 + 0.5) / across as f64 - 1.0);
                (x, (-2.0 * x * x).exp())
            };
            (0..across).for_each(|k| total += weight(k).1);
            for k in 0..across {
                let (x, w) = weight(k);
                let start = source + normal * (x * radius);
                let hit = if x == 0.0 { Some(centre) } else { self.scene.hit(&start, &direction, self.far()) };
                let Some(hit) = hit else { continue };
                let seen = self.deposit(canvas, &hit, &direction, power * w / total);
                if let (true, Some((u, v))) = (x.abs() < 1e-12, seen) {
                    middle.push(LitPoint { point: hit.point, u, v });
                }
            }
        }
        middle
    }

    /// Adds the pointer's light; returns the middle of the spot if the camera sees it.
    pub fn spot(&self, canvas: &mut Canvas) -> Option<LitPoint> {
        let (s, pointer) = (self.station, &self.station.pointer);
        let source = self.scene_from_camera.point(&pointer.source);
        let axis = self.scene_from_camera.direction(&pointer.axis);
        let centre = self.scene.hit(&source, &axis, self.far())?;
        let radius = pointer.radius(centre.t);
        let side = axis.cross(&Vec3::new(0.3, 0.5, 0.8)).normalize();
        let up = axis.cross(&side);
        let pixel = centre.t / s.camera.fx;
        let n = (4.0 * radius / pixel * 3.0).ceil() as usize | 1;
        let place = |k: usize| 2.0 * (2.0 * (k as f64 + 0.5) / n as f64 - 1.0);
        let total: f64 = (0..n).map(|k| (-2.0 * place(k).powi(2)).exp()).sum::<f64>().powi(2);
        let gain = self.spot_gain();
        let mut middle = None;
        for i in 0..n {
            for j in 0..n {
                let (x, y) = (place(i), place(j));
                let start = source + (side * x + up * y) * radius;
                let Some(hit) = self.scene.hit(&start, &axis, self.far()) else { continue };
                let weight = (-2.0 * (x * x + y * y)).exp() / total;
                let seen = self.deposit(canvas, &hit, &axis, gain * weight);
                if let (true, Some((u, v))) = (x.abs() < 1e-12 && y.abs() < 1e-12, seen) {
                    middle = Some(LitPoint { point: hit.point, u, v });
                }
            }
        }
        middle
    }

    /// Deposits a beam's power on a surface, and the mirrored share of it on the next surface.
    fn deposit(&self, canvas: &mut Canvas, hit: &Hit, direction: &Vec3, power: f64) -> Option<(f64, f64)> {
        let pixel = self.glow(canvas, hit, direction, power);
        let mirror = hit.material.mirror;
        if mirror > 0.0 {
            let onward = direction - hit.normal * (2.0 * direction.dot(&hit.normal));
            let start = hit.point + hit.normal * 1e-4;
            if let Some(second) = self.scene.hit(&start, &onward, self.far()) {
                self.glow(canvas, &second, &onward, power * mirror);
            }
        }
        pixel
    }

    /// Light of a lit point that the lens collects: albedo (and gloss) times the cosine at the surface, times the
    /// lens's solid angle.
    fn glow(&self, canvas: &mut Canvas, hit: &Hit, direction: &Vec3, power: f64) -> Option<(f64, f64)> {
        let eye = self.scene_from_camera.translation;
        let way = eye - hit.point;
        let distance = way.norm();
        let to_eye = way / distance;
        let cosine = hit.normal.dot(&to_eye);
        if cosine <= 0.0 {
            return None;
        }
        let in_camera = self.scene_from_camera.inverse().point(&hit.point);
        let px = self.station.camera.pixel_from_point(&in_camera)?;
        let (w, h) = (f64::from(self.station.camera.width), f64::from(self.station.camera.height));
        let reach = 4.0 * self.sigma_px() + 1.0;
        if !(px.x > -reach && px.y > -reach && px.x < w + reach && px.y < h + reach) {
            return None;
        }
        if !self.scene.clear(&(hit.point + hit.normal * 1e-4), &eye) {
            return None;
        }
        let m = hit.material;
        let mirrored = direction - hit.normal * (2.0 * direction.dot(&hit.normal));
        let gloss = m.gloss * mirrored.dot(&to_eye).max(0.0).powf(m.gloss_exponent);
        let off_axis = in_camera.z / distance;
        let energy = power * (m.albedo + gloss) * cosine * off_axis / (distance * distance);
        canvas.splat(px.x, px.y, energy, self.sigma_px());
        Some((px.x, px.y))
    }

    /// Scales power so that the stripe on a white plate across the axis at the working distance
    /// peaks at `laser_white` of full scale: energy per column = peak · √(2π) · σ.
    fn sheet_gain(&self) -> f64 {
        let (s, laser) = (self.station, &self.station.laser);
        let z = s.working_distance;
        let range = (Vec3::new(0.0, 0.0, z) - laser.source).norm();
        // The sheet's plane cuts the plate at an angle: its width grows by 1 / |n · plate's in-plane normal|.
        let width = laser.radius(range) / 2.0 / laser.normal.xy().norm().max(0.05) * s.camera.fy / z;
        let sigma = width.hypot(self.sigma_px());
        let angle_per_column = z / s.camera.fx / range;
        s.sensor.laser_white * (2.0 * std::f64::consts::PI).sqrt() * sigma * z * z / angle_per_column
    }

    /// The same scale for the pointer's spot: energy = peak · 2π · σ².
    fn spot_gain(&self) -> f64 {
        let s = self.station;
        let z = s.working_distance;
        let width = s.pointer.radius(z) / 2.0 * s.camera.fy / z;
        let sigma = width.hypot(self.sigma_px());
        s.sensor.laser_white * 2.0 * std::f64::consts::PI * sigma * sigma * z * z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{SceneSpec, Sensor, above};

    fn plate(tilt: f64) -> Scene {
        let text = format!(
            "name = 'plate'\nregion_mm = [-90, -60, 90, 60]\n[[part]]\nname = 'p'\nat_mm = [0, 0, 0]\ntilt_deg = \
             [{tilt}, 4]\n\
             [[part.solid]]\nshape = {{ block = {{ size_mm = [400, 400, 5] }} }}\nat_mm = [0, 0, 0]\nmaterial = {{ \
             albedo = 1 }}"
        );
        Scene::new(SceneSpec::parse(&text).unwrap()).unwrap()
    }

    /// The light's centroid in a column is where the plane of the sheet meets the plate, as the lens images it. The
    /// test computes it from the camera's own equations, without following beams.
    #[test]
    fn the_stripe_lies_where_the_sheet_meets_the_plate() {
        for (seed, tilt) in [(0, 0.0), (3, 8.0), (11, -10.0)] {
            let station = Station::random(seed);
            let scene = plate(tilt);
            let scene_from_camera = above(3.0, -2.0, station.working_distance);
            let view = View { station: &station, scene: &scene, scene_from_camera };
            let mut canvas = Canvas::new(640, 480);
            view.sheet(&mut canvas);
            let mut worst = 0f64;
            for u in (40..600).step_by(7) {
                let (mut sum, mut moment) = (0.0, 0.0);
                for v in 0..480 {
                    let g = f64::from(canvas.pixels[v * 640 + u]);
                    (sum, moment) = (sum + g, moment + g * v as f64);
                }
                assert!(sum > 0.1, "column {u} is dark");
                let v = moment / sum;
                let ray = station.camera.ray_from_pixel(&crate::geometry::Vec2::new(u as f64, v)).unwrap();
                let p = ray.meet(&station.laser.plane()).unwrap();
                worst = worst.max(scene.distance(&scene_from_camera.point(&p)));
            }
            // 2 µm at 155 mm is 0.008 px: the remainder is the beam's change of width over its own depth.
            assert!(worst < 0.002, "seed {seed}: {worst} mm");
        }
    }

    #[test]
    fn the_stripe_on_white_peaks_at_the_stated_grey() {
        for width in [640, 1920] {
            let mut station = Station::design().with_size(width, width * 3 / 4);
            station.sensor = Sensor { laser_white: 0.8, ..Sensor::default() };
            let scene = plate(0.0);
            let view =
                View { station: &station, scene: &scene, scene_from_camera: above(0.0, 0.0, station.working_distance) };
            let mut canvas = Canvas::new(width, width * 3 / 4);
            view.sheet(&mut canvas);
            let column: Vec<f64> =
                (0..canvas.height).map(|v| f64::from(canvas.pixels[(v * width + width / 2) as usize])).collect();
            let top = (1..column.len() - 1).max_by(|&a, &b| column[a].total_cmp(&column[b])).unwrap();
            // The peak lies between pixels: the parabola through three logarithms is exact for a Gaussian.
            let [a, b, c] = [column[top - 1].ln(), column[top].ln(), column[top + 1].ln()];
            let peak = (b - (a - c).powi(2) / (8.0 * (a - 2.0 * b + c))).exp();
            assert!((peak - 0.8).abs() < 0.02, "{width}: {peak}");
        }
    }

    #[test]
    fn walls_throw_shadows_for_laser_and_camera() {
        let text = "name = 'wall'\nregion_mm = [-9, -9, 9, 9]\n[[solid]]\nshape = { block = { size_mm = [300, 300, \
                    5] } }\nat_mm = [0, 0, 0]\n\
                    [[solid]]\nshape = { block = { size_mm = [20, 4, 12] } }\nat_mm = [0, -6, 12]";
        let station = Station::design();
        let scene = Scene::new(SceneSpec::parse(text).unwrap()).unwrap();
        let view =
            View { station: &station, scene: &scene, scene_from_camera: above(0.0, 0.0, station.working_distance) };
        let lit = view.sheet(&mut Canvas::new(640, 480));
        // The laser is on the -y side of the scene: the wall keeps its light from the floor behind it.
        let floor =
            |x0: f64, x1: f64| lit.iter().filter(|p| p.point.z < 0.1 && p.point.x > x0 && p.point.x < x1).count();
        assert!(floor(15.0, 30.0) > 50 && floor(-9.0, 9.0) == 0, "{} {}", floor(15.0, 30.0), floor(-9.0, 9.0));
    }
}
