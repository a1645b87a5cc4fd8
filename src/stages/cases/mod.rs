//! In: pictures chosen to break things. Out: the buffers of every stage of the chain at the moment it
//! runs, made by walking the chain on the CPU twins. Frame and unit: pixels, words.

mod peaks;

pub use peaks::{Space, peaks, ruled};

use super::entry::Case;
use super::frame::{self, Frame, px_log2};
use super::*;
use crate::camera::{Distortion, Intrinsics};
use crate::geometry::{Plane, Vec3};
use crate::raster::Image;
use std::collections::BTreeMap;

/// Pictures of one batch with their settings.
#[derive(Clone, Debug)]
pub struct Scene {
    pub name: &'static str,
    pub shots: Vec<Image>,
    pub params: ThresholdParams,
    pub thinning: Thinning,
    pub flags: u32,
    pub ambient: Option<Image>,
}

/// A small generator of repeatable noise (a permuted congruential generator would do no better here).
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as u32
    }
    /// About normal, mean 0, sigma 1.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| f64::from(self.next() % 65536) / 65536.0).sum::<f64>() - 6.0
    }
}

/// One curved Gaussian stripe of the given sigma on noise, with a few round reflections.
pub fn stripe(width: u32, height: u32, bits: u8, sigma: f64, blobs: u32, seed: u64) -> Image {
    let mut noise = Noise(seed);
    let full = f64::from((1u32 << bits) - 1);
    let spots: Vec<(f64, f64, f64)> = (0..blobs)
        .map(|_| (f64::from(noise.next() % width), f64::from(noise.next() % height), 2.0 + f64::from(noise.next() % 8)))
        .collect();
    let mut px = Vec::with_capacity((width * height) as usize);
    for y in 0..height {
        for x in 0..width {
            let t = f64::from(x) / f64::from(width);
            let centre =
                f64::from(height) * (0.5 + 0.2 * (5.0 * t + seed as f64).sin() + if t > 0.6 { 0.1 } else { 0.0 });
            let d = (f64::from(y) - centre) / sigma;
            let mut v = 0.7 * (-0.5 * d * d).exp();
            for &(bx, by, r) in &spots {
                let d2 = ((f64::from(x) - bx).powi(2) + (f64::from(y) - by).powi(2)) / (r * r);
                if d2 < 9.0 {
                    v += 0.9 * (-0.5 * d2).exp();
                }
            }
            let read = 0.008 * noise.normal() + (0.0003 * v.max(0.0)).sqrt() * noise.normal();
            px.push((full * (0.04 + v + read)).round().clamp(0.0, full) as u16);
        }
    }
    image(width, height, bits, px)
}

/// Any picture from a function of the pixel.
pub fn drawn(width: u32, height: u32, bits: u8, mut f: impl FnMut(u32, u32) -> u32) -> Image {
    let px = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| f(x, y) as u16).collect();
    image(width, height, bits, px)
}

/// Faint noise with one brighter pixel in every other tile of every other row of tiles, on the picture's border where the
/// tile has one, some of them two, and each as bright as the threshold or one level beside it.
fn specks(width: u32, height: u32, bits: u8) -> Image {
    let mut noise = Noise(31);
    let grey = |level: u32| level << (bits - 8);
    drawn(width, height, bits, |x, y| {
        let (tx, ty) = (x / 32, y / 8);
        let at = |n: u32, first: u32, size: u32, last: u32| (first + n % size).min(last - 1);
        let place = |k: u32| (at(tx * 13 + ty * 5 + k, 32 * tx, 32, width), at(tx * 3 + ty * 7 + k, 8 * ty, 8, height));
        let spot = (tx + ty) % 2 == 0 && ((x, y) == place(0) || tx % 3 == 0 && (x, y) == place(1));
        let border = [(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)].contains(&(x, y));
        let background = grey(10) + noise.next() % grey(2);
        if spot || border { background + grey(8) + tx % 3 * grey(1) / 2 } else { background }
    })
}

fn image(width: u32, height: u32, bits: u8, px: Vec<u16>) -> Image {
    if bits == 8 {
        Image::from_u8(width, height, px.iter().map(|&v| v as u8).collect())
    } else {
        Image::from_u16(width, height, bits, px)
    }
}

