//! In: the bytes of one batch after another. Out: the bytes that a recording computed from each, in order; the next
//! batch is uploaded at the same time. Frame and unit: bytes.

use super::device::{Fill, Mapping};
use super::{Buffer, Device, Recording, Replay};
use crate::fault::{Fault, Result};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::collections::VecDeque;

/// One slot of the ring: a batch's input and its results.
pub struct Slot {
    /// Written by the host; on unified memory the stages read the same memory.
    upload: Buffer,
    /// What the stages read.
    pub input: Buffer,
    /// Small results, which include the sizes of the large ones; written by the stages.
    pub header: Buffer,
    header_staging: Buffer,
    /// Large results; only the first part of each is copied to the host.
    pub outputs: Vec<Output>,
    /// The mapping requested last: of `upload` if the slot is free, of `header_staging` while a batch is in it.
    mapping: Option<Mapping>,
    /// The submission that works on this slot.
    at: Option<wgpu::SubmissionIndex>,
}

/// One large result, and its copy for the host if memory is not shared. The copy is only as large as the largest result
/// in this slot so far: the worst case that `buffer` is sized for is many times larger.
pub struct Output {
    pub buffer: Buffer,
    staging: Option<Buffer>,
    /// Bytes that are copied to the host together with the next batch.
    sent: u64,
}

/// Bytes that came back, and the threads that copy them.
pub struct Returned<'a> {
    bytes: &'a [u8],
    copiers: Option<&'a ThreadPool>,
}

impl Returned<'_> {
    /// Replaces the content of a list by the bytes, without a new allocation if the list is large enough.
    pub fn refill<T: bytemuck::Pod>(&self, list: &mut Vec<T>) {
        list.resize(self.bytes.len() / size_of::<T>(), T::zeroed());
        let to: &mut [u8] = bytemuck::cast_slice_mut(list);
        match self.copiers.filter(|_| to.len() > 4 * PART) {
            None => to.copy_from_slice(self.bytes),
            Some(pool) => pool.install(|| {
                let pieces = to.par_chunks_mut(PART).zip(self.bytes.par_chunks(PART));
                pieces.for_each(|(to, from)| to.copy_from_slice(from));
            }),
        }
    }
}

/// Batches in flight, oldest first, each with a `T` that is returned with its results. No buffer is made after the
/// start, unless results need more room than ever before.
pub struct Ring<T> {
    device: Device,
    /// Threads that together copy a batch and its results; `None` if the stages run on the same cores.
    copiers: Option<ThreadPool>,
    /// All slots, by the number that `fill` and `keep` return.
    pub slots: Vec<Slot>,
    free: VecDeque<usize>,
    busy: VecDeque<(usize, T)>,
}

/// Sizes of a ring in bytes.
#[derive(Clone, Debug)]
pub struct RingSizes {
    /// Number of slots, which is the largest number of batches in flight.
    pub slots: usize,
    /// Bytes of one batch as the stages read it.
    pub input: u64,
    /// Bytes of one batch's small results.
    pub header: u64,
    /// Largest size of each large result of one batch.
    pub outputs: Vec<u64>,
}

/// Part of each output that a device with its own memory copies back with the first batch: over PCIe 4, 1 MiB takes
/// 40 us.
const FIRST: u64 = 1 << 20;

/// Bytes of a batch that one thread writes at a time: large enough that distributing the parts costs little.
pub const PART: usize = 1 << 20;

/// Threads that copy a batch. Eight write hardly faster over PCIe 5 than four, at twice the CPU time (decision 0016).
const COPIERS: usize = 4;

/// `None` if the stages run on the same cores, or there is only one core.
fn copiers(device: &Device) -> Result<Option<ThreadPool>> {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get()).min(COPIERS);
    if threads == 1 || !device.has_own_processors() {
        return Ok(None);
    }
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map(Some).map_err(|e| {
        Fault::device(format!("{threads} threads to copy pictures cannot be started: {e}"))
            .next("close other programs, or raise the limits (ulimit -v, ulimit -u)")
    })
}

