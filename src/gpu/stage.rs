//! In: one WGSL file with its bindings and uniform layout. Out: a compiled pipeline, and one run of it.
//! Frame and unit: none.

use super::description::{Access, Stage};
use super::specialise::specialised;
use super::texels::{readers, texel_of};
use super::{Buffer, Device};
use crate::fault::Result;
use std::sync::{Arc, LazyLock, OnceLock};
use wgpu::naga;

impl Stage {
    /// The stage's naga module with its override constants. `Access::Texels` bindings are read as texels if `texels`,
    /// else as arrays.
    pub fn tree(&self, texels: bool, overrides: &[(String, f64)]) -> naga::Module {
        let source = if texels { readers(self) + &self.source() } else { self.source() };
        specialised(&source, overrides)
    }

    /// The stage with its override constants, compiled on another thread. The first use waits for the compilation, or
    /// does it if no thread was free.
    pub fn pipeline(&self, device: &Device, overrides: &[(&str, f64)]) -> Result<Pipeline> {
        let overrides = overrides.iter().map(|&(name, value)| (name.into(), value)).collect();
        let pipeline = self.begun(device, device.reads_texels, overrides);
        device.alive()?;
        Ok(pipeline)
    }

    /// Begins to compile the stage; `texels` says whether it reads arrays as texels.
    fn begun(&self, device: &Device, texels: bool, overrides: Vec<(String, f64)>) -> Pipeline {
        let entries: Vec<_> = self
            .bindings
            .iter()
            .enumerate()
            .map(|(i, b)| wgpu::BindGroupLayoutEntry {
                binding: i as u32,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: match b.access {
                    Access::Texels if texels => wgpu::BindingType::StorageTexture {
                        access: wgpu::StorageTextureAccess::ReadOnly,
                        format: texel_of(self, b.name).format(),
                        view_dimension: wgpu::TextureViewDimension::D2,
                    },
                    access => wgpu::BindingType::Buffer {
                        ty: match access {
                            Access::Uniform => wgpu::BufferBindingType::Uniform,
                            Access::Read | Access::Texels => wgpu::BufferBindingType::Storage { read_only: true },
                            Access::ReadWrite => wgpu::BufferBindingType::Storage { read_only: false },
                        },
                        has_dynamic_offset: false,
                        min_binding_size: None,
                    },
                },
                count: None,
            })
            .collect();
        let layout = device
            .raw
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(self.name), entries: &entries });
        let (stage, raw, bound, values) = (*self, device.raw.clone(), layout.clone(), overrides.clone());
        let compile = move || stage.compile(&raw, texels, &bound, &values);
        let compiled: Arc<Compiled> = Arc::new(LazyLock::new(Box::new(compile)));
        let ahead = compiled.clone();
        // A panic poisons `compiled`, so that its user panics as well.
        device.background.begin(move || {
            LazyLock::force(&ahead);
        });
        Pipeline { stage: *self, compiled, layout, texels, overrides, plain: Default::default() }
    }

    fn compile(
        &self,
        device: &wgpu::Device,
        texels: bool,
        layout: &wgpu::BindGroupLayout,
        overrides: &[(String, f64)],
    ) -> wgpu::ComputePipeline {
        let module = std::borrow::Cow::Owned(self.tree(texels, overrides));
        let source = wgpu::ShaderModuleDescriptor { label: Some(self.name), source: wgpu::ShaderSource::Naga(module) };
        // With a counter in every loop, which this check adds, the driver does not unroll short loops and compiles for
        // longer.
        let checks = wgpu::ShaderRuntimeChecks { force_loop_bounding: false, ..wgpu::ShaderRuntimeChecks::checked() };
        // SAFETY: every loop ends (tests/shader_contracts.rs); all other checks stay on.
        let module = unsafe { device.create_shader_module_trusted(source, checks) };
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(self.name),
            layout: Some(&device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(self.name),
                bind_group_layouts: &[Some(layout)],
                immediate_size: 0,
            })),
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &[],
                // No stage uses workgroup memory.
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        })
    }
}

