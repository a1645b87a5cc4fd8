//! In: bytes for one batch after the other. Out: the bytes that a recording made of each, in order, while
//! the next batch is already uploaded. Frame and unit: bytes.

use super::device::Mapping;
use super::{Buffer, Device, Recording, Replay};
use crate::fault::Result;
use std::collections::VecDeque;

/// One place of the ring: what the host fills, what the stages read, what comes back.
pub struct Slot {
    /// Written by the host; on unified memory the stages read it where it lies.
    upload: Buffer,
    /// What the stages read.
    pub input: Buffer,
    /// Small results with the size of the large ones; written by the stages.
    pub header: Buffer,
    header_staging: Buffer,
    /// Large results, of each of which only the first part is brought back.
    pub outputs: Vec<Output>,
    mapping: Option<Mapping>,
    /// The submission that works on this place.
    at: Option<wgpu::SubmissionIndex>,
}

/// One large result, and where the host reads it when memory is not shared.
pub struct Output {
    pub buffer: Buffer,
    staging: Option<Buffer>,
}

/// Batches in flight, oldest first; no buffer is made after the start.
pub struct Ring {
    device: Device,
    pub slots: Vec<Slot>,
    free: VecDeque<usize>,
    busy: VecDeque<usize>,
}

/// Sizes of a ring in bytes.
#[derive(Clone, Debug)]
pub struct RingSizes {
    pub slots: usize,
    pub input: u64,
    pub header: u64,
    pub outputs: Vec<u64>,
}

/// Part of each output brought back at once from a device with its own memory: 1 MiB is 40 us over PCIe 4.
const EAGER: u64 = 1 << 20;

impl Ring {
    pub fn new(device: &Device, sizes: RingSizes) -> Result<Ring> {
        let unified = device.info.unified_memory;
        let mut slots = Vec::new();
        for _ in 0..sizes.slots {
            let (upload, input) = if unified {
                let shared = device.mapped_storage("input", sizes.input)?;
                (shared.clone(), shared)
            } else {
                (device.upload_staging("input staging", sizes.input)?, device.storage("input", sizes.input)?)
            };
            let outputs = sizes.outputs.iter().map(|&bytes| match unified {
                true => Ok(Output { buffer: device.readable_storage("output", bytes)?, staging: None }),
                false => Ok(Output {
                    buffer: device.storage("output", bytes)?,
                    staging: Some(device.readback_staging("output staging", bytes)?),
                }),
            });
            let outputs = outputs.collect::<Result<Vec<_>>>()?;
            let slot = Slot {
                mapping: upload.open(),
                at: None,
                upload,
                input,
                header: device.storage("header", sizes.header)?,
                header_staging: device.readback_staging("header staging", sizes.header)?,
                outputs,
            };
            slots.push(slot);
        }
        device.wait(None)?;
        Ok(Ring { device: device.clone(), free: (0..sizes.slots).collect(), busy: VecDeque::new(), slots })
    }

    /// Batches under way.
    pub fn in_flight(&self) -> usize {
        self.busy.len()
    }
    pub fn has_room(&self) -> bool {
        !self.free.is_empty()
    }

    /// Fills the next free place; panics when there is no room. `fill` is given a writer (byte offset,
    /// bytes). Returns the place, whose work is started with `run`.
    pub fn fill(&mut self, fill: impl FnOnce(&mut dyn FnMut(usize, &[u8])) -> Result<()>) -> Result<usize> {
        self.device.alive()?;
        let at = self.free[0];
        let slot = &mut self.slots[at];
        if let Some(m) = slot.mapping.take() {
            if !m.ready() {
                self.device.wait(None)?;
            }
            m.done()?;
        }
        if let Err(e) = slot.upload.fill(fill) {
            slot.mapping = slot.upload.open();
            self.device.wait(None)?;
            return Err(e);
        }
        self.free.pop_front();
        self.busy.push_back(at);
        Ok(at)
    }

    /// Runs recordings on a filled place; `upload` copies its input to the device where memory is not shared.
    pub fn run(&mut self, at: usize, replay: &mut Replay, recordings: &[&Recording], upload: bool) -> Result<()> {
        let slot = &mut self.slots[at];
        let before = [(&slot.upload, 0, &slot.input, 0, slot.upload.raw.size())];
        let header = (&slot.header, 0, &slot.header_staging, 0, slot.header.raw.size());
        let separate = slot.outputs.iter().any(|o| o.staging.is_some());
        let copies = if upload && separate { &before[..] } else { &[] };
        let mut after = vec![header];
        for o in &slot.outputs {
            after.extend(o.staging.as_ref().map(|staging| (&o.buffer, 0, staging, 0, o.buffer.bytes.min(EAGER))));
        }
        slot.at = Some(replay.submit(copies, recordings, &after)?);
        slot.mapping = Some(slot.header_staging.map(wgpu::MapMode::Read, 0..slot.header.raw.size()));
        Ok(())
    }

    /// The oldest place whose work is done, its header written into `header`; waits for it if asked.
    pub fn oldest(&mut self, wait: bool, header: &mut [u32]) -> Result<Option<usize>> {
        let Some(&at) = self.busy.front() else { return Ok(None) };
        self.device.poll()?;
        while !self.slots[at].mapping.as_ref().is_some_and(Mapping::ready) {
            if !wait {
                return Ok(None);
            }
            self.device.wait(self.slots[at].at.clone())?;
        }
        let slot = &mut self.slots[at];
        slot.mapping.take().expect("busy").done()?;
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(header);
        bytes.copy_from_slice(&slot.header_staging.view(0..bytes.len() as u64)?);
        slot.header_staging.raw.unmap();
        Ok(Some(at))
    }

    /// Gives the first `bytes[i]` bytes of each output of the oldest place to `read` and frees the place.
    pub fn finish(&mut self, bytes: &[u64], mut read: impl FnMut(usize, &[u8])) -> Result<()> {
        let at = self.busy.pop_front().expect("a place is busy");
        let (device, slot) = (&self.device, &mut self.slots[at]);
        for (i, (output, &bytes)) in slot.outputs.iter().zip(bytes).enumerate() {
            let source = output.staging.as_ref().unwrap_or(&output.buffer);
            if bytes == 0 {
                read(i, &[]);
                continue;
            }
            if output.staging.is_some() && bytes > EAGER {
                let rest = (bytes - EAGER).next_multiple_of(4);
                let mut encoder = device.raw.create_command_encoder(&Default::default());
                encoder.copy_buffer_to_buffer(&output.buffer.raw, EAGER, &source.raw, EAGER, rest);
                device.queue.submit([encoder.finish()]);
            }
            if let Some(host) = &source.aliased {
                // The batch is done: its header has come.
                read(i, host.read(0..bytes as usize));
                continue;
            }
            let size = bytes.next_multiple_of(8);
            let mapping = source.map(wgpu::MapMode::Read, 0..size);
            device.poll()?;
            while !mapping.ready() {
                device.wait(None)?;
            }
            mapping.done()?;
            let view = source.view(0..size)?;
            read(i, &view[..bytes as usize]);
            drop(view);
            source.raw.unmap();
        }
        slot.mapping = slot.upload.open();
        device.poll()?;
        self.free.push_back(at);
        Ok(())
    }
}
