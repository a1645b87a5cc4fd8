//! In: a camera calibration. Out: its report page.
//! Frame and unit: pixels and mm as labelled.

use super::intrinsics::Observation;
use super::procedure::CameraResult;
use super::quality::{feature_bias, tilt_deg};
use crate::calibrate::boards::shape::Shape;
use crate::calibrate::report::{Page, axis_sphere, bars, coverage_map, residual_arrows, scatter};
use crate::camera::NAMES;
use crate::geometry::{Board, Camera, Rigid, Vec3};

/// The report of a camera calibration.
pub fn page(result: &CameraResult, title: &str) -> Page {
    let quality = &result.calibration.quality;
    let mut page = Page::new(title);
    page.verdict(quality);
    page.table("Parameters", &["name and unit", "value", "standard deviation"], &parameters(result));
    let figures: Vec<Vec<String>> =
        quality.figures.iter().map(|(name, v)| vec![name.clone(), format!("{v:.5}")]).collect();
    page.paragraph(
        "Fit and check are apart: rms_px is the residual of the corners that made the result; holdout_rms_px that of \
         pictures which the result has not seen. The expected errors follow from the covariance.",
    );
    page.table("Figures", &["figure and unit", "value"], &figures);
    draw_residuals(&mut page, result);
    if let Some(shape) = &result.solved.shape {
        draw_shape(&mut page, result, shape);
    }
    page.table(
        "Features that are off the same way in every picture (board printed or mounted unevenly), the worst first",
        &["feature", "x mm", "y mm", "standard error mm", "pictures"],
        &uneven_features(result),
    );
    let worst: Vec<Vec<String>> =
        result.worst.iter().map(|(name, id, r)| vec![name.clone(), id.to_string(), format!("{r:.3}")]).collect();
    if !worst.is_empty() {
        page.table("Corners that stand out", &["picture", "feature", "px"], &worst);
    }
    page.table("Boards", &["picture", "corners", "x mm", "y mm", "z mm", "tilt degrees"], &boards(result));
    let left: Vec<Vec<String>> = result.left_out.iter().map(|(n, why)| vec![n.clone(), why.clone()]).collect();
    if !left.is_empty() {
        page.table("Excluded pictures", &["picture", "why"], &left);
    }
    page
}

/// The camera's parameters with their sigmas.
fn parameters(result: &CameraResult) -> Vec<Vec<String>> {
    let (value, covariance) = (result.calibration.value.parameters(), &result.calibration.covariance);
    let index = |name: &String| NAMES.iter().position(|n| n == name);
    let row = |name: &String| {
        let held = index(name).is_some_and(|i| result.solved.held.contains(&i));
        let sigma = covariance.sigma(name).unwrap_or(f64::NAN);
        let sigma = if held { "held".into() } else { format!("{sigma:.6}") };
        vec![name.clone(), format!("{:.6}", value[index(name).unwrap_or(0)]), sigma]
    };
    covariance.parameters.iter().map(row).collect()
}

