//! In: peaks of some shots, the places of their points, the points of the neighbouring shots. Out: the peaks' flags;
//! kept peaks with too few neighbours get [`Reject::Unsupported`]. Frame and unit: base frame in whole 2⁻¹⁴ mm (0.06
//! µm), so that the same neighbours are counted on every machine.

use super::params::SupportParams;
use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::stages::entry::Case;
use crate::stages::noise::Noise;
use crate::stages::peak::SHARED as PEAKS;
use crate::stages::peak::found::{Peak, Reject};

/// Flags of peaks after a comparison with the points of the neighbouring shots; one invocation per peak.
pub const STAGE: Stage = Stage {
    name: "support",
    wgsl: include_str!("../../../shaders/support.wgsl"),
    shared: &[PEAKS],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "shots", access: Read },
        Binding { name: "sites", access: Read },
        Binding { name: "places", access: Read },
        Binding { name: "peaks", access: Read },
        Binding { name: "flags", access: ReadWrite },
    ],
    uniform: crate::stages::frame::uniform_fields!(SupportFrame: peaks, sure, right_low, right_high, haze,
        reserved_0, reserved_1,
        reserved_2),
    overrides: &[],
};

/// The WGSL struct of the same name, shaders/support.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct SupportFrame {
    /// Number of peaks.
    pub peaks: u32,
    /// Limits of a clean peak, px: largest sigma of the centre, smallest and largest width.
    pub sure: f32,
    pub right_low: f32,
    pub right_high: f32,
    /// Share of the amplitude by which the level beside a peak may exceed the usual one.
    pub haze: f32,
    pub reserved_0: u32,
    pub reserved_1: u32,
    pub reserved_2: u32,
}

impl SupportFrame {
    /// `width_px` is the stripe's Gaussian sigma, px.
    pub fn new(p: &SupportParams, width_px: f32) -> SupportFrame {
        SupportFrame {
            sure: p.sure * width_px,
            right_low: p.right_width[0] * width_px,
            right_high: p.right_width[1] * width_px,
            haze: p.haze,
            ..SupportFrame::default()
        }
    }
}

/// Numbers that the peaks of one shot need, and the ranges of its two neighbours' points in the list of sites.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Neighbourhood {
    pub first: [u32; 2],
    pub end: [u32; 2],
    /// Largest distance of a neighbour, 2⁻¹⁴ mm, at most 1 m; and the number of bits dropped so that its square fits 30
    /// bits.
    pub reach: [i32; 2],
    pub drop: [u32; 2],
    /// Number of neighbours that a clean peak, a doubtful one and one in a glow need.
    pub clean: u32,
    pub doubtful: u32,
    pub hazy: u32,
    /// Median level beside the shot's kept peaks, grey levels.
    pub usual: f32,
}

/// A point (x, y, z) and its position along the line.
pub type Site = [i32; 4];

/// Differences of coordinates of at least this much, after the dropped bits, are out of reach; smaller ones can be
/// squared.
pub(in crate::stages) const FAR: i32 = 1 << 15;

/// Length in whole 2⁻¹⁴ mm, clamped to 32 m.
pub fn whole(mm: f64) -> i32 {
    (mm * 16_384.0).round().clamp(-536_870_912.0, 536_870_912.0) as i32
}

/// Reach of a neighbourhood and the number of bits to drop.
pub fn reach(mm: f64) -> (i32, u32) {
    let reach = whole(mm.clamp(0.0, 1000.0));
    (reach, (32 - reach.leading_zeros()).saturating_sub(15))
}

/// CPU twin for one peak: its flags. `shot` is the entry of its shot.
pub fn judge(f: &SupportFrame, shot: &Neighbourhood, sites: &[Site], p: &Site, k: &Peak) -> u32 {
    if !k.kept() {
        return k.flags;
    }
    let right = k.sigma_px <= f.sure && k.width_px >= f.right_low && k.width_px <= f.right_high;
    let need = match (k.background - shot.usual > f.haze * k.amplitude, right) {
        (true, _) => shot.hazy,
        (false, true) => shot.clean,
        (false, false) => shot.doubtful,
    };
    let mut found = 0;
    for side in 0..2 {
        let (reach, drop) = (shot.reach[side], shot.drop[side]);
        let sites = &sites[shot.first[side] as usize..shot.end[side] as usize];
        let r = (reach >> drop) as u32;
        let from = sites.partition_point(|s| s[3] < p[3] - reach);
        let near = |s: &&Site| {
            let d: [i32; 3] = std::array::from_fn(|i| (s[i] - p[i]) >> drop);
            d.iter().all(|d| d.abs() < FAR) && d.iter().map(|d| (d * d) as u32).sum::<u32>() <= r * r
        };
        // Neighbours are only counted up to the number needed.
        let missing = (need - found) as usize;
        let within = sites[from..].iter().take_while(|s| s[3] <= p[3] + reach);
        found += within.filter(near).take(missing).count() as u32;
    }
    if found < need { k.flags | Reject::Unsupported as u32 } else { k.flags }
}

