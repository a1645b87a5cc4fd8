//! In: a device. Out: the rates at which this machine moves pictures to it, on the path that the chain takes, and
//! results back. Frame and unit: bytes, 1e9 bytes a second.

use super::description::{Access, Binding, Stage};
use super::ring::{PART, Ring, RingSizes};
use super::{Device, Recording, Replay};
use crate::fault::Result;
use std::time::Instant;

/// Transfer rates between host and device, 1e9 bytes a second.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Rates {
    /// Upload of pictures from the host's memory, one after the other through the ring, without any stage.
    pub upload_gb_s: f64,
    /// Readback into a slice, one copy at a time.
    pub readback_gb_s: f64,
    /// Bytes read and written by copies within the device's memory. `None` if it has no memory of its own.
    pub device_gb_s: Option<f64>,
}

/// Batches in flight, and number of batches that are timed.
const SLOTS: usize = 3;
const ROUNDS: usize = 32;
/// Bytes of a copy within the device, more than its caches hold, if a binding may be that large; and number of copies
/// that are timed together.
const COPY: u64 = 1 << 28;
const COPIES: usize = 32;
/// Copies within the device. A stage copies faster than the copy command.
const COPIER: Stage = Stage {
    name: "copy",
    wgsl: "@group(0) @binding(0) var<storage, read> before: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read_write> after: array<vec4<u32>>;
@compute @workgroup_size(256)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pitch = arrayLength(&before) / 4u;
    for (var i = id.x; i < arrayLength(&before); i += pitch) {
        after[i] = before[i];
    }
}",
    shared: &[],
    workgroup: [256, 1, 1],
    bindings: &[Binding { name: "before", access: Access::Read }, Binding { name: "after", access: Access::ReadWrite }],
    uniform: ("", &[], 0),
    overrides: &[],
};

impl Device {
    /// Median rates for pictures of `bytes` bytes.
    pub fn measure_rates(&self, bytes: u64) -> Result<Rates> {
        let rate = |bytes: u64, mut seconds: Vec<f64>| {
            seconds.sort_by(f64::total_cmp);
            bytes as f64 / seconds[seconds.len() / 2] / 1e9
        };
        let copy = COPY.min(self.info.max_binding_bytes / 64 * 64);
        Ok(Rates {
            upload_gb_s: rate(bytes, self.uploads(bytes)?),
            readback_gb_s: rate(bytes, self.readbacks(bytes)?),
            device_gb_s: if self.info.unified_memory {
                None
            } else {
                Some(rate(2 * copy * COPIES as u64, self.copies(copy)?))
            },
        })
    }

    /// Seconds from the end of one upload to the end of the next, in steady state.
    fn uploads(&self, bytes: u64) -> Result<Vec<f64>> {
        // Together larger than most caches.
        let pictures: Vec<Vec<u8>> = (1..=8).map(|level| vec![level; bytes as usize]).collect();
        let parts: Vec<usize> = pictures[0].chunks(PART).map(<[u8]>::len).collect();
        let mut ring = Ring::new(self, RingSizes { slots: SLOTS, input: bytes, header: 16, outputs: Vec::new() })?;
        let (mut replay, nothing) = (Replay::new(self, false)?, Recording::default());
        let mut seconds = Vec::new();
        let mut last = Instant::now();
        for picture in pictures.iter().cycle().take(SLOTS + ROUNDS) {
            if !ring.has_room() {
                ring.oldest(true, &mut [0; 4])?;
                ring.finish(&[], |_, _| {})?;
                seconds.push(last.elapsed().as_secs_f64());
                last = Instant::now();
            }
            let part = |i: usize, put: &mut dyn FnMut(usize, &[u8])| {
                put(0, picture.chunks(PART).nth(i).expect("as many as parts"));
                Ok(())
            };
            let at = ring.fill(&parts, &part, ())?;
            ring.run(at, &mut replay, &[&nothing], true)?;
        }
        self.wait(None)?;
        Ok(seconds)
    }

    /// Seconds that `COPIES` copies within the device take.
    fn copies(&self, bytes: u64) -> Result<Vec<f64>> {
        let (a, b) = (self.storage("rate", bytes)?, self.storage("rate copy", bytes)?);
        let copier = COPIER.pipeline(self, &[])?;
        let mut work = Recording::default();
        for n in 0..COPIES {
            let pair = if n % 2 == 0 { [&a, &b] } else { [&b, &a] };
            work.dispatch(self, &copier, &pair, COPIER.groups([(bytes / 64) as u32, 1, 1]));
        }
        let mut replay = Replay::new(self, false)?;
        let mut some = |_| {
            let start = Instant::now();
            replay.run(&[&work])?;
            Ok(start.elapsed().as_secs_f64())
        };
        some(0)?;
        (0..5).map(some).collect()
    }

    fn readbacks(&self, bytes: u64) -> Result<Vec<f64>> {
        let (from, to) = (self.storage("rate", bytes)?, self.readback_staging("rate readback", bytes)?);
        let one = |_| {
            let start = Instant::now();
            let mut encoder = self.raw.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&from.raw, 0, &to.raw, 0, bytes);
            self.submit(encoder.finish());
            let mapped = to.map(wgpu::MapMode::Read, 0..bytes);
            self.wait(None)?;
            mapped.done()?;
            std::hint::black_box(to.view(0..bytes)?.to_vec());
            to.raw.unmap();
            Ok(start.elapsed().as_secs_f64())
        };
        (0..9).map(one).collect()
    }
}