impl<T> Ring<T> {
    /// Makes every buffer. `Err` if one is larger than the adapter allows, or the device is lost.
    pub fn new(device: &Device, sizes: RingSizes) -> Result<Ring<T>> {
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
                true => Ok(Output { buffer: device.readable_storage("output", bytes)?, staging: None, sent: 0 }),
                false => Ok(Output {
                    buffer: device.storage("output", bytes)?,
                    staging: Some(device.readback_staging("output staging", bytes.min(FIRST))?),
                    sent: bytes.min(FIRST),
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
        Ok(Ring {
            device: device.clone(),
            copiers: copiers(device)?,
            free: (0..sizes.slots).collect(),
            busy: VecDeque::new(),
            slots,
        })
    }

    /// Number of batches in flight.
    pub fn in_flight(&self) -> usize {
        self.busy.len()
    }
    /// Whether a slot is free. Without one `fill` and `keep` panic.
    pub fn has_room(&self) -> bool {
        !self.free.is_empty()
    }

    /// The next free slot, and whether its upload buffer is mapped; waits for a pending mapping.
    fn next(&mut self) -> Result<(usize, bool)> {
        let at = self.free[0];
        let Some(mapping) = self.slots[at].mapping.take() else { return Ok((at, false)) };
        if !mapping.ready() {
            self.device.wait(None)?;
        }
        mapping.done()?;
        Ok((at, true))
    }

    /// Fills the next free slot, which is divided into parts of the given sizes in bytes; panics if there is no room.
    /// `fill` receives the number of a part and a writer (byte offset in the part, bytes). Several threads call it if
    /// that takes no time from the stages. Returns the slot; `run` starts its work. `cargo` is returned by `finish`.
    pub fn fill(&mut self, parts: &[usize], fill: &Fill, cargo: T) -> Result<usize> {
        self.device.alive()?;
        let (at, _) = self.next()?;
        let slot = &mut self.slots[at];
        if let Err(e) = slot.upload.fill(parts, self.copiers.as_ref(), fill) {
            slot.mapping = slot.upload.open();
            self.device.wait(None)?;
            return Err(e);
        }
        self.free.pop_front();
        self.busy.push_back((at, cargo));
        Ok(at)
    }

    /// Like `fill`, but reuses the content that the next free slot was last filled with.
    pub fn keep(&mut self, cargo: T) -> Result<usize> {
        let (at, open) = self.next()?;
        if open {
            self.slots[at].upload.raw.unmap();
        }
        self.free.pop_front();
        self.busy.push_back((at, cargo));
        Ok(at)
    }

    /// Runs recordings on a filled slot. `upload` copies its input to the device if memory is not shared.
    pub fn run(&mut self, at: usize, replay: &mut Replay, recordings: &[&Recording], upload: bool) -> Result<()> {
        let slot = &mut self.slots[at];
        let before = [(&slot.upload, 0, &slot.input, 0, slot.upload.raw.size())];
        let header = (&slot.header, 0, &slot.header_staging, 0, slot.header.raw.size());
        let copies = if upload && !self.device.info.unified_memory { &before[..] } else { &[] };
        let mut after = vec![header];
        for o in &slot.outputs {
            after.extend(o.staging.as_ref().map(|staging| (&o.buffer, 0, staging, 0, o.sent)));
        }
        slot.at = Some(replay.submit(copies, recordings, &after)?);
        slot.mapping = Some(slot.header_staging.map(wgpu::MapMode::Read, 0..slot.header.raw.size()));
        Ok(())
    }

    /// The oldest slot and its cargo, once its work is done. Its header is written into `header`. Waits for the work if
    /// `wait` is set.
    pub fn oldest(&mut self, wait: bool, header: &mut [u32]) -> Result<Option<(usize, &mut T)>> {
        let Some(at) = self.busy.front().map(|b| b.0) else { return Ok(None) };
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
        Ok(self.busy.front_mut().map(|(at, cargo)| (*at, cargo)))
    }

    /// Gives the first `bytes[i]` bytes of each output of the oldest slot to `read`, frees the slot and returns its
    /// cargo.
    pub fn finish(&mut self, bytes: &[u64], mut read: impl FnMut(usize, Returned)) -> Result<T> {
        let (at, cargo) = self.busy.pop_front().expect("a place is busy");
        let (device, copiers, slot) = (&self.device, self.copiers.as_ref(), &mut self.slots[at]);
        let mut read = |i, bytes: &[u8]| read(i, Returned { bytes, copiers });
        for (i, (output, &bytes)) in slot.outputs.iter_mut().zip(bytes).enumerate() {
            if let Some(staging) = &mut output.staging {
                let room = bytes.next_power_of_two().min(output.buffer.raw.size());
                if bytes > output.sent {
                    if staging.raw.size() < room {
                        *staging = device.readback_staging("output staging", room)?;
                    }
                    let mut encoder = device.raw.create_command_encoder(&Default::default());
                    encoder.copy_buffer_to_buffer(&output.buffer.raw, 0, &staging.raw, 0, room);
                    device.submit(encoder.finish());
                }
                // The next batch copies as much back. The amount halves from batch to batch, in case noise made this
                // one large. wgpu copies whole words only, which half of a half need not be.
                let half = (output.sent / 2).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
                output.sent = room.max(half).max(FIRST).min(staging.raw.size());
            }
            if bytes == 0 {
                read(i, &[]);
                continue;
            }
            let source = output.staging.as_ref().unwrap_or(&output.buffer);
            if let Some(host) = &source.aliased {
                // SAFETY: the batch is done, because its header has arrived. The next batch uses the memory after this
                // has returned.
                read(i, unsafe { host.read(0..bytes as usize) });
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
        Ok(cargo)
    }
}
