//! In: skeleton pixels. Out: the straight lines among them, found by votes in whole numbers and refined on their
//! pixels. Frame and unit: image pixels; a line is x cos(angle) + y sin(angle) = distance, angle in radians, 0..pi.

use crate::fault::{Fault, Result};
use crate::gpu::Access::*;
use crate::gpu::{Binding, Device, Stage, Workload, run_once};
use crate::stages::listing;

/// Votes of skeleton pixels for the lines through them; one invocation per pixel.
pub const STAGE: Stage = Stage {
    name: "hough",
    wgsl: include_str!("../../../shaders/hough.wgsl"),
    shared: &[listing::SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "header", access: Read },
        Binding { name: "pixels", access: Texels },
        Binding { name: "table", access: Read },
        Binding { name: "votes", access: ReadWrite },
    ],
    uniform: crate::stages::frame::uniform_fields!(HoughFrame: middle_x, middle_y, angles, cells),
    overrides: &[],
};

/// The WGSL struct of the same name, shaders/hough.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct HoughFrame {
    /// Half the picture's width, px, rounded down.
    pub middle_x: i32,
    /// Half the picture's height, px, rounded down.
    pub middle_y: i32,
    /// Directions of the line's normal in half a turn, starting at the x axis.
    pub angles: u32,
    /// Number of distances per angle, one px each; the middle one is a line through the picture's middle.
    pub cells: u32,
}

/// Settings of the line search.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HoughParams {
    /// Angles in half a turn, 45..=1440; more than the longer edge in pixels gives no gain.
    pub angles: u32,
    /// Least number of pixels in a line, 2..=65535.
    pub least_pixels: u32,
    /// Largest number of lines, 1..=64.
    pub most: usize,
    /// Distance within which a pixel belongs to a line, 0.5..=20 px.
    pub near_px: f64,
}

impl Default for HoughParams {
    fn default() -> Self {
        HoughParams { angles: 360, least_pixels: 40, most: 4, near_px: 2.0 }
    }
}

impl HoughParams {
    /// Refuses values out of their range.
    pub fn check(&self) -> Result<()> {
        for (name, value, low, high) in [
            ("angles", f64::from(self.angles), 45.0, 1440.0),
            ("least_pixels", f64::from(self.least_pixels), 2.0, 65535.0),
            ("most", self.most as f64, 1.0, 64.0),
            ("near_px", self.near_px, 0.5, 20.0),
        ] {
            if !(low..=high).contains(&value) {
                return Err(Fault::usage(format!("hough {name} is {value}, it must be in {low}..={high}"))
                    .next("correct [extraction] in station.toml"));
            }
        }
        Ok(())
    }
}

/// A straight line x cos(angle) + y sin(angle) = distance.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Line {
    /// Angle of the normal, from x towards y, rad, 0..pi.
    pub angle: f64,
    /// Distance from pixel (0, 0) along the normal, px; negative if the line lies on the other side.
    pub distance_px: f64,
    /// Number of pixels that belong to it.
    pub pixels: u32,
    /// Standard deviation of those pixels across the line, px.
    pub spread_px: f64,
}

impl HoughFrame {
    /// The layout for pictures of `width` x `height` px.
    pub fn new(width: u32, height: u32, p: &HoughParams) -> HoughFrame {
        // The farthest pixel from the middle, in both directions, and one cell for rounding.
        let reach = (f64::from(width / 2 + 1).hypot(f64::from(height / 2 + 1))).ceil() as u32 + 1;
        HoughFrame {
            middle_x: (width / 2) as i32,
            middle_y: (height / 2) as i32,
            angles: p.angles,
            cells: 2 * reach + 1,
        }
    }
    /// Cosines and sines in units of 1 / 16384: whole numbers, so that GPU and CPU vote for the same cell.
    pub fn table(&self) -> Vec<[i32; 2]> {
        (0..self.angles)
            .map(|k| {
                let (s, c) = (std::f64::consts::PI * f64::from(k) / f64::from(self.angles)).sin_cos();
                [(16384.0 * c).round() as i32, (16384.0 * s).round() as i32]
            })
            .collect()
    }
    /// Cell of a pixel at an angle.
    fn cell(&self, pixel: u32, k: usize, [c, s]: [i32; 2]) -> usize {
        let (x, y) = ((pixel & 0xffff) as i32 - self.middle_x, (pixel >> 16) as i32 - self.middle_y);
        k * self.cells as usize + (((x * c + y * s + 8192) >> 14) + self.cells as i32 / 2) as usize
    }
}

