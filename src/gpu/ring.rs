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
    /// Large results, of which only the first part is brought back.
    pub output: Buffer,
    output_staging: Option<Buffer>,
    mapping: Option<Mapping>,
    /// The submission that works on this place.
    at: Option<wgpu::SubmissionIndex>,
}

/// Batches in flight, oldest first; no buffer is made after the start.
pub struct Ring {
    device: Device,
    pub slots: Vec<Slot>,
    free: VecDeque<usize>,
    busy: VecDeque<usize>,
    /// Bytes of the output that are copied with the header where memory is not shared.
    eager: u64,
}

/// Sizes of a ring in bytes.
#[derive(Clone, Copy, Debug)]
pub struct RingSizes {
    pub slots: usize,
    pub input: u64,
    pub header: u64,
    pub output: u64,
}

/// Output brought back at once from a device with its own memory: 1 MiB is 40 us over PCIe 4.
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
            let output = if unified {
                device.readable_storage("output", sizes.output)?
            } else {
                device.storage("output", sizes.output)?
            };
            let slot = Slot {
                mapping: Some(upload.map(wgpu::MapMode::Write, 0..sizes.input)),
                at: None,
                upload,
                input,
                header: device.storage("header", sizes.header)?,
                header_staging: device.readback_staging("header staging", sizes.header)?,
                output,
                output_staging: if unified {
                    None
                } else {
                    Some(device.readback_staging("output staging", sizes.output)?)
                },
            };
            slots.push(slot);
        }
        device.wait(None)?;
        let eager = sizes.output.min(EAGER);
        Ok(Ring { device: device.clone(), free: (0..sizes.slots).collect(), busy: VecDeque::new(), slots, eager })
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
        {
            let mut view = slot.upload.view_mut(0..slot.upload.bytes)?;
            let filled = fill(&mut |offset, bytes| view.slice(offset..offset + bytes.len()).copy_from_slice(bytes));
            drop(view);
            slot.upload.raw.unmap();
            if let Err(e) = filled {
                slot.mapping = Some(slot.upload.map(wgpu::MapMode::Write, 0..slot.upload.bytes));
                self.device.wait(None)?;
                return Err(e);
            }
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
        let copies = if upload && slot.output_staging.is_some() { &before[..] } else { &[] };
        match &slot.output_staging {
            Some(staging) => {
                slot.at =
                    Some(replay.submit(copies, recordings, &[header, (&slot.output, 0, staging, 0, self.eager)])?);
            }
            None => {
                slot.at = Some(replay.submit(copies, recordings, &[header])?);
            }
        }
        slot.mapping = Some(slot.header_staging.map(wgpu::MapMode::Read, 0..slot.header.raw.size()));
        Ok(())
    }

    /// The oldest place whose work is done, with its header; waits for it if asked.
    pub fn oldest(&mut self, wait: bool) -> Result<Option<(usize, Vec<u8>)>> {
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
        let header = slot.header_staging.view(0..slot.header.bytes)?.to_vec();
        slot.header_staging.raw.unmap();
        Ok(Some((at, header)))
    }

    /// Gives the first `bytes` of the oldest place's output to `read` and frees the place.
    pub fn finish<T>(&mut self, bytes: u64, read: impl FnOnce(&[u8]) -> T) -> Result<T> {
        let at = self.busy.pop_front().expect("a place is busy");
        let (device, slot) = (&self.device, &mut self.slots[at]);
        let source = slot.output_staging.as_ref().unwrap_or(&slot.output);
        if slot.output_staging.is_some() && bytes > self.eager {
            let rest = (bytes - self.eager).next_multiple_of(4);
            let mut encoder = device.raw.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&slot.output.raw, self.eager, &source.raw, self.eager, rest);
            device.queue.submit([encoder.finish()]);
        }
        let out = if bytes == 0 {
            read(&[])
        } else {
            let size = bytes.next_multiple_of(8);
            let mapping = source.map(wgpu::MapMode::Read, 0..size);
            device.poll()?;
            while !mapping.ready() {
                device.wait(None)?;
            }
            mapping.done()?;
            let view = source.view(0..size)?;
            let out = read(&view[..bytes as usize]);
            drop(view);
            source.raw.unmap();
            out
        };
        slot.mapping = Some(slot.upload.map(wgpu::MapMode::Write, 0..slot.upload.bytes));
        device.poll()?;
        self.free.push_back(at);
        Ok(out)
    }
}
