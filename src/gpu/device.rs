//! In: the adapters of this machine. Out: one opened device and its buffers.
//! Frame and unit: bytes.

use super::alias::{self, Aliased};
use super::background::Background;
use super::texels::Texel;
use crate::fault::{Fault, Result};
use rayon::ThreadPool;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// The longest a single submission may take before the device counts as lost.
const TIMEOUT: Duration = Duration::from_secs(60);

/// Properties of an adapter for people to read.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct AdapterInfo {
    /// As the driver gives it. SHEETLIGHT_ADAPTER is searched in it.
    pub name: String,
    /// One of: discrete GPU, integrated GPU, virtual GPU, CPU, other.
    pub kind: String,
    /// The graphics interface: vulkan, metal or dx12.
    pub backend: String,
    /// Name and version of the driver, as far as it states them.
    pub driver: String,
    /// Largest buffer a stage can bind, bytes.
    pub max_binding_bytes: u64,
    /// Largest workgroup, invocations.
    pub max_workgroup: u32,
    /// Most storage buffers that one stage can bind.
    pub storage_buffers_per_stage: u32,
    /// Whether GPU timestamps can be taken.
    pub timestamps: bool,
    /// Whether host and device share memory, so that stages can read in place what the host writes.
    pub unified_memory: bool,
}

/// A storage buffer on the device. `bytes` is the requested size.
#[derive(Clone, Debug)]
pub struct Buffer {
    pub(super) raw: wgpu::Buffer,
    /// Bytes; on the device they are padded to a multiple of 16.
    pub bytes: u64,
    /// The memory under the buffer, if it can be read as texels.
    pub(super) aliased: Option<Arc<Aliased>>,
}

/// An opened GPU. Clones share it.
#[derive(Clone)]
pub struct Device {
    pub(super) raw: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    /// The adapter on which it was opened.
    pub info: AdapterInfo,
    /// Stages read arrays as texels of images on the same memory: faster on a software adapter (decision 0012).
    pub reads_texels: bool,
    /// Nanoseconds per timestamp tick; `None` if the adapter has no timestamps.
    pub(super) tick_ns: Option<f32>,
    lost: Arc<Mutex<Option<String>>>,
    /// Bytes of all buffers made through this device.
    allocated: Arc<std::sync::atomic::AtomicU64>,
    pub(super) background: Arc<Background>,
    /// One submission at a time: Vulkan requires it if a queue is used beside wgpu.
    submitting: Arc<Mutex<()>>,
    /// Most rows of an image as which an array is read.
    pub(super) image_rows: u32,
}

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    // Every argument of an indirect dispatch is computed by our own stages and bounded there; wgpu's
    // check costs an extra dispatch each (10 to 16 us instead of 1).
    descriptor.flags = wgpu::InstanceFlags::empty();
    wgpu::Instance::new(descriptor)
}

fn describe(adapter: &wgpu::Adapter) -> AdapterInfo {
    let (info, limits, features) = (adapter.get_info(), adapter.limits(), adapter.features());
    AdapterInfo {
        name: info.name,
        kind: match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete GPU",
            wgpu::DeviceType::IntegratedGpu => "integrated GPU",
            wgpu::DeviceType::VirtualGpu => "virtual GPU",
            wgpu::DeviceType::Cpu => "CPU",
            wgpu::DeviceType::Other => "other",
        }
        .into(),
        backend: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().into(),
        max_binding_bytes: limits.max_storage_buffer_binding_size,
        max_workgroup: limits.max_compute_invocations_per_workgroup,
        storage_buffers_per_stage: limits.max_storage_buffers_per_shader_stage,
        timestamps: features.contains(TIMESTAMPS),
        unified_memory: unified(&info.device_type, features),
    }
}

const TIMESTAMPS: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES);

/// A discrete GPU may offer mappable storage as well, but the stages would access it over the bus. A copy to its own
/// memory is faster there.
fn unified(kind: &wgpu::DeviceType, features: wgpu::Features) -> bool {
    matches!(kind, wgpu::DeviceType::Cpu | wgpu::DeviceType::IntegratedGpu)
        && features.contains(wgpu::Features::MAPPABLE_PRIMARY_BUFFERS)
}

