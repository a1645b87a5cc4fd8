//! In: the chain's table, the layout of a batch. Out: its steps as recordings on a GPU, and the buffers that they
//! share. Frame and unit: bytes, words.

use super::config::ChainConfig;
use super::part::{Part, whole};
use super::table::{self, BUFFERS, FRAME, HEADER, HEADERS, Placed, ROUND};
use crate::fault::Result;
use crate::gpu::{Buffer, Device, Pipeline, Recording};
use crate::stages::frame::Frame;
use crate::stages::step::Groups;
use crate::stages::stripe::threshold::gaussian_weights;
use std::collections::BTreeMap;

/// Bytes from one uniform block to the next; every adapter can bind at multiples of this.
const STEP_BYTES: u64 = 256;

/// The chain's stages, compiled, and the buffers that all batches use one after the other.
pub struct Recorded {
    uniforms: Buffer,
    buffers: BTreeMap<&'static str, Buffer>,
    pipelines: BTreeMap<&'static str, Pipeline>,
    has_ambient: bool,
}

/// Buffers of one slot of the ring, by the table's names.
pub type Own<'a> = [(&'static str, &'a Buffer)];

impl Recorded {
    pub fn new(device: &Device, f: &Frame, config: &ChainConfig) -> Result<Recorded> {
        let uniforms = device.storage("uniforms", STEP_BYTES * u64::from(ROUND + 1))?;
        for step in 0..=ROUND {
            device.write(&uniforms, STEP_BYTES * u64::from(step), bytemuck::bytes_of(&Frame { step, ..*f }));
        }
        let has_ambient = config.ambient.is_some();
        let mut buffers = BTreeMap::new();
        for (name, words) in BUFFERS.iter().filter(|(name, _)| *name != "ambient" || has_ambient) {
            buffers.insert(*name, device.storage(name, 4 * u64::from(words(f)))?);
        }
        let mut pipelines = BTreeMap::new();
        let placed = [
            table::prepare(has_ambient),
            table::front(f),
            table::thinning().concat(),
            table::restart(),
            table::back(f),
        ];
        for Placed { step, .. } in placed.iter().flatten() {
            if !pipelines.contains_key(step.stage.name) {
                let overrides = table::overrides(step, f, config.bits, config.thinning);
                pipelines.insert(step.stage.name, step.stage.pipeline(device, &overrides)?);
            }
        }
        let recorded = Recorded { uniforms, buffers, pipelines, has_ambient };
        recorded.fill(device, f, config)?;
        Ok(recorded)
    }

    /// Writes the data that stays the same for all batches: region, weights, ambient light.
    fn fill(&self, device: &Device, f: &Frame, config: &ChainConfig) -> Result<()> {
        if let Some(region) = &config.region {
            device.write(self.buffer("roi"), 0, bytemuck::cast_slice(&f.pack_mask(region)));
        }
        device.write(self.buffer("weights"), 0, bytemuck::cast_slice(&gaussian_weights(f.size)));
        if let Some(image) = &config.ambient {
            let mut bytes = vec![0; f.image_bytes()];
            f.pack_image(image, &mut bytes).map_err(|e| e.at("ambient picture"))?;
            device.write(self.buffer("ambient"), 0, &bytes);
        }
        Ok(())
    }

    /// A buffer of the table.
    pub fn buffer(&self, name: &str) -> &Buffer {
        self.buffers.get(name).unwrap_or_else(|| panic!("the chain has no buffer '{name}'"))
    }

    /// The part of a buffer that a name means in a sub-iteration.
    fn part<'a>(&'a self, name: &str, iteration: u32, own: &Own<'a>) -> Part<'a> {
        if name == FRAME {
            return (&self.uniforms, STEP_BYTES * u64::from(iteration), size_of::<Frame>() as u64);
        }
        if let Some((_, of, word)) = HEADERS.iter().find(|h| h.0 == name) {
            return (self.buffer(of), 4 * u64::from(*word), 4 * u64::from(HEADER));
        }
        let given = own.iter().find(|o| o.0 == name).map(|o| o.1);
        whole(given.unwrap_or_else(|| self.buffer(name)))
    }

    fn record(&self, device: &Device, f: &Frame, steps: &[Placed], own: &Own) -> Recording {
        let mut r = Recording::default();
        for s in steps {
            let parts: Vec<Part> = s.binds.iter().map(|name| self.part(name, s.iteration, own)).collect();
            let pipeline = &self.pipelines[s.step.stage.name];
            match s.groups {
                Groups::Of(groups) => r.dispatch_parts(device, pipeline, &parts, groups(f)),
                Groups::Listed(header) => {
                    let (buffer, offset, _) = self.part(header, 0, own);
                    r.indirect(device, pipeline, &parts, (buffer, offset));
                }
            }
        }
        r
    }

    /// Work on the pictures in place, once per batch.
    pub fn prepare(&self, device: &Device, f: &Frame, own: &Own) -> Recording {
        self.record(device, f, &table::prepare(self.has_ambient), own)
    }
    /// Work from the pictures to the mask.
    pub fn front(&self, device: &Device, f: &Frame, own: &Own) -> Recording {
        self.record(device, f, &table::front(f), own)
    }
    /// One round of thinning, in sections that end with a shortened list.
    pub fn thinning(&self, device: &Device, f: &Frame) -> Vec<Recording> {
        table::thinning().iter().map(|section| self.record(device, f, section, &[])).collect()
    }
    /// Work between two rounds of thinning.
    pub fn restart(&self, device: &Device, f: &Frame) -> Recording {
        self.record(device, f, &table::restart(), &[])
    }
    /// Work from the thinned mask to the pixel list.
    pub fn back(&self, device: &Device, f: &Frame, own: &Own) -> Recording {
        self.record(device, f, &table::back(f), own)
    }
}
