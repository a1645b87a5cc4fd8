//! In: the current belief about the unknowns, candidate poses. Out: the information that each candidate would add,
//! and the candidate with the smallest expected error of a scanned point.
//! Frame and unit: see `unknowns`; mm, rad, px (docs/math.md, Joint calibration (9), (10)).

use super::options::{JointOptions, Noise};
use super::shots::{PEAKS_A_STOP, Reported, Shot, Spot};
use super::solve::JointFit;
use super::terms::{Term, Terms, flange, lit};
use super::unknowns::{Layout, State};
use super::volume::{expected, weights};
use crate::calibrate::boards::extent::inside;
use crate::calibrate::hand_eye::options::Mount;
use crate::calibrate::laser_plane::views::StripePeak;
use crate::calibrate::measured_pose::SeenBoard;
use crate::camera::Intrinsics;
use crate::geometry::{Board, Camera, Mat3, Rigid, Vec2, Vec3, exp};
use crate::recording::BoardSpec;
use nalgebra::{DMatrix, Matrix2};
use rand::{Rng, SeedableRng};

/// The current belief about the shared unknowns.
pub struct Belief {
    /// The current state; its stops' boards are not used here.
    pub state: State,
    /// Information matrix of the shared unknowns; zero for those that no stop has measured.
    pub information: DMatrix<f64>,
    /// Noise of each source.
    pub noise: Noise,
    /// Mean JᵀJ of the points in the working volume ([`weights`]).
    pub weights: DMatrix<f64>,
    layout: Layout,
    mount: Mount,
    /// Typical stated sigmas of a corner, of an averaged peak and of a spot, px.
    sigmas_px: [f64; 3],
}

/// Indices of the unknowns with any information.
fn known(m: &DMatrix<f64>) -> Vec<usize> {
    (0..m.nrows()).filter(|&i| m[(i, i)] > 0.0).collect()
}

/// The inverse over the unknowns with information; zero for the others. The diagonal is scaled to one, because the
/// units differ by orders of magnitude.
fn inverse(m: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let at = known(m);
    let scale: Vec<f64> = at.iter().map(|&i| m[(i, i)].sqrt()).collect();
    let n = at.len();
    let inner = DMatrix::from_fn(n, n, |i, j| m[(at[i], at[j])] / (scale[i] * scale[j])).cholesky()?.inverse();
    let mut out = DMatrix::zeros(m.nrows(), m.nrows());
    for i in 0..n {
        for j in 0..n {
            out[(at[i], at[j])] = inner[(i, j)] / (scale[i] * scale[j]);
        }
    }
    Some(out)
}

fn middle(values: impl Iterator<Item = f64>, otherwise: f64) -> f64 {
    let mut v: Vec<f64> = values.collect();
    v.sort_by(f64::total_cmp);
    v.get(v.len() / 2).copied().unwrap_or(otherwise)
}

impl Belief {
    /// The belief after a solve. `places`: pixels of the working volume ([`super::volume::places`]). `None` if the
    /// covariance has no inverse.
    pub fn after(fit: &JointFit, places: &[Vec2], o: &JointOptions) -> Option<Belief> {
        let corners = fit.shots.iter().flat_map(|s| s.seen.sigmas_px.iter().copied());
        let peaks = fit.shots.iter().flat_map(|s| s.stripe.iter().map(|p| p.sigma_px));
        let spots = fit.shots.iter().filter_map(|s| Some((s.spot?.covariance.trace() / 2.0).sqrt()));
        Some(Belief {
            information: inverse(&fit.covariance)?,
            weights: weights(&fit.state, &fit.layout, places),
            sigmas_px: [middle(corners, 0.02), middle(peaks, 0.05), middle(spots, 0.1)],
            noise: fit.noise,
            layout: Layout { shots: 1, ..fit.layout.clone() },
            mount: o.mount,
            state: State { boards: Vec::new(), ..fit.state.clone() },
        })
    }

    /// Expected error of a scanned point, rms, mm.
    pub fn expected_mm(&self) -> f64 {
        inverse(&self.information).map_or(f64::INFINITY, |c| expected(&self.weights, &c))
    }

    /// The same with a stop added that contributes the information `gain`.
    pub fn expected_with(&self, gain: &DMatrix<f64>) -> f64 {
        inverse(&(&self.information + gain)).map_or(f64::INFINITY, |c| expected(&self.weights, &c))
    }

