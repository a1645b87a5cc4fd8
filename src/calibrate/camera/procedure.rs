//! In: recordings of boards. Out: the camera's calibration with verdict, advice and the data of the report
//! (\[zhang00\]; docs/math.md, Camera calibration).
//! Frame and unit: camera frame; pixels, mm; degrees where the name states them.

use super::choice::Doubt;
use super::intrinsics::{Boards, Observation, SolveOptions, Solved, solve};
use super::lens::{Lens, further_names, held_names};
use super::parts::apart;
use super::pictures::{Pictures, one_size, pictures};
use super::quality;
use super::ray_error::expected_ray_error;
use crate::calibrate::boards::FindOptions;
use crate::calibrate::limits::{Asked, Judgement, Limits};
use crate::camera::{ALWAYS_NAMED, Intrinsics, NAMES};
use crate::fault::{Fault, Result};
use crate::geometry::Vec2;
use crate::recording::{Recording, hot_pixels, one_readout};
use crate::rig::{Calibration, Covariance, Kind, Quality, Verdict, Volume};
use std::collections::BTreeMap;

/// Settings of [`calibrate`].
#[derive(Clone, Debug, Default)]
pub struct CameraOptions {
    /// Settings of the search for the board.
    pub find: FindOptions,
    /// Settings of the solve.
    pub solve: SolveOptions,
    /// Depths and tolerance by which the result is judged; without them the boards' median distance and a share of the
    /// view.
    pub asked: Asked,
}

impl CameraOptions {
    /// Refuses values outside the ranges stated at the fields.
    pub fn check(&self) -> Result<()> {
        self.find.check()?;
        self.asked.check()?;
        match self.asked.working.as_ref().map(|w| w.near_mm) {
            Some(d) if !(d > 0.0) => Err(Fault::usage(format!("the work is {d} mm away, more than 0 mm is needed"))
                .next("give the distance from the camera to the work in mm")),
            _ => Ok(()),
        }
    }
}

/// A camera calibration with the data of its report.
#[derive(Clone, Debug)]
pub struct CameraResult {
    /// The calibration in its stored form.
    pub calibration: Calibration<Intrinsics>,
    /// The used pictures in order; `solved` has the same indices.
    pub used: Vec<Observation>,
    /// The camera with every board's pose and every corner's residual.
    pub solved: Solved,
    /// Excluded pictures: name and reason.
    pub left_out: Vec<(String, String)>,
    /// Leave-one-out rms of each used picture, px.
    pub hold_out_px: Vec<Option<f64>>,
    /// Corners that the robust loss gave little weight or that stand out: picture, feature id, residual px.
    pub worst: Vec<(String, usize, f64)>,
}