/// Figures of corners and boards: their positions and their residuals.
fn draw_residuals(page: &mut Page, result: &CameraResult) {
    let (k, solved) = (&result.calibration.value, &result.solved);
    let seen: Vec<_> = result.used.iter().flat_map(|o| o.view.points.iter().map(|p| p.pixel)).collect();
    page.figure(
        "Where corners were seen; red cells are empty, the lens is extrapolated there.",
        &coverage_map(k.width, k.height, &seen),
    );
    let arrows: Vec<_> = result
        .used
        .iter()
        .zip(&solved.residuals)
        .flat_map(|(o, r)| o.view.points.iter().zip(r).map(|(p, (r, w))| (p.pixel, *r, *w < 0.5)))
        .collect();
    page.figure(
        "Residuals, seen minus predicted; red ones were given less than half of their weight. Patterns that hang \
         together mean that the lens model or the board's flatness is at fault.",
        &residual_arrows(k.width, k.height, &arrows),
    );
    page.figure("Rms residual per picture", &bars(&result.calibration.quality.per_picture, "px", None));
    let hold_out: Vec<(String, f64)> =
        result.used.iter().zip(&result.hold_out_px).filter_map(|(o, r)| Some((o.name.clone(), (*r)?))).collect();
    if !hold_out.is_empty() {
        page.figure("Rms residual of each picture when it was held out", &bars(&hold_out, "px", None));
    }
    let normals: Vec<(Vec3, String)> = result
        .used
        .iter()
        .zip(&solved.camera_from_board)
        .map(|(o, p)| (Vec3::from(p.rotation.column(2)), short(&o.name)))
        .collect();
    page.figure(
        "The boards' normals in the camera frame: the middle is a board that faces the camera; a good set is spread \
         round the ring of 20 to 40 degrees.",
        &axis_sphere(&normals),
    );
    let by_radius: Vec<(f64, f64)> =
        arrows.iter().map(|(p, r, _)| ((p.x - k.cx).hypot(p.y - k.cy), r.norm())).collect();
    page.figure("Residual against distance from the principal point", &scatter(&by_radius, "px from the centre", "px"));
}

/// Figures of the board's estimated shape.
fn draw_shape(page: &mut Page, result: &CameraResult, shape: &Shape) {
    let Some(features) = result.used.first().map(|o| &o.features) else { return };
    let off: Vec<Vec3> = features.iter().map(|x| shape.place(x) - x).collect();
    let far = off.iter().fold([0.0, 0.0], |[flat, high]: [f64; 2], d| [flat.max(d.xy().norm()), high.max(d.z.abs())]);
    page.paragraph(&format!(
        "Smooth departures of the board's features from its drawing were estimated beside the camera: up to {:.3} mm \
         in its plane, \
         up to {:.3} mm out of it (along its z axis). A scale of the whole board cannot be seen.",
        far[0], far[1]
    ));
    let mut farthest: Vec<usize> = (0..features.len()).collect();
    farthest.sort_by(|&a, &b| off[b].norm().total_cmp(&off[a].norm()));
    let row = |&id: &usize| {
        let d = off[id];
        [vec![id.to_string()], [d.x, d.y, d.z].map(|v| format!("{v:.4}")).to_vec()].concat()
    };
    page.table(
        "Features that are farthest from where the drawing has them",
        &["feature", "x mm", "y mm", "z mm"],
        &farthest.iter().take(10).map(row).collect::<Vec<_>>(),
    );
}

/// The ten features with the largest mean residual on the board relative to its standard error.
fn uneven_features(result: &CameraResult) -> Vec<Vec<String>> {
    let mut bias = feature_bias(&result.used, &result.solved);
    bias.sort_by(|a, b| (b.1.norm() / b.2).total_cmp(&(a.1.norm() / a.2)));
    bias.iter()
        .take(10)
        .map(|(id, mean, error, n)| {
            vec![
                id.to_string(),
                format!("{:.4}", mean.x),
                format!("{:.4}", mean.y),
                format!("{error:.4}"),
                n.to_string(),
            ]
        })
        .collect()
}

/// Position of the board in each picture.
fn boards(result: &CameraResult) -> Vec<Vec<String>> {
    let row = |(o, p): (&Observation, &Rigid<Camera, Board>)| {
        let t = p.translation;
        let n = o.view.points.len().to_string();
        let place = [t.x, t.y, t.z, tilt_deg(p)].map(|v| format!("{v:.2}"));
        [vec![o.name.clone(), n], place.to_vec()].concat()
    };
    result.used.iter().zip(&result.solved.camera_from_board).map(row).collect()
}

/// A file name without its extension and without the text before the first digit.
fn short(name: &str) -> String {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem).trim_start_matches(|c: char| !c.is_ascii_digit()).into()
}
