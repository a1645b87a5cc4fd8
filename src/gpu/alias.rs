//! In: a software adapter under Vulkan. Out: memory that stages write as a buffer and read as texels, and that the host
//! accesses in place. Frame and unit: bytes.
//!
//! Buffer and images are bound to the same bytes (VK_IMAGE_CREATE_ALIAS_BIT, linear tiling). wgpu does not know that
//! they share memory. It therefore puts no barrier between a write of the buffer and a read of the image. None is
//! needed if dispatches run one after the other, as on a software adapter. This module is used only there, after a
//! trial ([`super::texels_trial::trial`]). Reasons and figures: docs/decisions/0012.

use super::texels::{ROW_LOG2, Texel};
use ash::vk;
use std::sync::{Arc, OnceLock};
use wgpu::hal::api::Vulkan;

/// Memory that a buffer and its images share; freed after the last of them.
struct Memory {
    device: ash::Device,
    raw: vk::DeviceMemory,
    host: *mut u8,
    bytes: u64,
    /// Index in the adapter's list of memory types.
    kind: u32,
    /// The device and the driver that holds its code must outlive the memory. Without this field, scans with an ambient
    /// picture crashed when they ended (tests/scan_commands/inputs.rs).
    _owner: wgpu::Device,
}

// SAFETY: the host's pointer is used only under the rules of `Aliased::read` and `Aliased::write`. Vulkan's handles may
// be used by any thread.
unsafe impl Send for Memory {}
// SAFETY: as above; no field changes after construction.
unsafe impl Sync for Memory {}

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: buffer and images hold this memory until wgpu destroys them, which waits for the work that uses them.
        unsafe { self.device.free_memory(self.raw, None) };
    }
}

/// The memory of a buffer, and the images that share it, one for each [`Texel`].
pub(super) struct Aliased {
    memory: Arc<Memory>,
    views: [OnceLock<wgpu::TextureView>; 2],
}

impl std::fmt::Debug for Aliased {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Aliased({} bytes)", self.memory.bytes)
    }
}

/// A buffer with its own memory. `None` if the adapter is not Vulkan's or the memory cannot be allocated.
///
/// # Safety
/// The buffer's usages are among those of a storage buffer that is never mapped, and the adapter shares its memory with
/// the host.
pub(super) unsafe fn buffer(
    device: &wgpu::Device,
    descriptor: &wgpu::BufferDescriptor,
    zeroed: bool,
) -> Option<(wgpu::Buffer, Arc<Aliased>)> {
    // SAFETY: nothing of the device is destroyed through this handle. What is made here is destroyed if a later step
    // fails, or else by `destroy`, which wgpu calls when no work uses the buffer any more. The memory is bound once, to
    // a type that the buffer's requirements allow, and is mapped as a whole while it lives.
    unsafe {
        let hal = device.as_hal::<Vulkan>()?;
        let (raw, instance) = (hal.raw_device().clone(), hal.shared_instance().raw_instance());
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::INDIRECT_BUFFER
            | vk::BufferUsageFlags::UNIFORM_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let buffer =
            raw.create_buffer(&vk::BufferCreateInfo::default().size(descriptor.size).usage(usage), None).ok()?;
        let needs = raw.get_buffer_memory_requirements(buffer);
        // Images are padded to whole groups of four rows of the largest texels.
        let bytes = needs.size.next_multiple_of((4 * Texel::Four.bytes()) << ROW_LOG2);
        let kinds = instance.get_physical_device_memory_properties(hal.raw_physical_device());
        let wanted = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let kind = (0..kinds.memory_type_count).find(|&i| {
            needs.memory_type_bits & (1 << i) != 0 && kinds.memory_types[i as usize].property_flags.contains(wanted)
        });
        let allocated = kind.and_then(|kind| {
            let info = vk::MemoryAllocateInfo::default().allocation_size(bytes).memory_type_index(kind);
            Some((kind, raw.allocate_memory(&info, None).ok()?))
        });
        let Some((kind, allocated)) = allocated else {
            raw.destroy_buffer(buffer, None);
            return None;
        };
        let mapped = raw.map_memory(allocated, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty());
        let bound = mapped.and_then(|host| raw.bind_buffer_memory(buffer, allocated, 0).map(|()| host.cast::<u8>()));
        let Ok(host) = bound else {
            raw.destroy_buffer(buffer, None);
            raw.free_memory(allocated, None);
            return None;
        };
        if zeroed {
            host.write_bytes(0, bytes as usize);
        }
        let memory =
            Arc::new(Memory { device: raw.clone(), raw: allocated, host, bytes, kind, _owner: device.clone() });
        let held = memory.clone();
        let destroy = Box::new(move || {
            raw.destroy_buffer(buffer, None);
            drop(held);
        });
        let hal_buffer = wgpu::hal::vulkan::Buffer::from_raw_externally_owned(buffer, destroy);
        drop(hal);
        let buffer = device.create_buffer_from_hal::<Vulkan>(hal_buffer, descriptor);
        Some((buffer, Arc::new(Aliased { memory, views: Default::default() })))
    }
}