    /// The predicted measurements of a stop: the board's features, and the stripe and the spot if they fall on the
    /// board. `None` if a feature lies outside the picture.
    pub fn predicted(&self, spec: &BoardSpec, board: &Rigid<Camera, Board>, place: usize) -> Option<Shot> {
        let points = spec.features();
        let camera = &self.state.camera;
        let pixels: Vec<Vec2> =
            points.iter().map(|p| in_picture(camera, &board.point(p), 0.0)).collect::<Option<_>>()?;
        let pose = flange(self.mount, &self.state.near_from_camera, &self.state.far_from_board[place], board);
        Some(Shot {
            seen: SeenBoard { name: String::new(), sigmas_px: vec![self.sigmas_px[0]; points.len()], points, pixels },
            robot: Some(Reported { pose, place }),
            stripe: self.stripe(spec, board),
            spot: self.spot(spec, board),
        })
    }

    fn stripe(&self, spec: &BoardSpec, board: &Rigid<Camera, Board>) -> Vec<StripePeak> {
        let length = stripe_on(&self.state, spec, board);
        let Some([from, to]) = length else { return Vec::new() };
        let at = |k: usize| from + (to - from) * ((k as f64 + 0.5) / PEAKS_A_STOP as f64);
        let peak = |p: Vec3| {
            let pixel = self.state.camera.pixel_from_point(&p)?;
            Some(StripePeak { pixel, sigma_px: self.sigmas_px[1], width_px: 1.0 })
        };
        (0..PEAKS_A_STOP).filter_map(|k| peak(at(k))).collect()
    }

    fn spot(&self, spec: &BoardSpec, board: &Rigid<Camera, Board>) -> Option<Spot> {
        let p = lit(&self.state, board)?;
        let q = board.inverse().point(&p);
        let pixel = in_picture(&self.state.camera, &p, 0.0).filter(|_| inside(spec, q.x, q.y) > 0.0)?;
        Some(Spot { pixel, covariance: Matrix2::identity() * self.sigmas_px[2].powi(2) })
    }

    /// Information that a stop adds about the shared unknowns, with its own board's pose eliminated.
    pub fn gain(&self, shot: &Shot, board: &Rigid<Camera, Board>) -> Option<DMatrix<f64>> {
        let state = State { boards: vec![*board], ..self.state.clone() };
        let mut terms = Terms {
            shots: std::slice::from_ref(shot),
            mount: self.mount,
            layout: &self.layout,
            noise: self.noise,
            peak_sigma_mm: Vec::new(),
            prior: None,
        };
        terms.settle(&state);
        let (n, all) = (self.layout.shared(), self.layout.width());
        let mut h = DMatrix::<f64>::zeros(all, all);
        terms.visit(&state, true, &mut |t: Term<'_>| {
            for row in t.jacobian.chunks_exact(t.columns.len()) {
                for (a, &ca) in t.columns.iter().enumerate() {
                    for (b, &cb) in t.columns.iter().enumerate() {
                        h[(ca, cb)] += row[a] * row[b];
                    }
                }
            }
        })?;
        let own = h.view((n, n), (6, 6)).into_owned().cholesky()?;
        let mixed = h.view((n, 0), (6, n)).into_owned();
        Some(h.view((0, 0), (n, n)) - mixed.transpose() * own.solve(&mixed))
    }
}

/// Pixel of a camera-frame point if it is in the picture and at least `margin` px from its edge.
pub fn in_picture(camera: &Intrinsics, p: &Vec3, margin: f64) -> Option<Vec2> {
    let (w, h) = (f64::from(camera.width) - 1.0 - margin, f64::from(camera.height) - 1.0 - margin);
    camera.pixel_from_point(p).filter(|q| q.x >= margin && q.y >= margin && q.x <= w && q.y <= h)
}

