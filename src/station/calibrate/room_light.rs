//! In: a board's picture in room light, one with the laser at the same pose, the board's pose. Out: the laser's
//! light alone, if the second picture contains room light too.
//! Frame and unit: grey levels of the pictures' depth.

use super::board_views::FrameBoard;
use crate::calibrate::boards::extent::inside;
use crate::camera::Intrinsics;
use crate::fault::Fault;
use crate::geometry::{Board, Camera, Rigid, Vec2, Vec3};
use crate::raster::{Image, Light};
use crate::recording::{BoardSpec, Recording};
use crate::stages::stripe::ambient::subtract;

/// Step between the pixels that are examined, px, in x and y.
const STEP: usize = 3;
/// Grey level (8 bits) of the picture in room light below which a pixel is not used for the ratio of the exposures.
const DARK: f32 = 24.0;
/// Fewest pixels of a board that determine the ratio.
const LEAST: usize = 100;
/// Smallest grey level (8 bits) of room light on the bright print for which it is subtracted; with less the laser's
/// picture was taken in the dark, or through a filter.
const LEFT: f32 = 4.0;

/// Share of the room's light in the laser's picture: the median ratio of both pictures over the board, of which the
/// laser covers only a small part. Two exposures of one room differ by this factor. 0 if there is no room light.
pub fn share(
    laser: &Image,
    ambient: &Image,
    board: &BoardSpec,
    pose: &Rigid<Camera, Board>,
    camera: &Intrinsics,
) -> f32 {
    let board_from_camera = pose.inverse();
    let normal: Vec3 = pose.rotation.column(2).into();
    let on_board = |x: u32, y: u32| {
        let ray = camera.normalised_from_pixel(&Vec2::new(f64::from(x), f64::from(y)))?.push(1.0);
        let far = normal.dot(&pose.translation) / normal.dot(&ray);
        let p = board_from_camera.point(&(ray * far));
        (far > 0.0 && inside(board, p.x, p.y) > 0.0).then_some(())
    };
    let unit = f32::from(ambient.full_scale()) / 255.0;
    let full = ambient.full_scale();
    let mut ratios = Vec::new();
    let mut bright = 0.0f32;
    for y in (0..laser.height).step_by(STEP) {
        for x in (0..laser.width).step_by(STEP) {
            let (a, l) = (ambient.get(x, y), laser.get(x, y));
            if f32::from(a) > DARK * unit && a < full && on_board(x, y).is_some() {
                ratios.push(f32::from(l) / f32::from(a));
                bright = bright.max(f32::from(a));
            }
        }
    }
    if ratios.len() < LEAST {
        return 0.0;
    }
    let middle = ratios.len() / 2;
    let share = *ratios.select_nth_unstable_by(middle, f32::total_cmp).1;
    if share * bright < LEFT * unit { 0.0 } else { share }
}

/// The laser's picture minus the room's light.
pub fn without(laser: &Image, ambient: &Image, share: f32) -> Image {
    let full = u32::from(laser.full_scale());
    let room = ambient.to_f32().into_iter().map(|g| (g * share).round() as u32);
    let left = laser.to_f32().into_iter().zip(room).map(|(l, r)| subtract(l as u32, r, full));
    let (w, h) = (laser.width, laser.height);
    match laser.bits {
        8 => Image::from_u8(w, h, left.map(|g| g as u8).collect()),
        bits => Image::from_u16(w, h, bits, left.map(|g| g as u16).collect()),
    }
}

/// The laser's picture of a board; room light is subtracted if it contains any.
pub fn alone(laser: Image, ambient: &Image, b: &FrameBoard, camera: &Intrinsics) -> Image {
    let share = share(&laser, ambient, &b.board, &b.pose.camera_from_board, camera);
    if share > 0.0 { without(&laser, ambient, share) } else { laser }
}

/// Adds to a fault what one of the laser's pictures shows, without subtraction.
pub fn lit(recording: &Recording, name: &str, fault: Fault) -> Fault {
    match recording.picture(name) {
        Ok(picture) => Light::of(&picture).explain(name, fault),
        Err(_) => fault,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pictures(exposure: f32, bits: u8) -> (Image, Image, f32) {
        let full = ((1u32 << bits) - 1) as f32;
        let unit = full / 255.0;
        // A board of dark and bright squares with a bright lamp beside it, and a line across.
        let print = |x: u32, y: u32| if (x / 10 + y / 10).is_multiple_of(2) { 150.0 } else { 40.0 };
        let room = |x: u32, y: u32| unit * if x > 90 { 250.0 } else { print(x, y) };
        let line = |x: u32, y: u32| unit * 120.0 * (-0.5 * ((y as f32 - 41.3 - 0.05 * x as f32) / 1.3).powi(2)).exp();
        let make = |f: &dyn Fn(u32, u32) -> f32| {
            let px: Vec<u16> = (0..8000).map(|i| f(i % 100, i / 100).min(full).round() as u16).collect();
            match bits {
                8 => Image::from_u8(100, 80, px.iter().map(|&g| g as u8).collect()),
                _ => Image::from_u16(100, 80, bits, px),
            }
        };
        (make(&|x, y| exposure * room(x, y) + line(x, y)), make(&room), unit)
    }

    #[test]
    fn room_light_of_any_exposure_is_taken_out_and_none_where_there_is_none() {
        let board = BoardSpec::Chessboard {
            inner_corners: [8, 7],
            square_mm: 10.0,
            border_mm: 0.0,
            first_square: "black".into(),
        };
        let camera = Intrinsics {
            fx: 100.0,
            fy: 100.0,
            cx: 0.0,
            cy: 0.0,
            skew: 0.0,
            distortion: crate::camera::Distortion::default(),
            width: 100,
            height: 80,
        };
        let pose = Rigid::new(nalgebra::Matrix3::identity(), Vec3::new(10.0, 10.0, 100.0));
        for bits in [8, 12] {
            for exposure in [0.4, 1.0, 1.1, 0.0] {
                let (laser, ambient, unit) = pictures(exposure, bits);
                let found = share(&laser, &ambient, &board, &pose, &camera);
                assert!((found - exposure).abs() < 0.02, "{bits} bits, exposure {exposure}: {found}");
                let alone = without(&laser, &ambient, found);
                let off = |x, y| f32::from(alone.get(x, y)) / unit;
                assert!(off(30, 10) < 3.0 && off(30, 70) < 3.0 && off(45, 12) < 3.0, "{} {}", off(30, 10), off(30, 70));
                assert!((off(30, 43) - 118.0).abs() < 6.0, "{}", off(30, 43));
            }
        }
    }
}