/// A compiled pipeline, or one whose compilation is pending.
pub(super) type Compiled = LazyLock<wgpu::ComputePipeline, Box<dyn FnOnce() -> wgpu::ComputePipeline + Send>>;

/// A stage with its override constants; clones share the compiled pipeline.
#[derive(Clone, Debug)]
pub struct Pipeline {
    /// Text, bindings and uniform block of the compiled stage.
    pub stage: Stage,
    pub(super) compiled: Arc<Compiled>,
    layout: wgpu::BindGroupLayout,
    texels: bool,
    overrides: Vec<(String, f64)>,
    /// The same stage without texels, for arrays that cannot be read as images.
    plain: Arc<OnceLock<Pipeline>>,
}

impl Pipeline {
    /// Binds buffers, or `(offset, size)` parts of them, in the order of the stage's list. Returns the bind group with
    /// the pipeline that it fits: the one without texels if a buffer cannot be read as an image.
    pub(super) fn bind(&self, device: &Device, buffers: &[(&Buffer, u64, u64)]) -> (Arc<Compiled>, wgpu::BindGroup) {
        assert_eq!(buffers.len(), self.stage.bindings.len(), "{}: bindings", self.stage.name);
        let resource = |(i, (b, offset, size)): (usize, &(&'_ Buffer, u64, u64))| {
            let binding = &self.stage.bindings[i];
            if binding.access == Access::Texels && self.texels {
                assert_eq!(*offset, 0, "{}: texels '{}' are bound whole", self.stage.name, binding.name);
                let view = device.texels(b, texel_of(&self.stage, binding.name));
                return view.cloned().map(Bound::Texels);
            }
            Some(Bound::Buffer(b.raw.clone(), *offset, *size))
        };
        let Some(bound) = buffers.iter().enumerate().map(resource).collect::<Option<Vec<_>>>() else {
            let plain = self.plain.get_or_init(|| self.stage.begun(device, false, self.overrides.clone()));
            return plain.bind(device, buffers);
        };
        let entries: Vec<_> = (0u32..)
            .zip(&bound)
            .map(|(binding, bound)| wgpu::BindGroupEntry {
                binding,
                resource: match bound {
                    Bound::Texels(view) => wgpu::BindingResource::TextureView(view),
                    Bound::Buffer(buffer, offset, size) => wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                        buffer,
                        offset: *offset,
                        size: std::num::NonZero::new(*size),
                    }),
                },
            })
            .collect();
        let group = device.raw.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(self.stage.name),
            layout: &self.layout,
            entries: &entries,
        });
        (self.compiled.clone(), group)
    }
}

/// What a binding is bound to: a part of a buffer, or an image of the whole buffer.
enum Bound {
    Buffer(wgpu::Buffer, u64, u64),
    Texels(wgpu::TextureView),
}

/// Input of one run of one stage: bytes per binding (including the uniform block) and the workgroups.
pub struct Workload {
    /// Bytes of each binding, in the order of the stage's list.
    pub bindings: Vec<Vec<u8>>,
    /// Workgroups: x, y, z.
    pub groups: [u32; 3],
}

/// Runs one stage once and returns the bytes of every binding afterwards. For tests and self-tests.
pub fn run_once(device: &Device, pipeline: &Pipeline, load: &Workload) -> Result<Vec<Vec<u8>>> {
    let buffers = load
        .bindings
        .iter()
        .zip(pipeline.stage.bindings)
        .map(|(bytes, b)| {
            let buffer = device.storage(b.name, bytes.len() as u64)?;
            device.write(&buffer, 0, bytes);
            Ok(buffer)
        })
        .collect::<Result<Vec<_>>>()?;
    let parts: Vec<_> = buffers.iter().map(|b| (b, 0, b.raw.size())).collect();
    let (compiled, group) = pipeline.bind(device, &parts);
    let mut encoder = device.raw.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&compiled);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(load.groups[0], load.groups[1], load.groups[2]);
    }
    let at = device.submit(encoder.finish());
    device.wait(Some(at))?;
    buffers.iter().map(|b| device.read(b)).collect()
}