impl Aliased {
    /// The same bytes as an image of at most `most` rows of 2^ROW_LOG2 texels, stored one after the other. `None` if
    /// the adapter has no such image, or would lay it out differently.
    ///
    /// # Safety
    /// `device` is the one that the buffer was made on. Nobody submits to its queue during the call. Its dispatches run
    /// one after the other, so that no barrier is needed between a write of the buffer and a read of the image.
    pub(super) unsafe fn texels(&self, device: &wgpu::Device, texel: Texel, most: u32) -> Option<&wgpu::TextureView> {
        let slot = &self.views[texel as usize];
        if slot.get().is_none() {
            // SAFETY: the caller's promises are the ones that `image` requires.
            let _ = slot.set(unsafe { self.image(device, texel, most) }?);
        }
        slot.get()
    }

    /// # Safety
    /// As [`Aliased::texels`].
    unsafe fn image(&self, device: &wgpu::Device, texel: Texel, most: u32) -> Option<wgpu::TextureView> {
        let row = texel.bytes() << ROW_LOG2;
        let (width, height) = (1 << ROW_LOG2, u32::try_from(self.memory.bytes / row).ok()?);
        if width.max(height) > most {
            return None;
        }
        let format = match texel {
            Texel::One => vk::Format::R32_UINT,
            Texel::Four => vk::Format::R32G32B32A32_UINT,
        };
        // SAFETY: as in `buffer`. The adapter has such images, and the memory's type is one that this image may be
        // bound to. The image fits in the memory, which it holds until it is destroyed. Its layout is the one that wgpu
        // is given.
        unsafe {
            let hal = device.as_hal::<Vulkan>()?;
            let (raw, instance) = (hal.raw_device().clone(), hal.shared_instance().raw_instance());
            let (kind, tiling) = (vk::ImageType::TYPE_2D, vk::ImageTiling::LINEAR);
            let (usage, flags) = (vk::ImageUsageFlags::STORAGE, vk::ImageCreateFlags::ALIAS);
            let card = hal.raw_physical_device();
            let has = instance.get_physical_device_image_format_properties(card, format, kind, tiling, usage, flags);
            let largest = has.ok()?.max_extent;
            if width > largest.width || height > largest.height {
                return None;
            }
            let info = vk::ImageCreateInfo::default()
                .flags(flags)
                .image_type(kind)
                .format(format)
                .extent(vk::Extent3D { width, height, depth: 1 })
                .mip_levels(1)
                .array_layers(1)
                .samples(vk::SampleCountFlags::TYPE_1)
                .tiling(tiling)
                .usage(usage)
                // The bytes must stay: the layout "undefined" would lose them.
                .initial_layout(vk::ImageLayout::PREINITIALIZED);
            let image = raw.create_image(&info, None).ok()?;
            let part = vk::ImageSubresource { aspect_mask: vk::ImageAspectFlags::COLOR, mip_level: 0, array_layer: 0 };
            let layout = raw.get_image_subresource_layout(image, part);
            let needs = raw.get_image_memory_requirements(image);
            let fits = needs.size <= self.memory.bytes && needs.memory_type_bits & (1 << self.memory.kind) != 0;
            let plain = layout.offset == 0 && layout.row_pitch == row;
            let bound = fits && plain && raw.bind_image_memory(image, self.memory.raw, 0).is_ok();
            if !bound || to_general(&hal, image).is_err() {
                raw.destroy_image(image, None);
                return None;
            }
            let held = self.memory.clone();
            let destroy = Box::new(move || {
                raw.destroy_image(image, None);
                drop(held);
            });
            let d = wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: texel.format(),
                usage: wgpu::TextureUsages::STORAGE_BINDING,
                view_formats: &[],
            };
            let only_read = wgpu::wgt::TextureUses::STORAGE_READ_ONLY;
            let hal_descriptor = wgpu::hal::TextureDescriptor {
                label: d.label,
                size: d.size,
                mip_level_count: d.mip_level_count,
                sample_count: d.sample_count,
                dimension: d.dimension,
                format: d.format,
                usage: only_read,
                memory_flags: wgpu::hal::MemoryFlags::empty(),
                view_formats: vec![],
            };
            let external = wgpu::hal::vulkan::TextureMemory::External;
            let hal_texture = hal.texture_from_raw(image, &hal_descriptor, Some(destroy), external);
            drop(hal);
            let texture = device.create_texture_from_hal::<Vulkan>(hal_texture, &d, only_read);
            Some(texture.create_view(&Default::default()))
        }
    }

    /// Reads the bytes in place.
    ///
    /// # Safety
    /// While the bytes are borrowed, no submitted work writes the buffer, and nobody calls [`Aliased::write`] on it.
    pub(super) unsafe fn read(&self, range: std::ops::Range<usize>) -> &[u8] {
        assert!(range.start <= range.end && range.end as u64 <= self.memory.bytes, "{range:?} bytes");
        // SAFETY: inside the mapped memory, as just checked, which stays mapped as long as `self` lives.
        unsafe { std::slice::from_raw_parts(self.memory.host.add(range.start), range.len()) }
    }

    /// Writes the bytes in place.
    ///
    /// # Safety
    /// No submitted work uses the buffer, nobody borrows these bytes, and no other thread writes them.
    pub(super) unsafe fn write(&self, offset: usize, bytes: &[u8]) {
        let end = offset.checked_add(bytes.len()).filter(|end| *end as u64 <= self.memory.bytes);
        assert!(end.is_some(), "{offset} + {} bytes", bytes.len());
        // SAFETY: inside the mapped memory, as just checked, which stays mapped as long as `self` lives.
        unsafe { self.memory.host.add(offset).copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
    }
}

