//! In: the skeleton pixels of a picture. Out: those that belong to long pieces. Spots and their reflections are short,
//! and can have more pixels than the stripe. Frame and unit: pixels.

use glam::Vec2;
use std::collections::HashMap;

/// Pixels this near belong to one piece, px: thinning leaves gaps of a pixel.
const NEAR: i32 = 2;

/// The pixels of pieces that reach over `least` px or more in direction `along`, in their order. A pixel is
/// x | y << 16. The number of a piece's pixels would not do: the skeleton of a spot branches.
pub(super) fn long_pieces(pixels: &[u32], along: Vec2, least: f32) -> Vec<u32> {
    let index: HashMap<u32, usize> = pixels.iter().enumerate().map(|(i, &p)| (p, i)).collect();
    let mut piece = vec![usize::MAX; pixels.len()];
    let mut lengths = Vec::new();
    for first in 0..pixels.len() {
        if piece[first] != usize::MAX {
            continue;
        }
        let number = lengths.len();
        let mut open = vec![first];
        piece[first] = number;
        let (mut from, mut to) = (f32::INFINITY, f32::NEG_INFINITY);
        while let Some(i) = open.pop() {
            let (x, y) = ((pixels[i] & 0xffff) as i32, (pixels[i] >> 16) as i32);
            let at = along.dot(Vec2::new(x as f32, y as f32));
            (from, to) = (from.min(at), to.max(at));
            let near = (-NEAR..=NEAR).flat_map(|dy| (-NEAR..=NEAR).map(move |dx| (x + dx, y + dy)));
            for (x, y) in near.filter(|&(x, y)| x >= 0 && y >= 0) {
                if let Some(&j) = index.get(&(x as u32 | (y as u32) << 16))
                    && piece[j] == usize::MAX
                {
                    piece[j] = number;
                    open.push(j);
                }
            }
        }
        lengths.push(to - from + 1.0);
    }
    pixels.iter().zip(&piece).filter(|(_, n)| lengths[**n] >= least).map(|(p, _)| *p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_measured_along_the_stripe_and_a_gap_of_a_pixel_is_none() {
        let at = |x: u32, y: u32| x | y << 16;
        let line: Vec<u32> = (0..20).filter(|x| x % 5 != 3).map(|x| at(x, 100 + x / 2)).collect();
        // Many pixels, but short: seven columns.
        let spot: Vec<u32> = (0..7).flat_map(|x| (0..5).map(move |y| at(40 + x, 100 + y))).collect();
        let mut all = spot.clone();
        all.extend(&line);
        let long = |least| long_pieces(&all, Vec2::X, least);
        assert_eq!((long(8.0), long(7.0)), (line.clone(), all.clone()));
        assert!(long(21.0).is_empty());
        // Down the picture the line reaches over ten rows.
        assert_eq!(long_pieces(&all, Vec2::Y, 6.0), line);
        // Three columns apart: two pieces.
        let apart = [at(0, 0), at(3, 0)];
        assert!(long_pieces(&apart, Vec2::X, 2.0).is_empty() && long_pieces(&[], Vec2::X, 1.0).is_empty());
    }
}