/// CPU twin of the vote: one shot's pixels, x | y << 16.
pub fn votes(frame: &HoughFrame, pixels: &[u32]) -> Vec<u32> {
    let mut votes = vec![0; (frame.angles * frame.cells) as usize];
    let table = frame.table();
    for &pixel in pixels {
        for (k, &t) in table.iter().enumerate() {
            votes[frame.cell(pixel, k, t)] += 1;
        }
    }
    votes
}

/// Largest size of the votes in one run, bytes; every adapter can bind that much.
const RUN_BYTES: usize = 64 << 20;

/// The votes of each shot's pixels, from the stage on a GPU or from its twin, which gives the same numbers.
pub fn vote(device: Option<&Device>, frame: &HoughFrame, shots: &[Vec<u32>]) -> Result<Vec<Vec<u32>>> {
    let Some(device) = device else { return Ok(shots.iter().map(|pixels| votes(frame, pixels)).collect()) };
    let each = (frame.angles * frame.cells) as usize;
    let pipeline = STAGE.pipeline(device, &[])?;
    let mut out = Vec::new();
    for run in shots.chunks((RUN_BYTES / 4 / each).max(1)) {
        let points: Vec<[u32; 2]> =
            run.iter().enumerate().flat_map(|(i, pixels)| pixels.iter().map(move |&p| [p, i as u32])).collect();
        let n = points.len() as u32;
        let load = Workload {
            bindings: vec![
                bytemuck::bytes_of(frame).to_vec(),
                bytemuck::cast_slice(&[0, 0, 0, n]).to_vec(),
                bytemuck::cast_slice(&points).to_vec(),
                bytemuck::cast_slice(&frame.table()).to_vec(),
                vec![0; 4 * each * run.len()],
            ],
            groups: STAGE.groups([n.max(1), 1, 1]),
        };
        let bytes = run_once(device, &pipeline, &load)?.pop().expect("the votes");
        out.extend(bytemuck::pod_collect_to_vec::<u8, u32>(&bytes).chunks_exact(each).map(<[u32]>::to_vec));
    }
    Ok(out)
}

/// Lines of one shot, the one with most votes first. Each is refined by total least squares on the pixels near it. The
/// votes of these pixels are then removed, so that no line is found twice. `votes` come from the stage or its twin.
pub fn lines(frame: &HoughFrame, mut votes: Vec<u32>, pixels: &[u32], p: &HoughParams) -> Vec<Line> {
    let table = frame.table();
    let mut left: Vec<u32> = pixels.to_vec();
    let mut found = Vec::new();
    while found.len() < p.most {
        // The first of several equal cells, so that the result does not depend on the machine.
        let Some((at, &most)) = votes.iter().enumerate().rev().max_by_key(|(_, v)| **v) else { break };
        if most == 0 {
            break;
        }
        let [c, s] = table[at / frame.cells as usize].map(|v| f64::from(v) / 16384.0);
        let distance = (at % frame.cells as usize) as f64 - f64::from(frame.cells / 2)
            + c * f64::from(frame.middle_x)
            + s * f64::from(frame.middle_y);
        let mut line = (c, s, distance);
        // A cell is one pixel and half an angle step wide; three fits converge to the line of the pixels.
        let mut members = Vec::new();
        let mut fit = None;
        for _ in 0..3 {
            members = near(&left, line, p.near_px);
            let Some((next, spread)) = total_least_squares(&members) else { break };
            line = next;
            fit = Some(spread);
        }
        let pixels = members.len() as u32;
        let gone = if members.is_empty() { near(&left, line, 1.0) } else { members };
        if let (Some(spread_px), true) = (fit, pixels >= p.least_pixels) {
            let (mut angle, mut distance_px) = (line.1.atan2(line.0), line.2);
            if angle < 0.0 {
                (angle, distance_px) = (angle + std::f64::consts::PI, -distance_px);
            }
            found.push(Line { angle, distance_px, pixels, spread_px });
        } else if most < p.least_pixels {
            break;
        }
        if gone.is_empty() {
            votes[at] = 0;
        }
        for &pixel in &gone {
            for (k, &t) in table.iter().enumerate() {
                let cell = &mut votes[frame.cell(pixel, k, t)];
                *cell = cell.saturating_sub(1);
            }
        }
        left.retain(|pixel| !gone.contains(pixel));
    }
    found
}

