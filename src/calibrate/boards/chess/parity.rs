//! In: chessboards of every size from 3x3 to 12x12, drawn, rotated by quarter turns, mirrored and with swapped
//! colours. Out: tests that each is read from the origin that its description states, or refused.
//! Frame and unit: pixels, mm.

use super::trials::{facing, picture_by};
use super::turns::turns;
use crate::calibrate::boards::{FindOptions, find};
use crate::camera::{Distortion, Intrinsics};
use crate::geometry::{Vec2, Vec3};
use crate::raster::Image;
use crate::recording::BoardSpec;

const SIDE: u32 = 300;

fn chessboard(n: [u32; 2], first_square: &str) -> BoardSpec {
    BoardSpec::Chessboard { inner_corners: n, square_mm: 10.0, border_mm: 7.0, first_square: first_square.into() }
}

fn opposite(colour: &str) -> &'static str {
    if colour == "black" { "white" } else { "black" }
}

/// The picture with pixel (x, y) moved to `to(x, y)` and its grey levels changed by `level`.
fn changed(image: &Image, to: impl Fn(f64, f64) -> [f64; 2], level: impl Fn(u8) -> u8) -> Image {
    let old = image.to_f32();
    let mut pixels = vec![0; old.len()];
    for (k, v) in old.iter().enumerate() {
        let [x, y] = to((k as u32 % SIDE).into(), (k as u32 / SIDE).into());
        pixels[y as usize * SIDE as usize + x as usize] = level(*v as u8);
    }
    Image::from_u8(SIDE, SIDE, pixels)
}

/// Draws the board and reads it in all orientations; returns the number of pictures read.
fn check(n: [u32; 2], drawn_first: &str) -> usize {
    let drawn = chessboard(n, drawn_first);
    let pixels_per_mm = 0.75 * f64::from(SIDE) / (f64::from(n[0].max(n[1])) * 10.0 + 34.0);
    let camera = Intrinsics {
        fx: 400.0,
        fy: 400.0,
        cx: 149.5,
        cy: 149.5,
        skew: 0.0,
        distortion: Distortion::default(),
        width: SIDE,
        height: SIDE,
    };
    let pose = facing(&drawn, Vec3::new(0.25, -0.2, 0.1), 400.0 / pixels_per_mm);
    let features = drawn.features();
    let seen: Vec<Vec2> = features.iter().map(|f| camera.pixel_from_point(&pose.point(f)).unwrap()).collect();
    let picture = picture_by(&camera, &drawn, &pose);
    let last = f64::from(SIDE - 1);
    let mut count = 0;
    // Colours as drawn, and a negative of the picture: a print of white on black, in front of a bright wall.
    for (negative, quarter) in (0..8).map(|k| (k % 2 == 1, k / 2)) {
        let turn = |x: f64, y: f64| [[x, y], [last - y, x], [last - x, last - y], [y, last - x]][quarter];
        let level = |v: u8| if negative { 255 - v } else { v };
        let shown = changed(&picture, turn, level);
        let first = if negative { opposite(drawn_first) } else { drawn_first };
        let said = format!("{n:?} first {first}, turned by {} degrees", 90 * quarter);
        let board = chessboard(n, first);
        let view = find(&shown, &board, &FindOptions::default()).unwrap_or_else(|e| panic!("{said}: {e}"));
        let ways = turns(&board);
        assert_eq!(view.ambiguous, ways.len() > 1, "{said}");
        let off = |ids: &[usize]| {
            let far = view.points.iter().map(|p| {
                let at = seen[ids[p.feature_id]];
                (Vec2::from(turn(at.x, at.y)) - p.pixel).norm()
            });
            far.fold(0.0, f64::max)
        };
        let best = ways.iter().map(|t| off(&t.ids)).fold(f64::INFINITY, f64::min);
        assert!(view.points.len() == features.len() && best < 0.1, "{said}: {best} px");
        count += 1;
        // The other colour: the same board in another rotation if that swaps the colours, otherwise no board.
        let other = chessboard(n, opposite(first));
        let swaps = (n[0] + n[1]) % 2 == 1 || (n[0] == n[1] && n[0] % 2 == 1);
        if quarter == 0 {
            match find(&shown, &other, &FindOptions::default()) {
                Ok(view) => {
                    let as_drawn = ways.iter().map(|t| {
                        let far = view.points.iter().map(|p| (seen[t.ids[p.feature_id]] - p.pixel).norm());
                        far.fold(0.0, f64::max)
                    });
                    assert!(swaps && as_drawn.fold(f64::INFINITY, f64::min) > 5.0, "{said}: taken for its opposite");
                }
                Err(e) => assert!(!swaps && e.what.contains("first corner"), "{said}: {e}"),
            }
            // A mirrored chessboard is another board only if both numbers are odd and differ.
            let mirrored = changed(&shown, |x, y| [last - x, y], |v| v);
            let told = n[0] % 2 == 1 && n[1] % 2 == 1 && n[0] != n[1];
            match find(&mirrored, &board, &FindOptions::default()) {
                Ok(_) => assert!(!told, "{said}: a mirrored picture was taken"),
                Err(e) => assert!(told && e.cause.contains("mirrored"), "{said}: {e}"),
            }
        }
    }
    count
}

#[test]
fn every_parity_is_read_from_its_origin_in_every_orientation() {
    let long = std::env::var_os("SHEETLIGHT_LONG").is_some();
    let all = (3..=12).flat_map(|a| (3..=12).map(move |b| [a, b]));
    // Short version: all squares, and rectangles of each parity in both orientations.
    let some = [[3, 4], [4, 6], [5, 3], [6, 5], [7, 9], [8, 7], [8, 4], [9, 6]];
    let boards = all.filter(|n| long || n[0] == n[1] || some.contains(n));
    let (mut boards_read, mut pictures) = (0, 0);
    for (k, n) in boards.enumerate() {
        pictures += check(n, if k % 2 == 0 { "black" } else { "white" });
        boards_read += 1;
    }
    println!("{pictures} pictures of {boards_read} boards");
    assert_eq!(pictures, 8 * if long { 100 } else { 18 });
}
