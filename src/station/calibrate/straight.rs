//! In: stripe peaks of pictures, boards of known pose in them. Out: for each picture the peaks along the strongest
//! straight line on its board (stage `hough`), and along a second one that is nearly as strong. A flat board meets
//! the sheet in a line; dots and halos do not lie on it. Only all pictures together decide which of two lines is
//! the sheet.
//! Frame and unit: pixels of a camera without lens distortion, in which the line is straight.

use crate::calibrate::boards::extent::inside;
use crate::calibrate::laser_plane::views::StripeView;
use crate::camera::Intrinsics;
use crate::fault::Result;
use crate::geometry::Vec2;
use crate::gpu::Device;
use crate::stages::stripe::hough::{HoughFrame, HoughParams, lines, vote};

/// Half width of the band around the line, in stripe sigmas, at least 2 px: a peak farther off belongs to something
/// else.
const NEAR_WIDTHS: f64 = 3.0;
/// Share of the strongest line's pixels from which a second line is retained too.
const RIVAL: f64 = 0.4;
/// Fewest peaks of a line; with fewer on the board nothing is excluded, and the solver judges the peaks.
const LEAST: u32 = 10;

/// Excludes peaks that do not lie along a line; pictures without a line are not changed.
pub fn keep_straight(views: &mut [StripeView], camera: &Intrinsics, device: Option<&Device>) -> Result<()> {
    // After undistortion the picture's corners lie outside it by less than a quarter of its size.
    let margin = Vec2::new(f64::from(camera.width / 4), f64::from(camera.height / 4));
    let (width, height) = (camera.width + 2 * (camera.width / 4), camera.height + 2 * (camera.height / 4));
    let params = HoughParams { most: 2, least_pixels: LEAST, ..HoughParams::default() };
    let frame = HoughFrame::new(width, height, &params);
    let place = |pixel: &Vec2| {
        let n = camera.normalised_from_pixel(pixel)?;
        let p = Vec2::new(camera.fx * n.x + camera.cx, camera.fy * n.y + camera.cy) + margin;
        let there = (0.0..f64::from(width) - 1.0).contains(&p.x) && (0.0..f64::from(height) - 1.0).contains(&p.y);
        there.then_some(p)
    };
    let places: Vec<Vec<Option<Vec2>>> =
        views.iter().map(|v| v.peaks.iter().map(|k| place(&k.pixel)).collect()).collect();
    let pixels: Vec<Vec<u32>> = views
        .iter()
        .zip(&places)
        .map(|(view, places)| {
            let board_from_camera = view.pose.camera_from_board.inverse();
            let on_board = |pixel: &Vec2| {
                let normal = view.pose.camera_from_board.rotation.column(2).into_owned();
                let ray = camera.normalised_from_pixel(pixel)?.push(1.0);
                let far = normal.dot(&view.pose.camera_from_board.translation) / normal.dot(&ray);
                let p = board_from_camera.point(&(ray * far));
                (far > 0.0 && inside(&view.board, p.x, p.y) > 0.0).then_some(())
            };
            let seen = view.peaks.iter().zip(places).filter(|(k, _)| on_board(&k.pixel).is_some());
            seen.filter_map(|(_, p)| *p).map(|p| p.x.round() as u32 | (p.y.round() as u32) << 16).collect()
        })
        .collect();
    for (((view, places), pixels), votes) in
        views.iter_mut().zip(&places).zip(&pixels).zip(vote(device, &frame, &pixels)?)
    {
        let mut kept = lines(&frame, votes, pixels, &params);
        let Some(strongest) = kept.iter().map(|l| l.pixels).max() else { continue };
        kept.retain(|l| f64::from(l.pixels) >= RIVAL * f64::from(strongest));
        let mut at = places.iter();
        view.peaks.retain(|k| {
            let near = f64::max(2.0, NEAR_WIDTHS * k.width_px);
            at.next().expect("one a peak").is_some_and(|p| {
                kept.iter().any(|l| (p.x * l.angle.cos() + p.y * l.angle.sin() - l.distance_px).abs() < near)
            })
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::laser_plane::views::StripePeak;
    use crate::calibrate::measured_pose::{SeenBoard, measure};
    use crate::geometry::{Rigid, Vec3};
    use crate::recording::BoardSpec;

    /// A stripe across a board, a halo beside it on the same board, dots off it.
    #[test]
    fn halos_and_dots_are_left_out_and_the_stripe_stays() {
        let camera = Intrinsics {
            fx: 611.6,
            fy: 611.6,
            cx: 315.0,
            cy: 232.3,
            skew: 0.0,
            distortion: [-0.118, 0.086, 0.0006, -0.0004, -0.017].into(),
            width: 640,
            height: 480,
        };
        let board = BoardSpec::Chessboard {
            inner_corners: [9, 6],
            square_mm: 10.0,
            border_mm: 7.0,
            first_square: "black".into(),
        };
        let pose = Rigid::from_vectors(&Vec3::new(0.1, 0.2, 0.05), Vec3::new(-40.0, -25.0, 160.0));
        let corners: Vec<Vec3> =
            (0..54).map(|i| Vec3::new(10.0 * f64::from(i % 9), 10.0 * f64::from(i / 9), 0.0)).collect();
        let pixels: Vec<Vec2> = corners.iter().map(|p| camera.pixel_from_point(&pose.point(p)).unwrap()).collect();
        let seen = SeenBoard { name: "a".into(), points: corners, pixels, sigmas_px: vec![0.05; 54] };
        let peak = |p: &Vec3, off: f64| StripePeak {
            pixel: camera.pixel_from_point(&pose.point(p)).unwrap() + Vec2::new(0.0, off),
            sigma_px: 0.05,
            width_px: 0.8,
        };
        let mut peaks: Vec<StripePeak> =
            (0..100).map(|i| peak(&Vec3::new(f64::from(i), 20.0 + 0.05 * f64::from(i), 0.0), 0.0)).collect();
        peaks.extend((0..40).map(|i| peak(&Vec3::new(f64::from(2 * i), 20.0, 0.0), 30.0 + f64::from(i * i % 37))));
        peaks.extend((0..30).map(|i| peak(&Vec3::new(f64::from(3 * i) - 10.0, -60.0, 0.0), 0.0)));
        let view = StripeView { pose: measure(&seen, &camera, &pose).unwrap(), board, peaks };
        let mut on_twin = vec![view.clone()];
        keep_straight(&mut on_twin, &camera, None).unwrap();
        assert_eq!(on_twin[0].peaks, view.peaks[..100]);
        if let Some(device) = Device::for_tests() {
            let mut on_gpu = vec![view];
            keep_straight(&mut on_gpu, &camera, Some(&device)).unwrap();
            assert_eq!(on_gpu[0].peaks, on_twin[0].peaks);
        }
    }
}