/// Finds the board in every picture of recordings by one camera (in the ambient picture where there is one), and
/// calibrates the camera from all of them together. A picture that occurs twice counts once. `progress` is called
/// with (done, all).
///
/// # Errors
/// No board described; no pictures; pictures of two sizes; the board found in fewer than two of them (the fault gives
/// the reasons).
pub fn calibrate(
    recordings: &[Recording],
    options: &CameraOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<CameraResult> {
    options.check()?;
    let (width, height) = one_size(recordings)?;
    let readout = one_readout(recordings)?;
    let remarks: Vec<Option<String>> = recordings.iter().map(Recording::grey_levels).collect::<Result<_>>()?;
    let Pictures { found, left_out, mut inputs } = pictures(recordings, &options.find, progress)?;
    let mut result = from_observations(found, left_out, width, height, options)?;
    inputs.retain(|name, _| name.ends_with("meta.json") || result.used.iter().any(|o| o.name == *name));
    result.calibration.inputs = inputs;
    result.calibration.quality.reasons.extend(remarks.into_iter().flatten());
    result.calibration.readout = readout;
    result.calibration.hot_pixels = hot_pixels(recordings).places().to_vec();
    Ok(result)
}

/// A picture is excluded if its typical residual, over its corners' sigmas, is this many times the median picture's.
const OUTLIER_PICTURE: f64 = 3.5;

/// The pictures that agree, and the camera solved from them.
struct Agreed {
    pictures: Vec<Observation>,
    solved: Solved,
    /// Excluded pictures: name and reason.
    left_out: Vec<(String, String)>,
    /// True if more than a quarter of the pictures would have to be excluded.
    contradiction: bool,
}

/// Calibrates from boards that were already found.
pub fn from_observations(
    pictures: Vec<Observation>,
    left_out: Vec<(String, String)>,
    width: u32,
    height: u32,
    options: &CameraOptions,
) -> Result<CameraResult> {
    let agreed = agree(pictures, left_out, [width, height], &options.solve)?;
    let Agreed { pictures, solved, .. } = &agreed;
    let hold_out_px = if pictures.len() > 2 {
        quality::hold_out(pictures, solved, &options.solve)
    } else {
        vec![None; pictures.len()]
    };
    let worst = worst_corners(pictures, solved);
    let judged = judge(&agreed, &hold_out_px, &worst, options);
    let calibration = Calibration::new(Kind::Camera, solved.intrinsics, None, stated_covariance(solved), judged);
    let Agreed { pictures, solved, left_out, .. } = agreed;
    Ok(CameraResult { calibration, used: pictures, solved, left_out, hold_out_px, worst })
}

/// Solves, and excludes what does not fit: first a few pictures with another readout, then one picture per round, the
/// worst first. A wrong picture also increases the residuals of the others.
fn agree(
    mut pictures: Vec<Observation>,
    mut left_out: Vec<(String, String)>,
    [width, height]: [u32; 2],
    options: &SolveOptions,
) -> Result<Agreed> {
    let mut solved = solve(&pictures, width, height, options)?;
    let most = pictures.len() / 4;
    let (mut outliers, mut contradiction) = (0, false);
    while let Some(part) = apart(&pictures, &solved, options) {
        if outliers + part.which.len() > most {
            return Err(part.fault(&pictures));
        }
        outliers += part.which.len();
        let names = part.which.iter().rev().map(|&i| pictures.remove(i).name);
        left_out.extend(names.map(|name| (name, part.reason())));
        solved = solve(&pictures, width, height, options)?;
    }
    while let Some((i, ratio)) = worst_picture(&pictures, &solved).filter(|w| w.1 > OUTLIER_PICTURE) {
        if outliers == most {
            contradiction = true;
            break;
        }
        let o = pictures.remove(i);
        left_out.push((o.name, format!("its residuals are {ratio:.1} times those of the median picture")));
        outliers += 1;
        solved = solve(&pictures, width, height, options)?;
    }
    Ok(Agreed { pictures, solved, left_out, contradiction })
}

/// Covariance of the parameters that a calibration names: all except held lens terms.
fn stated_covariance(solved: &Solved) -> Covariance {
    let stated = |i: &usize| *i < ALWAYS_NAMED || !solved.held.contains(i);
    let stated: Vec<usize> = (0..NAMES.len()).filter(stated).collect();
    solved.covariance.as_ref().map_or_else(Covariance::default, |c| {
        let names: Vec<&str> = stated.iter().map(|&i| NAMES[i]).collect();
        Covariance::new(&names, &c.select_rows(&stated).select_columns(&stated))
    })
}

/// Typical residual of a picture over its corners' sigmas; robust against single wrong corners.
fn typical_misfit(o: &Observation, residuals: &[(Vec2, f64)]) -> f64 {
    let lengths = o.view.points.iter().zip(residuals).map(|(p, (r, _))| r.norm() / p.sigma_px.hypot(0.01));
    crate::solve::robust_scale(&mut lengths.collect::<Vec<f64>>(), 2)
}

/// Index of the picture with the worst fit, and its misfit relative to the median picture's.
fn worst_picture(pictures: &[Observation], solved: &Solved) -> Option<(usize, f64)> {
    if pictures.len() < 4 {
        return None;
    }
    let all: Vec<f64> = pictures.iter().zip(&solved.residuals).map(|(o, r)| typical_misfit(o, r)).collect();
    let mut sorted = all.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2].max(1e-9);
    let (i, worst) = all.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    Some((i, worst / median))
}

