//! In: a stage, a shader's text and a case. Out: the words of every binding after the dispatch.

use super::open::{Device, Open};
use crate::case::Case;
use crate::contract::pipeline_keys;
use crate::error::{Error, Kind, Result};
use crate::stage::{Access, Stage};
use crate::words::Words;
use std::sync::mpsc;
use std::time::Duration;
use wgpu::naga;

/// A pipeline of one text with one set of override constants.
pub(crate) struct Compiled {
    pipeline: wgpu::ComputePipeline,
    /// Of group 0 to the last one used; `None` for numbers between them that are not used.
    layouts: Vec<Option<wgpu::BindGroupLayout>>,
}

/// Makes errors of wgpu's checks a result.
fn checked<T>(device: &wgpu::Device, what: &str, make: impl FnOnce() -> T) -> Result<T> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let made = make();
    let errors = [validation.pop().caught(), internal.pop().caught(), memory.pop().caught()];
    match errors.into_iter().flatten().next() {
        None => Ok(made),
        Some(e) => Err(Error::new(Kind::Refused, format!("{what}: {e}"))
            .cause("the shader needs a feature or a limit that this adapter does not have")
            .next("read the limit in the message, or ask for another adapter")),
    }
}

/// Waits for what a scope caught.
trait Caught {
    fn caught(self) -> Option<wgpu::Error>;
}

impl<F: Future<Output = Option<wgpu::Error>>> Caught for F {
    fn caught(self) -> Option<wgpu::Error> {
        pollster::block_on(self)
    }
}

impl Device {
    /// Compiles a text with the bindings of a stage.
    pub(crate) fn compile(&self, stage: &Stage, wgsl: &str, overrides: &[(String, f64)]) -> Result<Compiled> {
        let open = self.current();
        open.alive(self.adapter())?;
        let what = format!("{}: {}: the shader cannot be compiled", self.adapter(), stage.name);
        let keys = keys(wgsl, overrides);
        let constants: Vec<(&str, f64)> = keys.iter().map(|(key, value)| (key.as_str(), *value)).collect();
        checked(&open.raw, &what, || {
            let layouts = open.layouts(stage);
            let module = open.raw.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(&stage.name),
                source: wgpu::ShaderSource::Wgsl(wgsl.into()),
            });
            let bind_group_layouts: Vec<_> = layouts.iter().map(Option::as_ref).collect();
            let layout = open.raw.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(&stage.name),
                bind_group_layouts: &bind_group_layouts,
                immediate_size: 0,
            });
            let pipeline = open.raw.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(&stage.name),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(&stage.entry),
                compilation_options: wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() },
                cache: None,
            });
            Compiled { pipeline, layouts }
        })
    }

    /// Runs a case once and gives the words of all bindings afterwards; those that are only read are as before.
    pub(crate) fn run(
        &self,
        compiled: &Compiled,
        stage: &Stage,
        case: &Case,
        time_limit: Duration,
    ) -> Result<Vec<Words>> {
        let open = self.current();
        open.alive(self.adapter())?;
        let what = format!("{}: {}: case '{}' cannot run", self.adapter(), stage.name, case.name);
        let (submission, staging) = checked(&open.raw, &what, || open.submitted(compiled, stage, case))?;
        open.alive(self.adapter())?;
        let (sender, receiver) = mpsc::channel();
        staging.map_async(wgpu::MapMode::Read, .., move |mapped| {
            // The receiver is gone where the wait was given up.
            let _ = sender.send(mapped);
        });
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(time_limit) };
        if let Err(e) = open.raw.poll(wait) {
            open.give_up("an earlier run did not end in time");
            let what = format!("{what}: no end within {} s: {e}", time_limit.as_secs_f64());
            return Err(Error::new(Kind::TimedOut, what)
                .cause("a loop of the shader does not end, or the case is large")
                .next("raise the time limit (Pair::time_limit), or make the case smaller"));
        }
        open.alive(self.adapter())?;
        let mapped = receiver.try_recv();
        if !matches!(mapped, Ok(Ok(()))) {
            let error = Error::new(Kind::Lost, format!("{what}: the result cannot be read: {mapped:?}"));
            return Err(error.cause("the device was lost or its memory ran out"));
        }
        let view = staging.get_mapped_range(..);
        let view = view.map_err(|e| Error::new(Kind::Lost, format!("{what}: the result cannot be read: {e}")))?;
        let mut at = 0;
        Ok(stage
            .bindings
            .iter()
            .zip(&case.bindings)
            .map(|(binding, given)| {
                if binding.access != Access::ReadWrite {
                    return given.clone();
                }
                at += given.bytes();
                Words::of(&view[at - given.bytes()..at])
            })
            .collect())
    }
}

