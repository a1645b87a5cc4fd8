//! In: the bindings of the stage `support` for some shots. Out: the flags of their peaks, from a GPU. Frame and unit:
//! as in the stage. Buffers grow to the largest batch and are then reused.

use super::stage::{Neighbourhood, STAGE, Site, SupportFrame};
use crate::fault::Result;
use crate::gpu::{Buffer, Device, Pipeline, Recording, Replay};
use crate::stages::peak::found::Peak;

/// The compiled stage with its buffers.
pub struct OnGpu {
    device: Device,
    pipeline: Pipeline,
    replay: Replay,
    /// Buffers in the order of the stage's bindings.
    buffers: Vec<Buffer>,
}

impl OnGpu {
    pub fn new(device: &Device) -> Result<OnGpu> {
        let buffers = STAGE.bindings.iter().map(|b| device.storage(b.name, 1024)).collect::<Result<_>>()?;
        Ok(OnGpu {
            device: device.clone(),
            pipeline: STAGE.pipeline(device, &[])?,
            replay: Replay::new(device, false)?,
            buffers,
        })
    }

    /// One word of flags for each peak; waits for the GPU.
    pub fn judge(
        &mut self,
        frame: &SupportFrame,
        shots: &[Neighbourhood],
        sites: &[Site],
        places: &[Site],
        peaks: &[Peak],
    ) -> Result<Vec<u32>> {
        let given: [&[u8]; 5] = [
            bytemuck::bytes_of(frame),
            bytemuck::cast_slice(shots),
            bytemuck::cast_slice(sites),
            bytemuck::cast_slice(places),
            bytemuck::cast_slice(peaks),
        ];
        for (i, binding) in STAGE.bindings.iter().enumerate() {
            let bytes = given.get(i).map_or(4 * peaks.len(), |b| b.len()) as u64;
            // The uniform's buffer never grows; the others double.
            if bytes > self.buffers[i].bytes {
                self.buffers[i] = self.device.storage(binding.name, bytes.next_power_of_two())?;
            }
            if let Some(bytes) = given.get(i) {
                self.device.write(&self.buffers[i], 0, bytes);
            }
        }
        let mut work = Recording::default();
        let buffers: Vec<&Buffer> = self.buffers.iter().collect();
        work.dispatch(&self.device, &self.pipeline, &buffers, STAGE.groups([frame.peaks, 1, 1]));
        self.replay.run(&[&work])?;
        let mut flags: Vec<u32> = bytemuck::pod_collect_to_vec(&self.device.read(&self.buffers[5])?);
        flags.truncate(peaks.len());
        Ok(flags)
    }
}