/// Corners with residuals beyond four robust sigmas, the worst first, at most 20.
fn worst_corners(pictures: &[Observation], solved: &Solved) -> Vec<(String, usize, f64)> {
    let mut lengths: Vec<f64> = solved.residuals.iter().flatten().map(|r| r.0.norm()).collect();
    let limit = 4.0 * crate::solve::robust_scale(&mut lengths, 2);
    let mut worst: Vec<(String, usize, f64)> = pictures
        .iter()
        .zip(&solved.residuals)
        .flat_map(|(o, r)| o.view.points.iter().zip(r).map(move |(p, r)| (o.name.clone(), p.feature_id, r.0.norm())))
        .filter(|w| w.2 > limit)
        .collect();
    worst.sort_by(|a, b| b.2.total_cmp(&a.2));
    worst.truncate(20);
    worst
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0usize), |(s, n), v| (s + v * v, n + 1));
    (sum / n.max(1) as f64).sqrt()
}

/// What a verdict rests on.
struct Evidence<'a> {
    agreed: &'a Agreed,
    /// Typical distance of the boards, mm.
    distance: f64,
    /// Where the camera is judged, and by which tolerance.
    limits: Limits,
    /// Of the viewing rays over the image, px; infinite where the pictures do not determine all parameters.
    expected: f64,
    /// The same where boards were seen.
    expected_seen: f64,
    /// Spread of the boards' normals, degrees.
    tilt: f64,
    /// Share of the image in which corners were seen.
    covered: f64,
    corners: usize,
    /// rms of the held-out pictures, px; `None` if none could be held out.
    held_out: Option<f64>,
}

fn judge(
    agreed: &Agreed,
    hold_out: &[Option<f64>],
    worst: &[(String, usize, f64)],
    options: &CameraOptions,
) -> Quality {
    let Agreed { pictures, solved, .. } = agreed;
    let k = &solved.intrinsics;
    let distance = quality::typical_distance(pictures, &solved.camera_from_board);
    let covered = quality::Covered::by(pictures, k.width, k.height);
    let evidence = Evidence {
        agreed,
        distance,
        limits: options.asked.limits(&Volume::new(distance, distance, "where the boards were"), |z| k.view_mm(z)),
        expected: solved.covariance.as_ref().map_or(f64::INFINITY, |c| expected_ray_error(k, c)),
        expected_seen: solved.covariance.as_ref().map_or(f64::INFINITY, |c| covered.ray_error(k, c)),
        tilt: quality::tilt_spread_deg(&solved.camera_from_board),
        covered: covered.share(),
        corners: pictures.iter().map(|o| o.view.points.len()).sum(),
        held_out: Some(rms(hold_out.iter().flatten().copied())).filter(|r| r.is_finite() && *r > 0.0),
    };
    let Evidence { corners, expected, .. } = evidence;
    let summary = format!("{} pictures, {corners} corners, reprojection rms {:.3} px", pictures.len(), solved.rms_px);
    let mut j = Judgement { verdict: Verdict::Good, reasons: vec![summary], advice: Vec::new() };
    evidence.determined(&mut j);
    evidence.fits(&mut j);
    j.reasons.extend(pictures.iter().find(|o| o.view.begins_white).map(|o| {
        format!(
            "{}: the ChArUco board begins with a white square, as OpenCV drew boards before version 4.6 (\"legacy \
             pattern\")",
            o.name
        )
    }));
    j.reasons.extend(held_parameters(solved, options.solve.lens));
    j.reasons.extend(further_parameters(solved, options.solve.lens));
    j.reasons.extend(solved.doubts.iter().map(doubted));
    let shape = board_shape(pictures, solved);
    let told = options.solve.boards == Boards::Evidence;
    j.reasons.extend(shape.map(|[flat, lifted]| {
        let off = format!("its features are {flat:.3} mm off in its plane and {lifted:.3} mm out of it (rms)");
        if told {
            format!(
                "the board differs from its drawing: {off}; its shape was estimated with the camera; pictures that \
                 were held out fit better with it"
            )
        } else {
            format!("the board's shape was estimated with the camera, as was asked: {off}")
        }
    }));
    j.reasons.extend(excluded(&agreed.left_out));
    if let Some((name, id, r)) = worst.first() {
        j.reasons.push(format!("worst corner: {name}, feature {id}, {r:.2} px ({} stand out)", worst.len()));
    }
    let noise = rms(solved.residuals.iter().flatten().map(|r| r.0.norm())) / std::f64::consts::SQRT_2;
    j.advice = advise(pictures, solved, distance, noise, expected, j.verdict);
    j.advice.extend(shape.filter(|_| told).map(|_| {
        "calibrate hand-eye, laser plane and pointer with a flatter board (print on glass or aluminium): they take \
         it as drawn"
            .to_string()
    }));
    let per_picture = pictures
        .iter()
        .zip(&solved.residuals)
        .map(|(o, r)| (o.name.clone(), rms(r.iter().map(|r| r.0.norm()))))
        .collect();
    let figures = evidence.figures();
    Quality { verdict: j.verdict, reasons: j.reasons, advice: j.advice, figures, per_picture }
}