/// The pictures of the stage tests: real shapes, odd sizes, both depths, and adversarial ones.
pub fn scenes() -> Vec<Scene> {
    let base = Scene {
        name: "",
        shots: Vec::new(),
        params: ThresholdParams::default(),
        thinning: Thinning::ZhangSuen,
        flags: 0,
        ambient: None,
    };
    let p = |size, offset, minimum| ThresholdParams { size, offset, minimum, ..Default::default() };
    let mut noise = Noise(7);
    let mut grain = Noise(99);
    vec![
        Scene {
            name: "two stripes of 641 x 479",
            shots: vec![stripe(641, 479, 8, 2.5, 3, 1), stripe(641, 479, 8, 4.0, 0, 2)],
            ..base.clone()
        },
        Scene {
            name: "12 bits, Guo-Hall, ambient",
            shots: vec![stripe(203, 150, 12, 3.0, 2, 3)],
            params: p(25, 120, 300),
            thinning: Thinning::GuoHall,
            ambient: Some(drawn(203, 150, 12, |x, y| (x * 7 + y * 13) % 160)),
            ..base.clone()
        },
        Scene {
            name: "16 bits, saturated, window 101",
            shots: vec![drawn(130, 90, 16, |x, y| if (x / 9 + y / 5) % 3 == 0 { 65535 } else { 40000 + x * 50 })],
            params: p(101, 500, 0),
            ..base.clone()
        },
        Scene {
            name: "noise, every tile",
            shots: vec![drawn(97, 69, 8, |_, _| noise.next() % 256)],
            params: p(3, 0, 0),
            flags: frame::ALL_TILES,
            ..base.clone()
        },
        Scene {
            name: "checkers",
            shots: vec![drawn(160, 64, 8, |x, y| if (x + y) % 2 == 0 { 200 } else { 10 })],
            params: p(5, -3, 0),
            ..base.clone()
        },
        Scene {
            name: "all bright, negative offset",
            shots: vec![drawn(64, 40, 8, |_, _| 255)],
            params: p(11, -1, 0),
            ..base.clone()
        },
        Scene {
            name: "stripes on tile borders, region of interest",
            shots: vec![drawn(256, 128, 8, |x, y| if x % 32 < 2 || y % 8 == 7 { 220 } else { 20 })],
            params: p(31, 20, 40),
            flags: frame::HAS_ROI,
            ..base.clone()
        },
        Scene {
            name: "specks at all borders",
            shots: vec![specks(229, 122, 8), specks(229, 122, 8)],
            params: p(31, 8, 0),
            ..base.clone()
        },
        Scene {
            name: "deep specks, window 9, region of interest",
            shots: vec![specks(170, 99, 12)],
            params: p(9, 124, 160),
            flags: frame::HAS_ROI,
            ..base.clone()
        },
        Scene {
            // 9 (25 - 4) is 9 * 20 + 5 + 4: one level brighter would pass.
            name: "specks that just do not pass",
            shots: vec![drawn(96, 40, 8, |x, y| if x % 64 == 17 && y % 16 == 3 { 25 + y / 32 } else { 20 })],
            params: p(3, 4, 0),
            ..base.clone()
        },
        Scene {
            name: "Gaussian window",
            shots: vec![stripe(320, 200, 8, 3.0, 2, 5)],
            params: ThresholdParams { window: Window::Gaussian, size: 31, offset: 6, minimum: 0 },
            ..base.clone()
        },
        Scene {
            name: "Gaussian window of 7 on deep noise",
            shots: vec![drawn(70, 50, 10, |_, _| grain.next() % 1024)],
            params: ThresholdParams { window: Window::Gaussian, size: 7, offset: 20, minimum: 30 },
            ..base.clone()
        },
        Scene { name: "one pixel", shots: vec![drawn(1, 1, 8, |_, _| 9)], params: p(3, -1, 0), ..base },
    ]
}

/// A camera of 55 degrees with a common lens, a sheet that crosses its axis at 155 mm.
pub fn optics(width: u32, height: u32) -> point::Optics {
    let f = 0.96 * width as f32;
    point::Optics {
        pinhole: [f, f, 0.49 * width as f32, 0.51 * height as f32, 0.0],
        distortion: [-0.118, 0.086, 0.00062, -0.00041, -0.017, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        untilt: point::FLAT,
        normal: [-0.0192, 0.8828, 0.4694],
        offset: 72.15,
    }
}

/// The same with all of a lens's terms on a sensor that is tilted by 11 and 7 degrees.
fn tilted(width: u32, height: u32) -> point::Optics {
    let k = Intrinsics {
        fx: 0.96 * f64::from(width),
        fy: 0.97 * f64::from(width),
        cx: 0.49 * f64::from(width),
        cy: 0.51 * f64::from(height),
        skew: 0.4,
        distortion: Distortion([0.3, -0.1, 6e-4, -4e-4, 0.01, 0.5, 0.04, 0.02, 2e-3, -1e-3, -2e-3, 1e-3, 0.19, -0.12]),
        width,
        height,
    };
    point::Optics::new(&k, &Plane::new(Vec3::new(-0.0192, 0.8828, 0.4694), 72.15).expect("a normal"))
}

/// A turned pose some way off the base, another one a shot.
pub fn pose(shot: u32) -> [f32; 12] {
    let (s, c) = (0.3 + 0.1 * shot as f32).sin_cos();
    [c, -s, 0.0, 420.0, s, c, 0.0, -60.0 + shot as f32, 0.0, 0.0, 1.0, 310.0]
}

/// The cases of one stage over all scenes.
pub fn of(stage: &str) -> Vec<Case> {
    scenes().iter().flat_map(|s| Walk::new(s).run(stage)).collect()
}

/// The chain on the twins, buffer by buffer.
pub struct Walk<'a> {
    scene: &'a Scene,
    pub frame: Frame,
    pub buffers: BTreeMap<&'static str, Vec<u32>>,
    captured: Vec<Case>,
    wanted: &'a str,
}

