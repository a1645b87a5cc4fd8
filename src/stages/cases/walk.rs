//! In: a scene. Out: the chain on the twins, buffer by buffer; the cases of each of its stages.
//! Frame and unit: words of the stages' bindings.

use super::scenes::{Scene, scenes};
use crate::raster::Image;
use crate::stages::entry::Case;
use crate::stages::frame::{self, Frame, px_log2};
use crate::stages::listing;
use crate::stages::stripe::{ambient, lengthen, skeleton, specks, stats, thin, threshold, tiles};
use std::collections::BTreeMap;

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