/// Adapters of this machine, best first: discrete, integrated, virtual, other, software.
pub fn adapters() -> Vec<AdapterInfo> {
    sorted(&instance()).iter().map(describe).collect()
}

fn sorted(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    all.sort_by_key(|a| match a.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    all
}

/// The best adapter whose name contains `wanted`.
fn chosen(wanted: Option<&str>) -> Result<wgpu::Adapter> {
    let all = sorted(&instance());
    let names: Vec<String> = all.iter().map(|a| a.get_info().name).collect();
    all.into_iter()
        .find(|a| wanted.is_none_or(|w| a.get_info().name.to_lowercase().contains(&w.to_lowercase())))
        .ok_or_else(|| match wanted {
            Some(w) if !names.is_empty() => {
                Fault::device(format!("no adapter's name holds '{w}'; there are: {}", names.join(", ")))
                    .next("correct SHEETLIGHT_ADAPTER or unset it")
            }
            _ => Fault::device("0 Vulkan, Metal or DX12 adapters found, 1 needed")
                .cause("no GPU driver is installed")
                .next(
                    "install one (Debian: apt install mesa-vulkan-drivers); what has --on runs without one, with \
                       --on cpu",
                ),
        })
}

/// Receives the reason when the device is lost.
fn heard(raw: &wgpu::Device) -> Arc<Mutex<Option<String>>> {
    let lost = Arc::new(Mutex::new(None::<String>));
    let note = lost.clone();
    raw.set_device_lost_callback(move |reason, message| {
        note.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(format!("{reason:?}: {message}"));
    });
    // Out of memory and driver errors arrive here; a validation error is a bug in this program and panics.
    let note = lost.clone();
    raw.on_uncaptured_error(Arc::new(move |e: wgpu::Error| match e {
        wgpu::Error::Validation { .. } if note.lock().unwrap_or_else(PoisonError::into_inner).is_none() => {
            panic!("{e}")
        }
        e => {
            note.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(e.to_string());
        }
    }));
    lost
}

impl Device {
    /// Opens the best adapter whose name contains `wanted`. The device reads arrays as buffers, not as texels.
    pub(super) fn opened(wanted: Option<&str>) -> Result<Device> {
        let chosen = chosen(wanted)?;
        let info = describe(&chosen);
        let offered = chosen.limits();
        // Only the limits that the stages need are raised above the portable defaults, up to what the adapter offers.
        let limits = wgpu::Limits {
            max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
            max_buffer_size: offered.max_buffer_size,
            max_storage_buffers_per_shader_stage: offered.max_storage_buffers_per_shader_stage.min(16),
            max_compute_workgroups_per_dimension: offered.max_compute_workgroups_per_dimension,
            max_storage_textures_per_shader_stage: offered.max_storage_textures_per_shader_stage.min(8),
            max_texture_dimension_2d: offered.max_texture_dimension_2d.min(16384),
            ..wgpu::Limits::downlevel_defaults()
        };
        let mut features = wgpu::Features::empty();
        if info.timestamps {
            features |= TIMESTAMPS;
        }
        if info.unified_memory {
            features |= wgpu::Features::MAPPABLE_PRIMARY_BUFFERS;
        }
        let (raw, queue) = pollster::block_on(chosen.request_device(&wgpu::DeviceDescriptor {
            label: Some("sheetlight"),
            required_features: features,
            required_limits: limits,
            ..Default::default()
        }))
        .map_err(|e| {
            Fault::device(format!("{}: the device cannot be opened: {e}", info.name))
                .cause("the driver is broken or its memory is taken")
                .next("run `sheetlight doctor`, or choose another adapter with SHEETLIGHT_ADAPTER")
        })?;
        let lost = heard(&raw);
        let image_rows = raw.limits().max_texture_dimension_2d;
        let tick_ns = info.timestamps.then(|| queue.get_timestamp_period());
        Ok(Device {
            raw,
            queue,
            info,
            reads_texels: false,
            tick_ns,
            lost,
            allocated: Default::default(),
            background: Default::default(),
            submitting: Default::default(),
            image_rows,
        })
    }

    /// The same device with its arrays read as buffers, as on every other adapter; for tests and comparisons.
    pub fn without_texels(&self) -> Device {
        Device { reads_texels: false, ..self.clone() }
    }

    /// The same device, treated as one with its own memory and processors: for tests on machines without such a device.
    pub fn as_discrete(&self) -> Device {
        let info = AdapterInfo { kind: "discrete GPU".into(), unified_memory: false, ..self.info.clone() };
        Device { info, reads_texels: false, ..self.clone() }
    }

    /// False for a software adapter, which runs on the cores that the CPU twins would use.
    pub fn has_own_processors(&self) -> bool {
        self.info.kind != "CPU"
    }

    /// A zeroed storage buffer that stages, indirect dispatches and copies can use.
    pub fn storage(&self, label: &str, bytes: u64) -> Result<Buffer> {
        use wgpu::BufferUsages as U;
        self.buffer(label, bytes, U::STORAGE | U::INDIRECT | U::UNIFORM | U::COPY_SRC | U::COPY_DST, true)
    }
    /// A buffer that the host writes and stages read in place, on unified memory.
    pub fn mapped_storage(&self, label: &str, bytes: u64) -> Result<Buffer> {
        use wgpu::BufferUsages as U;
        let access = if self.reads_texels { U::COPY_DST } else { U::MAP_WRITE };
        self.buffer(label, bytes, U::STORAGE | access | U::COPY_SRC, true)
    }
    /// A buffer that stages write and the host reads in place, on unified memory. Bytes that the stages did not write
    /// are undefined: such a buffer is sized for the worst case, and memory that is never touched costs nothing.
    pub fn readable_storage(&self, label: &str, bytes: u64) -> Result<Buffer> {
        use wgpu::BufferUsages as U;
        let access = if self.reads_texels { U::COPY_DST } else { U::MAP_READ };
        self.buffer(label, bytes, U::STORAGE | access | U::COPY_SRC, false)
    }
    /// A buffer that the host writes and that is copied to a storage buffer.
    pub fn upload_staging(&self, label: &str, bytes: u64) -> Result<Buffer> {
        self.buffer(label, bytes, wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC, true)
    }
    /// A buffer that a storage buffer is copied to and that the host reads.
    pub fn readback_staging(&self, label: &str, bytes: u64) -> Result<Buffer> {
        self.buffer(label, bytes, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST, true)
    }

    fn buffer(&self, label: &str, bytes: u64, usage: wgpu::BufferUsages, zeroed: bool) -> Result<Buffer> {
        let limit = self.raw.limits().max_buffer_size;
        let binding = self.info.max_binding_bytes;
        let size = bytes.max(16).next_multiple_of(16);
        if size > limit || (usage.contains(wgpu::BufferUsages::STORAGE) && size > binding) {
            return Err(Fault::device(format!(
                "buffer '{label}' needs {size} bytes, {} allows {}",
                self.info.name,
                limit.min(binding)
            ))
            .cause("the pictures are too large for this adapter")
            .next("choose another one with SHEETLIGHT_ADAPTER; what has --on runs without, with --on cpu"));
        }
        self.allocated.fetch_add(size, std::sync::atomic::Ordering::Relaxed);
        let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        let maps = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::MAP_WRITE;
        if self.reads_texels && usage.contains(wgpu::BufferUsages::STORAGE) && !usage.intersects(maps) {
            // SAFETY: a storage buffer that is not mapped, on a software adapter, whose memory is the host's.
            let made = unsafe { alias::buffer(&self.raw, &descriptor, zeroed) };
            let (raw, aliased) = made.ok_or_else(|| {
                Fault::device(format!("{}: {size} bytes for '{label}' cannot be allocated", self.info.name))
                    .cause("the memory ran out")
                    .next("close other programs; what has --on runs in less memory with --on cpu")
            })?;
            return Ok(Buffer { raw, bytes, aliased: Some(aliased) });
        }
        let raw = self.raw.create_buffer(&descriptor);
        self.alive()?;
        Ok(Buffer { raw, bytes, aliased: None })
    }

    /// A buffer as an image. `None` if it is too large for one, or the adapter has no image of that kind.
    pub(super) fn texels<'a>(&self, buffer: &'a Buffer, texel: Texel) -> Option<&'a wgpu::TextureView> {
        let _alone = self.submitting.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: only buffers of this device are aliased, and only on a software adapter, which runs dispatches one
        // after the other. All submissions take the lock.
        unsafe { buffer.aliased.as_ref()?.texels(&self.raw, texel, self.image_rows) }
    }

    /// Submits recorded commands.
    pub(super) fn submit(&self, commands: wgpu::CommandBuffer) -> wgpu::SubmissionIndex {
        let _alone = self.submitting.lock().unwrap_or_else(PoisonError::into_inner);
        self.queue.submit([commands])
    }

    /// Bytes of all buffers made so far.
    pub fn allocated_bytes(&self) -> u64 {
        self.allocated.load(std::sync::atomic::Ordering::Relaxed)
    }

    /// Queues a write, which is executed before the next submission.
    pub fn write(&self, buffer: &Buffer, offset: u64, bytes: &[u8]) {
        if bytes.len().is_multiple_of(4) {
            self.queue.write_buffer(&buffer.raw, offset, bytes);
        } else {
            let mut padded = bytes.to_vec();
            padded.resize(bytes.len().next_multiple_of(4), 0);
            self.queue.write_buffer(&buffer.raw, offset, &padded);
        }
    }

    /// Copies a storage buffer to the host; waits. For tests and self-tests, not for scanning.
    pub fn read(&self, buffer: &Buffer) -> Result<Vec<u8>> {
        let staging = self.readback_staging("read", buffer.bytes)?;
        let mut encoder = self.raw.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&buffer.raw, 0, &staging.raw, 0, buffer.raw.size());
        let at = self.submit(encoder.finish());
        let mapped = staging.map(wgpu::MapMode::Read, 0..buffer.raw.size());
        self.wait(Some(at))?;
        mapped.done()?;
        let bytes = staging.view(0..buffer.raw.size())?[..buffer.bytes as usize].to_vec();
        staging.raw.unmap();
        Ok(bytes)
    }

    /// Waits for a submission, or for all of them.
    pub(super) fn wait(&self, at: Option<wgpu::SubmissionIndex>) -> Result<()> {
        self.raw.poll(wgpu::PollType::Wait { submission_index: at, timeout: Some(TIMEOUT) }).map_err(|e| {
            Fault::device(format!("{}: no answer within {} s: {e}", self.info.name, TIMEOUT.as_secs()))
                .next("run `sheetlight doctor`; what has --on runs without the GPU with --on cpu")
        })?;
        self.alive()
    }
    /// Runs the callbacks of what has finished; does not wait.
    pub(super) fn poll(&self) -> Result<()> {
        let _ = self.raw.poll(wgpu::PollType::Poll);
        self.alive()
    }

    /// `Err` after the device was lost or ran out of memory.
    pub fn alive(&self) -> Result<()> {
        match &*self.lost.lock().unwrap_or_else(PoisonError::into_inner) {
            None => Ok(()),
            Some(why) => Err(Fault::device(format!("{}: the device was lost: {}", self.info.name, why.trim()))
                .cause("the driver crashed, the GPU was unplugged or reset, or its memory ran out")
                .next("run the same command again; finished shots are kept")),
        }
    }

    /// Destroys the device on purpose, as a driver crash would. Later calls must fail with a clear error.
    pub fn lose(&self) {
        self.raw.destroy();
        let _ = self.raw.poll(wgpu::PollType::Poll);
        self.lost.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert("destroyed".into());
    }
}

