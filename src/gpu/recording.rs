//! In: dispatches with their buffers, as data. Out: the same work, replayed for each batch and timed on request. Frame
//! and unit: none; times in seconds.

use super::stage::Compiled;
use super::{Buffer, Device, Pipeline};
use crate::fault::Result;
use std::sync::Arc;

/// One step of a recording.
#[derive(Clone, Debug)]
pub struct Dispatch {
    /// Name of the stage.
    pub label: &'static str,
    pipeline: Arc<Compiled>,
    bind: wgpu::BindGroup,
    size: Size,
}

#[derive(Clone, Debug)]
enum Size {
    Groups([u32; 3]),
    /// Number of workgroups: three u32 at a byte offset of a buffer.
    Indirect(wgpu::Buffer, u64),
}

/// GPU work, built once per configuration and replayed per batch of shots. It runs in one compute pass, because a pass
/// costs more than several dispatches.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    steps: Vec<Dispatch>,
}

/// Time between two steps on the GPU.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StageTime {
    /// Name of the stage that ran between the two timestamps.
    pub label: &'static str,
    /// GPU time, s.
    pub seconds: f64,
}

impl Recording {
    /// Adds a dispatch that binds whole buffers, in the order of the stage's bindings.
    pub fn dispatch(&mut self, device: &Device, pipeline: &Pipeline, buffers: &[&Buffer], groups: [u32; 3]) {
        let parts: Vec<_> = buffers.iter().map(|b| (*b, 0, b.raw.size())).collect();
        self.dispatch_parts(device, pipeline, &parts, groups);
    }
    /// Adds a dispatch that binds parts of buffers: (buffer, byte offset, bytes). Offsets are multiples of 256.
    pub fn dispatch_parts(
        &mut self,
        device: &Device,
        pipeline: &Pipeline,
        parts: &[(&Buffer, u64, u64)],
        groups: [u32; 3],
    ) {
        self.push(device, pipeline, parts, Size::Groups(groups));
    }
    /// Adds a dispatch whose number of workgroups is read from `args` (buffer, byte offset) when the step runs.
    pub fn indirect(
        &mut self,
        device: &Device,
        pipeline: &Pipeline,
        parts: &[(&Buffer, u64, u64)],
        args: (&Buffer, u64),
    ) {
        self.push(device, pipeline, parts, Size::Indirect(args.0.raw.clone(), args.1));
    }
    fn push(&mut self, device: &Device, pipeline: &Pipeline, parts: &[(&Buffer, u64, u64)], size: Size) {
        let (pipeline, label) = (pipeline.bind(device, parts), pipeline.stage.name);
        self.steps.push(Dispatch { label, pipeline: pipeline.0, bind: pipeline.1, size });
    }
    /// Appends the steps of another recording.
    pub fn append(&mut self, other: &Recording) {
        self.steps.extend(other.steps.iter().cloned());
    }
    /// Number of steps.
    pub fn len(&self) -> usize {
        self.steps.len()
    }
    /// Whether there are no steps.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }
}

/// Submits recordings, with uploads before them and copies to the host after them.
pub struct Replay {
    device: Device,
    queries: Option<(wgpu::QuerySet, Buffer, Buffer)>,
    labels: Vec<&'static str>,
}

/// Most timestamps of one submission.
const QUERIES: u32 = 512;

impl Replay {
    /// `timed` takes a timestamp before every step if the adapter has timestamps; that costs a few microseconds a step.
    pub fn new(device: &Device, timed: bool) -> Result<Replay> {
        let queries = if timed && device.tick_ns.is_some() {
            let set = device.raw.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("stage times"),
                ty: wgpu::QueryType::Timestamp,
                count: QUERIES,
            });
            let bytes = u64::from(QUERIES) * 8;
            let resolve = Buffer {
                raw: device.raw.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("stage times"),
                    size: bytes,
                    usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                }),
                bytes,
                aliased: None,
            };
            Some((set, resolve, device.readback_staging("stage times", bytes)?))
        } else {
            None
        };
        Ok(Replay { device: device.clone(), queries, labels: Vec::new() })
    }

    /// Runs recordings on the current content of their buffers and waits. Writes queued earlier are executed first.
    pub fn run(&mut self, recordings: &[&Recording]) -> Result<()> {
        let at = self.submit(&[], recordings, &[])?;
        self.device.wait(Some(at))
    }

    /// Copies `before`, runs the recordings, copies `after`. Each copy is (source, its offset, target, its offset,
    /// bytes).
    pub(super) fn submit(
        &mut self,
        before: &[(&Buffer, u64, &Buffer, u64, u64)],
        recordings: &[&Recording],
        after: &[(&Buffer, u64, &Buffer, u64, u64)],
    ) -> Result<wgpu::SubmissionIndex> {
        let mut encoder = self.device.raw.create_command_encoder(&Default::default());
        for (from, at, to, to_at, bytes) in before {
            encoder.copy_buffer_to_buffer(&from.raw, *at, &to.raw, *to_at, *bytes);
        }
        let steps = || recordings.iter().flat_map(|r| &r.steps);
        let n = steps().count() as u32;
        let timed = self.queries.as_ref().filter(|_| n < QUERIES);
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            for (i, step) in steps().enumerate() {
                if let Some((set, ..)) = timed {
                    pass.write_timestamp(set, i as u32);
                }
                pass.set_pipeline(&step.pipeline);
                pass.set_bind_group(0, &step.bind, &[]);
                match &step.size {
                    Size::Groups([x, y, z]) => pass.dispatch_workgroups(*x, *y, *z),
                    Size::Indirect(buffer, offset) => pass.dispatch_workgroups_indirect(buffer, *offset),
                }
            }
            if let Some((set, ..)) = timed {
                pass.write_timestamp(set, n);
            }
        }
        if let Some((set, resolve, staging)) = timed {
            encoder.resolve_query_set(set, 0..n + 1, &resolve.raw, 0);
            encoder.copy_buffer_to_buffer(&resolve.raw, 0, &staging.raw, 0, u64::from(n + 1) * 8);
            self.labels.clear();
            self.labels.extend(steps().map(|s| s.label));
        }
        for (from, at, to, to_at, bytes) in after {
            encoder.copy_buffer_to_buffer(&from.raw, *at, &to.raw, *to_at, *bytes);
        }
        let at = self.device.submit(encoder.finish());
        self.device.alive()?;
        Ok(at)
    }

    /// GPU time of every step of the last submission; waits. Empty if no timestamps were taken.
    pub fn times(&self) -> Result<Vec<StageTime>> {
        let (Some((_, _, staging)), Some(tick)) = (&self.queries, self.device.tick_ns) else {
            return Ok(Vec::new());
        };
        if self.labels.is_empty() {
            return Ok(Vec::new());
        }
        let bytes = (self.labels.len() as u64 + 1) * 8;
        let mapped = staging.map(wgpu::MapMode::Read, 0..bytes);
        self.device.wait(None)?;
        mapped.done()?;
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&staging.view(0..bytes)?[..]);
        staging.raw.unmap();
        Ok(self
            .labels
            .iter()
            .zip(ticks.windows(2))
            .map(|(&label, t)| StageTime { label, seconds: t[1].saturating_sub(t[0]) as f64 * f64::from(tick) * 1e-9 })
            .collect())
    }
}