/// CPU twin: the peaks of all shots of a run.
pub fn stage_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f: SupportFrame = *bytemuck::from_bytes(bytemuck::cast_slice(&b[0]));
    let [_, shots, sites, places, peaks, flags] = b else { unreachable!() };
    let (shots, sites): (&[Neighbourhood], &[Site]) = (bytemuck::cast_slice(shots), bytemuck::cast_slice(sites));
    let (places, peaks): (&[Site], &[Peak]) = (bytemuck::cast_slice(places), bytemuck::cast_slice(peaks));
    for i in 0..f.peaks as usize {
        flags[i] = judge(&f, &shots[peaks[i].shot as usize], sites, &places[i], &peaks[i]);
    }
}

/// Wavy shots with strays, doubtful, hazy and rejected peaks: shots close together, and shots 40 mm apart. A lattice
/// whose diagonals are just within reach, and one whose diagonals equal the reach: 0.25, 0.1875 and 0.3125 mm are whole
/// numbers of steps.
pub fn cases() -> Vec<Case> {
    let exact = (0.3125f64.powi(2) - 1.44 * 0.1875f64.powi(2)).sqrt() as f32;
    [
        ("0.35 mm apart", 0.35, 0.3, 1.0),
        ("40 mm apart, wide reach", 40.0, 8.0, 1.0),
        ("a lattice", 0.35, 0.0927, 0.0),
        ("a lattice on the radius", 0.1875, exact, 0.0),
    ]
    .map(|(name, step, radius, rough)| case(name, step, radius, rough))
    .into()
}

/// Shots `step` mm apart; the surface rises, and points stray, in proportion to `rough` mm.
fn case(name: &str, step: f64, radius: f32, rough: f64) -> Case {
    let mut noise = Noise(17);
    let p = SupportParams { radius_mm: Some(radius), ..Default::default() };
    let mut f = SupportFrame::new(&p, 1.0);
    let (mut shots, mut sites, mut places, mut peaks) = (vec![], vec![], vec![], vec![]);
    for shot in 0..5u32 {
        let first = places.len();
        for i in 0..150 {
            let (x, y) = (0.25 * f64::from(i), step * f64::from(shot));
            let stray = if noise.next().is_multiple_of(9) { 4.0 * noise.normal() } else { 0.02 * noise.normal() };
            let z = rough * ((x / 7.0).sin() + stray);
            let place = [1200.0 + x, y, z, 1200.0 + x].map(whole);
            let odd = f32::from(u8::from(noise.next().is_multiple_of(3)));
            places.push(place);
            peaks.push(Peak {
                amplitude: 100.0,
                background: if i % 11 == 0 { 40.0 } else { 3.0 },
                width_px: 1.0 + 0.4 * odd,
                sigma_px: 0.05,
                flags: if i % 17 == 0 { Reject::Faint as u32 } else { 0x100 * (i % 2) },
                shot,
                ..Peak::default()
            });
        }
        let from = sites.len();
        let kept = (first..places.len()).filter(|&i| peaks[i].kept());
        sites.extend(kept.map(|i| places[i]));
        sites[from..].sort_by_key(|s: &Site| s[3]);
        shots.push((from as u32, sites.len() as u32));
    }
    let table = neighbourhoods(&shots, (radius.powi(2) as f64 + 1.44 * step * step).sqrt());
    f.peaks = peaks.len() as u32;
    Case {
        name: name.into(),
        overrides: Vec::new(),
        groups: [f.peaks.div_ceil(64), 1, 1],
        bindings: vec![
            bytemuck::cast_slice(&[f]).to_vec(),
            bytemuck::cast_slice(&table).to_vec(),
            bytemuck::cast_slice(&sites).to_vec(),
            bytemuck::cast_slice(&places).to_vec(),
            bytemuck::cast_slice(&peaks).to_vec(),
            vec![0; peaks.len()],
        ],
    }
}

/// The neighbourhood of each shot: first and last site of both neighbours, and the reach, mm.
fn neighbourhoods(shots: &[(u32, u32)], mm: f64) -> Vec<Neighbourhood> {
    let (reach, drop) = reach(mm);
    let at = |i: i64| usize::try_from(i).ok().and_then(|i| shots.get(i)).copied().unwrap_or((0, 0));
    (0..shots.len() as i64)
        .map(|i| Neighbourhood {
            first: [at(i - 1).0, at(i + 1).0],
            end: [at(i - 1).1, at(i + 1).1],
            reach: [reach; 2],
            drop: [drop; 2],
            clean: 3,
            doubtful: 4,
            hazy: 6,
            usual: 3.0,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_neighbour_on_the_radius_counts_and_one_beyond_it_does_not() {
        let (reach, drop) = reach(0.3125);
        let shot =
            Neighbourhood { end: [1, 0], reach: [reach; 2], drop: [drop; 2], clean: 1, ..Neighbourhood::default() };
        let frame = SupportFrame::new(&SupportParams::default(), 1.0);
        let peak = Peak { amplitude: 100.0, width_px: 1.0, sigma_px: 0.05, ..Peak::default() };
        let fate = |x: f64| judge(&frame, &shot, &[[x, 0.1875, 0.0, x].map(whole)], &[0; 4], &peak);
        assert_eq!(fate(0.25), 0);
        assert_eq!(fate(0.25 + 1.0 / 16_384.0), Reject::Unsupported as u32);
    }
}