/// Ends of the part of the stripe that is on the board and in the picture, camera frame, mm; `None` without such a
/// part.
pub fn stripe_on(s: &State, spec: &BoardSpec, board: &Rigid<Camera, Board>) -> Option<[Vec3; 2]> {
    let normal: Vec3 = board.rotation.column(2).into();
    let along = s.plane.normal.cross(&normal).try_normalize(1e-9)?;
    let [x0, y0, x1, y1] = spec.outline();
    let centre = board.point(&Vec3::new((x0 + x1) / 2.0, (y0 + y1) / 2.0, 0.0));
    let m = Mat3::from_rows(&[s.plane.normal.transpose(), normal.transpose(), along.transpose()]);
    let right = Vec3::new(s.plane.offset, normal.dot(&board.translation), along.dot(&centre));
    let on = m.lu().solve(&right)?;
    let board_from_camera = board.inverse();
    let half = 0.5 * (x1 - x0).hypot(y1 - y0);
    let lit = |k: i32| {
        let p = on + along * (half * f64::from(k) / 100.0);
        let q = board_from_camera.point(&p);
        (inside(spec, q.x, q.y) > 0.0 && in_picture(&s.camera, &p, 0.0).is_some()).then_some(p)
    };
    let (first, last) = ((-100..=100).find_map(lit)?, (-100..=100).rev().find_map(lit)?);
    ((last - first).norm() > 0.1 * half).then_some([first, last])
}

/// Limits of the board poses, relative to the camera, that are considered for the next stop.
#[derive(Clone, Copy, Debug)]
pub struct Looks {
    /// Range of depths of the board's middle, mm.
    pub depths: [f64; 2],
    /// Largest tilt of the board relative to the image plane, degrees.
    pub tilt_deg: f64,
    /// Largest rotation about the optical axis, relative to `upright`, degrees.
    pub turn_deg: f64,
    /// Smallest distance of a feature from the picture's edge, px.
    pub margin_px: f64,
    /// Rotation of the board about the optical axis that counts as zero, rad.
    pub upright: f64,
    /// Whether part of the stripe has to be in view; false while the laser plane is unknown.
    pub lit: bool,
}

/// Random board poses in the camera frame with the entire board and, if required, part of the stripe in view. At most
/// `count`; the same seed gives the same poses.
pub fn candidates(s: &State, spec: &BoardSpec, looks: &Looks, count: usize, seed: u64) -> Vec<Rigid<Camera, Board>> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let features = spec.features();
    let centre = features.iter().sum::<Vec3>() / features.len() as f64;
    let (w, h) = (f64::from(s.camera.width), f64::from(s.camera.height));
    let one = |rng: &mut rand_pcg::Pcg64| {
        let mut within = |by: f64| rng.random_range(-by..=by);
        let pixel = Vec2::new(w / 2.0 + within(0.45 * w), h / 2.0 + within(0.45 * h));
        let (azimuth, turn) = (within(std::f64::consts::PI), looks.upright + within(looks.turn_deg.to_radians()));
        let tilt = within(looks.tilt_deg.to_radians());
        let depth = looks.depths[0] + (looks.depths[1] - looks.depths[0]) * rng.random::<f64>();
        let n = s.camera.normalised_from_pixel(&pixel)?;
        let rotation = exp(&(Vec3::new(azimuth.cos(), azimuth.sin(), 0.0) * tilt)) * exp(&(Vec3::z() * turn));
        let board = Rigid::new(rotation, Vec3::new(n.x, n.y, 1.0) * depth - rotation * centre);
        let whole = features.iter().all(|p| in_picture(&s.camera, &board.point(p), looks.margin_px).is_some());
        (whole && (!looks.lit || stripe_on(s, spec, &board).is_some())).then_some(board)
    };
    (0..60 * count).filter_map(|_| one(&mut rng)).take(count).collect()
}

/// The chosen next stop.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Index of the candidate.
    pub index: usize,
    /// Expected error of a scanned point with this stop added, rms, mm.
    pub expected_mm: f64,
}

/// The candidate with the smallest expected error of a scanned point in the working volume; the first one of equal
/// candidates. Candidates that are not completely visible are skipped.
pub fn next(belief: &Belief, spec: &BoardSpec, candidates: &[Rigid<Camera, Board>], place: usize) -> Option<Choice> {
    let value = |board: &Rigid<Camera, Board>| {
        let shot = belief.predicted(spec, board, place)?;
        Some(belief.expected_with(&belief.gain(&shot, board)?))
    };
    let mut best: Option<Choice> = None;
    for (index, board) in candidates.iter().enumerate() {
        if let Some(expected_mm) = value(board).filter(|v| v.is_finite())
            && best.as_ref().is_none_or(|b| expected_mm < b.expected_mm)
        {
            best = Some(Choice { index, expected_mm });
        }
    }
    best
}