/// A part of a mapped buffer.
struct Place<'a>(wgpu::WriteOnly<'a, [u8]>);

// SAFETY: it is the only access to its bytes, like a `&mut [u8]`, which may go to another thread. wgpu declares this
// for elements of a known size, but not for slices.
unsafe impl Send for Place<'_> {}

impl Place<'_> {
    fn put(&mut self, offset: usize, bytes: &[u8]) {
        self.0.slice(offset..offset + bytes.len()).copy_from_slice(bytes);
    }
}

/// Writes the part of a buffer with the given number.
pub(super) type Fill<'a> = dyn Fn(usize, &mut dyn FnMut(usize, &[u8])) -> Result<()> + Sync + 'a;

/// A mapping that was requested; `done` may be called after the device was polled.
pub(super) struct Mapping(Arc<Mutex<Option<std::result::Result<(), wgpu::BufferAsyncError>>>>);

impl Mapping {
    pub(super) fn ready(&self) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }
    pub(super) fn done(&self) -> Result<()> {
        match &*self.0.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(Ok(())) => Ok(()),
            other => Err(Fault::device(format!("a buffer could not be mapped: {other:?}"))
                .cause("the device was lost or its memory ran out")
                .next("run the same command again; finished shots are kept")),
        }
    }
}

impl Buffer {
    /// Requests the mapping that the host needs before it fills the buffer. `None` if the host can access the memory
    /// directly.
    pub(super) fn open(&self) -> Option<Mapping> {
        self.aliased.is_none().then(|| self.map(wgpu::MapMode::Write, 0..self.bytes))
    }
    /// Writes to an open buffer, which is divided into parts of the given sizes in bytes. `fill` receives a part's
    /// number and its writer (byte offset in the part, bytes). Several threads call it if there are `writers`. Closes
    /// the buffer, also after an error.
    pub(super) fn fill(&self, parts: &[usize], writers: Option<&ThreadPool>, fill: &Fill) -> Result<()> {
        if let Some(host) = &self.aliased {
            let mut begin = 0;
            return parts.iter().enumerate().try_for_each(|(i, bytes)| {
                let first = begin;
                begin += bytes;
                // SAFETY: the ring gives out a slot only after its batch is done, and only to this thread.
                fill(i, &mut |offset, bytes| unsafe { host.write(first + offset, bytes) })
            });
        }
        let mut view = self.view_mut(0..self.bytes)?;
        let mut rest = view.slice(..);
        let places: Vec<_> = parts
            .iter()
            .map(|&bytes| {
                let (place, behind) = std::mem::take(&mut rest).split_at(bytes);
                rest = behind;
                Place(place)
            })
            .collect();
        let write = |(i, mut place): (usize, Place)| fill(i, &mut |offset, bytes| place.put(offset, bytes));
        let filled = match writers {
            None => places.into_iter().enumerate().try_for_each(write),
            Some(pool) => pool.install(|| places.into_par_iter().enumerate().try_for_each(write)),
        };
        drop(view);
        self.raw.unmap();
        filled
    }
    pub(super) fn map(&self, mode: wgpu::MapMode, range: std::ops::Range<u64>) -> Mapping {
        let slot = Arc::new(Mutex::new(None));
        let note = slot.clone();
        self.raw.map_async(mode, range, move |r| *note.lock().unwrap_or_else(PoisonError::into_inner) = Some(r));
        Mapping(slot)
    }
    pub(super) fn view(&self, range: std::ops::Range<u64>) -> Result<wgpu::BufferView> {
        self.raw.get_mapped_range(range).map_err(|e| {
            Fault::device(format!("a mapped buffer cannot be read: {e}"))
                .next("run the same command again; finished shots are kept")
        })
    }
    fn view_mut(&self, range: std::ops::Range<u64>) -> Result<wgpu::BufferViewMut> {
        self.raw.get_mapped_range_mut(range).map_err(|e| {
            Fault::device(format!("a mapped buffer cannot be written: {e}"))
                .next("run the same command again; finished shots are kept")
        })
    }
}
