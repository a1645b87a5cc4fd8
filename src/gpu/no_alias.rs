//! In: any device. Out: nothing: on this system no memory is both a buffer and an image. Frame and unit: bytes.

use super::texels::Texel;
use std::sync::Arc;

#[derive(Debug)]
pub(super) enum Aliased {}

/// # Safety
/// There are no requirements.
pub(super) unsafe fn buffer(
    _: &wgpu::Device,
    _: &wgpu::BufferDescriptor,
    _: bool,
) -> Option<(wgpu::Buffer, Arc<Aliased>)> {
    None
}

impl Aliased {
    /// # Safety
    /// There are no requirements, here and below.
    pub(super) unsafe fn texels(&self, _: &wgpu::Device, _: Texel, _: u32) -> Option<&wgpu::TextureView> {
        match *self {}
    }
    pub(super) unsafe fn read(&self, _: std::ops::Range<usize>) -> &[u8] {
        match *self {}
    }
    pub(super) unsafe fn write(&self, _: usize, _: &[u8]) {
        match *self {}
    }
}