impl Open {
    fn layouts(&self, stage: &Stage) -> Vec<Option<wgpu::BindGroupLayout>> {
        let places: Vec<(u32, u32)> = (0..stage.bindings.len()).map(|i| stage.place(i)).collect();
        let last = places.iter().map(|p| p.0).max();
        let entry = |i: usize| wgpu::BindGroupLayoutEntry {
            binding: places[i].1,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: match stage.bindings[i].access {
                    Access::Uniform => wgpu::BufferBindingType::Uniform,
                    access => wgpu::BufferBindingType::Storage { read_only: access == Access::Read },
                },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        (0..last.map_or(0, |l| l + 1))
            .map(|group| {
                let entries: Vec<_> = (0..places.len()).filter(|&i| places[i].0 == group).map(entry).collect();
                let descriptor = wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries };
                (!entries.is_empty()).then(|| self.raw.create_bind_group_layout(&descriptor))
            })
            .collect()
    }

    fn submitted(&self, compiled: &Compiled, stage: &Stage, case: &Case) -> (wgpu::SubmissionIndex, wgpu::Buffer) {
        use wgpu::BufferUsages as U;
        let buffer = |label: &str, bytes: usize, usage| {
            self.raw.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                // Empty buffers do not exist; a stage without writable bindings reads one word.
                size: bytes.max(4) as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let buffers: Vec<wgpu::Buffer> = stage
            .bindings
            .iter()
            .zip(&case.bindings)
            .map(|(binding, words)| {
                let kind = if binding.access == Access::Uniform { U::UNIFORM } else { U::STORAGE };
                // The buffer has the size of the content: `arrayLength` is computed from it.
                let made = buffer(&binding.name, words.bytes(), kind | U::COPY_SRC | U::COPY_DST);
                self.queue.write_buffer(&made, 0, bytemuck::cast_slice(words.raw()));
                made
            })
            .collect();
        let written = || stage.bindings.iter().zip(&buffers).filter(|(b, _)| b.access == Access::ReadWrite);
        let total: u64 = written().map(|(_, b)| b.size()).sum();
        let staging = buffer("results", total as usize, U::MAP_READ | U::COPY_DST);
        let mut encoder = self.raw.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&compiled.pipeline);
            for (group, layout) in (0u32..).zip(&compiled.layouts) {
                let Some(layout) = layout else { continue };
                let entries: Vec<_> = (0..buffers.len())
                    .filter(|&i| stage.place(i).0 == group)
                    .map(|i| wgpu::BindGroupEntry {
                        binding: stage.place(i).1,
                        resource: buffers[i].as_entire_binding(),
                    })
                    .collect();
                let descriptor = wgpu::BindGroupDescriptor { label: None, layout, entries: &entries };
                pass.set_bind_group(group, &self.raw.create_bind_group(&descriptor), &[]);
            }
            let [x, y, z] = case.groups;
            pass.dispatch_workgroups(x, y, z);
        }
        let mut at = 0;
        for (_, from) in written() {
            encoder.copy_buffer_to_buffer(from, 0, &staging, at, from.size());
            at += from.size();
        }
        (self.queue.submit([encoder.finish()]), staging)
    }
}

/// The constants as the pipeline of this text knows them.
fn keys(wgsl: &str, overrides: &[(String, f64)]) -> Vec<(String, f64)> {
    match naga::front::wgsl::parse_str(wgsl) {
        Ok(module) if !overrides.is_empty() => pipeline_keys(&module, overrides),
        // A text that cannot be parsed is refused by the device, with the reason.
        _ => overrides.to_vec(),
    }
}