/// Changes a new image to the layout in which stages read it, and waits for that. The bytes are preserved.
///
/// # Safety
/// Nobody submits to the device's queue during the call. The image is bound, and in the layout that it was made in.
unsafe fn to_general(hal: &wgpu::hal::vulkan::Device, image: vk::Image) -> Result<(), vk::Result> {
    let raw = hal.raw_device();
    let whole =
        vk::ImageSubresourceRange::default().aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1);
    let barrier = vk::ImageMemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::HOST_WRITE | vk::AccessFlags::SHADER_WRITE)
        .dst_access_mask(vk::AccessFlags::SHADER_READ)
        .old_layout(vk::ImageLayout::PREINITIALIZED)
        .new_layout(vk::ImageLayout::GENERAL)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image)
        .subresource_range(whole);
    let (before, after) =
        (vk::PipelineStageFlags::HOST | vk::PipelineStageFlags::COMPUTE_SHADER, vk::PipelineStageFlags::COMPUTE_SHADER);
    // SAFETY: the commands are recorded, run once and waited for before their pool and the fence are destroyed.
    unsafe {
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(hal.queue_family_index());
        let pool = raw.create_command_pool(&pool, None)?;
        let run = || {
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            let commands = raw.allocate_command_buffers(&info)?;
            raw.begin_command_buffer(commands[0], &vk::CommandBufferBeginInfo::default())?;
            raw.cmd_pipeline_barrier(commands[0], before, after, Default::default(), &[], &[], &[barrier]);
            raw.end_command_buffer(commands[0])?;
            let fence = raw.create_fence(&vk::FenceCreateInfo::default(), None)?;
            let done = raw
                .queue_submit(hal.raw_queue(), &[vk::SubmitInfo::default().command_buffers(&commands)], fence)
                .and_then(|()| raw.wait_for_fences(&[fence], true, u64::MAX));
            raw.destroy_fence(fence, None);
            done
        };
        let done = run();
        raw.destroy_command_pool(pool, None);
        done
    }
}

#[cfg(test)]
mod tests {
    use crate::gpu::Device;
    use crate::gpu::texels::Texel;
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::Arc;

    #[test]
    fn no_byte_outside_is_touched() {
        let Some(device) = Device::with_texels_for_tests() else { return };
        let buffer = device.storage("ends", 4096).unwrap();
        let memory = buffer.aliased.as_ref().unwrap();
        let outside = |act: &dyn Fn()| catch_unwind(AssertUnwindSafe(act)).is_err();
        let held = memory.memory.bytes as usize;
        // SAFETY: nothing is submitted, and nobody else has the buffer. Accesses out of bounds are what the test tries.
        unsafe {
            assert!(outside(&|| memory.write(usize::MAX, &[1, 2])) && outside(&|| memory.write(held - 1, &[1, 2])));
            assert!(outside(&|| _ = memory.read(held..held + 1)) && outside(&|| _ = memory.read(0..usize::MAX)));
            memory.write(held - 2, &[1, 2]);
            assert_eq!(memory.read(held - 2..held), [1, 2]);
        }
    }

    #[test]
    fn memory_lives_as_long_as_what_lies_on_it() {
        let Some(device) = Device::with_texels_for_tests() else { return };
        let buffer = device.storage("lives", 1 << 20).unwrap();
        let memory = Arc::downgrade(&buffer.aliased.as_ref().unwrap().memory);
        let view = device.texels(&buffer, Texel::Four).unwrap().clone();
        drop(buffer);
        device.wait(None).unwrap();
        assert!(memory.upgrade().is_some(), "an image still lies there");
        drop(view);
        device.wait(None).unwrap();
        assert!(memory.upgrade().is_none(), "nothing lies there any more");
    }
}