impl Evidence<'_> {
    /// Checks that the pictures and the tilts of their boards suffice for the required accuracy of the viewing rays.
    fn determined(&self, j: &mut Judgement) {
        let (pictures, tilt) = (self.agreed.pictures.len(), self.tilt);
        j.at_best(Verdict::BadlyDetermined, pictures < 3, || {
            format!("{pictures} pictures: none is left to check the result; 3 are required, 10 recommended")
        });
        j.at_best(Verdict::Usable, (3..8).contains(&pictures), || format!("only {pictures} pictures"));
        j.at_best(Verdict::BadlyDetermined, tilt < 10.0, || {
            format!(
                "all boards are parallel within {tilt:.1} degrees; 10 are needed: focal length and distance cannot \
                 be separated"
            )
        });
        if !self.expected_seen.is_finite() {
            j.at_best(Verdict::BadlyDetermined, true, || "the pictures do not determine all parameters".into());
            return;
        }
        let (seen, depth) = (self.expected_seen, self.limits.middle());
        let says = format!(
            "where boards were seen the viewing rays are known to {seen:.2} px, {:.3} mm at {} mm",
            seen * self.mm_per_px(),
            self.limits.working.depth(depth)
        );
        let by_error = self.limits.by_error(seen * self.mm_per_px(), says);
        if by_error.verdict > Verdict::Good {
            j.verdict = j.verdict.max(by_error.verdict);
            j.reasons.extend(by_error.reasons);
        }
    }

    /// Size of a pixel at the distance of the work, mm.
    fn mm_per_px(&self) -> f64 {
        let k = &self.agreed.solved.intrinsics;
        self.limits.middle() / (0.5 * (k.fx + k.fy))
    }

    /// Checks that the model fits the pictures, including held-out ones, everywhere in the image.
    fn fits(&self, j: &mut Judgement) {
        let Agreed { solved, contradiction, .. } = self.agreed;
        j.ended(solved.end);
        j.at_best(Verdict::BadlyDetermined, *contradiction, || {
            "more than a quarter of the pictures contradict the others".into()
        });
        let to = if solved.rms_px > 3.0 { Verdict::BadlyDetermined } else { Verdict::Usable };
        j.at_best(to, solved.rms_px > 1.0, || {
            format!("reprojection rms {:.2} px; below 1 px is expected of a flat, sharp board", solved.rms_px)
        });
        let worse = self.held_out.filter(|held| *held > 3.0 * solved.rms_px.max(0.01));
        if let Some(held) = worse {
            j.at_best(Verdict::BadlyDetermined, true, || {
                format!("pictures that were held out fit with {held:.3} px, those used with {:.3} px", solved.rms_px)
            });
        }
        j.at_best(Verdict::BadlyDetermined, solved.intrinsics.fold().is_some(), || {
            let what = "the lens model folds back inside the image";
            format!("{what}: take boards nearer to its corners, or ask for fewer terms (--lens four)")
        });
        j.at_best(Verdict::Usable, self.covered < 0.6, || {
            format!(
                "corners cover {:.0} % of the image, 60 % are wanted: elsewhere the lens is extrapolated, and over the \
                 whole image the viewing rays are known to {:.2} px",
                self.covered * 100.0,
                self.expected
            )
        });
    }

    fn figures(&self) -> BTreeMap<String, f64> {
        let Agreed { pictures, solved, left_out, .. } = self.agreed;
        let k = &solved.intrinsics;
        let mut figures = BTreeMap::from([
            ("rms_px".to_string(), solved.rms_px),
            ("corner_noise_ratio".into(), solved.sigma0),
            ("largest_scatter_from_picture_to_picture".into(), solved.repeat.max()),
            ("expected_ray_error_px".into(), self.expected),
            ("expected_ray_error_where_seen_px".into(), self.expected_seen),
            ("expected_error_at_working_distance_mm".into(), self.expected_seen * self.mm_per_px()),
            ("working_distance_mm".into(), self.limits.middle()),
            ("tolerance_mm".into(), self.limits.tolerance_mm),
            ("pictures".into(), pictures.len() as f64),
            ("pictures_left_out".into(), left_out.len() as f64),
            ("corners".into(), self.corners as f64),
            ("coverage_share".into(), self.covered),
            ("tilt_spread_deg".into(), self.tilt),
        ]);
        if let Some([flat, lifted]) = board_shape(&self.agreed.pictures, solved) {
            figures.insert("board_off_in_its_plane_rms_mm".into(), flat);
            figures.insert("board_off_out_of_its_plane_rms_mm".into(), lifted);
        }
        if let Some(held) = self.held_out {
            figures.insert("holdout_rms_px".into(), held);
            figures.insert("holdout_rms_mm".into(), held * self.distance / (0.5 * (k.fx + k.fy)));
        }
        // JSON has no infinity: unknown figures are omitted; a reason mentions them.
        figures.retain(|_, v| v.is_finite());
        figures
    }
}