fn xy(pixel: u32) -> (f64, f64) {
    (f64::from(pixel & 0xffff), f64::from(pixel >> 16))
}

fn near(pixels: &[u32], (c, s, distance): (f64, f64, f64), within: f64) -> Vec<u32> {
    let off = |p: u32| (xy(p).0 * c + xy(p).1 * s - distance).abs();
    pixels.iter().copied().filter(|&p| off(p) <= within).collect()
}

/// The line with the least squared distances: its normal is the smaller axis of the pixels' scatter.
fn total_least_squares(pixels: &[u32]) -> Option<((f64, f64, f64), f64)> {
    if pixels.len() < 2 {
        return None;
    }
    let n = pixels.len() as f64;
    let (mx, my) = pixels.iter().fold((0.0, 0.0), |m, &p| (m.0 + xy(p).0 / n, m.1 + xy(p).1 / n));
    let (mut xx, mut xy_sum, mut yy) = (0.0, 0.0, 0.0);
    for &p in pixels {
        let (dx, dy) = (xy(p).0 - mx, xy(p).1 - my);
        xx += dx * dx;
        xy_sum += dx * dy;
        yy += dy * dy;
    }
    let along = 0.5 * (2.0 * xy_sum).atan2(xx - yy);
    let (c, s) = (-along.sin(), along.cos());
    let across = xx * c * c + 2.0 * xy_sum * c * s + yy * s * s;
    Some(((c, s, c * mx + s * my), (across.max(0.0) / n).sqrt()))
}

pub(crate) fn stage_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let frame: HoughFrame = *bytemuck::from_bytes(bytemuck::cast_slice(&b[0]));
    let [_, header, points, table, votes] = b else { unreachable!() };
    let table: &[[i32; 2]] = bytemuck::cast_slice(table);
    for point in points.chunks_exact(2).take(header[listing::COUNT] as usize) {
        for (k, &t) in table.iter().enumerate() {
            votes[(point[1] * frame.angles * frame.cells) as usize + frame.cell(point[0], k, t)] += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of a straight line as they are after thinning.
    fn drawn(angle: f64, distance: f64, width: u32, height: u32) -> Vec<u32> {
        let (s, c) = angle.sin_cos();
        let mut pixels = Vec::new();
        for i in 0..width.max(height) {
            let t = f64::from(i);
            let (x, y) = if s.abs() > c.abs() { (t, (distance - t * c) / s) } else { ((distance - t * s) / c, t) };
            let (x, y) = (x.round(), y.round());
            if (0.0..f64::from(width)).contains(&x) && (0.0..f64::from(height)).contains(&y) {
                pixels.push(x as u32 | (y as u32) << 16);
            }
        }
        pixels
    }

    #[test]
    fn two_lines_in_specks_are_found_below_a_cell() {
        let truth = [(1.2345, 300.4), (2.9, -310.7)];
        let mut pixels: Vec<u32> = truth.iter().flat_map(|&(a, d)| drawn(a, d, 640, 480)).collect();
        let mut noise = crate::stages::noise::Noise(5);
        pixels.extend((0..300).map(|_| (noise.next() % 640) | ((noise.next() % 480) << 16)));
        let p = HoughParams { most: 2, ..Default::default() };
        let frame = HoughFrame::new(640, 480, &p);
        let found = lines(&frame, votes(&frame, &pixels), &pixels, &p);
        assert_eq!(found.len(), 2);
        for (angle, distance) in truth {
            let line = found.iter().find(|l| (l.angle - angle).abs() < 0.01).expect("both lines");
            // Rounding to pixels has an error of 0.29 px rms, averaged over about 500 pixels.
            assert!((line.angle - angle).abs() < 5e-4 && (line.distance_px - distance).abs() < 0.15, "{line:?}");
        }
    }

    #[test]
    fn specks_alone_are_no_line() {
        let mut noise = crate::stages::noise::Noise(6);
        let pixels: Vec<u32> = (0..200).map(|_| (noise.next() % 640) | ((noise.next() % 480) << 16)).collect();
        let p = HoughParams::default();
        let frame = HoughFrame::new(640, 480, &p);
        assert!(lines(&frame, votes(&frame, &pixels), &pixels, &p).is_empty());
    }
}