impl<'a> Walk<'a> {
    pub fn new(scene: &'a Scene) -> Walk<'a> {
        let first = &scene.shots[0];
        let mut f = Frame::new(first.width, first.height, first.bits, scene.shots.len() as u32, &scene.params)
            .expect("scenes are valid");
        f.flags |= scene.flags;
        let pack = |images: &[Image]| {
            let mut bytes = vec![0u8; f.image_bytes() * images.len()];
            for (image, out) in images.iter().zip(bytes.chunks_exact_mut(f.image_bytes())) {
                f.pack_image(image, out).expect("scenes are valid");
            }
            bytemuck::pod_collect_to_vec::<u8, u32>(&bytes)
        };
        let (tiles, rows) = (f.tiles() as usize, (f.tiles_y * f.shots) as usize);
        let per_shot = (f.tiles_x * f.tiles_y * 8) as usize;
        let weights = threshold::gaussian_weights(f.size).iter().map(|w| w.to_bits()).collect();
        let header = listing::HEADER_WORDS as usize;
        let buffers = BTreeMap::from([
            ("image", pack(&scene.shots)),
            ("ambient", pack(scene.ambient.as_slice())),
            ("stats", vec![0; 4 * tiles]),
            ("roi", (0..per_shot).map(|i| if i % 5 < 3 { 0x00ff_fff0 } else { 0 }).collect()),
            ("first", vec![7; 2 * header]),
            ("all_active", [7, 7, 0, 0, 0, 0, 0, 0].iter().flat_map(|&n| vec![n; header]).collect()),
            ("listing", vec![0, 1, 1, 0]),
            ("single_listing", vec![0, 1, 1, 0]),
            ("singles", vec![0; 2 * tiles]),
            ("run_listing", vec![0, 1, 1, 0]),
            ("runs", vec![0; 2 * tiles]),
            ("runs_first", vec![7; 4]),
            ("lit_listing", vec![0, 1, 1, 0]),
            ("lit_list", vec![0; tiles]),
            ("lit_first", vec![7; 4]),
            ("active", vec![0, 1, 1, 0]),
            ("active_list", vec![0; tiles]),
            ("weights", weights),
            ("quads", vec![0; 8 * tiles]),
            ("mask", vec![0; 8 * tiles]),
            ("other_mask", vec![0; 8 * tiles]),
            ("lit", vec![0; 8 * tiles]),
            ("stamps", vec![0; tiles]),
            ("long", vec![0; 8 * tiles]),
            ("counts", vec![0; tiles]),
            ("starts", vec![0; tiles]),
            ("rows", vec![0; rows]),
            ("row_starts", vec![0; rows]),
            ("totals", vec![0; f.shots as usize]),
            ("header", vec![0; skeleton::HEADER + f.shots as usize + 1]),
            ("points", vec![0; 2 * f.capacity as usize]),
        ]);
        f.lengthen = lengthen::LengthenParams::default().word(3.0);
        Walk { scene, frame: f, buffers, captured: Vec::new(), wanted: "" }
    }

    fn step(
        &mut self,
        stage: &crate::gpu::Stage,
        twin: fn(&mut [Vec<u32>], &[(&'static str, f64)]),
        names: &[&'static str],
        groups: [u32; 3],
    ) {
        let all = [
            (frame::PX_LOG2, f64::from(px_log2(self.scene.shots[0].bits))),
            (threshold::RADIUS, f64::from(self.frame.size / 2)),
            (tiles::WEIGHTED, f64::from(u8::from(self.frame.flags & frame::GAUSSIAN != 0))),
            (thin::RULE, f64::from(self.scene.thinning.number())),
        ];
        let overrides: Vec<_> = all.into_iter().filter(|o| stage.overrides.contains(&o.0)).collect();
        let mut bindings = vec![bytemuck::cast_slice::<Frame, u32>(&[self.frame]).to_vec()];
        bindings.extend(names.iter().map(|n| self.buffers[n].clone()));
        if stage.name == self.wanted {
            let name = format!("{}, sub-iteration {}", self.scene.name, self.frame.step);
            self.captured.push(Case { name, overrides: overrides.clone(), bindings: bindings.clone(), groups });
        }
        twin(&mut bindings, &overrides);
        for (name, words) in names.iter().zip(bindings.into_iter().skip(1)) {
            self.buffers.insert(name, words);
        }
    }

    /// Walks the chain; gives the cases of the stage of that name. An empty name runs the chain only.
    pub fn run(&mut self, wanted: &'a str) -> Vec<Case> {
        self.wanted = wanted;
        let f = self.frame;
        let listed = |b: &BTreeMap<&'static str, Vec<u32>>, list: &str| [b[list][3].div_ceil(64).max(1), 1, 1];
        if self.scene.ambient.is_some() {
            self.step(&ambient::STAGE, ambient::twin, &["image", "ambient"], ambient::groups(&f));
        }
        self.step(&stats::STAGE, stats::twin, &["image", "stats"], stats::groups(&f));
        let names = ["stats", "roi", "listing", "single_listing", "singles", "run_listing", "runs"];
        self.step(&tiles::STAGE, tiles::twin, &names, tiles::groups(&f));
        if f.flags & frame::GAUSSIAN != 0 {
            let groups = listed(&self.buffers, "single_listing");
            let names = ["image", "single_listing", "singles", "weights", "quads"];
            self.step(&threshold::GAUSSIAN, threshold::stage_twin, &names, groups);
            let names = ["single_listing", "singles", "quads", "roi", "mask", "lit", "lit_listing", "lit_list"];
            self.step(&threshold::GATHER, threshold::gather_twin, &names, groups);
        } else {
            let groups = listed(&self.buffers, "single_listing");
            let out = ["mask", "lit", "lit_listing", "lit_list"];
            let names = [&["image", "single_listing", "singles", "roi"], &out[..], &["run_listing", "runs"]].concat();
            self.step(&specks::STAGE, specks::twin, &names, groups);
            let groups = listed(&self.buffers, "run_listing");
            let names = [&["image", "run_listing", "runs", "roi"], &out[..]].concat();
            self.step(&threshold::MEAN, threshold::mean_twin, &names, groups);
        }
        let all = listed(&self.buffers, "lit_listing");
        self.buffers.insert("active", self.buffers["lit_listing"].clone());
        self.buffers.insert("active_list", self.buffers["lit_list"].clone());
        while self.buffers["active"][3] > 0 {
            for step in 0..8 {
                self.frame.step = self.frame.step - self.frame.step % 8 + step;
                let masks = if step % 2 == 0 { ["mask", "other_mask"] } else { ["other_mask", "mask"] };
                let names = ["active", "active_list", masks[0], masks[1], "stamps"];
                let groups = listed(&self.buffers, "active");
                self.step(&thin::STAGE, thin::stage_twin, &names, groups);
            }
            self.frame.step += 1;
            self.buffers.insert("active", vec![0, 1, 1, 0]);
            let names = ["lit_listing", "lit_list", "stamps", "active", "active_list"];
            self.step(&listing::COMPACT, listing::compact_twin, &names, all);
        }
        let stamps = self.buffers["stamps"].clone();
        self.step(&listing::REBASE, listing::rebase_twin, &["lit_listing", "lit_list", "stamps"], all);
        self.buffers.insert("stamps", stamps);
        self.step(&lengthen::COPY, lengthen::copy_twin, &["lit_listing", "lit_list", "mask", "long"], all);
        let names = ["image", "lit_listing", "lit_list", "mask", "lit", "long"];
        self.step(&lengthen::STAGE, lengthen::stage_twin, &names, all);
        self.step(&skeleton::COUNT, skeleton::count_twin, &["lit_listing", "lit_list", "mask", "counts"], all);
        let groups = skeleton::rows_groups(&f);
        self.step(&skeleton::SCAN_ROWS, skeleton::scan_rows_twin, &["counts", "starts", "rows"], groups);
        let (names, groups) = (["rows", "row_starts", "totals"], skeleton::shots_groups(&f));
        self.step(&skeleton::SCAN_SHOTS, skeleton::scan_shots_twin, &names, groups);
        let names = ["totals", "listing", "all_active", "header"];
        self.step(&skeleton::HEAD, skeleton::head_twin, &names, groups);
        let names = ["lit_listing", "lit_list", "mask", "starts", "row_starts", "header", "points"];
        self.step(&skeleton::STAGE, skeleton::stage_twin, &names, all);
        if wanted == "clear" {
            let names = ["lit_listing", "lit_list", "mask", "other_mask", "lit", "stamps", "counts"];
            self.step(&listing::CLEAR, listing::clear_twin, &names, all);
        }
        self.frame.step = 1;
        self.step(&listing::RESET, listing::reset_twin, &["first", "lit_first", "runs_first", "all_active"], [1, 1, 1]);
        std::mem::take(&mut self.captured)
    }
}