/// Deviation of the board from its drawing, rms, mm, in its plane and out of it; `None` if the board was taken as
/// drawn.
fn board_shape(pictures: &[Observation], solved: &Solved) -> Option<[f64; 2]> {
    Some(solved.shape.as_ref()?.departs(&pictures.first()?.features))
}

/// The excluded pictures, those with the same reason in one sentence, in the order of their names.
fn excluded(left_out: &[(String, String)]) -> Vec<String> {
    let mut by_reason: Vec<(&str, Vec<&str>)> = Vec::new();
    for (name, why) in left_out {
        match by_reason.iter_mut().find(|(reason, _)| reason == why) {
            Some((_, names)) => names.push(name),
            None => by_reason.push((why, vec![name])),
        }
    }
    by_reason
        .into_iter()
        .map(|(why, mut names)| {
            names.sort_unstable();
            let verb = if names.len() == 1 { "was" } else { "were" };
            format!("{} {verb} excluded: {why}", names.join(", "))
        })
        .collect()
}

/// The lens parameters that the evidence holds at 0, in words; `None` if the lens was stated.
fn held_parameters(solved: &Solved, lens: Lens) -> Option<String> {
    let names = held_names(&solved.held);
    (lens == Lens::Evidence && !names.is_empty()).then(|| {
        format!(
            "{} set to 0: in these pictures {} not differ from 0",
            names.join(", "),
            if names.len() > 1 { "they do" } else { "it does" }
        )
    })
}

/// The lens terms that the evidence added, in words.
fn further_parameters(solved: &Solved, lens: Lens) -> Option<String> {
    let names = further_names(&solved.held);
    (lens == Lens::Evidence && !names.is_empty())
        .then(|| format!("{} estimated too: pictures that were held out fit better with them", names.join(", ")))
}

/// The terms that pictures ask for and that are not believed, in words.
fn doubted(doubt: &Doubt) -> String {
    let name: &str = doubt.lens.into();
    let why =
        if doubt.folds { "the lens would fold back inside the image" } else { "no more than print, blur and light" };
    format!(
        "the {name} terms are not estimated: they explain {:.3} px, {why}; they would move the viewing rays by \
         {:.2} px, and half of that is in the uncertainty",
        doubt.explained_px, doubt.rays_px
    )
}

fn advise(
    pictures: &[Observation],
    solved: &Solved,
    distance: f64,
    noise: f64,
    expected: f64,
    verdict: Verdict,
) -> Vec<String> {
    let Some(first) = pictures.first() else { return Vec::new() };
    match quality::next_picture(solved, &first.features, distance, noise.max(1e-3)) {
        Some(next) if verdict > Verdict::Good || next.expected_px < 0.8 * expected => {
            vec![format!("{}; expected ray error {expected:.3} -> {:.3} px", next.words, next.expected_px)]
        }
        Some(_) => Vec::new(),
        None => vec![
            "tilt the board by 20 to 40 degrees about the horizontal axis in one picture and about the \
                      vertical axis in another, in different corners of the picture"
                .into(),
        ],
    }
}
