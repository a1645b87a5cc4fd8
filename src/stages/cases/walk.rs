//! In: a scene. Out: the result of the chain on the twins, with the table from which the GPU's recording is made; the
//! cases of each of its stages. Frame and unit: words of the stages' bindings.

use super::scenes::{Scene, scenes};
use crate::raster::Image;
use crate::stages::chain::table::{self, BUFFERS, FRAME, HEADER, HEADERS, Placed};
use crate::stages::entry::Case;
use crate::stages::frame::Frame;
use crate::stages::step::Groups;
use crate::stages::stripe::{lengthen, skeleton, threshold};
use std::collections::BTreeMap;

/// The cases of one stage over all scenes.
pub fn of(stage: &str) -> Vec<Case> {
    scenes().iter().flat_map(|s| Walk::new(s).run(stage)).collect()
}

/// A run of the chain on the twins, buffer by buffer.
pub struct Walk<'a> {
    scene: &'a Scene,
    /// Layout and settings of the scene's batch.
    pub frame: Frame,
    /// Words of every buffer, by the names in [`crate::stages::chain::table`].
    pub buffers: BTreeMap<&'static str, Vec<u32>>,
    captured: Vec<Case>,
    wanted: &'a str,
}

impl<'a> Walk<'a> {
    /// Packs the scene's pictures and settings into their buffers; every other buffer is 0.
    pub fn new(scene: &'a Scene) -> Walk<'a> {
        let first = &scene.shots[0];
        let mut f = Frame::new(first.width, first.height, first.bits, scene.shots.len() as u32, &scene.params)
            .expect("scenes are valid");
        f.flags |= scene.flags;
        f.lengthen = lengthen::LengthenParams::default().word(3.0);
        f.spacing = scene.spacing;
        let pack = |images: &[Image]| {
            let mut bytes = vec![0u8; f.image_bytes() * images.len()];
            for (image, out) in images.iter().zip(bytes.chunks_exact_mut(f.image_bytes())) {
                f.pack_image(image, out).expect("scenes are valid");
            }
            bytemuck::pod_collect_to_vec::<u8, u32>(&bytes)
        };
        let mut buffers: BTreeMap<_, _> = BUFFERS.iter().map(|(n, words)| (*n, vec![0; words(&f) as usize])).collect();
        let region = buffers["roi"].len();
        buffers.extend([
            ("image", pack(&scene.shots)),
            ("ambient", pack(scene.ambient.as_slice())),
            ("roi", (0..region).map(|i| if i % 5 < 3 { 0x00ff_fff0 } else { 0 }).collect()),
            ("weights", threshold::gaussian_weights(f.size).iter().map(|w| w.to_bits()).collect()),
            ("header", vec![0; skeleton::HEADER + f.shots as usize + 1]),
            ("pixels", vec![0; 2 * f.capacity as usize]),
        ]);
        Walk { scene, frame: f, buffers, captured: Vec::new(), wanted: "" }
    }

    /// The buffer and the range of words that a name means.
    fn words(&self, name: &'static str) -> (&'static str, std::ops::Range<usize>) {
        match HEADERS.iter().find(|h| h.0 == name) {
            Some((_, of, at)) => (of, *at as usize..(at + HEADER) as usize),
            None => (name, 0..self.buffers[name].len()),
        }
    }

    fn read(&self, name: &'static str) -> Vec<u32> {
        let (of, range) = self.words(name);
        self.buffers[of][range].to_vec()
    }

    fn step(&mut self, placed: &Placed) {
        let (f, stage) = (Frame { step: placed.iteration, ..self.frame }, placed.step.stage);
        let overrides = table::overrides(&placed.step, &f, self.scene.shots[0].bits, self.scene.thinning);
        let uniform = || bytemuck::cast_slice::<Frame, u32>(&[f]).to_vec();
        let bound = |name: &&'static str| if *name == FRAME { uniform() } else { self.read(name) };
        let mut bindings: Vec<Vec<u32>> = placed.binds.iter().map(bound).collect();
        if stage.name == self.wanted {
            let groups = match placed.groups {
                Groups::Of(groups) => groups(&f),
                Groups::Listed(header) => [self.read(header)[0].max(1), 1, 1],
            };
            let name = format!("{}, sub-iteration {}", self.scene.name, placed.iteration);
            let case = Case { name, overrides: overrides.clone(), bindings: bindings.clone(), groups };
            self.captured.push(case);
        }
        (placed.step.twin)(&mut bindings, &overrides);
        for (name, words) in placed.binds.iter().zip(bindings).filter(|(name, _)| **name != FRAME) {
            let (of, range) = self.words(name);
            self.buffers.get_mut(of).expect("it was read")[range].copy_from_slice(&words);
        }
    }

    fn steps(&mut self, steps: &[Placed]) {
        steps.iter().for_each(|s| self.step(s));
    }

    /// Runs the chain and returns the cases of the stage of that name. With an empty name it only runs the chain.
    pub fn run(&mut self, wanted: &'a str) -> Vec<Case> {
        self.wanted = wanted;
        self.steps(&table::prepare(self.scene.ambient.is_some()));
        self.steps(&table::front(&self.frame));
        self.thin();
        self.steps(&table::back(&self.frame));
        // The steps with which the next batch starts on the results of this one.
        let next: Vec<Placed> = table::front(&self.frame).into_iter().take(2).collect();
        let left = (self.buffers.clone(), self.frame);
        self.steps(&next);
        (self.buffers, self.frame) = left;
        std::mem::take(&mut self.captured)
    }

    /// Rounds of thinning until nothing changes.
    fn thin(&mut self) {
        for _ in 0..8 {
            for section in table::thinning() {
                self.steps(&section);
                let shortened = section.last().expect("it ends with a shortened list").binds[4];
                if self.read(shortened)[3] == 0 {
                    return self.restarted();
                }
            }
            self.steps(&table::restart());
        }
    }

    /// Tries the steps before a further round even if one round was enough; their results are discarded.
    fn restarted(&mut self) {
        let left = self.buffers.clone();
        self.steps(&table::restart());
        self.buffers = left;
    }
}
